"""Calibration of EMULATED readings: fourteen pastes that are known, by real particle runs throughout.

    python -m benchmarks.calibration [--anew]

A slot of 30 mm is filled by coarse particles (R = 0.8 mm). Viscosity, yield stress, freezing age and volume of each
truth are a point of a scrambled Halton sequence; its readings are one run at 27 stations with normal errors of
0.09 mm (95 % half-width 0.18 mm). Each is searched with 40 runs, the first 19 of which are the same for all. A
calibration succeeds where the likeliest setting's profile is within 0.18 mm RMS of the truth's: means over 3 seeds
each, less what the scatter of these seeds adds. Nothing of the method was chosen on these truths.

The truths are also read by 40 runs of a Sobol sequence alone, as they are and with smooth errors that a setting makes
too: the sizes of the errors that a calibration allows for were chosen on the first eight truths with these. The last
readings are of a second reality at the truths' settings, a continuum without particles (``benchmarks.reality``).
The pastes of the truths are also poured with a weighed volume of 1.9 ml, once, and again at half or twice the speed.

Bars: so many settings are identified and in their interval, and at least 80 % of those identified are. A method that
identifies nothing misses the first, one that guesses the second.

``calibration.csv`` keeps the runs; without them it takes 20 minutes of one core. --anew removes those of other solvers.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np
from scipy.stats import qmc
from typer import Option

from benchmarks.kept_runs import KeptRuns, add_rows, rows_in
from benchmarks.reality.inputs import Cavity, Numerics, Paste
from benchmarks.reality.pour import poured
from benchmarks.samples import pour_along
from benchmarks.table import Row, run_benchmark
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.calibration.search import CONFIRM, SearchResult, Setting, Source, search, settings_at
from sealtwin.core.records import Floats, Outline, Sample, Solid, Trajectory
from simulate import pour as pours
from simulate.run import fill as fill_crack
from simulate.settings import Fluid, Nozzle, Solver
from tests.support.shapes import straight_slot
from validate.calibration.emulator import Emulator
from validate.calibration.posterior import (
    Free,
    Marginal,
    Posterior,
    ReadLevels,
    marginals_of,
    reach_of,
    smooth_errors_mm2,
)
from validate.uncertainty.computed import require_different

TABLE = Path(__file__).with_name("calibration.csv")
KEPT = KeptRuns(TABLE, "python -m benchmarks.calibration --anew", ("solids", "simulate"))
BUDGET, TRUTHS = 40, 14
CLOSE_MM, READING_MM = 0.18, 0.09  # 95 % half-width of a reading, and its standard deviation
LENGTH_MM, WIDTH_MM, DEPTH_MM, WALL_DEG, TRIM_MM = 30.0, 5.0, 14.0, 6.0, 6.0
STATIONS_MM = np.arange(2.0, 28.5)
NOMINAL_ML, SETTLE_S = 1.9, 0.6
SPEED_MM_S, SPEEDS_MM_S = 12.0, (12.0, 6.0, 24.0)  # Of the first pour; half and twice of it
NOZZLE, ACCURATE = Nozzle(diameter_mm=3.4), Solver(radius_mm=0.8, settle_s=SETTLE_S)
FREES = (
    Free("fluid.viscosity_pa_s", 0.1, 2.0),
    Free("fluid.yield_stress_pa", 0.5, 8.0),
    Free("fluid.freeze_after_s", 0.8, 3.2),
    Free("path.volume_ml", 0.85 * NOMINAL_ML, 1.15 * NOMINAL_ML),
)
READ, AGAIN = 1000, 2000  # First seeds of the runs that are read, and of those that give a truth's own profile
SEEDS_OF_A_TRUTH = 3
PASTE, WEIGHED = FREES[:3], {FREES[3].name: NOMINAL_ML}
NEEDED = 12.0  # Truths to be calibrated within CLOSE_MM
MIN_HELD = 80.0  # Percent of the truths in 90 % intervals
MIN_FOUND, MIN_FOUND_OUTSIDE, MIN_FOUND_BY_TWO = 5, 3, 10
"""Smallest numbers of settings that are identified and held: of 56 by one pour, of 56 in the second reality, of 42 by
two weighed pours. A method that identifies nothing has 0. One weighed pour has 7, so a useless second one misses 10."""
POURS = {  # Speeds of the pours that are calibrated together
    "one weighed pour": SPEEDS_MM_S[:1],
    "a second at half the speed": SPEEDS_MM_S[:2],
    "a second at twice the speed": SPEEDS_MM_S[::2],
}


@cache
def slot() -> tuple[Outline, Solid]:
    outline = straight_slot(LENGTH_MM, WIDTH_MM)
    return outline, build_solid(outline, CrackShape(depth_mm=DEPTH_MM, tilt="flare", wall_angle_deg=WALL_DEG))


class Library:
    """Runs by their settings and seed, in the order in which they were made."""

    def __init__(self) -> None:
        """Read the runs that are kept. Leaves if another solver computed them."""
        KEPT.require()
        rows = [[float(value) for value in row] for row in rows_in(TABLE)]
        keys = len(FREES) + 2
        self._levels_mm = {tuple(row[:keys]): np.array(row[keys:]) for row in rows}

    def levels_mm(self, setting: Setting, seed: int, speed_mm_s: float = SPEED_MM_S) -> Floats:
        key = (*(setting[free.name] for free in FREES), speed_mm_s, float(seed))
        if key not in self._levels_mm:
            level_mm = self._levels_mm[key] = np.round(fill(setting, seed, speed_mm_s), 3)
            KEPT.begin()
            names = [*(free.name for free in FREES), "path.speed_mm_s", "seed"]
            header = [*names, *(f"level_at_{s:g}_mm" for s in STATIONS_MM)]
            add_rows(TABLE, header, [[f"{value:g}" for value in (*key, *level_mm)]])
        return self._levels_mm[key]

    def run(self, wanted: Sequence[tuple[Setting, int]]) -> Sequence[Floats | None]:
        return [self.levels_mm(setting, seed) for setting, seed in wanted]

    def of_a_truth_mm(self, setting: Setting) -> Floats:
        """Levels of a truth with seeds that are not read, (seeds, stations)."""
        return np.array([self.levels_mm(setting, AGAIN + seed) for seed in range(SEEDS_OF_A_TRUTH)])


def fill(setting: Setting, seed: int, speed_mm_s: float) -> Floats:
    outline, solid = slot()
    sample = Sample(outline, solid, trajectory(setting, speed_mm_s))
    _, profile = fill_crack(pours.Pour(sample, (fluid(setting),), ACCURATE, NOZZLE, seed))
    return np.interp(STATIONS_MM, profile.s_mm, profile.level_mm)


def trajectory(setting: Setting, speed_mm_s: float) -> Trajectory:
    outline, solid = slot()
    path = NozzlePath(volume_ml=setting["path.volume_ml"], speed_mm_s=speed_mm_s, trim_mm=TRIM_MM)
    return plan_trajectory(outline, path, solid.cavity_volume_mm3, solid.sections)


def fluid(setting: Setting) -> Fluid:
    table = {name.partition(".")[2]: value for name, value in setting.items() if name.startswith("fluid.")}
    return Fluid.model_validate(table)


def second_reality_mm(setting: Setting, speed_mm_s: float = SPEED_MM_S) -> Floats:
    """Return the level by the continuum of ``benchmarks.reality``, which knows nothing of particles."""
    paste = fluid(setting)
    # Walls that flare: the traced width is that of the floor.
    mouth_mm = WIDTH_MM + 2 * DEPTH_MM * math.tan(math.radians(WALL_DEG))
    bed = poured(
        Cavity.even(LENGTH_MM, mouth_mm, DEPTH_MM, WALL_DEG),
        Paste(
            paste.density_kg_m3,
            setting["fluid.yield_stress_pa"],
            setting["fluid.viscosity_pa_s"],
            freezes_at_s=setting["fluid.freeze_after_s"],
        ),
        pour_along(trajectory(setting, speed_mm_s), NOZZLE.size_mm),
        numerics=Numerics(settle_s=SETTLE_S),
    )
    return bed.at(STATIONS_MM)


def truths() -> list[Setting]:
    return [settings_at(FREES, point) for point in qmc.Halton(len(FREES), rng=20261122).random(TRUTHS)]


def reading_errors_mm(number: int) -> Floats:
    return READING_MM * np.random.default_rng(number).standard_normal(len(STATIONS_MM))


def readings(library: Library, number: int, truth: Setting, speed_mm_s: float = SPEED_MM_S) -> ReadLevels:
    level_mm = library.levels_mm(truth, READ + number, speed_mm_s) + reading_errors_mm(number)
    smooth_mm2 = smooth_errors_mm2(STATIONS_MM, (TRIM_MM, LENGTH_MM - TRIM_MM))
    return ReadLevels(STATIONS_MM, level_mm, READING_MM**2 * np.eye(len(STATIONS_MM)), smooth_mm2)


def smooth_errors(level_mm: Floats) -> dict[str, Floats]:
    """Return readings of ``level_mm`` with an error that no setting stands for, by its name."""
    height_mm, s_mm = level_mm + DEPTH_MM, STATIONS_MM
    area_mm2 = _area_mm2(height_mm, WALL_DEG)
    uneven_deg = WALL_DEG + 1.5 * np.sin(2 * np.pi * s_mm / LENGTH_MM)
    return {
        "nothing": level_mm,
        "datum 0.3 mm off": level_mm + 0.3,
        "crack 4 % wider": _height_mm(area_mm2 / 1.04, WALL_DEG) - DEPTH_MM,
        "walls 1.5 degrees off along the crack": _height_mm(area_mm2, uneven_deg) - DEPTH_MM,
        "shrunk by 2 %": level_mm - 0.02 * height_mm,
        "tilted by 0.35 mm at each end": level_mm + np.linspace(-0.35, 0.35, len(s_mm)),
        "a late pump": level_mm - 1.2 * np.exp(-np.maximum(s_mm - TRIM_MM, 0.0) / 4),
    }


def _area_mm2(height_mm: Floats, wall_deg: float | Floats) -> Floats:
    """Return the section's area up to a height above the floor, which has the traced width if walls flare."""
    return WIDTH_MM * height_mm + np.tan(np.radians(wall_deg)) * height_mm**2


