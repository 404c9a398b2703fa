"""The band of ``sealtwin validate --uncertainty`` on twenty blind trials drawn anew, judged by trials: EMULATED.

    python -m benchmarks.blind_own_band [--trials 3 --trials 17 ...]

The numerics are those of three runs at each of three particle sizes, which ``benchmarks.blind_labs`` keeps for each
lab. The band is computed from them as the command does, with 200 draws of the fast model in place of 1,000. Reality is
particles of another seed and size, or the second reality in several worlds, a continuum that knows nothing of particles
(``benchmarks.reality``). There is no part by readings: bands are compared with the level itself. Beside the level by
particles two are judged that cost nothing: the flat line of the poured volume, and the fast model.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, NamedTuple

import numpy as np
from typer import Option

from benchmarks.blind_labs import (
    KEPT,
    LABS,
    SHORT_AND_LATE,
    Sizes,
    base_of,
    kept_sizes,
    real_levels_mm,
    second_reality,
)
from benchmarks.blind_trials import STATIONS_MM, measured
from benchmarks.reality.inputs import Paste
from benchmarks.reality.worlds import A_DAY, World, as_declared, slips, wets
from benchmarks.table import Row, processes, run_benchmark
from sealtwin.core.errors import present
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile
from sealtwin.study.perturbed_inputs import Base, draw
from validate.metrics.volumes import balance_profile
from validate.result import PredictedLevel
from validate.uncertainty.computed import Spread
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.validation import BedEnds, predict

DRAWS = 200
PLACES_MM = STATIONS_MM[(STATIONS_MM >= 4) & (STATIONS_MM <= 36)]
"""Places at which a level is held against its band: the crack's own ends are cut off."""
LEAST, MIN_PLACES = 17, 92.0  # Of twenty trials; percent of the places
TENSION_N_M = Paste(1.0, 1.0, 1.0).surface_tension_n_m
LEVELS = ("level", "flat line by volume", "fast model")
WIDEST = 1.5  # Half-width of a mean level over 1.96 standard deviations of the errors


class Reality(NamedTuple):
    """A reality, and the lab that predicts it."""

    world: World | None  # None: particles
    lab: str = "inputs"
    judged: bool = True
    wets: bool = False  # True if the lab declares the paste's surface tension


REALITIES: Mapping[str, Reality] = {
    "particles": Reality(None),
    "W0": Reality(as_declared),
    "slip, unmeasured": Reality(slips, judged=False),
    "late and 8 % low, unmeasured": Reality(SHORT_AND_LATE, judged=False),
    "late and 8 % low, sample weighed": Reality(SHORT_AND_LATE, "weighed, late and 8 % low"),
    "W10, undeclared": Reality(wets(1.0), judged=False),
    "W10, tension declared": Reality(wets(1.0), wets=True),
    "W11, unmeasured": Reality(A_DAY, judged=False),
    "W11, sample weighed": Reality(A_DAY, "weighed, W11"),
}


def main(
    trials: Annotated[list[int] | None, Option(help="number of a judged trial; may be repeated; default: all")] = None,
) -> list[Row]:
    KEPT.require()
    kept, drawn = kept_sizes(), trials or sorted(real_levels_mm())
    chosen = [number for number in drawn if all((number, lab) in kept for lab in LABS)]
    left = f"no runs are kept for the others: '{KEPT.command}' goes on with them"
    return [Row("EMULATED trials judged", len(chosen), "", len(drawn), because=left), *_rows(chosen, kept)]


class Judged(NamedTuple):
    off_mm: float  # Mean level, real less predicted
    half_mm: float  # Half of its 95 % interval
    places: float  # Share of the places in their bands
    whole: bool  # True if the whole profile is in its band
    band_mm: float  # Half of the band, median
    rms_mm: list[float]  # Of each of LEVELS


def _rows(numbers: Sequence[int], kept: Mapping[tuple[int, str], Sizes]) -> Iterator[Row]:
    with processes(2) as pool:
        judged = list(pool.map(partial(_judge_trial, kept), numbers))
    for name in REALITIES:
        yield from _figures(name, [trial[name] for trial in judged], REALITIES[name])


