"""The fluid on a GPU: one run, a whole study in one launch, and how far it lies from what a CPU makes of the same.

    python -m benchmarks.cuda_runs [--device cuda:0] [--runs N] [--radius-mm R]

One run is the paper's trial, frozen by age; the study is the paper's 132 pairs of U and D, with particles of 0.6 mm.
The trial with a yield stress of 12 Pa is computed on the device, and three times on the CPU: as it is, and with the
nozzle 1e-6 mm higher and lower; device and CPU may lie twice as far apart as these. --radius-mm coarsens all. A time is
that of set-up, frames and results, after such a run has loaded every kernel; digitising and the profiles are apart. On
the CPU (--device cpu) times have no targets.
"""

import math
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Annotated, NamedTuple

import numpy as np
from typer import Option

from benchmarks.samples import digitised
from benchmarks.table import Row, run_benchmark
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import progress_for_stderr
from sealtwin.core.records import Profile, Run, Sample
from sealtwin.study.study_file import load_study, plan_runs
from sealtwin.trial.trial_file import Trial, load_trial
from simulate.device import choose_device, describe_device
from simulate.injection import ComputeOptions, prepare
from simulate.profile import measure_profile
from simulate.run import run_to_end
from tests.support.paths import FIXTURE
from validate.metrics.curve_distances import error_bins

ALIKE = {"fluid.U": 30.0, "fluid.D_cm": 0.3}
"""The paper's own pair, of its 132."""
PASTE = {"fluid.yield_stress_pa": 12.0, "fluid.freeze_after_s": "never"}
STUDY_MM = 0.6
"""Radius of the study's particles, 4,304 in each run."""
ONE_S, STUDY_S = 2.0, 30.0
NUDGE_MM = 1e-6
UP = np.array([0.0, 0.0, 1.0])
NO_DEVICE = 3
"""The command's code for input that cannot be."""


class Launch(NamedTuple):
    """Some runs that were computed at once."""

    outcomes: list[Run | NumericalError]
    took_s: float
    recorded: bool
    particles: int

    @property
    def runs(self) -> list[Run]:
        return [outcome for outcome in self.outcomes if isinstance(outcome, Run)]


def main(
    device: str = "cuda:0",
    runs: Annotated[int, Option(help="of the study's 132, spread over all of them")] = 132,
    radius_mm: float | None = None,
) -> list[Row]:
    try:
        device = choose_device(device)
    except InputError as fault:
        print(fault, file=sys.stderr)
        sys.exit(NO_DEVICE)
    print(f"Device: {describe_device(device)}")
    paste = _coarsened(load_trial(FIXTURE / "trial.toml", PASTE), radius_mm)
    study = _pairs(radius_mm or STUDY_MM)
    own = {"solver": paste.solver.model_copy(update={"settle_s": 0.0})}
    paper = next(trial for settings, trial in study if settings == ALIKE).model_copy(update=own)
    bench = digitised(paper)
    spread = [study[number][1] for number in np.linspace(0, len(study) - 1, runs).round().astype(int)]
    for trials in ([paper], spread):
        inject_at_once(bench, trials, device, frames=3)
    one = inject_at_once(bench, [paper], device)
    together = inject_at_once(bench, spread, device)
    return [
        *_timed("one run", one, ONE_S, "<= 1", device),
        *_timed(f"{len(spread)} runs", together, STUDY_S, "<= 10", device),
        *_apart(bench, paste, device),
    ]


def inject_at_once(bench: Sample, trials: Sequence[Trial], device: str, frames: int | None = None) -> Launch:
    """All runs in one launch; ``frames`` ends them early."""
    first = trials[0]
    pour, options = first.pour(bench), ComputeOptions(device, progress=progress_for_stderr())
    # Walls are kept, and their time is not that of the runs.
    prepare(pour, options)
    began = time.perf_counter()
    injection = prepare(replace(pour, fluids=tuple(trial.given_fluid for trial in trials)), options)
    if frames is None:
        run_to_end(injection, options)
    else:
        for _ in range(frames):
            injection.advance()
    outcomes = injection.outcomes()
    return Launch(
        outcomes,
        time.perf_counter() - began,
        injection.engine.recorded,
        injection.schedule.particles,
    )


def _timed(name: str, launch: Launch, most_s: float, goal: str, device: str) -> list[Row]:
    on_gpu = device != "cpu"
    unplaced = sum(int((~np.isfinite(run.position_mm)).any(axis=1).sum()) for run in launch.runs)
    return [
        Row(f"{name}, with set-up and results", launch.took_s, "s", 0, most_s if on_gpu else math.inf, goal),
        Row(f"{name}: frames replayed from one graph", launch.recorded, "", on_gpu, on_gpu),
        Row(f"{name}: particles each", launch.particles, ""),
        Row(f"{name}: failed", len(launch.outcomes) - len(launch.runs), "", 0, 0),
        Row(f"{name}: particles through a wall", sum(run.escaped_particles for run in launch.runs), "", 0, 0),
        Row(f"{name}: places that are no number", unplaced, "", 0, 0),
    ]


def _apart(bench: Sample, trial: Trial, device: str) -> list[Row]:
    """Of device and CPU, and of CPU runs among themselves: how far two levels lie apart, mean over bins of 10 mm."""

    def level(device: str, up_mm: float = 0.0) -> Profile:
        nudged = replace(bench.trajectory, position_mm=bench.trajectory.position_mm + up_mm * UP)
        (run,) = inject_at_once(replace(bench, trajectory=nudged), [trial], device).runs
        return measure_profile(run, bench.outline, bench.solid)

    def apart_mm(one: Profile, other: Profile) -> float:
        return float(np.mean([part.mean_error_mm or 0.0 for part in error_bins(one, other, bench.outline.length_mm)]))

    here, *nudged = (level("cpu", up_mm) for up_mm in (0.0, NUDGE_MM, -NUDGE_MM))
    among = float(np.mean([apart_mm(*pair) for pair in combinations((here, *nudged), 2)]))
    return [
        # At 0 nothing was nudged, and the next row would hold nothing.
        Row(f"CPU runs, the nozzle {NUDGE_MM:g} mm apart", among, "mm", 1e-9, math.inf),
        Row("device and CPU", apart_mm(level(device), here), "mm", 0, 2 * among),
    ]


def _coarsened(trial: Trial, radius_mm: float | None) -> Trial:
    solver = trial.solver if radius_mm is None else trial.solver.model_copy(update={"radius_mm": radius_mm})
    return trial.model_copy(update={"solver": solver})


def _pairs(radius_mm: float) -> list[tuple[dict[str, object], Trial]]:
    """What varies in each run of the paper's study, and its trial."""
    file = FIXTURE / "study-paper.toml"
    study = load_study(file)
    planned = plan_runs(study, file, load_trial(FIXTURE / study.trial))
    return [(run.settings, _coarsened(run.trial, radius_mm)) for run in planned]


if __name__ == "__main__":
    run_benchmark(main)
