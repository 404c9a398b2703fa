"""Held out is a claim that the lab's own catalogue is searched for."""

import shutil

import numpy as np
import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Profile
from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.held_out import facts_above, note_study, note_use, readings_hash
from sealtwin.trial.trial_file import load_trial
from tests.labs import edit, sealtwin
from validate.readings.read_readings import read_readings

STUDY = """
name = "which U"
trial = "{trial}"

[grid]
"fluid.U" = [3.0, 300.0]
"""


def facts_of(home):
    return facts_above(load_trial(home / "trial.toml"), home)


def calibrated(home):
    """Its readings, held out as those of both trials of the lab are, become calibrated on."""
    edit(home / "trial.toml", "held-out", "calibrated-on")


def test_readings_that_nothing_was_chosen_by_are_held_out(lab, tmp_path):
    assert facts_of(lab / "P01").lab_searched
    calibrated(lab / "P02")
    assert facts_of(lab / "P01").lab_searched, "P02 has readings of its own"
    assert not facts_of(lab / "P02").lab_searched, "it claims nothing"
    outside = shutil.copytree(lab / "P01", tmp_path / "elsewhere" / "P01")
    assert not facts_of(outside).lab_searched, "there is no catalogue"
    shutil.copytree(lab / "P01" / "inputs", lab / "P01" / "run" / "inputs")
    shutil.copy(lab / "P01" / "trial.toml", lab / "P01" / "run")
    assert facts_of(lab / "P01" / "run").lab_searched


def test_what_another_sample_was_calibrated_on_is_refused_by_its_values(lab):
    """The same numbers in a file with other bytes, and other columns for the repeats."""
    sheet = lab / "P01" / "inputs" / "readings.csv"
    head, *rows = sheet.read_text(encoding="utf-8").splitlines()
    turned = [",".join([s, *reversed(levels)]) for s, *levels in (row.split(",") for row in rows)]
    other = lab / "P02" / "inputs" / "readings.csv"
    other.write_text("\n".join([head, *turned]) + "\n", encoding="utf-8")
    assert other.read_bytes() != sheet.read_bytes()
    calibrated(lab / "P02")
    with pytest.raises(InputError, match="calibration of sample 'P02', revision 1,"):
        facts_of(lab / "P01")


def test_a_study_of_the_lab_is_named_where_it_chose_with_the_readings(lab, tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(STUDY.format(trial=lab / "P01" / "trial.toml"), encoding="utf-8")
    note_study(study)
    with pytest.raises(InputError, match="the study 'which U' of ") as fault:
        facts_of(lab / "P01")
    assert len(str(fault.value).splitlines()) == 1
    assert facts_of(lab / "P02").lab_searched
    answer = sealtwin("run", lab / "P01" / "trial.toml", "--out", tmp_path / "run")
    assert answer.exit_code == 3
    assert "which U" in answer.stderr
    assert not (tmp_path / "run").exists()
    calibrated(lab / "P01")
    facts_of(lab / "P01")


@pytest.mark.parametrize("broken", ["inputs", "trial.toml"])
def test_another_samples_broken_files_are_a_caution(lab, broken):
    """Once they kept every held-out trial of the lab from its run."""
    calibrated(lab / "P02")
    readings = present(load_trial(lab / "P02" / "trial.toml").readings, "readings")
    (lab / "P02" / (readings.file if broken == "inputs" else broken)).write_text("no table")
    facts = facts_of(lab / "P01")
    assert not facts.lab_searched, "what is not read may hold the same"
    (caution,) = facts.cautions
    assert caution.startswith("caution: sample 'P02' ")


def test_a_map_against_a_sheet_of_the_lab_is_a_use_of_it(lab, tmp_path):
    settings = present(load_trial(lab / "P01" / "trial.toml").readings, "readings")
    sheet = lab / "P01" / settings.file
    profile = read_readings(sheet, settings)
    note_use(sheet, profile, "map of the study 'x'")
    note_use(tmp_path / sheet.name, profile, "map of the study 'y'")
    assert Catalogue.of(lab).content.uses == {readings_hash(profile): ["map of the study 'x'"]}
    with pytest.raises(InputError, match="map of the study 'x'"):
        facts_of(lab / "P01")


@pytest.mark.parametrize(
    ("changed", "same"),
    [
        ({"repeats_mm": [[-2.0, -1.0], [-3.0, np.nan]]}, True),  # The repeats of a station have no order
        ({"repeats_mm": [[-1.0, -2.0, np.nan], [-3.0, np.nan, np.nan]]}, True),
        ({"data": "synthetic", "source": "other.xlsx"}, True),
        ({"repeats_mm": [[-1.0, -2.0], [-3.01, np.nan]]}, False),
        ({"s_mm": [0.0, 5.1]}, False),
    ],
)
def test_a_hash_is_that_of_the_values(changed, same):
    content = {"s_mm": [0.0, 5.0], "repeats_mm": [[-1.0, -2.0], [-3.0, np.nan]], "data": "measured", "source": "a.csv"}

    def hashed(s_mm, repeats_mm, data, source):
        repeats = np.array(repeats_mm)
        return readings_hash(Profile(np.array(s_mm), np.nanmean(repeats, axis=1), repeats, data, source))

    assert (hashed(**content | changed) == hashed(**content)) is same