def _judge_trial(kept: Mapping[tuple[int, str], Sizes], number: int) -> dict[str, Judged]:
    trial, judged = measured(number, Path()), dict[str, Judged]()
    particles_mm = np.interp(PLACES_MM, STATIONS_MM, real_levels_mm()[number])
    bases = {name: base_of(trial, number, lab) for name, lab in LABS.items()}
    spreads = {name: spread_of(base, kept[number, name]) for name, base in bases.items()}
    for name, reality in REALITIES.items():
        base, world = bases[reality.lab], reality.world
        band = predicted(base, spreads[reality.lab], TENSION_N_M if reality.wets else None)
        real_mm = particles_mm if world is None else second_reality(trial, world).at(PLACES_MM)
        judged[name] = judge(real_mm, band, base)
    print(f"trial {number}: judged", flush=True)
    return judged


def spread_of(base: Base, sizes: Sizes, s_mm: Floats = STATIONS_MM) -> Spread:
    """Return the runs at ``s_mm`` that a prediction's band follows from."""
    unfit, fast = base.run.unfit, base.profile
    fast_mm = None if unfit else np.interp(s_mm, fast.s_mm, fast.level_mm)
    with TemporaryDirectory() as parts:
        draws = draw(base, 0, Progress(), Path(parts), DRAWS)
    return Spread(s_mm, sizes, (), None, None, draws, fast_mm, unfit)


def predicted(base: Base, spread: Spread, surface_tension_n_m: float | None = None) -> PredictedLevel:
    """Return the level of a trial's first run, with its band."""
    sizes = present(spread.sizes, "the runs of three sizes")
    simulated = Profile(spread.s_mm, sizes[1].levels_mm[0], data="synthetic", source="simulation")
    declared = base.trial.uncertainty.model_copy(update={"surface_tension_n_m": surface_tension_n_m})
    mouth = Mouth.of(base.sample.outline, base.sample.solid, base.trial.given_fluid.density_kg_m3)
    return predict(simulated, spread, declared, ends=BedEnds.of(base.sample.trajectory, base.run), mouth=mouth)


def judge(real_mm: Floats, band: PredictedLevel, base: Base, places_mm: Floats = PLACES_MM) -> Judged:
    predicted_mm, half_mm, profile_mm = (
        np.interp(places_mm, band.s_mm, values) for values in (band.level_mm, band.band_95_mm, band.profile_band_95_mm)
    )
    flat = balance_profile(base.run.dispensed_volume_mm3, base.sample.outline, base.sample.solid)
    flat_mm, fast_mm = (np.interp(places_mm, level.s_mm, level.level_mm) for level in (flat, base.profile))
    off_mm = real_mm - predicted_mm
    low_mm, high_mm = band.mean_level_95_mm
    return Judged(
        float(off_mm.mean()),
        (high_mm - low_mm) / 2,
        float(np.mean(np.abs(off_mm) <= half_mm)),
        bool((np.abs(off_mm) <= profile_mm).all()),
        float(np.median(half_mm)),
        [float(np.sqrt(np.mean((real_mm - level_mm) ** 2))) for level_mm in (predicted_mm, flat_mm, fast_mm)],
    )


def _figures(name: str, trials: Sequence[Judged], reality: Reality) -> Iterator[Row]:
    count, bars = len(trials), (LEAST / 20 * len(trials), MIN_PLACES) if reality.judged else (0.0, 0.0)
    off_mm, half_mm = (np.array([getattr(one, key) for one in trials]) for key in ("off_mm", "half_mm"))
    places = 100 * float(np.mean([one.places for one in trials]))
    yield Row(
        f"{name}: mean levels in their intervals, of {count}", int((np.abs(off_mm) <= half_mm).sum()), "", bars[0]
    )
    yield Row(f"{name}: whole profiles in their bands", sum(one.whole for one in trials), "", bars[0])
    yield Row(f"{name}: places in their bands", places, "%", bars[1])
    yield Row(f"{name}: mean level off by, mean of the trials", float(off_mm.mean()), "mm")
    if count > 1:
        wide = float(np.median(half_mm) / (1.96 * off_mm.std(ddof=1)))
        most = WIDEST if reality.world is None else np.inf
        yield Row(f"{name}: half of a mean level's interval over 1.96 sd of the errors", wide, "", 0, most)
    yield Row(f"{name}: half of a mean level's interval, median", float(np.median(half_mm)), "mm")
    yield Row(f"{name}: half of the band, median", float(np.median([one.band_mm for one in trials])), "mm")
    rms_mm = np.sqrt(np.mean(np.square([one.rms_mm for one in trials]), axis=0))
    for by, off_by_mm in zip(LEVELS, rms_mm, strict=True):
        yield Row(f"{name}: {by} off by, RMS", float(off_by_mm), "mm")


if __name__ == "__main__":
    run_benchmark(main)
