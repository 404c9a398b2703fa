"""What a draft costs: levels of drafts against the mean of accurate runs, in ten pours, and the time of both.

    python -m benchmarks.drafts [--only shipped|twelve] [--seeds 3]

Nothing is measured. Levels are compared every 2.5 mm along the crack. Two processes take the pours in turn, on one
thread each, and the figures of time are ratios of processor time within one. Twelve of the paper's 132 pairs have
particles of 0.6 mm, as a draft has: there only substeps and shear rates differ.
"""

import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Annotated, Any, NamedTuple

import numpy as np

from benchmarks.machine import processor
from benchmarks.samples import digitised
from benchmarks.table import Row, one_of, processes, rms, run_benchmark
from sealtwin.core.records import Floats, Sample
from sealtwin.trial.trial_file import Trial, drafted, load_trial
from simulate.injection import ComputeOptions
from simulate.profile import volume_ratio
from simulate.run import fill
from tests.support.paths import FIXTURE
from validate.run_facts import DRAFTED_MM

STEP_MM = 2.5
FLARING = {"fluid.freeze_after_s": "never", "fluid.yield_stress_pa": 12.0}
NARROW = {**FLARING, "crack.tilt": "undercut", "crack.wall_angle_deg": 4.84}
PASTE = {**NARROW, "fluid.viscosity_pa_s": 0.3}
POURS: Mapping[str, dict[str, Any]] = {
    "shipped": {},
    "flaring": FLARING,
    "narrow": NARROW,
    "less": {**NARROW, "path.volume_ml": 4.0},
    "paste": PASTE,
    "soft": {**NARROW, "fluid.viscosity_pa_s": 0.1, "fluid.yield_stress_pa": 3.0, "path.volume_ml": 5.2},
    "stiff": {**NARROW, "fluid.viscosity_pa_s": 1.0, "fluid.yield_stress_pa": 25.0, "path.volume_ml": 4.4},
    "oil": {**NARROW, "fluid.viscosity_pa_s": 0.5, "fluid.yield_stress_pa": 0.0, "path.volume_ml": 5.0},
    "thinning": {**NARROW, "fluid.consistency_pa_s_n": 2.0, "fluid.flow_index": 0.5, "fluid.yield_stress_pa": 8.0},
    "fast": {**PASTE, "path.speed_mm_s": 12.0, "crack.depth_mm": 10.0, "path.volume_ml": 2.8},
}
"""Settings of each pour that replace the shipped trial's. A narrow mouth has the photo's width."""
TWELVE = "twelve"
OF_THE_STUDY: Mapping[str, Any] = {"solver.radius_mm": 0.6, "solver.settle_s": 0.0}
JUDGED: Mapping[str, tuple[float, float]] = dict.fromkeys(("shipped", "flaring", "narrow"), (0.22, 0.05))
"""Largest RMS and mean difference between the means of three runs, mm."""
STANDS = "paste of 25 Pa stands above hollows in a mouth of 3.1 mm; accurate runs scatter by 3 mm there as well"
WHY = "a heap above a narrow mouth is as wide as two particles of a draft"


class Poured(NamedTuple):
    level_mm: Floats  # (seeds, places)
    volume_ratio: float  # Mean of the seeds
    cpu_s: float  # Mean of a run


def main(only: Annotated[str | None, one_of((*POURS, TWELVE))] = None, seeds: int = 3) -> list[Row]:
    print(f"{processor()}; {seeds} seeds", flush=True)
    pours = list(POURS) if only is None else [only] if only in POURS else []
    return [*(_rows(pours, seeds) if pours else ()), *(_twelve() if only in (None, TWELVE) else ())]


def _twelve() -> Iterator[Row]:
    settings = ({"fluid.U": u, "fluid.D_cm": d_cm} for u, d_cm in product((0.01, 30, 1000, 10000), (1e-4, 0.3, 3)))
    with processes(2) as pool:
        pairs = pool.map(partial(_both, 1), [{**OF_THE_STUDY, **each} for each in settings])
        accurate_s, draft_s = np.sum([(accurate.cpu_s, draft.cpu_s) for accurate, draft in pairs], axis=0)
    yield Row(
        "twelve of the paper's runs: processor time of drafts over accurate runs", draft_s / accurate_s, "", 0, 0.65
    )


def _both(seeds: int, settings: Mapping[str, Any]) -> tuple[Poured, Poured]:
    """Pour accurate runs and drafts."""
    sample, trial = _prepared(settings)
    return pour(sample, trial, seeds), pour(sample, drafted(trial, sample), seeds)


def _rows(names: list[str], seeds: int) -> Iterator[Row]:
    off_mm, paces = list[Floats](), list[float]()
    with processes(2) as pool:
        poured = list(pool.map(partial(_both, seeds), [POURS[name] for name in names]))
    for name, (accurate, draft) in zip(names, poured, strict=True):
        accurate_mm = accurate.level_mm.mean(axis=0)
        apart_mm = draft.level_mm.mean(axis=0) - accurate_mm
        off_mm.append(np.abs(draft.level_mm - accurate_mm).ravel())
        paces.append(draft.cpu_s / accurate.cpu_s)
        rms_most_mm, mean_most_mm = JUDGED.get(name, (np.inf, np.inf))
        rms_mm, mean_mm = rms(apart_mm), float(np.abs(apart_mm.mean()))
        why = WHY if name == "narrow" else ""
        yield Row(f"{name}: means of {seeds} runs, RMS", rms_mm, "mm", 0, rms_most_mm, because=why)
        yield Row(f"{name}: their mean level", mean_mm, "mm", 0, mean_most_mm, because=why)
        yield Row(f"{name}: one draft off the mean of accurate runs, nine of ten", _nine(off_mm[-1]), "mm")
        yield Row(
            f"{name}: one accurate run off that mean, nine of ten",
            _nine(accurate.level_mm - accurate_mm),
            "mm",
        )
        yield Row(f"{name}: volume of a draft over the dispensed", draft.volume_ratio, "", 0.98, 1.02, because=STANDS)
        yield Row(f"{name}: processor time of a draft over an accurate run", paces[-1], "")
    yield Row(
        "all: one draft off the mean of accurate runs, nine of ten", _nine(np.concatenate(off_mm)), "mm", 0, DRAFTED_MM
    )
    yield Row("all: processor time of a draft over an accurate run", float(np.exp(np.mean(np.log(paces)))), "", 0, 0.35)


def _nine(off_mm: Floats) -> float:
    return float(np.quantile(np.abs(off_mm), 0.9))


def pour(sample: Sample, trial: Trial, seeds: int) -> Poured:
    levels, ratios, began_s = [], [], time.process_time()
    at_mm = np.arange(STEP_MM / 2, sample.outline.length_mm, STEP_MM)
    for seed in range(seeds):
        run, profile = fill(replace(trial.pour(sample), seed=seed), ComputeOptions("cpu", threads=1))
        levels.append(np.interp(at_mm, profile.s_mm, profile.level_mm))
        ratios.append(volume_ratio(run, sample.solid))
    return Poured(np.array(levels), float(np.mean(ratios)), (time.process_time() - began_s) / seeds)


def _prepared(settings: Mapping[str, Any]) -> tuple[Sample, Trial]:
    trial = load_trial(FIXTURE / "trial.toml", settings)
    return digitised(trial), trial


if __name__ == "__main__":
    run_benchmark(main)
