"""Questions that only the traced crack raises are asked and answered in pairing.csv, as those on sheets are."""

from pathlib import Path

import numpy as np
import pytest

from sealtwin.core import record_files
from sealtwin.core.errors import present
from sealtwin.core.records import Profile
from sealtwin.lab import ingest as steps
from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import QUIET, answer, edit, hashes_of, pairing_rows, question, sealtwin
from tests.support.photos import mortar, wandering, with_crack, write_png


def _ingest(folder, lab):
    return sealtwin("ingest", folder, "--out", lab, "--quiet")


@pytest.fixture
def late(small, tmp_path):
    """Two cracks in the photo of P02, of which nobody says the ends; a reading of P01 beyond its crack's end."""
    one = with_crack(mortar((200, 200), seed=1), wandering([(40, 50), (160, 50)], 9.0), 12)
    write_png(small / "P02.png", with_crack(one, wandering([(40, 150), (160, 150)], 9.0), 12))
    edit(small / "lab.toml", "radius_mm = 0.45", "radius_mm = 0.3")
    (small / "P02_Notiz.toml").write_text("crack.depth_mm = 8.0\n")
    with (small / "P01.csv").open("a") as sheet:
        sheet.write("40.0,-1.0,-1.0,-1.0\n")
    return small, tmp_path / "lab"


def test_a_sheet_in_question_is_held_against_its_crack_too(late):
    folder, lab = late
    edit(folder / "P01.csv", "level", "reading")
    ingest(folder, lab, QUIET, jobs=1)
    assert "sign = ..." in question(lab, "P01.csv")
    assert "outside the crack" in question(lab, "P01.csv")


def test_they_stand_beside_their_files_and_the_same_command_takes_the_answers(late):
    folder, lab = late
    before = hashes_of(folder)
    first = _ingest(folder, lab)
    assert first.exit_code == 6, first.output
    assert "To answer the questions, edit" in first.stdout
    assert "2 cracks compete" in question(lab, "P02.png")
    assert "such as photo.crack = 2" in (asked := question(lab, "P02.png"))
    assert Path(asked.partition("Look at ")[2].rstrip(".")).is_file(), asked
    assert question(lab, "P01.csv").startswith("P01.csv: 40 mm in A8 is outside the crack")
    assert question(lab, "P01.png") == ""
    answer(lab, {"P01.csv": {"skip": "8"}, "P02.png": {"settings": "photo.crack = 2"}})
    last = _ingest(folder, lab)
    assert last.exit_code == 0, last.output
    assert "2 of 2 samples are sound" in last.stdout
    assert {row["question"] for row in pairing_rows(lab)} == {""}
    assert hashes_of(folder) == before


@pytest.mark.slow
def test_the_direction_of_s_is_asked_once_there_is_a_level(small, tmp_path):
    lab = tmp_path / "lab"
    edit(small / "lab.toml", "volume_ml = 0.08", 'volume_ml = "cavity"')
    levels_mm = np.linspace(-3.0, -0.5, 6)
    rows = [f"{s_mm},{z},{z - 0.1}" for s_mm, z in zip(range(1, 12, 2), levels_mm, strict=True)]
    (small / "P01.csv").write_text("\n".join(["s_mm,level_1_mm,level_2_mm", *rows]))
    assert _ingest(small, lab).exit_code == 0
    run = lab / "P01" / "run"
    assert sealtwin("simulate", run, "--quiet").exit_code == 0
    s_mm = np.linspace(0.0, 12.0, 25)
    record_files.write_profile(
        run, Profile(s_mm, np.interp(s_mm, [1, 11], [-0.5, -3.0]), data="synthetic", source="simulation")
    )
    asked = _ingest(small, lab)
    assert asked.exit_code == 6, asked.output
    assert "Give s_from = second." in asked.output
    assert "Give s_from = second." in question(lab, "P01.csv")
    answer(lab, {"P01.csv": {"s_from": "second"}})
    assert _ingest(small, lab).exit_code == 0
    readings = present(load_trial(lab / "P01@2" / "trial.toml").readings, "readings")
    assert present(readings.columns, "columns").s_from == "second"


def test_an_answer_given_meanwhile_is_not_written_over(late, monkeypatch):
    folder, lab = late
    traced = steps.digitise_many

    def answered_meanwhile(*arguments, **more):
        answer(lab, {"P02.png": {"crack": "2"}})
        return traced(*arguments, **more)

    for file in folder.glob("P01*"):
        file.unlink()
    monkeypatch.setattr(steps, "digitise_many", answered_meanwhile)
    _ingest(folder, lab)
    monkeypatch.undo()
    assert next(row["crack"] for row in pairing_rows(lab) if row["file"] == "P02.png") == "2"
    assert "crack = 2" not in (lab / "P02" / "trial.toml").read_text()
    ingest(folder, lab, QUIET)
    assert "crack = 2" in (lab / "P02" / "trial.toml").read_text()
