"""The command `sealtwin markers` as a user meets it."""

import json
import tomllib

import pytest

from tests.support.processes import sealtwin
from tests.support.sheets import read_pdf


def _markers(*arguments):
    return sealtwin("markers", *arguments)


def test_a_frame_and_its_table_are_written(tmp_path):
    """And once more: the same frame is no file of the user's."""
    command = ("--face-mm", "160x40", "--out", tmp_path / "frame.pdf", "--toml", tmp_path / "board.toml")
    assert _markers(*command).exit_code == 0
    answer = _markers(*command)
    assert answer.exit_code == 0, answer.output
    assert read_pdf(tmp_path / "frame.pdf").size_mm == pytest.approx((297, 210), abs=5e-3)
    table = (tmp_path / "board.toml").read_text()
    assert answer.stdout == table
    assert len(tomllib.loads(table)["photo"]["markers"]["markers"]) == 8
    assert f"sealtwin digitise PHOTO --markers {tmp_path / 'board.toml'} --face-mm 160x40" in answer.stderr


def test_quiet_leaves_the_table_alone(tmp_path):
    answer = _markers(*f"--face-mm 70x40 --out {tmp_path}/frame.PDF --count 4 --paper letter --quiet".split())
    assert answer.exit_code == 0, answer.output
    assert not answer.stderr
    assert answer.stdout.startswith("# In [photo]: face_mm = [70.0, 40.0]\n[photo.markers]")
    assert read_pdf(tmp_path / "frame.PDF").size_mm == pytest.approx((215.9, 279.4), abs=5e-3)


def test_a_program_gets_the_board_as_one_object(tmp_path):
    answer = _markers("--face-mm", "70x40", "--out", tmp_path / "frame.pdf", "--size-mm", "10", "--json")
    assert "For the trial file" not in answer.stderr, "a program has no trial file to paste into"
    content = json.loads(answer.stdout)
    assert content["face_mm"] == [70, 40]
    assert content["markers"]["size_mm"] == 10
    assert content["markers"]["markers"][0] == {"id": 0, "x_mm": -8.75, "y_mm": -8.75}


@pytest.mark.parametrize("option", ["--out", "--toml"])
def test_nothing_of_the_users_is_overwritten(tmp_path, option):
    """--toml wants a new file for the table: whoever gives the trial's own name must not lose the trial."""
    mine = tmp_path / "mine.pdf"
    mine.write_text("mine")
    named = {"--out": tmp_path / "frame.pdf", "--toml": tmp_path / "board.toml"} | {option: mine}
    answer = _markers("--face-mm", "160x40", *(part for pair in named.items() for part in pair))
    assert answer.exit_code == 3
    assert "mine.pdf: already exists" in answer.stderr
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("mine.pdf", "mine")]


@pytest.mark.parametrize(
    ("arguments", "code", "named"),
    [
        ("--face-mm 300x200", 3, "210 x 297"),
        ("--face-mm 160", 2, "--face-mm 160: expected WxH"),
        ("--face-mm 160x40 --size-mm 1", 2, "--size-mm"),
        ("--face-mm 160x40 --out frame.png", 2, ".pdf"),
        ("--face-mm 160x40 --toml frame.pdf", 2, "same file"),
    ],
)
def test_what_cannot_be_printed_is_said_and_nothing_written(tmp_path, monkeypatch, arguments, code, named):
    monkeypatch.chdir(tmp_path)
    answer = _markers(*arguments.split(), *([] if "--out" in arguments else ["--out", "frame.pdf"]))
    assert answer.exit_code == code
    assert named in " ".join(answer.stderr.replace("│", " ").split())
    assert not list(tmp_path.iterdir())
