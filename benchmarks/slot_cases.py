"""Forty slots by which the fast model is judged, and their fill by particles.

    python -m benchmarks.slot_cases

They are a Latin hypercube over seven settings by a fixed seed; stresses and viscosities, which span decades, evenly in
their logarithms. They were drawn after the model was chosen, on two other draws.
Each slot is straight, 60 mm long and closed at both ends, and opens upward from the width of its floor. Particles fill
each with two seeds and the settings that a trial has by default, at four abreast or more but in the narrowest.
Levels that ``benchmarks/slot/`` keeps are not computed again.
"""

import time
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from benchmarks.kept_runs import KeptRuns, add_rows, rows_in
from benchmarks.table import run_benchmark
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.records import Floats, Outline, Sample, Solid, Trajectory
from simulate.pour import Pour
from simulate.run import fill as fill_crack
from simulate.settings import Fluid, Nozzle, Solver, particle_volume
from simulate.slot.fill import Filled, HerschelBulkley, fill
from simulate.slot.fitness import Fitness, fitness_of
from simulate.slot.run import paste_of
from tests.support.shapes import straight_slot

FOLDER = Path(__file__).parent / "slot"
KEPT = KeptRuns(FOLDER, "python -m benchmarks.slot_cases", ("solids", "simulate"))
CASES, SEEDS = 40, (0, 1)
SEED = 20261123
LENGTH_MM, TRIM_MM, SETTLE_S = 60.0, 8.0, 3.0
STATIONS_MM = np.arange(0.0, LENGTH_MM + 0.25, 0.5)
ABREAST, RADII_MM, MANY = 8.0, (0.35, 0.6), 7000
"""Particle radii over the floor's width, bounds of the radius, and the number of particles above which it grows."""
MIN_ABREAST = 5.0
NOZZLE_MM, NOZZLE_SHARE = 2.4, 0.7  # The paper's, or this share of the floor's width: a jet into the slot


@dataclass(frozen=True)
class Case:
    """One setting of the draw."""

    width_mm: float
    depth_mm: float
    angle_deg: float
    yield_stress_pa: float
    viscosity_pa_s: float
    fill: float
    speed_mm_s: float

    @cached_property
    def outline(self) -> Outline:
        return straight_slot(LENGTH_MM, self.width_mm)

    @cached_property
    def solid(self) -> Solid:
        shape = {"depth_mm": self.depth_mm, "tilt": "flare", "wall_angle_deg": self.angle_deg}
        return build_solid(self.outline, CrackShape.model_validate(shape))

    @property
    def trajectory(self) -> Trajectory:
        path = NozzlePath(fill=self.fill, speed_mm_s=self.speed_mm_s, trim_mm=TRIM_MM)
        return plan_trajectory(self.outline, path, self.solid.cavity_volume_mm3, self.solid.sections)

    @property
    def fluid(self) -> Fluid:
        return Fluid(viscosity_pa_s=self.viscosity_pa_s, yield_stress_pa=self.yield_stress_pa, freeze_after_s="never")

    @property
    def paste(self) -> HerschelBulkley:
        sample = Sample(self.outline, self.solid, self.trajectory)
        return paste_of(Pour(sample, (self.fluid,), self.solver, self.nozzle))

    def filled(self) -> Filled:
        """Return the bed by the fast model."""
        nozzle_mm = self.nozzle.size_mm
        return fill(self.solid, self.outline, self.trajectory, self.paste, nozzle_mm=nozzle_mm, settle_s=SETTLE_S)

    @cached_property
    def fitness(self) -> Fitness:
        above_mm = max(0.0, float(self.filled().level_mm.max()))
        return replace(fitness_of(self.solid, self.outline, self.trajectory, self.paste), above_mm=above_mm)

    @property
    def nozzle(self) -> Nozzle:
        return Nozzle(diameter_mm=round(min(NOZZLE_MM, NOZZLE_SHARE * self.width_mm), 2))

    @property
    def particles(self) -> float:
        return self.trajectory.dispensed_mm3 / particle_volume(self.solver.size_mm)

    @property
    def solver(self) -> Solver:
        fine_mm = float(np.clip(self.width_mm / ABREAST, *RADII_MM))
        affordable_mm = float(np.cbrt(self.trajectory.dispensed_mm3 / MANY / particle_volume(1.0)))
        radius_mm = min(self.width_mm / MIN_ABREAST, max(fine_mm, affordable_mm))
        return Solver(radius_mm=round(radius_mm, 3), settle_s=SETTLE_S)


LOW = Case(2.0, 8.0, 0.0, 2.0, 0.05, 0.4, 2.0)
HIGH = Case(8.0, 30.0, 8.0, 60.0, 5.0, 1.1, 10.0)
IN_LOGARITHMS = ("yield_stress_pa", "viscosity_pa_s")


def drawn() -> list[Case]:
    """Cases of the Latin hypercube."""
    unit = qmc.LatinHypercube(7, seed=SEED).random(CASES)  # pyright: ignore[reportCallIssue]
    columns: list[Floats] = []
    for column, name in enumerate(Case.__dataclass_fields__):
        low, high = getattr(LOW, name), getattr(HIGH, name)
        share = unit[:, column]
        columns.append(low * (high / low) ** share if name in IN_LOGARITHMS else low + (high - low) * share)
    return [Case(*(float(f"{value:.4g}") for value in row)) for row in np.stack(columns, axis=1)]


def kept_levels_mm() -> dict[tuple[int, int], Floats]:
    """Return levels by particles at ``STATIONS_MM``, by case and seed. Leaves if another solver computed them."""
    KEPT.require()
    return {
        (int(case), int(seed)): np.array(level, dtype=float) for case, seed, *level in rows_in(FOLDER / "levels.csv")
    }


def _run(number: int, seed: int, case: Case) -> None:
    began = time.process_time()
    sample = Sample(case.outline, case.solid, case.trajectory)
    run, profile = fill_crack(Pour(sample, (case.fluid,), case.solver, case.nozzle, seed))
    level_mm = np.interp(STATIONS_MM, profile.s_mm, profile.level_mm)
    facts = {
        "case": number,
        "seed": seed,
        "radius_mm": run.radius_mm,
        "particles": len(run.position_mm),
        "volume_ratio": round(run.health.volume_ratio or 0.0, 4),
        "spilled": run.spilled_particles,
        "escaped": run.escaped_particles,
        "processor_s": round(time.process_time() - began, 1),
    }
    header = ["case", "seed", *(f"level_at_{s:g}_mm" for s in STATIONS_MM)]
    add_rows(FOLDER / "levels.csv", header, [[number, seed, *(f"{value:.3f}" for value in level_mm)]])
    add_rows(FOLDER / "runs.csv", list(facts), [list(facts.values())])
    print(facts, flush=True)


def main() -> None:
    KEPT.begin()
    FOLDER.mkdir(exist_ok=True)
    cases, kept = enumerate(drawn()), kept_levels_mm()
    for number, case in sorted(cases, key=lambda pair: (bool(pair[1].fitness.unfit), pair[1].particles)):
        for seed in SEEDS:
            if (number, seed) not in kept:
                _run(number, seed, case)


if __name__ == "__main__":
    run_benchmark(main)
