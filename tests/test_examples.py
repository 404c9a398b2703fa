"""The examples run as they stand, as a user runs them; they are pages of the documentation too."""

import os
import subprocess
import sys

import pytest

from tests.places import ROOT

EXAMPLES = {path.stem.removeprefix("plot_"): path for path in sorted((ROOT / "examples").glob("plot_*.py"))}
QUICK = {"in_a_notebook", "lines_and_fast_model", "readings_only", "robot_program"}
MOST_LINES = 60


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.broad if name in QUICK else pytest.mark.slow) for name in EXAMPLES],
)
def test_an_example_runs_in_any_folder_and_leaves_nothing_there(tmp_path, name):
    environment = {**os.environ, "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "error::DeprecationWarning:__main__", str(EXAMPLES[name])]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert not list(tmp_path.iterdir())


def test_examples_are_short_pages_of_a_gallery():
    assert len(EXAMPLES) == 11
    for path in EXAMPLES.values():
        lines = path.read_text(encoding="utf-8").splitlines()
        assert len(lines) <= MOST_LINES, path.name
        assert lines[0] == '"""', path.name
        assert lines[2] == "=" * len(lines[1]), path.name
        assert lines.count("# %%") >= 2, path.name
