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
from tests.places import ROOT
from tests.programs import sealtwin

COMMANDS = typer.main.get_command(app).commands  # pyright: ignore[reportAttributeAccessIssue]
ALL_OPTIONS = {"--help", "--version"} | {
    name for command in COMMANDS.values() for parameter in command.params for name in parameter.opts if name[0] == "-"
}
OTHERS = {"--nworkers", "--nthreads", "--constraint", "--editable"}
"""Options of Dask and of pip."""
PHOTO = ("--depth-mm", "5", "--mm-per-px", "0.1")


def _strings(tree):
    return [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]


@pytest.mark.broad
def test_no_sentence_names_an_option_or_a_command_that_does_not_exist():
    # Variables of a style sheet begin with two hyphens as well.
    drawn = {"theme.py", "charts.py"}
    texts = {str(path): "\n".join(_strings(tree)) for path, tree in modules() if path.name not in drawn}
    texts |= {str(page): page.read_text() for page in (ROOT / "README.md", *(ROOT / "docs").rglob("how-to/*.md"))}
    templates = {*(ROOT / "sealtwin" / "templates").glob("*.toml")}
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


@pytest.mark.parametrize("option", ["--mm-per-px", "--depth-mm"])
def test_a_decimal_comma_is_read_and_half_a_number_is_not(option):
    """Code 3 is of a photo that is not there: the numbers were read."""
    others = [word for at in (0, 2) if PHOTO[at] != option for word in PHOTO[at : at + 2]]
    for text, code in (("0,5", 3), *((odd, 2) for odd in ("1_0", "nan", "1e999", "\u0663", "1,000", "0x1", ""))):
        answer = sealtwin("digitise", "none.png", *others, option, text)
        assert answer.exit_code == code, (option, text, answer.output)


@pytest.mark.parametrize(("text", "value"), [("0,125", 0.125), ("-1,5e2", -150), (".5", 0.5), ("5.", 5), (" 12 ", 12)])
def test_numbers_as_people_write_them(text, value):
    assert read_number(text) == value


def test_counts_are_whole_and_within_their_bounds():
    assert [sealtwin("digitise", "none.png", *PHOTO, "--jobs", n).exit_code for n in ("1_0", "2,5", "0", "65")] == [
        2
    ] * 4


@pytest.mark.broad
@pytest.mark.parametrize(
    "aside", ["warnings.warn('aside', RuntimeWarning)", "logging.getLogger('lib').warning('aside')"]
)
def test_what_a_library_says_aside_is_not_printed(aside, tmp_path):
    script = f"import logging, warnings; from sealtwin.cli import app; app.app = lambda: {aside}\napp.main()"
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, cwd=tmp_path, text=True, check=False)
    assert (answer.returncode, answer.stderr) == (0, "")
