"""Output on pages that lack a letter, and on terminals without a width: each in a process of its own."""

import json
import os
import subprocess
import sys

import pytest

from tests.places import ROOT
from tests.wrong_inputs.processes import OUTCOME, study_of

pytestmark = pytest.mark.broad


def answer(*words: object, **environment: str) -> bytes:
    line = [sys.executable, "-m", "sealtwin", *map(str, words)]
    done = subprocess.run(line, cwd=ROOT, env=os.environ | environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(("page", "as_json"), [("cp1252", False), ("ascii", True)])
def test_a_name_that_the_page_lacks_is_printed_as_an_escape(tmp_path, page, as_json):
    """As on Windows, in any pipe: all was written, and then the answer ended with UnicodeEncodeError."""
    study_of(OUTCOME, study="płyta")(tmp_path)
    printed = answer("sweep", "status", tmp_path, *["--json"] * as_json, PYTHONIOENCODING=page)
    if as_json:
        assert json.loads(printed.decode("utf-8"))["name"] == "płyta"
    else:
        assert printed.startswith(b"p\\u0142yta: 1 run")


def test_help_is_not_blank_on_a_terminal_whose_width_is_not_known():
    assert b"Usage" in answer("lab", "--help", COLUMNS="0")
