"""Labs that measure more of a blind trial than its inputs, the runs of each lab's prediction, and reality: EMULATED.

    python -m benchmarks.blind_labs

The trials are those of ``benchmarks.blind_trials``. A lab may also weigh the sample before and after the pour. It
predicts with three runs at each of three particle sizes, as ``sealtwin validate --uncertainty`` does. Reality is a run
at the true inputs with another seed and another size of the particles. ``benchmarks/blind/`` keeps all runs, and
computes those that are missing.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.blind_trials import SEED, STATIONS_MM, Measured, level_mm, measured, notebook, real_level_mm
from benchmarks.kept_runs import KeptRuns, add_rows, rows_in
from benchmarks.reality.inputs import Cavity, Numerics, Paste, Pour, Poured
from benchmarks.reality.pour import poured
from benchmarks.reality.worlds import A_DAY, World, flows, late, together
from benchmarks.samples import pour_along
from benchmarks.table import run_benchmark
from digitise.settings import Dispensed
from digitise.trajectory import plan_trajectory
from sealtwin.core.records import Floats, Sample
from sealtwin.material import DENSITY_ERROR
from sealtwin.study.perturbed_inputs import Base
from sealtwin.study.uncertainty_runs import RATIO, REPLICATES
from simulate.slot.run import pour
from validate.uncertainty.computed import SizeRuns

FOLDER = Path(__file__).parent / "blind"
REAL, SIZES = FOLDER / "real.csv", FOLDER / "sizes.csv"
KEPT = KeptRuns(FOLDER, "python -m benchmarks.blind_labs")
LEVELS = [f"level_at_{s:g}_mm" for s in STATIONS_MM]
FACTORS = (1 / RATIO, 1.0, RATIO)
MASS_SD_G = 0.014  # Of two weighings by a scale of 0.01 g
PUMP_DELAY_S = 0.3  # A lab that looks for the pump's start by eye
SHORT_AND_LATE = together(late(1.0), flows(0.92))


class Lab(NamedTuple):
    """What a lab measures in addition to the inputs of a blind trial."""

    weighs: World | None = None  # World whose sample is weighed before and after the pour


LABS: Mapping[str, Lab] = {
    "inputs": Lab(),
    "weighed, late and 8 % low": Lab(weighs=SHORT_AND_LATE),
    "weighed, W11": Lab(weighs=A_DAY),
}
Sizes = tuple[SizeRuns, SizeRuns, SizeRuns]
"""Runs of the finer particles, the trial's own and the coarser ones."""


def base_of(one: Measured, number: int, lab: Lab) -> Base:
    """Return a trial as a lab knows it, with its run by the fast model."""
    own, random = one.base, np.random.default_rng([SEED, number, 4])
    changes: dict[str, Any] = {}
    if lab.weighs is not None:
        arrived_g = 1e-6 * one.real_fluid["density_kg_m3"] * second_reality(one, lab.weighs).volume_mm3
        density = own.trial.given_fluid.density_kg_m3
        weighed = {"mass_g": arrived_g + MASS_SD_G * float(random.normal()), "mass_sd_g": MASS_SD_G}
        weighed |= {"density_kg_m3": density, "density_sd_kg_m3": DENSITY_ERROR * density}
        changes |= {"path.volume_ml": Dispensed(**weighed).volume_ml, "path.weighed": weighed}
        changes |= {"uncertainty.volume_ml": None, "uncertainty.pump_delay_s": PUMP_DELAY_S}
    if not changes:
        return own
    trial, sample = own.changed(changes), own.sample
    solid = sample.solid
    path = plan_trajectory(sample.outline, trial.path, solid.cavity_volume_mm3, solid.sections)
    sample = replace(sample, trajectory=path)
    return Base(own.path, trial, sample, *pour(trial.pour(sample)))


def second_reality(one: Measured, world: World) -> Poured:
    """Pour the true inputs of a trial in the second reality."""
    return poured(*true_inputs(one.real, one), world, Numerics(settle_s=one.base.trial.solver.settle_s))


def true_inputs(real: Sample, one: Measured) -> tuple[Cavity, Paste, Pour]:
    outline, truth = real.outline, one.truth
    s_mm, ones = outline.s_mm, np.ones(len(outline.s_mm))
    # Walls that flare: the traced width is that of the floor.
    depth_mm, angle_deg = truth["depth_mm"], truth["angle_deg"]
    mouth_mm = outline.width_mm + 2 * depth_mm * np.tan(np.radians(angle_deg))
    cavity = Cavity(s_mm, mouth_mm, depth_mm * ones, angle_deg * ones, angle_deg * ones)
    fluid = one.real_fluid
    paste = Paste(fluid["density_kg_m3"], fluid["yield_stress_pa"], fluid["viscosity_pa_s"])
    return cavity, paste, pour_along(real.trajectory, one.base.trial.nozzle.size_mm)


def real_levels_mm() -> dict[int, Floats]:
    """Return the kept levels of reality by particles at STATIONS_MM, by trial."""
    return {int(number): np.array(level, dtype=float) for number, *level in rows_in(REAL)}


def kept_sizes() -> dict[tuple[int, str], Sizes]:
    """Return the kept runs by trial and lab."""
    runs = dict[tuple[int, str], dict[float, list[list[float]]]]()
    for number, lab, radius_mm, _, *level in rows_in(SIZES):
        by_radius = runs.setdefault((int(number), lab), {})
        by_radius.setdefault(float(radius_mm), []).append([*map(float, level)])
    sizes = dict[tuple[int, str], Sizes]()
    for key, by_radius in runs.items():
        fine, own, coarse = (SizeRuns(radius_mm, np.array(by_radius[radius_mm])) for radius_mm in sorted(by_radius))
        sizes[key] = fine, own, coarse
    return sizes


def main() -> None:
    KEPT.begin()
    FOLDER.mkdir(exist_ok=True)
    real, done = real_levels_mm(), kept_sizes()
    for number in notebook():
        one = measured(number, Path())
        if number not in real:
            _add(REAL, ["trial"], [[number]], [real_level_mm(number, one)])
        for name, lab in LABS.items():
            if (number, name) not in done:
                _record(number, name, base_of(one, number, lab), one)


def _record(number: int, name: str, base: Base, one: Measured) -> None:
    trial, runs, levels = base.trial, [], []
    for factor in FACTORS:
        solver = trial.solver.model_copy(update={"radius_mm": factor * trial.solver.size_mm})
        for seed in range(REPLICATES):
            runs.append([number, name, f"{solver.size_mm:.6g}", seed])
            levels.append(level_mm(base.sample, trial.given_fluid, solver, one, seed=seed))
    _add(SIZES, ["trial", "lab", "radius_mm", "seed"], runs, levels)
    print(f"trial {number}, {name}: kept", flush=True)


def _add(path: Path, header: list[str], runs: list[list[Any]], levels_mm: list[Floats]) -> None:
    """Add runs with their levels to a table."""
    pairs = zip(runs, levels_mm, strict=True)
    add_rows(path, [*header, *LEVELS], ([*run, *(f"{value:.3f}" for value in level)] for run, level in pairs))


if __name__ == "__main__":
    run_benchmark(main)
