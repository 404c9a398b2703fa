"""A liquid weighed into a crack, on a lab's own sheet beside photo and readings: found, asked about, used, reported."""

import json

import numpy as np
import openpyxl

from sealtwin.core.errors import present
from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from tests.labs import QUIET, answer, pairing_rows, question, sealtwin


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
    assert "P01 Wasser.xlsx, sheet 'Sheet': column A has no unit" in question(lab, "P01 Wasser.xlsx")
    answer(lab, {"P01 Wasser.xlsx": {"mass": "g", "settings": 'crack.tilt = "funnel"'}})
    assert not ingest(small, lab, QUIET).faults
