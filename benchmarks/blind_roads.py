"""Ten blind trials whose cracks vary as roads do, 3 to 15 mm wide and 5 to 40 mm deep along one crack: EMULATED.

    python -m benchmarks.blind_roads [--pour]

Cracks of 80 mm and their fills were drawn by SEED, which was fixed before any run; nothing is tuned on them. Width and
depth vary by at least twice along each crack. Paste, pump and their errors are those of the first ten trials of
``benchmarks.blind_trials``. A lab takes a photo, gauges the depth every 10 mm, and weighs a liquid into the crack. It
predicts with three runs at each of three particle sizes, as ``sealtwin validate --uncertainty`` does, and with
``uncertainty.differences = "slot"``. Its radius is "auto", four particles across the mean width, or less, so that the
coarser particles fit the nozzle. Reality is particles of another seed and size, or the second reality. ``--pour``
computes the runs that ``benchmarks/blind_roads/`` does not have yet.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks.blind_labs import add_real, add_sizes, kept_sizes, real_levels_mm
from benchmarks.blind_own_band import Judged, Reality, figures, judge, predicted, spread_of
from benchmarks.blind_trials import Measured, notebook, real_level_mm
from benchmarks.kept_runs import KeptRuns
from benchmarks.reality.inputs import Cavity, Numerics, Paste
from benchmarks.reality.pour import poured
from benchmarks.reality.worlds import as_declared
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
from sealtwin.study.uncertainty_runs import RATIO
from sealtwin.trial.trial_file import Trial
from simulate.settings import Nozzle
from simulate.setup.resolution import ACCURATE_RESOLUTION
from simulate.slot.run import pour
from tests.support.shapes import CUT, outline_between

FOLDER = Path(__file__).with_suffix("")
REAL, SIZES, LAB = FOLDER / "real.csv", FOLDER / "sizes.csv", "inputs"
KEPT = KeptRuns(FOLDER, "python -m benchmarks.blind_roads --pour")
SEED, TRIALS, LENGTH_MM = 20261130, 10, 80.0
T_MM = np.linspace(0.0, LENGTH_MM, 321)
STATIONS_MM = np.arange(0.0, LENGTH_MM + 0.5, 2.0)
PLACES_MM = STATIONS_MM[(STATIONS_MM >= 4) & (STATIONS_MM <= LENGTH_MM - 4)]
WIDTHS_MM, DEPTHS_MM, MIN_RATIO = (3.0, 15.0), (5.0, 40.0), 2.0
ANGLES_DEG = (0.5, 2.0)  # At most so steep that no walls of this draw meet
FILLS = (0.5, 0.85)  # Paste over the cavity
DEPTH_STEP_MM, GAUGED_EVERY = 5.0, 2  # Between rows of the true depth; rows between two readings of the gauge
WIDTH_SD_MM, DEPTH_SD_MM = 0.1, 0.5
STEPS = np.array([0.8, 0.55, 0.3, 0.0])  # Levels of the weighed liquid below the face, over the least depth
FLOWS = ("constant", "cross_section")  # Of even and odd trials


def measured(number: int, seed: int = SEED) -> Measured:
    """Draw a crack, and emulate all measurements of a trial."""
    notes, random = notebook()[number], np.random.default_rng([seed, number])
    angle_deg, fill = float(random.uniform(*ANGLES_DEG)), float(random.uniform(*FILLS))
    traced, depths_mm = _crack(random), _depths(random)
    outline, off_mm = widened(traced, float(random.normal(0, WIDTH_SD_MM))), float(random.normal(0, DEPTH_SD_MM))
    walls = CrackShape(depth_mm=depths_mm, tilt="funnel", wall_angle_deg=angle_deg)
    readings_mm = tuple((s_mm, depth_mm + off_mm) for s_mm, depth_mm in depths_mm[::GAUGED_EVERY])
    gauged = CrackShape(depth_mm=readings_mm, tilt="funnel")
    liquid = _weighed_into(random, outline, walls)
    moved, shape, by_weight = weigh(traced, gauged, liquid, WIDTH_SD_MM, DEPTH_SD_MM)
    solid = with_weighed(build_solid(moved, shape), by_weight)
    noted, real, nozzle = notes["trial"], notes["real"]["path"], Nozzle(**notes["trial"]["nozzle"])
    volume_ml, noted_ml = fill * solid.cavity_volume_mm3 / 1e3, noted["path"]["volume_ml"]
    radius_mm = min(ACCURATE_RESOLUTION.radius_mm(moved.mean_width_mm, nozzle), nozzle.diameter_mm / 2 / RATIO)
    doubt_ml = noted["uncertainty"]["volume_ml"] * volume_ml / noted_ml
    changes = {
        "name": f"roads {seed} {number}",
        "crack": {"depth_mm": readings_mm, "tilt": "funnel", "fill": liquid.model_dump(exclude_none=True)},
        "path": noted["path"] | {"volume_ml": volume_ml, "flow": FLOWS[number % 2]},
        "solver": noted["solver"] | {"radius_mm": float(f"{radius_mm:.3f}")},
        "uncertainty": noted["uncertainty"] | {"volume_ml": doubt_ml, "differences": "slot"},
    }
    trial = checked(Trial, Path("trial.toml"), noted | changes)
    sample = Sample(moved, solid, plan_trajectory(moved, trial.path, solid.cavity_volume_mm3, solid.sections))
    base = Base(Path(), trial, sample, *pour(trial.pour(sample)))
    as_poured = real | {"volume_ml": volume_ml * real["volume_ml"] / noted_ml, "trim_mm": tuple(real["trim_mm"])}
    real_path = trial.path.model_copy(update=as_poured)
    path = plan_trajectory(moved, real_path, solid.cavity_volume_mm3, solid.sections)
    truth = notes["truth"] | {"angle_deg": angle_deg}
    return Measured(truth, base, Sample(outline, build_solid(outline, walls), path))


def _along(random: np.random.Generator, s_mm: Floats, limits_mm: tuple[float, float]) -> Floats:
    """Return values of a smooth wave whose least and largest value are drawn evenly in their logarithms."""
    low_mm = limits_mm[0] * (limits_mm[1] / MIN_RATIO / limits_mm[0]) ** random.uniform()
    high_mm = MIN_RATIO * low_mm * (limits_mm[1] / MIN_RATIO / low_mm) ** random.uniform()
    waves = np.arange(1, 5)
    phases = random.uniform(0, 2 * np.pi, len(waves))
    wave = (np.sin(np.pi * waves * T_MM[:, None] / LENGTH_MM + phases) / waves).sum(axis=1)
    share = (wave - wave.min()) / np.ptp(wave)
    return np.interp(s_mm, T_MM, low_mm * (high_mm / low_mm) ** share)


def _crack(random: np.random.Generator) -> Outline:
    phases = random.uniform(0, 2 * np.pi, 2)
    across_mm = np.sin(2 * np.pi * T_MM[:, None] / (LENGTH_MM, LENGTH_MM / 2) + phases) @ (1.5, 0.5)
    centre = np.column_stack([T_MM, across_mm])
    half_mm = _along(random, T_MM, WIDTHS_MM)[:, None] / 2 * left_normals(centre)
    return outline_between(centre, centre + half_mm, centre - half_mm, CUT, None)


def _depths(random: np.random.Generator) -> tuple[tuple[float, float], ...]:
    s_mm = np.arange(0.0, LENGTH_MM + 1, DEPTH_STEP_MM)
    return tuple(zip(s_mm.tolist(), _along(random, s_mm, DEPTHS_MM).tolist(), strict=True))


def _weighed_into(random: np.random.Generator, outline: Outline, walls: CrackShape) -> WeighedFill:
    """Return a fill as a lab weighs it: four steps above the shallowest floor, since lower pools are not connected."""
    slicer = Slicer(lay_out(outline, walls, max(wall_shifts_mm(walls))), walls)
    down_mm = np.linspace(0.0, walls.deepest_mm, 81)
    area_mm2 = np.array([slicer.cavity(depth_mm).area() for depth_mm in down_mm])
    below_mm3 = np.cumulative_sum((area_mm2[1:] + area_mm2[:-1])[::-1] / 2 * down_mm[1], include_initial=True)[::-1]
    blank = WeighedFill(mass_g=(1.0,), level_mm=(0.0,))
    lowest_mm = -float(walls.depth_at_mm(walls.depth_stations_mm).min()) * STEPS
    capillary_mm = capillary_length_mm(blank.surface_tension_n_m, blank.density_kg_m3)
    lift_mm = mean_level_mm(lowest_mm, outline.mean_width_mm, capillary_mm) - lowest_mm
    off_mm = random.normal(0, np.where(lowest_mm < 0, blank.level_sd_mm, blank.flush_sd_mm))
    # At the brim the lab writes 0, whatever the level is.
    true_mm = lowest_mm + lift_mm * (1 + random.normal(0, MENISCUS_SD)) + np.where(lowest_mm < 0, 0.0, off_mm)
    volume_mm3 = np.interp(-true_mm, down_mm, below_mm3)
    mass_g = blank.density_kg_m3 / 1e6 * volume_mm3 * (1 + random.normal(0, DENSITY_SD))
    mass_g += random.normal(0, blank.mass_sd_g, len(mass_g))
    read_mm = np.where(lowest_mm < 0, lowest_mm + off_mm, 0.0)
    return WeighedFill(mass_g=tuple(mass_g.tolist()), level_mm=tuple(read_mm.tolist()))


def _second_reality_mm(one: Measured) -> Floats:
    outline, walls, fluid = one.real.outline, one.real.solid, one.real_fluid
    angle_deg = np.full(len(outline.s_mm), one.truth["angle_deg"])
    cavity = Cavity(outline.s_mm, outline.width_mm, walls.depth_at_mm(outline.s_mm), angle_deg, angle_deg)
    paste = Paste(fluid["density_kg_m3"], fluid["yield_stress_pa"], fluid["viscosity_pa_s"])
    path = pour_along(one.real.trajectory, one.base.trial.nozzle.diameter_mm)
    return poured(cavity, paste, path, as_declared, Numerics(settle_s=one.base.trial.solver.settle_s)).at(PLACES_MM)


def main(compute: Annotated[bool, Option("--pour", help="compute the runs that are missing")] = False) -> list[Row]:
    if compute:
        KEPT.begin()
        FOLDER.mkdir(exist_ok=True)
    KEPT.require()
    trials = {number: measured(number) for number in range(TRIALS)}
    for number, one in trials.items() if compute else ():
        if number not in real_levels_mm(REAL):
            add_real(REAL, number, real_level_mm(number, one, STATIONS_MM, SEED), STATIONS_MM)
        if (number, LAB) not in kept_sizes(SIZES):
            add_sizes(SIZES, number, LAB, one.base, one, STATIONS_MM)
    return [*_of_verdicts([one.base for one in trials.values()]), *_of_runs(trials)]


def _of_verdicts(bases: list[Base]) -> Iterator[Row]:
    yield Row("EMULATED trials drawn", len(bases), "")
    yield Row("the fast model calls fit", sum(not base.run.unfit for base in bases), "")
    for key, count in Counter(reason.key for base in bases for reason in base.run.unfit).items():
        yield Row(f"it calls unfit for {key.removeprefix('unfit.')}", count, "")
    radii_mm = [base.trial.solver.size_mm for base in bases]
    yield Row("particle radius of a prediction, least", min(radii_mm), "mm")
    yield Row("particle radius of a prediction, largest", max(radii_mm), "mm")


def _of_runs(trials: Mapping[int, Measured]) -> Iterator[Row]:
    kept, real_mm = kept_sizes(SIZES), real_levels_mm(REAL)
    judged = dict[str, dict[int, Judged]]({"particles": {}, "second reality": {}})
    for number, one in trials.items():
        if (number, LAB) not in kept:
            continue
        band = predicted(one.base, spread_of(one.base, kept[number, LAB], STATIONS_MM))
        particles_mm = np.interp(PLACES_MM, STATIONS_MM, real_mm[number])
        for name, level_mm in zip(judged, (particles_mm, _second_reality_mm(one)), strict=True):
            judged[name][number] = judge(level_mm, band, one.base, PLACES_MM)
            print(f"trial {number}, {name}: {judged[name][number]}", flush=True)
    for name, by_number in judged.items():
        yield from figures(name, list(by_number.values()), Reality(None, judged=False))
        fit = [one.rms_mm[2] for number, one in by_number.items() if not trials[number].base.run.unfit]
        yield Row(f"{name}: fast model off by where it calls itself fit, RMS", rms(fit), "mm")


if __name__ == "__main__":
    run_benchmark(main)