def _height_mm(area_mm2: Floats, wall_deg: float | Floats) -> Floats:
    opens = np.tan(np.radians(wall_deg))
    return (np.sqrt(WIDTH_MM**2 + 4 * opens * area_mm2) - WIDTH_MM) / (2 * opens)


def apart_mm(a_mm: Floats, b_mm: Floats, noise_mm2: float) -> float:
    """Root mean square of the difference of two profiles, less the variance that their seeds add."""
    return float(np.sqrt(max(0.0, np.mean((a_mm - b_mm) ** 2) - noise_mm2)))


def sobol_points(count: int) -> Floats:
    """As many as the budget, of the 64 that keep the sequence's balance; the search begins with the first 16."""
    return qmc.Sobol(count, rng=0).random(64)[:BUDGET]


def main(anew: Annotated[bool, Option(help="remove kept runs of another solver")] = False) -> list[Row]:
    if anew:
        KEPT.begin()
    library, results = Library(), list[tuple[Setting, SearchResult]]()
    for number, truth in enumerate(truths()):
        began = time.process_time()
        result = search(FREES, [Source("slot", readings(library, number, truth), library.run)], BUDGET, lambda _: None)
        results.append((truth, result))
        words = f"nothing possible (implausibility {result.least_implausibility:.2f}, {result.reaches[0]})"
        if result.draws is not None:
            marginals = marginals_of(FREES, result.draws, result.best)
            words = ", ".join(f"{truth[each.free.name]:.3g} in {each.low:.3g} to {each.high:.3g}" for each in marginals)
        print(f"truth {number + 1}: {words}; {time.process_time() - began:.0f} s", flush=True)
    return [*rows(library, results), *library_rows(library), *weighed_rows(library)]


