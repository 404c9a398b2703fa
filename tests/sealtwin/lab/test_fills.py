"""A liquid weighed into a crack, on a lab's own sheet beside photo and readings: found, asked about, used, reported."""

import json

import numpy as np
import openpyxl
import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.core.settings import checked
from sealtwin.lab.ingest import ingest
from sealtwin.lab.pairing import note_of_answers
from sealtwin.lab.sheets import read_fill
from sealtwin.trial.trial_file import load_trial, with_settings
from tests.labs import QUIET, answer, pairing_rows, question, sealtwin
from validate.settings import Declared

MASS_G, LEVEL_MM = (0.02, 0.06, 0.1, 0.15), (-6.0, -4.0, -2.0, 0.0)
GERMAN = "Auslitern P01;\nMasse [g];Pegel unter Kante [cm]\n0,02;0,6\n0,06;0,4\n0,1;0,2\n0,15;0\n"


def _read(tmp_path, text, **answers):
    (tmp_path / "fill.csv").write_text(text)
    unit = answers.pop("mass", "")
    entries = note_of_answers(answers, "pairing.csv").entries
    content = with_settings({"readings": {}}, {key: entry.value for key, entry in entries.items()})["readings"]
    table, sentence = read_fill(tmp_path / "fill.csv", checked(Declared, tmp_path, content), unit)
    assert sentence.startswith(f"{tmp_path / 'fill.csv'}: read as a fill of {len(table['mass_g'])} steps")
    return table["mass_g"], table["level_mm"]


@pytest.mark.parametrize(
    ("text", "answers"),
    [
        ("mass_g,level_mm\n0.02,-6\n0.06,-4\n0.1,-2\n0.15,0\n", {}),
        (GERMAN, {"sign": "down"}),
        ("Peso (kg)\tProfundidad (mm)\n0.00002\t6\n0.00006\t4\n0.0001\t2\n0.00015\t0\n", {}),
        ("Zeit;Waage;Tiefe\nhh:mm;g;mm\n10:01;0,02;6\n10:03;0,06;4\n;;\n10:05;0,1;2\n10:09;0,15;0\n", {"unit": "mm"}),
        (
            "a;b;c\n1;0,02;6\n2;0,06;4\n3;0,1;2\n4;0,15;0\n",
            {"s": "b", "mass": "g", "levels": "c", "unit": "mm", "sign": "Down"},
        ),
    ],
)
def test_fills_are_read_as_labs_write_them(tmp_path, text, answers):
    masses_g, levels_mm = _read(tmp_path, text, **answers)
    assert masses_g == pytest.approx(MASS_G)
    assert levels_mm == pytest.approx(LEVEL_MM)


@pytest.mark.parametrize(
    ("text", "question"),
    [
        ("Masse;Pegel [mm]\n1;-5\n2;0\n", "'Masse': no unit.*mass = "),
        ("Masse [g];Pegel\n1;-5\n2;0\n", "'Pegel': no unit.*unit"),
        ("Masse [g];Ablesung [mm]\n1;-5\n2;0\n", "sign in pairing.csv: up or down"),
        ("Masse [g];Pegel [mm];Tiefe [mm]\n1;-5;5\n2;0;0\n", "level and depth columns in one sheet"),
        ("Masse [g];Pegel [mm]\n1;-5\n1;0\n", "1 after 1"),
        ("Masse [g];Pegel [mm]\n1;5\n2;6\n", "levels below the face are negative"),
        ("s_mm;level_mm\n1;5\n2;6\n", "no column of masses"),
    ],
)
def test_what_a_fill_leaves_open_is_asked(tmp_path, text, question):
    with pytest.raises(InputError, match=rf"fill\.csv.*{question}"):
        _read(tmp_path, text)


def _poured(small, *head):
    """Write a workbook of what the crack of P01, 12 mm by 2 by 8 mm with upright walls, holds."""
    book = openpyxl.Workbook()
    for row in (head, *((round(12 * 2 * 8 * (1 + z / 8) * 0.998e-3, 3), -z) for z in np.linspace(-6.0, 0.0, 5))):
        book.worksheets[0].append(row)
    book.save(small / "P01 Wasser.xlsx")
    note = (small / "lab.toml").read_text().replace('tilt = "vertical"', "wall_angle_deg = 5.0")
    (small / "lab.toml").write_text(note + "[crack.fill]\nmass_sd_g = 0.02\n[uncertainty]\nwidth_mm = 0.1\n")


def test_a_fill_beside_the_readings_is_copied_used_and_reported(small, tmp_path):
    _poured(small, "Masse [g]", "Tiefe [mm]")
    lab = tmp_path / "lab"
    asked = sealtwin("ingest", small, "--out", lab, "--quiet").stdout
    (row,) = (row for row in pairing_rows(lab) if row["role"] == "fill")
    assert (row["file"], row["sample"]) == ("P01 Wasser.xlsx", "P01")
    assert "crack.tilt is missing: the steps of a fill need it" in asked
    answer(lab, {"P01 Wasser.xlsx": {"settings": 'crack.tilt = "funnel"'}})
    assert "P01 Wasser.xlsx: read as a fill of 5 steps" in sealtwin("ingest", small, "--out", lab, "--quiet").stdout
    trial = load_trial(lab / "P01" / "trial.toml")
    fill = present(present(trial.crack, "crack").fill, "fill")
    assert fill.level_mm == (-6.0, -4.5, -3.0, -1.5, 0.0)
    assert fill.mass_sd_g == 0.02
    assert trial.note is None or "wall_angle_deg" not in trial.note
    assert (lab / "P01" / "inputs" / "fill.xlsx").read_bytes() == (small / "P01 Wasser.xlsx").read_bytes()
    weighed = json.loads((lab / "P01" / "run" / "solid.json").read_text())["weighed"]
    assert weighed["wall_angle_deg"] < 3.0, "the walls of what was poured are upright"
    other = present(load_trial(lab / "P02" / "trial.toml").crack, "crack")
    assert (other.fill, other.wall_angle_deg) == (None, 5.0), "the folder's words hold for the others"


def test_a_fill_in_doubt_is_asked_beside_its_file(small, tmp_path):
    _poured(small, "Masse", "Tiefe [mm]")
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    assert "P01 Wasser.xlsx, sheet 'Sheet', row 1: 'Masse': no unit." in question(lab, "P01 Wasser.xlsx")
    answer(lab, {"P01 Wasser.xlsx": {"mass": "g", "settings": 'crack.tilt = "funnel"'}})
    assert not ingest(small, lab, QUIET).faults
