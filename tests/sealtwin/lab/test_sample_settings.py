"""Settings of samples from lab.toml, from pairing.csv and from weighed fills."""

import json

import numpy as np
import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.lab.ingest import ingest
from sealtwin.lab.sample_settings import SampleSettings
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import QUIET, answer, pairing_rows, sealtwin


def test_the_scale_of_a_sample_replaces_any_scale_of_the_folder():
    folder = SampleSettings(dict.fromkeys(("photo.mm_per_px", "crack.depth_mm", "fluid.U"), 1.0))
    sample = SampleSettings(dict.fromkeys(("photo.face_mm", "fluid.viscosity_pa_s"), 1.0))
    assert {*sample.over(folder).values} == {"photo.face_mm", "fluid.viscosity_pa_s", "crack.depth_mm"}


def test_all_faults_of_lab_toml_are_listed_together_and_stop_the_ingest(small, tmp_path):
    faulty = 'data = "measured"\nname = "all"\n[photo]\nmm_per_pxl = 0.1\nscale = 2\n[readings]\nas_written = ["C4"]\n'
    (small / "lab.toml").write_text(faulty)
    with pytest.raises(InputError, match=r"lab\.toml: ") as refusal:
        ingest(small, tmp_path / "lab", QUIET)
    faults = "photo.mm_per_pxl = '0.1': there is no such", "photo.scale = '2': there is no such", "as_written"
    lines = str(refusal.value).splitlines()
    assert [sum(fault in line for line in lines) for fault in faults] == [1, 1, 1]
    assert len(lines) == 3


def test_a_column_of_pairing_csv_may_be_any_setting_of_a_trial(small, tmp_path):
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    rows = {"P01.png": {"crack.depth_mm": "[[0.0, 7.5], [12.0, 8.5]]", "path.speed_mm_s": "15", "operator": "C. D."}}
    answer(lab, rows)
    ingested = ingest(small, lab, QUIET)
    assert not ingested.faults
    trial, other = (load_trial(lab / name / "trial.toml") for name in ("P01", "P02"))
    assert present(trial.crack, "crack").depth_mm == ((0.0, 7.5), (12.0, 8.5))
    assert (trial.path.speed_mm_s, other.path.speed_mm_s) == (15, 20)
    assert [sample.said["operator"] for sample in ingested.samples] == ["C. D.", "A. Muster"]
    assert {"crack.depth_mm", "path.speed_mm_s", "operator"} <= pairing_rows(lab)[0].keys()
    for column, text, sentence in (
        ("photo.file", "P02.png", "photo.file = 'P02.png', but the sample's photo is P01.png"),
        ("date", "03/05/2026", "date = '03/05/2026': this is not a date"),
        ("crack.wall_angle_deg", "80", "crack.wall_angle_deg = 80: should be less than 60"),
    ):
        answer(lab, {"P01.png": {column: text}})
        assert [sentence in fault.sentence for fault in ingest(small, lab, QUIET).faults] == [True]
        answer(lab, {"P01.png": {column: ""}})
    answer(lab, {"P01.png": {"crack.depht_mm": "8"}})
    with pytest.raises(InputError, match=r"in the column 'crack\.depht_mm'; allowed columns are"):
        ingest(small, lab, QUIET)


def test_a_missing_depth_is_asked_in_a_column_of_its_name(small, tmp_path):
    lab, text = tmp_path / "lab", (small / "lab.toml").read_text()
    (small / "lab.toml").write_text(text.replace("depth_mm = 8.0\n", ""))
    ingest(small, lab, QUIET)
    rows = pairing_rows(lab)
    assert ["crack.depth_mm is missing" in row["question"] for row in rows if row["role"] == "photo"] == [True] * 2
    answer(lab, {row["file"]: {"crack.depth_mm": "8"} for row in rows if row["role"] == "photo"})
    assert not ingest(small, lab, QUIET).faults


@pytest.fixture
def poured(small):
    """The small folder with a weighed fill of P01, whose crack is 12 x 2 x 8 mm with upright walls."""
    steps = ((12 * 2 * 8 * (1 + z / 8) * 0.998e-3, z) for z in np.linspace(-6.0, 0.0, 5))
    rows = [f"{mass_g:.3f},{z}" for mass_g, z in steps]
    (small / "P01 Wasser.csv").write_text("\n".join(["mass_g,level_mm", *rows]))
    note = (small / "lab.toml").read_text().replace('tilt = "vertical"', "wall_angle_deg = 5.0")
    (small / "lab.toml").write_text(note + "[crack.fill]\nmass_sd_g = 0.02\n[uncertainty]\nwidth_mm = 0.1\n")
    return small


def test_a_weighed_fill_beside_the_readings_is_copied_and_used_for_the_solid(poured, tmp_path):
    lab = tmp_path / "lab"
    asked = sealtwin("ingest", poured, "--out", lab, "--quiet").stdout
    (row,) = (row for row in pairing_rows(lab) if row["role"] == "fill")
    assert (row["file"], row["sample"]) == ("P01 Wasser.csv", "P01")
    assert "crack.tilt is missing: the steps of a fill require it" in asked
    answer(lab, {"P01 Wasser.csv": {"crack.tilt": "funnel"}})
    last = sealtwin("ingest", poured, "--out", lab, "--quiet")
    assert last.exit_code == 0, last.output
    trial = load_trial(lab / "P01" / "trial.toml")
    fill = present(present(trial.loaded(lab / "P01").crack, "crack").fill, "fill")
    assert (fill.level_mm, fill.mass_sd_g) == ((-6.0, -4.5, -3.0, -1.5, 0.0), 0.02)
    assert "wall_angle_deg" not in (trial.note or "")
    assert (lab / "P01" / "inputs" / "fill.csv").read_bytes() == (poured / "P01 Wasser.csv").read_bytes()
    weighed = json.loads((lab / "P01" / "run" / "solid.json").read_text())["weighed"]
    assert weighed["wall_angle_deg"] < 3.0, "the walls of what was poured are upright"
    other = present(load_trial(lab / "P02" / "trial.toml").crack, "crack")
    assert (other.fill, other.wall_angle_deg) == (None, 5.0), "the folder's words hold for the others"