@dataclass(frozen=True)
class Calibration:
    """What a calibration says of a truth."""

    truth: Setting
    marginals: Sequence[Marginal]
    possible: bool  # The readings are not refused

    @property
    def held(self) -> list[bool]:
        """Return whether the 90 % interval of each setting contains the truth."""
        return [each.low <= self.truth[each.free.name] <= each.high for each in self.marginals]

    @property
    def identified(self) -> list[bool]:
        return [self.possible and each.identified for each in self.marginals]


def power_rows(name: str, calibrations: Sequence[Calibration], floor: int) -> list[Row]:
    """Return figures of calibrations of all truths, once or several times. They are judged if ``floor`` is above 0."""
    hits = np.array([each.held for each in calibrations])
    identified = np.array([each.identified for each in calibrations])
    widths = np.array([[marginal.width_over_prior for marginal in each.marginals] for each in calibrations])
    sound, count = int((hits & identified).sum()), int(identified.sum())
    result = [
        Row(f"{name}: settings identified, of {hits.size}", count, ""),
        Row(f"{name}: identified and held, of {hits.size}", sound, "", floor),
        Row(f"{name}: of the identified, held", 100 * sound / max(1, count), "%", MIN_HELD if floor else 0),
        Row(f"{name}: settings held", 100 * float(hits.mean()), "%"),
        Row(f"{name}: found possible, of {len(calibrations)}", sum(each.possible for each in calibrations), ""),
    ]
    if floor:
        odds = odds_of_missing(hits & identified, identified, floor)
        result += [Row(f"{name}: odds that other truths miss one of the bars", odds, "%")]
    for number, marginal in enumerate(calibrations[0].marginals):
        setting = f"{name}: {marginal.free.name}"
        result += [
            Row(f"{setting} identified, of {len(hits)}", int(identified[:, number].sum()), ""),
            Row(f"{setting} held, of {len(hits)}", int(hits[:, number].sum()), ""),
            Row(f"{setting}, width of interval over range", float(widths[:, number].mean()), ""),
        ]
    return result


