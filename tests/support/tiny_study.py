"""A study whose runs take a fraction of a second: a drawn crack of 12 mm, coarse particles, a quick nozzle."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from sealtwin.core.errors import present
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import open_folder
from sealtwin.study.pipeline import run_stages
from sealtwin.study.runner import StudyOptions, compute
from sealtwin.study.study_folder import profile_path, read_plan
from sealtwin.trial.job import Job, start_job
from sealtwin.trial.trial_file import load_trial
from tests.support.photos import mortar, with_crack, write_png
from tests.support.report_stubs import leave_out_pages
from tests.support.robot_cells import PHOTO_CELL

HERE = StudyOptions(device="cpu", jobs=0, batch=1, drafts=False)
"""Runs one by one in this process: starting others takes seconds."""
TRIAL = """
name = "tiny"

[photo]
file = "crack.png"
data = "synthetic"
mm_per_px = 0.1
ends_px = [[40, 101], [160, 98]]

[crack]
depth_mm = 8
tilt = "vertical"

[path]
volume_ml = 0.08
speed_mm_s = 20
trim_mm = 1

[fluid]
U = 30.0
D_cm = 0.3
freeze_after_s = 0.2

[solver]
radius_mm = 0.45
substeps = 2
settle_s = 0.0

[nozzle]
diameter_mm = 2.4

[readings]
file = "readings.csv"
data = "synthetic"
role = "calibrated-on"
"""
AGED = "U = 30.0\nD_cm = 0.3\nfreeze_after_s = 0.2"
FAST_PASTE = 'viscosity_pa_s = 0.05\nyield_stress_pa = 1.0\nfreeze_after_s = "never"'
FAST = TRIAL.replace(AGED, FAST_PASTE).replace("[solver]", '[solver]\nmodel = "slot"')
"""The same by the fast model."""
READINGS = "s_mm,level_1_mm\n1,-2\n4,-2\n7,-1\n11,-1\n"
GRID = """
[grid]
"fluid.U" = [3.0, 300.0]
"fluid.D_cm" = [0.03, 0.3]
"""


def tiny_lab(folder: Path, varies: str = GRID) -> Path:
    """Photo, trial, readings and study in ``folder``; returns the study file."""
    folder.mkdir(parents=True, exist_ok=True)
    write_png(folder / "crack.png", with_crack(mortar((200, 200)), [(40, 101), (80, 97), (120, 103), (160, 98)], 20))
    (folder / "trial.toml").write_text(TRIAL, encoding="utf-8")
    (folder / "readings.csv").write_text(READINGS, encoding="utf-8")
    study = folder / "study.toml"
    study.write_text(f'name = "tiny"\ntrial = "trial.toml"\n{varies}', encoding="utf-8")
    return study


def plannable_lab(folder: Path) -> Path:
    """A trial of that crack which can be planned, with a cell."""
    tiny_lab(folder)
    fluid = 'viscosity_pa_s = 1\nyield_stress_pa = 5\nfreeze_after_s = "never"'
    trial = TRIAL.split("[readings]")[0].replace(AGED, fluid)
    trial = trial.replace("volume_ml = 0.08\nspeed_mm_s = 20", 'volume_ml = "cavity"\nspeed_mm_s = 8')
    (folder / "planned.toml").write_text(trial.replace("settle_s = 0.0", "settle_s = 0.5"))
    (folder / "cell.toml").write_text(PHOTO_CELL.replace('["spel", "csv"]', '["csv"]'))
    return folder


def run_tiny(lab: Path, text: str = TRIAL) -> Path:
    """Digitise and simulate a trial with the photo of ``tiny_lab``, without pictures; returns its run folder."""
    tiny_lab(lab)
    (lab / "trial.toml").write_text(text, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch, open_folder(lab / "run", create=True) as folder:
        leave_out_pages(patch)
        run_stages(start_job(load_trial(lab / "trial.toml"), lab, folder, "cpu", Progress()), ("digitise", "simulate"))
    return lab / "run"


@contextmanager
def job_in(path: Path, progress: Progress | None = None) -> Iterator[Job]:
    """Of a run folder that is there."""
    with open_folder(path, create=False) as folder:
        yield start_job(load_trial(folder.path / "trial.toml"), folder.path, folder, "cpu", progress or Progress())


def compute_here(out: Path, *, batch: int = 1) -> None:
    """Compute the waiting runs of a planned study in this process: starting others takes seconds."""
    compute(out, read_plan(out).runs, StudyOptions("cpu", 0, batch), "", Progress())


def results_of(out: Path) -> dict[int, tuple[bytes, dict]]:
    """Profile's bytes, and figures except for times, of every run of a study that is done."""
    results = {}
    for run in read_plan(out).runs:
        assert run.state == "done", run.reason
        figures = present(run.figures, "figures").model_dump(exclude_unset=True)
        for name in ("setup_s", "frames_s"):
            del figures["health"][name]
        results[run.number] = profile_path(out, run).read_bytes(), figures
    return results
