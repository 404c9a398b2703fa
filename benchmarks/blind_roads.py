"""Ten blind trials whose cracks vary as roads do, 3 to 15 mm wide and 5 to 40 mm deep along one crack: EMULATED.

    python -m benchmarks.blind_roads [--pour]

Cracks of 80 mm and their fills were drawn by SEED, which was fixed before any run; nothing is tuned on them. Width and
depth vary by at least twice along each crack. Paste, pump and their errors are those of the first ten trials of
``benchmarks.blind_trials``. A lab takes a photo, gauges the depth every 10 mm, and weighs a liquid into the crack. It
predicts as ``sealtwin validate --uncertainty`` does, with ``uncertainty.differences = "slot"``. Its particle radius is
"auto", four across the mean width, or less, so that the coarser particles fit the nozzle. Reality is particles of
another seed and size, or the second reality. ``--pour`` computes the runs that ``blind_roads.csv`` does not have.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks.blind_own_band import LEVELS, Judged, judge, predicted, spread_of
from benchmarks.blind_trials import Measured, level_mm, notebook, real_level_mm
from benchmarks.kept_runs import KeptRuns, add_rows, rows_in
from benchmarks.reality.inputs import Cavity, Numerics, Paste
from benchmarks.reality.pour import poured
from benchmarks.samples import pour_along
from benchmarks.table import Row, rms, run_benchmark
from digitise.geometry.polyline import left_normals
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid, with_weighed
from digitise.solid.footprint import lay_out
from digitise.solid.sections import Slicer
from digitise.solid.wedges import wall_shifts_mm
from digitise.trajectory import plan_trajectory
from digitise.weighing.fill import WeighedFill
from digitise.weighing.fit_cavity import DENSITY_SD, MENISCUS_SD, weigh
from digitise.weighing.moved_walls import widened
from sealtwin.core.records import Floats, Outline, Sample
from sealtwin.core.regime import capillary_length_mm, mean_level_mm
from sealtwin.core.settings import checked
from sealtwin.study.perturbed_inputs import Base
from sealtwin.study.uncertainty_runs import RATIO, REPLICATES
from sealtwin.trial.trial_file import Trial
from simulate.setup.resolution import ACCURATE_RESOLUTION
from simulate.slot.run import pour
from tests.support.shapes import CUT, outline_between
from validate.uncertainty.computed import SizeRuns

RUNS = Path(__file__).with_suffix(".csv")
KEPT = KeptRuns(RUNS, "python -m benchmarks.blind_roads --pour")
REALITY, SIZES = "reality", {"finer": 1 / RATIO, "own": 1.0, "coarser": RATIO}
WANTED = [(REALITY, 0), *product(("own", "coarser", "finer"), range(REPLICATES))]  # The dearest last
SEED, TRIALS, LENGTH_MM = 20261130, 10, 80.0
T_MM = np.linspace(0.0, LENGTH_MM, 321)
STATIONS_MM = np.arange(0.0, LENGTH_MM + 0.5, 2.0)
HEADER = ["trial", "size", "seed", *(f"level_at_{s:g}_mm" for s in STATIONS_MM)]
PLACES_MM = STATIONS_MM[(STATIONS_MM >= 4) & (STATIONS_MM <= LENGTH_MM - 4)]
WIDTHS_MM, DEPTHS_MM, MIN_RATIO = (3.0, 15.0), (5.0, 40.0), 2.0
ANGLES_DEG, FILLS = (0.5, 2.0), (0.5, 0.85)  # No walls of this draw meet; paste over the cavity
ROW, GAUGED_EVERY = 20, 2  # Points of T_MM between rows of the true depth, and rows between readings of the gauge
WIDTH_SD_MM, DEPTH_SD_MM = 0.1, 0.5


def measured(number: int, seed: int = SEED) -> Measured:
    """Draw a crack, and emulate all measurements of a trial."""
    notes, random = notebook()[number], np.random.default_rng([seed, number])
    angle_deg, fill = float(random.uniform(*ANGLES_DEG)), float(random.uniform(*FILLS))
    phases = random.uniform(0, 2 * np.pi, 2)
    across_mm = np.sin(2 * np.pi * T_MM[:, None] / (LENGTH_MM, LENGTH_MM / 2) + phases) @ (1.5, 0.5)
    centre = np.column_stack([T_MM, across_mm])
    half_mm = _along(random, WIDTHS_MM)[:, None] / 2 * left_normals(centre)
    traced = outline_between(centre, centre + half_mm, centre - half_mm, CUT, None)
    depths_mm = tuple(zip(T_MM[::ROW].tolist(), _along(random, DEPTHS_MM)[::ROW].tolist(), strict=True))
    outline, off_mm = widened(traced, float(random.normal(0, WIDTH_SD_MM))), float(random.normal(0, DEPTH_SD_MM))
    walls = CrackShape(depth_mm=depths_mm, tilt="funnel", wall_angle_deg=angle_deg)
    readings_mm = tuple((s_mm, depth_mm + off_mm) for s_mm, depth_mm in depths_mm[::GAUGED_EVERY])
    gauged = CrackShape(depth_mm=readings_mm, tilt="funnel")
    liquid = _weighed_into(random, outline, walls)
    moved, shape, by_weight = weigh(traced, gauged, liquid, WIDTH_SD_MM, DEPTH_SD_MM)
    solid = with_weighed(build_solid(moved, shape), by_weight)
    noted, real, doubts = notes["trial"], notes["real"]["path"], notes["trial"]["uncertainty"]
    volume_ml, noted_ml = fill * solid.cavity_volume_mm3 / 1e3, noted["path"]["volume_ml"]
    radius_mm = min(moved.mean_width_mm / ACCURATE_RESOLUTION.abreast, noted["nozzle"]["diameter_mm"] / RATIO) / 2
    changes = {
        "name": f"roads {seed} {number}",
        "crack": {"depth_mm": readings_mm, "tilt": "funnel", "fill": liquid.model_dump(exclude_none=True)},
        "path": noted["path"] | {"volume_ml": volume_ml, "flow": ("constant", "cross_section")[number % 2]},
        "solver": noted["solver"] | {"radius_mm": float(f"{radius_mm:.3g}")},
        "uncertainty": doubts | {"differences": "slot", "volume_ml": doubts["volume_ml"] * volume_ml / noted_ml},
    }
    trial = checked(Trial, Path("trial.toml"), noted | changes)
    sample = Sample(moved, solid, plan_trajectory(moved, trial.path, solid.cavity_volume_mm3, solid.sections))
    base = Base(Path(), trial, sample, *pour(trial.pour(sample)))
    as_poured = real | {"volume_ml": volume_ml * real["volume_ml"] / noted_ml, "trim_mm": tuple(real["trim_mm"])}
    path = plan_trajectory(moved, trial.path.model_copy(update=as_poured), solid.cavity_volume_mm3, solid.sections)
    return Measured(notes["truth"] | {"angle_deg": angle_deg}, base, Sample(outline, build_solid(outline, walls), path))


def _along(random: np.random.Generator, limits_mm: tuple[float, float]) -> Floats:
    """Return values at T_MM of a smooth wave whose least and largest value are drawn evenly in their logarithms."""
    low_mm = limits_mm[0] * (limits_mm[1] / MIN_RATIO / limits_mm[0]) ** random.uniform()
    high_mm = MIN_RATIO * low_mm * (limits_mm[1] / MIN_RATIO / low_mm) ** random.uniform()
    waves = np.arange(1, 5)
    phases = random.uniform(0, 2 * np.pi, len(waves))
    wave = (np.sin(np.pi * waves * T_MM[:, None] / LENGTH_MM + phases) / waves).sum(axis=1)
    return low_mm * (high_mm / low_mm) ** ((wave - wave.min()) / np.ptp(wave))


def _weighed_into(random: np.random.Generator, outline: Outline, walls: CrackShape) -> WeighedFill:
    """Return a fill as a lab weighs it: four steps above the shallowest floor, since lower pools are not connected."""
    slicer = Slicer(lay_out(outline, walls, max(wall_shifts_mm(walls))), walls)
    down_mm = np.linspace(0.0, walls.deepest_mm, 81)
    area_mm2 = np.array([slicer.cavity(depth_mm).area() for depth_mm in down_mm])
    below_mm3 = np.cumulative_sum((area_mm2[1:] + area_mm2[:-1])[::-1] / 2 * down_mm[1], include_initial=True)[::-1]
    blank = WeighedFill(mass_g=(1.0,), level_mm=(0.0,))
    lowest_mm = -float(walls.depth_at_mm(walls.depth_stations_mm).min()) * np.array([0.8, 0.55, 0.3, 0.0])
    capillary_mm = capillary_length_mm(blank.surface_tension_n_m, blank.density_kg_m3)
    lift_mm = mean_level_mm(lowest_mm, outline.mean_width_mm, capillary_mm) - lowest_mm
    off_mm = random.normal(0, np.where(lowest_mm < 0, blank.level_sd_mm, blank.flush_sd_mm))
    # At the brim the lab writes 0, whatever the level is.
    true_mm = lowest_mm + lift_mm * (1 + random.normal(0, MENISCUS_SD)) + np.where(lowest_mm < 0, 0.0, off_mm)
    mass_g = blank.density_kg_m3 / 1e6 * np.interp(-true_mm, down_mm, below_mm3) * (1 + random.normal(0, DENSITY_SD))
    mass_g += random.normal(0, blank.mass_sd_g, len(mass_g))
    return WeighedFill(mass_g=tuple(mass_g), level_mm=tuple(np.where(lowest_mm < 0, lowest_mm + off_mm, 0.0)))


def _second_reality_mm(one: Measured) -> Floats:
    outline, walls, fluid = one.real.outline, one.real.solid, one.real_fluid
    angle_deg = np.full(len(outline.s_mm), one.truth["angle_deg"])
    cavity = Cavity(outline.s_mm, outline.width_mm, walls.depth_at_mm(outline.s_mm), angle_deg, angle_deg)
    paste = Paste(fluid["density_kg_m3"], fluid["yield_stress_pa"], fluid["viscosity_pa_s"])
    path = pour_along(one.real.trajectory, one.base.trial.nozzle.size_mm)
    return poured(cavity, paste, path, numerics=Numerics(settle_s=one.base.trial.solver.settle_s)).at(PLACES_MM)


def kept_runs() -> dict[tuple[int, str, int], Floats]:
    """Return the levels at STATIONS_MM of the kept runs, by trial, size and seed."""
    return {(int(trial), size, int(seed)): np.array(level, dtype=float) for trial, size, seed, *level in rows_in(RUNS)}


def main(compute: Annotated[bool, Option("--pour", help="compute the runs that are missing")] = False) -> list[Row]:
    if compute:
        KEPT.begin()
    KEPT.require()
    trials = {number: measured(number) for number in range(TRIALS)}
    for (size, seed), number in product(WANTED, trials) if compute else ():
        if (number, size, seed) not in kept_runs():
            run_mm = _run_mm(number, trials[number], size, seed)
            add_rows(RUNS, HEADER, [[number, size, seed, *(f"{value:.3f}" for value in run_mm)]])
    kept = kept_runs()
    complete = {number: one for number, one in trials.items() if all((number, *run) in kept for run in WANTED)}
    return [*_of_verdicts([one.base for one in trials.values()]), *_of_runs(complete, kept)]


def _run_mm(number: int, one: Measured, size: str, seed: int) -> Floats:
    if size == REALITY:
        return real_level_mm(number, one, STATIONS_MM, SEED)
    trial = one.base.trial
    solver = trial.solver.model_copy(update={"radius_mm": SIZES[size] * trial.solver.size_mm})
    return level_mm(one.base.sample, trial.given_fluid, solver, one, STATIONS_MM, seed=seed)


def _of_verdicts(bases: list[Base]) -> Iterator[Row]:
    yield Row(f"fit for the fast model, of {len(bases)} EMULATED trials", sum(not base.run.unfit for base in bases), "")
    for key, count in Counter(reason.key for base in bases for reason in base.run.unfit).items():
        yield Row(f"unfit by its {key.removeprefix('unfit.')}", count, "")
    yield Row("particle radius, median", float(np.median([base.trial.solver.size_mm for base in bases])), "mm")


def _of_runs(trials: Mapping[int, Measured], kept: Mapping[tuple[int, str, int], Floats]) -> Iterator[Row]:
    judged = dict[str, list[Judged]]({"particles": [], "second reality": []})
    yield Row("trials with all runs, which are judged", len(trials), "")
    for number, one in trials.items():
        own_mm = one.base.trial.solver.size_mm
        finer, own, coarser = (
            SizeRuns(factor * own_mm, np.array([kept[number, size, seed] for seed in range(REPLICATES)]))
            for size, factor in SIZES.items()
        )
        band = predicted(one.base, spread_of(one.base, (finer, own, coarser), STATIONS_MM))
        particles_mm = np.interp(PLACES_MM, STATIONS_MM, kept[number, REALITY, 0])
        for name, real_mm in zip(judged, (particles_mm, _second_reality_mm(one)), strict=True):
            judged[name].append(judge(real_mm, band, one.base, PLACES_MM))
    for name, each in judged.items():
        for by, off_mm in zip(LEVELS, np.transpose([one.rms_mm for one in each]), strict=True):
            yield Row(f"{name}: {by} off by, RMS", rms(off_mm), "mm")
        fit_mm = [one.rms_mm[-1] for one, trial in zip(each, trials.values(), strict=True) if not trial.base.run.unfit]
        yield Row(f"{name}: fast model off by if it calls itself fit, RMS", rms(fit_mm), "mm")
        yield Row(f"{name}: mean levels in their intervals", sum(abs(one.off_mm) <= one.half_mm for one in each), "")
        yield Row(f"{name}: places in their bands", 100 * float(np.mean([one.places for one in each])), "%")
        yield Row(f"{name}: half of the band, median", float(np.median([one.band_mm for one in each])), "mm")


if __name__ == "__main__":
    run_benchmark(main)