def odds_of_missing(sound: np.ndarray, identified: np.ndarray, floor: int) -> float:
    """Return the percentage of samples of the truths, drawn with replacement, that miss a bar."""
    drawn = np.random.default_rng(0).integers(TRUTHS, size=(4000, TRUTHS))
    by_truth = (each.sum(axis=1).reshape(-1, TRUTHS).sum(axis=0) for each in (sound, identified))
    sounds, counts = (each[drawn].sum(axis=1) for each in by_truth)
    return 100 * float(np.mean((sounds < floor) | (100 * sounds < MIN_HELD * counts)))


def library_rows(library: Library) -> list[Row]:
    """Return what the Sobol runs say of the truths without a search."""
    points = sobol_points(len(FREES))
    levels_mm = np.array(library.run([(settings_at(FREES, point), seed) for seed, point in enumerate(points)]))
    calibrations = dict[str, list[Calibration]]()
    for number, truth in enumerate(truths()):
        true = readings(library, number, truth)
        other_mm = {"second reality": second_reality_mm(truth) + reading_errors_mm(number)}
        for name, level_mm in (smooth_errors(true.level_mm) | other_mm).items():
            evidence = [replace(true, level_mm=level_mm)]
            calibrations.setdefault(name, []).append(calibration(truth, FREES, points, [levels_mm], evidence))
    plain, floors = calibrations["nothing"], {"nothing": MIN_FOUND, "second reality": MIN_FOUND_OUTSIDE}
    pooled = [each for name in calibrations if name not in floors for each in calibrations[name]]
    possible, percentage = sum(each.possible for each in plain), 100 * float(np.mean([each.held for each in plain]))
    return [
        Row(f"without search: EMULATED readings found possible, of {TRUTHS}", possible, "", TRUTHS - 1),
        Row("without search: truths that 90 % intervals hold", percentage, "%", MIN_HELD),
        *(row for name, each in calibrations.items() for row in power_rows(name, each, floors.get(name, 0))),
        *power_rows("all smooth errors", pooled, len(pooled) // TRUTHS * MIN_FOUND),
    ]


def calibration(
    truth: Setting, frees: Sequence[Free], points: Floats, levels_mm: Sequence[Floats], evidence: Sequence[ReadLevels]
) -> Calibration:
    """Calibrate without a search: ``levels_mm`` and ``evidence`` are of each pour, runs are at ``points``."""
    reaches = [reach_of(points, *pour) for pour in zip(levels_mm, evidence, strict=True)]
    emulators = [
        Emulator.fitted(points, pour_mm, reach.components) for pour_mm, reach in zip(levels_mm, reaches, strict=True)
    ]
    posterior = Posterior(frees, emulators, evidence)
    draws, _ = posterior.draws(500, 600)
    possible = all(reach.possible for reach in reaches) and posterior.least_implausibility <= 1
    return Calibration(truth, marginals_of(frees, draws, draws[0]), possible)


def weighed_rows(library: Library) -> list[Row]:
    """Return what one pour and two pours of a weighed volume say of the pastes of the truths, without a search."""
    points = sobol_points(len(PASTE))
    settings = [settings_at(PASTE, point) | WEIGHED for point in points]
    levels_mm = {
        speed_mm_s: np.array([library.levels_mm(setting, seed, speed_mm_s) for seed, setting in enumerate(settings)])
        for speed_mm_s in SPEEDS_MM_S
    }
    calibrations = dict[str, list[Calibration]]()
    for number, truth in enumerate(truths()):
        true = {
            speed_mm_s: readings(library, number + TRUTHS * (speed_mm_s != SPEED_MM_S), truth | WEIGHED, speed_mm_s)
            for speed_mm_s in SPEEDS_MM_S
        }
        for name, speeds in POURS.items():
            pours_mm, evidence = [levels_mm[each] for each in speeds], [true[each] for each in speeds]
            calibrations.setdefault(name, []).append(calibration(truth, PASTE, points, pours_mm, evidence))
    return [
        row
        for name, each in calibrations.items()
        for row in power_rows(name, each, MIN_FOUND_BY_TWO * (len(POURS[name]) > 1))
    ]


def rows(library: Library, results: Sequence[tuple[Setting, SearchResult]]) -> list[Row]:
    """Return the figures of the calibrations."""
    seeds_mm = np.array([library.of_a_truth_mm(truth) for truth, _ in results])
    for levels_mm in seeds_mm:
        require_different(levels_mm, [f"with seed {AGAIN + seed}" for seed in range(SEEDS_OF_A_TRUTH)], f"{TABLE}")
    noise_mm2 = float(seeds_mm.var(axis=1, ddof=1).mean())
    first = 1 / SEEDS_OF_A_TRUTH + 1 / CONFIRM
    errors_mm, calibrations = list[float](), list[Calibration]()
    for (truth, result), true_mm in zip(results, seeds_mm.mean(axis=1), strict=True):
        best_mm = np.full(len(STATIONS_MM), np.inf)
        if result.draws is not None:
            best_mm = result.confirmed_mm(0).mean(axis=0)
        draws = result.posterior.draws(500, 600)[0] if result.draws is None else result.draws
        calibrations.append(Calibration(truth, marginals_of(FREES, draws, draws[0]), result.possible))
        errors_mm.append(apart_mm(best_mm, true_mm, first * noise_mm2))
    succeeded = sum(error_mm <= CLOSE_MM for error_mm in errors_mm)
    return [
        Row("EMULATED truths that were run", len(results), ""),
        Row(f"calibrated within {CLOSE_MM:g} mm RMS in {BUDGET} runs", succeeded, "", NEEDED),
        Row("median RMS of the calibrated profile", float(np.median(errors_mm)), "mm"),
        Row("largest RMS of the calibrated profile", max(errors_mm), "mm"),
        Row(
            "truths that 90 % intervals hold", 100 * float(np.mean([each.held for each in calibrations])), "%", MIN_HELD
        ),
        *power_rows("by a search", calibrations, MIN_FOUND),
        Row("scatter of a run between seeds", float(np.sqrt(noise_mm2)), "mm"),
    ]


if __name__ == "__main__":
    run_benchmark(main)
