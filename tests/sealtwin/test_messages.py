"""Sentences of the command: options where options are meant, settings where a trial file is, and none that is not."""

import os
import re
import subprocess
import sys

import pytest

from sealtwin.cli.options import read_number
from tests.house_rules import PACKAGES
from tests.support.paths import ROOT
from tests.support.processes import commands, sealtwin

COMMANDS = commands()
ALL_OPTIONS = {"--help", "--version"} | {
    name for command in COMMANDS.values() for parameter in command.params for name in parameter.opts if name[0] == "-"
}
OTHERS = {"--nworkers", "--nthreads", "--constraint", "--editable"}
"""Options of Dask and of pip."""


def test_no_sentence_names_an_option_or_a_command_that_does_not_exist():
    # Variables of a style sheet begin with two hyphens as well.
    drawn = {"theme.py", "charts.py"}
    code = (path for name in PACKAGES for path in (ROOT / name).rglob("*.py") if path.name not in drawn)
    templates = (ROOT / "sealtwin" / "templates").glob("*.toml")
    pages = (ROOT / "README.md", *(ROOT / "docs").rglob("how-to/*.md"))
    texts = {str(path): path.read_text(encoding="utf-8") for path in (*code, *templates, *pages)}
    named = {
        (place, name)
        for place, text in texts.items()
        for name in re.findall(r"(?<![\w(-])--[a-z][a-z-]*[a-z](?![\w:-])", text)
    }
    assert len(named) > 50
    assert {(place, name) for place, name in named if name not in ALL_OPTIONS | OTHERS} == set()
    verbs = {(place, verb) for place, text in texts.items() for verb in re.findall(r"'sealtwin ([a-z][a-z-]+)", text)}
    assert len(verbs) > 10
    assert {(place, verb) for place, verb in verbs if verb not in " ".join(COMMANDS).split()} == set()


def test_a_decimal_comma_is_read_and_half_a_number_is_not():
    """Code 3 is of a photo that is not there: the number was read."""
    for text, code in (("0,5", 3), *((odd, 2) for odd in ("1_0", "nan", "1e999", "\u0663", "1,000", "0x1", ""))):
        answer = sealtwin("digitise", "none.png", "--mm-per-px", "0.1", "--depth-mm", text)
        assert answer.exit_code == code, (text, answer.output)


@pytest.mark.parametrize(("text", "value"), [("0,125", 0.125), ("-1,5e2", -150), (".5", 0.5), ("5.", 5), (" 12 ", 12)])
def test_numbers_as_people_write_them(text, value):
    assert read_number(text) == value


def test_counts_are_whole_and_within_their_bounds():
    for count in ("1_0", "2,5", "0", "65"):
        assert sealtwin("digitise", "none.png", "--depth-mm", "5", "--jobs", count).exit_code == 2, count


ASIDE = """
import logging, os, warnings
from sealtwin.cli import app

def command():
    warnings.warn("aside", RuntimeWarning)
    logging.getLogger("library").warning("aside")
    print("płyta", os.environ.get("COLUMNS"))

app.app = command
app.main()
"""


@pytest.mark.parametrize(("options", "printed"), [((), b"p\\u0142yta None"), (("--json",), "płyta None".encode())])
def test_any_name_is_printed_and_what_a_library_says_aside_is_not(options, printed, tmp_path):
    """A page that lacks a letter gets an escape, as pipes on Windows; JSON is UTF-8. Width 0 would make help blank."""
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "COLUMNS": "0"}
    command = [sys.executable, "-c", ASIDE, *options]
    answer = subprocess.run(command, capture_output=True, cwd=tmp_path, env=environment, check=False)
    assert (answer.returncode, answer.stdout.strip(), answer.stderr) == (0, printed, b"")
