"""A liquid weighed into a crack, as a CSV beside photo and readings: used, reported, and asked about."""

import json

import numpy as np
import pytest

from sealtwin.core.errors import present
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import answer, edit, pairing_rows, question, sealtwin


@pytest.fixture
def poured(small):
    """The small folder with a CSV of what the crack of P01, 12 mm by 2 by 8 mm with upright walls, holds."""
    steps = ((12 * 2 * 8 * (1 + z / 8) * 0.998e-3, z) for z in np.linspace(-6.0, 0.0, 5))
    rows = [f"{mass_g:.3f},{z}" for mass_g, z in steps]
    (small / "P01 Wasser.csv").write_text("\n".join(["mass_g,level_mm", *rows]))
    note = (small / "lab.toml").read_text().replace('tilt = "vertical"', "wall_angle_deg = 5.0")
    (small / "lab.toml").write_text(note + "[crack.fill]\nmass_sd_g = 0.02\n[uncertainty]\nwidth_mm = 0.1\n")
    return small


def test_a_fill_beside_the_readings_is_copied_used_and_reported(poured, tmp_path):
    lab = tmp_path / "lab"
    asked = sealtwin("ingest", poured, "--out", lab, "--quiet").stdout
    (row,) = (row for row in pairing_rows(lab) if row["role"] == "fill")
    assert (row["file"], row["sample"]) == ("P01 Wasser.csv", "P01")
    assert "crack.tilt is missing: the steps of a fill need it" in asked
    answer(lab, {"P01 Wasser.csv": {"settings": 'crack.tilt = "funnel"'}})
    last = sealtwin("ingest", poured, "--out", lab, "--quiet")
    assert last.exit_code == 0, last.output
    trial = load_trial(lab / "P01" / "trial.toml")
    fill = present(present(trial.loaded(lab / "P01").crack, "crack").fill, "fill")
    assert fill.level_mm == (-6.0, -4.5, -3.0, -1.5, 0.0)
    assert fill.mass_sd_g == 0.02
    assert trial.note is None or "wall_angle_deg" not in trial.note
    assert (lab / "P01" / "inputs" / "fill.csv").read_bytes() == (poured / "P01 Wasser.csv").read_bytes()
    weighed = json.loads((lab / "P01" / "run" / "solid.json").read_text())["weighed"]
    assert weighed["wall_angle_deg"] < 3.0, "the walls of what was poured are upright"
    other = present(load_trial(lab / "P02" / "trial.toml").crack, "crack")
    assert (other.fill, other.wall_angle_deg) == (None, 5.0), "the folder's words hold for the others"


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("P01 Wasser.csv", "mass_g", "Masse [g]", "expected a CSV"),
        ("P01 Wasser.csv", "-3.0", "-5.0", "row 4, column level_mm: -5 after -4.5"),
        ("P01 Wasser.xlsx", "", "PK", "CSV"),
    ],
)
def test_a_fill_that_cannot_be_read_is_asked_about_beside_its_file(poured, tmp_path, name, old, new, words):
    file = poured / "P01 Wasser.csv"
    text = file.read_text().replace(old, new)
    file.unlink()
    (poured / name).write_text(text)
    edit(poured / "lab.toml", "wall_angle_deg = 5.0", 'tilt = "funnel"')
    sealtwin("ingest", poured, "--out", tmp_path / "lab", "--quiet")
    assert words in question(tmp_path / "lab", name)
    assert question(tmp_path / "lab", name).startswith(name)
