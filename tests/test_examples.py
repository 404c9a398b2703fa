"""The examples run as a user runs them; they are also pages of the documentation."""

import os
import runpy
import subprocess
import sys
import warnings

import pytest
from matplotlib import pyplot

from tests.support.paths import ROOT

EXAMPLES = {path.stem.removeprefix("plot_"): path for path in sorted((ROOT / "examples").glob("plot_*.py"))}
QUICK = ("in_a_notebook", "lines_and_fast_model", "readings_only", "robot_program")


@pytest.mark.parametrize("name", QUICK)
def test_a_quick_example_runs_in_any_folder_and_leaves_no_file(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # Of what a run cannot show
        runpy.run_path(str(EXAMPLES[name]), run_name="__main__")
    pyplot.close("all")
    assert capsys.readouterr().out.strip()
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(EXAMPLES.keys() - QUICK))
def test_a_slow_example_runs_in_any_folder_and_leaves_no_file(tmp_path, name):
    """Each example runs in its own process, since some start further processes."""
    environment = {**os.environ, "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "error::DeprecationWarning:__main__", str(EXAMPLES[name])]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert not list(tmp_path.iterdir())
