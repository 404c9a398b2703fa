"""The chapter of a report's page that moves settings, in Chromium, and the command on the trial file that it writes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core import record_files
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile, Run
from sealtwin.trial.pipeline import run_trial
from sealtwin.trial.trial_file import load_trial

MOVE = """(shares) => new Promise((done) => {
  for (const [name, share] of Object.entries(shares)) {
    const input = document.getElementById(`live-${name}`);
    input.value = Math.round(Number(input.min) + share * (Number(input.max) - Number(input.min)));
    input.dispatchEvent(new Event("input"));
  }
  // The page computes in the next frame, asked for before this one.
  requestAnimationFrame(done);
})"""


def move(page: Any, shares: Mapping[str, float]) -> None:
    """Move each slider to a share of its way, and wait for the level."""
    page.evaluate(MOVE, dict(shares))


def level_mm(page: Any) -> Floats:
    """The level that the page shows, at the stations of the report's profile."""
    return np.array([float(level) for level in page.get_attribute("#live", "data-level").split()])


def write_changed(page: Any, file: Path) -> Path:
    """Press the button for the trial file, and put it where ``file`` says."""
    with page.expect_download() as coming:
        page.click("#live button[value=trial]")
    coming.value.save_as(file)
    return file


def poured(file: Path, out: Path) -> tuple[Run, Profile]:
    """What 'sealtwin run' of a trial file gives with the fast model."""
    trial = load_trial(file)
    trial = trial.model_copy(update={"solver": trial.solver.model_copy(update={"model": "slot"})})
    run_trial(trial, file.parent, out, ("digitise", "simulate"), "cpu", Progress())
    return record_files.read_run(out), record_files.read_profile(out)
