"""Many photos, digitised by one command."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from sealtwin.cli.folder_answer import batch_answer
from sealtwin.core.arc_length import arc_length
from sealtwin.core.progress import Progress
from sealtwin.study import photos as batch
from sealtwin.study.photos import digitise_many, plan
from tests.support.ingested_lab import sealtwin
from tests.support.photos import mortar, with_crack, write_png

SIZE_PX = (250, 150)
GIVEN = {"photo.mm_per_px": 0.1, "photo.crack": 1, "crack.depth_mm": 16.0}


def _digitise(photos, *arguments):
    return sealtwin("digitise", photos, "--mm-per-px", 0.1, "--depth-mm", 16, *arguments, "--quiet")


def wave(y):
    """A crack's line: straight ones would pass for joints."""
    return [(x, round(y + 7 * np.sin(x / 15 + y) + 3 * np.sin(x / 6))) for x in range(20, 231, 3)]


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Two photos with a crack, a mortar face without one, and a text file that calls itself a photo."""
    folder = tmp_path_factory.mktemp("lab")
    write_png(folder / "first.png", with_crack(mortar(SIZE_PX), wave(75)))
    write_png(folder / "second.png", with_crack(mortar(SIZE_PX), wave(60)))
    write_png(folder / "plain.png", mortar(SIZE_PX))
    (folder / "note.jpg").write_text("This is no photo.")
    return folder


def rows_of(out):
    """Return the rows of the table of a batch by the name of the photo."""
    with (out / "photos.csv").open(newline="") as table:
        return {Path(row["file"]).name: row for row in csv.DictReader(table)}


def _both(lab, out, **how):
    """Digitise the two photos with a crack."""
    return digitise_many(plan([lab / "first.png", lab / "second.png"], GIVEN), out, Progress(), **how)


@pytest.fixture(scope="module")
def done(lab, tmp_path_factory):
    out = tmp_path_factory.mktemp("batch") / "out"
    return out, batch_answer(digitise_many(plan([lab], GIVEN), out, Progress()))


def test_a_batch_continues_past_failed_photos_and_lists_the_failures(done):
    out, answer = done
    assert answer.exit_code == 6
    note, plain = answer.lines[-2:]
    assert "failed: " in note
    assert "note.jpg: not a readable photo" in note
    assert "plain.png: no crack found" in plain
    rows = rows_of(out)
    states = {name: row["status"] for name, row in rows.items()}
    assert states == {"first.png": "ok", "note.jpg": "failed", "plain.png": "failed", "second.png": "ok"}
    first, drawn_mm = rows["first.png"], 0.1 * arc_length(np.array(wave(75), dtype=float))[-1]
    assert float(first["length_mm"]) == pytest.approx(drawn_mm + 1.4, rel=0.05)  # A round end of 0.7 mm at each side
    assert float(first["cavity_ml"]) == pytest.approx(float(first["sealant_ml"]), rel=1e-3)
    assert first["path_source"] == "choice"
    page = (out / "index.html").read_text()
    assert page.count("data:image/jpeg;base64,") == 2
    assert "2 of 4 photos digitised" in page
    assert "http" not in page.replace("http-equiv", ""), "it loads nothing"


@pytest.mark.parametrize(
    ("photos", "last"),
    [
        pytest.param(("a/x.jpg", "a/x.png", "b/X.jpg", "b/y.jpg"), "y", id="photos of one name share no folder"),
        pytest.param(("p/a/x.png", "q/a/x.png", "r/a/x.png", "s/a-x-2.png"), "a-x-2", id="a suffixed name that exists"),
    ],
)
def test_each_photo_of_a_batch_has_its_own_folder(tmp_path, photos, last):
    names = [item.name for item in plan([tmp_path / photo for photo in photos], GIVEN)]
    assert len({name.casefold() for name in names}) == 4
    assert names[3] == last


def test_masks_of_trials_and_hidden_files_are_not_taken_for_photos(tmp_path):
    """A Mac leaves hidden files beside photos. A hidden file that is named is digitised, as by any command."""
    for name in ("a.png", "a_mask.png", "._a.png", ".hidden.jpg"):
        (tmp_path / name).touch()
    photo = '[photo]\nfile = "a.png"\ndata = "measured"\nmm_per_px = 0.1\nmask = "a_mask.png"\n'
    (tmp_path / "a.toml").write_text(f'name = "a"\n{photo}[crack]\ndepth_mm = 16\n')
    for path, names in ((tmp_path, ["a.toml"]), (tmp_path / ".hidden.jpg", [".hidden.jpg"])):
        assert [item.file.name for item in plan([path], GIVEN)] == names


def test_a_bug_in_one_photo_is_reported_without_stopping_other_photos(tmp_path, lab, monkeypatch):
    real = batch.run_stages

    def burst(job, stages):
        if job.trial.name == "second":
            return real(job, stages)
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(batch, "run_stages", burst)
    report = _both(lab, tmp_path)
    assert report.exit_code == 1
    assert [row.status for row in report.rows] == ["bug", "ok"]
    assert "ZeroDivisionError: on purpose" in (tmp_path / "first" / "fault.txt").read_text()


def test_a_batch_does_not_overwrite_files_of_the_user(tmp_path, lab):
    (tmp_path / "batch.json").write_text("mine")
    answer = _digitise(lab, "--out", tmp_path)
    assert answer.exit_code == 3
    assert "batch.json that no batch wrote" in answer.stderr
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("batch.json", "mine")]


@pytest.mark.parametrize("name", ["...jpg", ".png", ".lock.png", "photos.csv.png", "INDEX.html.png"])
def test_a_photo_name_never_becomes_a_parent_folder_or_a_batch_file(tmp_path, name):
    """The stem of "...jpg" is "..": its run folder would be the folder above."""
    (tmp_path / name).touch()
    folder = plan([tmp_path / name], GIVEN)[0].name
    assert not folder.startswith(".")
    assert "." not in folder


def test_a_photo_name_that_is_not_utf8_fails_without_stopping_the_batch(tmp_path, lab):
    shutil.copy(lab / "first.png", tmp_path / "caf\udce9.png")
    report = digitise_many(plan([tmp_path, lab / "first.png"], GIVEN), tmp_path / "out", Progress())
    assert [row.status for row in report.rows] == ["failed", "ok"]
    assert "caf\\xe9.png: the name is not UTF-8" in report.rows[0].reason
    assert json.loads((tmp_path / "out" / "batch.json").read_text())["failed"] == 1


@pytest.mark.parametrize(
    ("arguments", "named"),
    [("--ends 1,2 3,4 --out x", "photo.ends_px cannot be given for several photos"), ("", "--out")],
)
def test_crack_ends_and_a_missing_out_option_are_refused_for_several_photos(lab, arguments, named):
    answer = _digitise(lab, *arguments.split())
    assert answer.exit_code == 2
    assert named in answer.stderr.replace("\n", " ")
