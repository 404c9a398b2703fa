"""Sentences of the command: options where options are meant, settings where a trial file is, and none that is not."""

import ast
import re
import subprocess
import sys

import pytest
import typer.main

from sealtwin.cli.app import app
from sealtwin.cli.options import read_number
from tests.house_rules import modules
from tests.pictures import mortar, with_crack, write_png
from tests.places import ROOT
from tests.programs import sealtwin

COMMANDS = typer.main.get_command(app).commands  # pyright: ignore[reportAttributeAccessIssue]
ALL_OPTIONS = {"--help", "--version"} | {
    name for command in COMMANDS.values() for parameter in command.params for name in parameter.opts if name[0] == "-"
}
OTHERS = {"--array", "--job-name", "--cpus-per-task", "--constraint", "--editable"}
"""Options of batch systems, in the scripts that we write for them, and of pip."""
PHOTO = ("--depth-mm", "5", "--mm-per-px", "0.1")


@pytest.fixture
def photo(tmp_path):
    return write_png(tmp_path / "photo.png", with_crack(mortar(), [(40, 150), (460, 140)]))


def _strings(tree):
    return [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]


def test_no_sentence_names_an_option_or_a_command_that_does_not_exist():
    # Variables of a style sheet begin with two hyphens as well.
    drawn = {"theme.py", "charts.py"}
    texts = {str(path): "\n".join(_strings(tree)) for path, tree in modules() if path.name not in drawn}
    texts |= {str(page): page.read_text() for page in (ROOT / "README.md", *(ROOT / "docs").rglob("how-to/*.md"))}
    templates = {*(ROOT / "sealtwin" / "templates").glob("*.toml")}
    # It names options that are gone.
    templates.remove(ROOT / "sealtwin" / "templates" / "removed_options.toml")
    texts |= {str(page): page.read_text() for page in templates}
    named = {
        (place, name)
        for place, text in texts.items()
        for name in re.findall(r"(?<![\w(-])--[a-z][a-z-]*[a-z](?![\w:-])", text)
    }
    assert len(named) > 50
    assert {(place, name) for place, name in named if name not in ALL_OPTIONS | OTHERS} == set()
    verbs = {(place, verb) for place, text in texts.items() for verb in re.findall(r"'sealtwin ([a-z][a-z-]+)", text)}
    assert len(verbs) > 10
    assert {(place, verb) for place, verb in verbs if verb not in COMMANDS} == set()


def test_a_note_names_the_setting_of_a_photo_as_of_a_trial(photo, tmp_path):
    answer = sealtwin("digitise", photo, *PHOTO, "--out", tmp_path / "run")
    assert answer.exit_code == 0, answer.output
    trial = tmp_path / "trial.toml"
    lines = ('name = "t"', "[photo]", 'file = "photo.png"', 'data = "synthetic"', "mm_per_px = 0.1")
    trial.write_text("\n".join([*lines, "[crack]", "depth_mm = 5.0"]))
    for said in (answer.stderr, sealtwin("digitise", trial, "--out", tmp_path / "run2").stderr):
        assert "then give ends_px to confirm it" in said


@pytest.mark.parametrize("option", ["--mm-per-px", "--depth-mm"])
def test_a_decimal_comma_is_read_and_half_a_number_is_not(photo, tmp_path, option):
    values = {"--mm-per-px": "0,1", "--depth-mm": "5,5"}
    others = [word for at in (0, 2) if PHOTO[at] != option for word in PHOTO[at : at + 2]]
    given = [*others, "--ends", "40,150", "460,140", "--out", tmp_path / "run"]
    assert sealtwin("digitise", photo, *given, option, values[option]).exit_code == 0
    for odd in ("1_0", "nan", "1e999", "\u0663", "1,000", "0x1", ""):
        answer = sealtwin("digitise", photo, *given, option, odd)
        assert answer.exit_code == 2, (option, odd, answer.output)


@pytest.mark.parametrize(("text", "value"), [("0,125", 0.125), ("-1,5e2", -150), (".5", 0.5), ("5.", 5), (" 12 ", 12)])
def test_numbers_as_people_write_them(text, value):
    assert read_number(text) == value


def test_counts_are_whole_and_within_their_bounds(photo):
    assert [sealtwin("digitise", photo, *PHOTO, "--jobs", n).exit_code for n in ("1_0", "2,5", "0", "65")] == [2] * 4


@pytest.mark.parametrize(
    "said", ["warnings.warn('aside', RuntimeWarning)", "logging.getLogger('lib').warning('aside')"]
)
def test_what_a_library_says_aside_is_not_printed(said, tmp_path):
    script = "import logging, sys, warnings; from sealtwin.cli import app; sys.argv = ['sealtwin', 'init', 'lab']\n"
    script += f"app.refuse_foreign_packages = lambda: {said}\napp.main()"
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, cwd=tmp_path, text=True, check=False)
    assert (answer.returncode, answer.stderr) == (0, "")


def test_a_table_of_depths_with_two_columns_of_one_name_is_refused(photo, tmp_path):
    table = tmp_path / "depths.csv"
    table.write_text("s_mm,s_mm,depth_mm\n0,1,5\n10,11,6\n")
    answer = sealtwin("digitise", photo, "--depth-mm", table, "--mm-per-px", "0.1", "--out", tmp_path / "run")
    assert answer.exit_code == 3
    assert "2 columns s_mm; keep one" in answer.stderr
