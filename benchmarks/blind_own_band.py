"""The band of ``sealtwin validate --uncertainty`` on the trials of the blind prediction, judged by trials: EMULATED.

    python -m benchmarks.blind_own_band [--record] [--trials 3 --trials 17 ...]

``benchmarks.blind_prediction`` judges a band whose numerics are one number, the same for all trials. The command takes
them from three runs at each of three particle sizes. ``--record`` makes these runs and keeps them, half a minute of one
core a trial, of which there are twenty; the band is then computed as the command does, with 200 draws of the fast model
in place of 1,000. Reality is the particles of ``benchmarks.blind_cases``, or the second reality in several worlds,
which knows nothing of particles (``benchmarks.second_reality``). If the sample is weighed or strips are tested, the
prediction is moved by what the fast model says of that measurement. There is no part by readings: bands are held
against the level itself.
"""

import csv
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from typer import Option

from benchmarks import slumps
from benchmarks.blind_cases import FOLDER, JUDGED_SEED, STATIONS_MM, finished, level_mm
from benchmarks.blind_measured import SETTLE_S, Measured, measured
from benchmarks.kept_runs import KeptRuns
from benchmarks.reality.inputs import Cavity, Numerics, Paste, Pour
from benchmarks.reality.pour import poured
from benchmarks.reality.worlds import WORLDS, World, flows, late, slips, together
from benchmarks.table import Row, run_benchmark
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile, Sample
from sealtwin.study.drawn_runs import draw, level_of
from sealtwin.study.extra_runs import RATIO, REPLICATES
from validate.result import PredictedLevel
from validate.uncertainty.bed_ends import BedEnds
from validate.uncertainty.computed import SizeRuns, Spread
from validate.uncertainty.validation import predict

SIZES = FOLDER / f"{JUDGED_SEED}-sizes.csv"
KEPT = KeptRuns(SIZES, "python -m benchmarks.blind_own_band --record")
FACTORS = (1 / RATIO, 1.0, RATIO)
DRAWS = 200
PLACES_MM = STATIONS_MM[(STATIONS_MM >= 4) & (STATIONS_MM <= 36)]
"""Places at which a level is held against its band: the crack's own ends are cut off."""
LEAST = 17  # Of twenty trials
WIDEST = 1.5  # Half-width of a mean level over 1.96 standard deviations of the errors


class Reality(NamedTuple):
    """A reality, and what the lab measures in addition."""

    world: World | None  # None: the particles of blind_cases
    weighed: bool = False  # The sample, before and after the pour
    strips: bool = False  # Strips of paste on the cut face
    least_stations: float = 0.0  # Percent of the stations that the bands must hold


REALITIES: Mapping[str, Reality] = {
    "particles": Reality(None, least_stations=88),
    "W0": Reality(WORLDS["W0 as declared"], least_stations=88),
    "slip, unmeasured": Reality(slips),
    "slip, strips tested": Reality(slips, strips=True, least_stations=88),
    "late and 8 % low, unmeasured": Reality(together(late(1.0), flows(0.92))),
    "late and 8 % low, sample weighed": Reality(together(late(1.0), flows(0.92)), weighed=True, least_stations=88),
    "W11, unmeasured": Reality(next(world for name, world in WORLDS.items() if name.startswith("W11"))),
    "W11, sample weighed": Reality(
        next(world for name, world in WORLDS.items() if name.startswith("W11")), weighed=True, least_stations=88
    ),
}


def main(
    trials: Annotated[
        list[int] | None, Option(help="number of a judged trial; may be given again; default: all")
    ] = None,
    record: Annotated[bool, Option(help="make the runs that are not kept")] = False,
) -> list[Row]:
    drawn = trials or sorted(finished(JUDGED_SEED))
    # Trials are emulated by them: they come first.
    slumps.KEPT.require()
    if record:
        KEPT.begin()
        for number in drawn:
            _record(number)
    KEPT.require()
    chosen = [number for number in drawn if number in _kept()]
    left = f"no runs are kept for the others: '{KEPT.command}' goes on with them"
    return [Row("EMULATED trials judged", len(chosen), "", len(drawn), because=left), *_rows(chosen)]


def _record(number: int) -> None:
    if number in _kept():
        return
    with tempfile.TemporaryDirectory() as place:
        one = measured(JUDGED_SEED, number, Path(place))
    rows = []
    for factor in FACTORS:
        trial = one.base.trial
        assert trial.fluid is not None
        solver = trial.solver.model_copy(update={"radius_mm": factor * trial.solver.size_mm})
        for seed in range(REPLICATES):
            level = level_mm(one.base.sample, trial.fluid, solver, one, seed=seed)
            rows.append([number, f"{solver.size_mm:.6g}", seed, *(f"{value:.3f}" for value in level)])
    with SIZES.open("a", newline="", encoding="utf-8") as file:
        if file.tell() == 0:
            csv.writer(file).writerow(["trial", "radius_mm", "seed", *(f"level_at_{s:g}_mm" for s in STATIONS_MM)])
        csv.writer(file).writerows(rows)
    _kept.cache_clear()
    print(f"trial {number}: kept", flush=True)


@cache
def _kept() -> dict[int, tuple[SizeRuns, SizeRuns, SizeRuns]]:
    if not SIZES.is_file():
        return {}
    table = np.loadtxt(SIZES, delimiter=",", skiprows=1, ndmin=2)
    trials = dict[int, tuple[SizeRuns, SizeRuns, SizeRuns]]()
    for number in np.unique(table[:, 0]):
        of = table[table[:, 0] == number]
        fine, own, coarse = (SizeRuns(radius, of[of[:, 1] == radius, 3:]) for radius in np.unique(of[:, 1]))
        trials[int(number)] = fine, own, coarse
    return trials


class _Judged(NamedTuple):
    off_mm: float  # Mean level, real less predicted
    half_mm: float  # Half of its 95 % interval
    stations: float  # Share of the places in their bands
    whole: bool  # True if the whole profile is in its band
    rms_mm: float


def _rows(numbers: Sequence[int]) -> Iterator[Row]:
    judged: dict[str, list[_Judged]] = {name: [] for name in REALITIES}
    for number in numbers:
        with tempfile.TemporaryDirectory() as place:
            one = measured(JUDGED_SEED, number, Path(place))
            draws = draw(one.base, Path(place, "draws"), 0, Progress(), DRAWS)
        fine, own, coarse = _kept()[number]
        simulated = Profile(STATIONS_MM, own.levels_mm[0], data="synthetic", source="simulation")
        spread = Spread(STATIONS_MM, (fine, own, coarse), (), None, None, draws)
        ends = BedEnds.of(one.base.sample.trajectory, one.base.run)
        band = predict(simulated, spread, one.base.trial.uncertainty, ends=ends)
        assert band is not None
        yield Row(f"trial {number}: half of the command's band, median", float(np.median(band.band_95_mm)), "mm")
        for name, reality in REALITIES.items():
            judged[name].append(_judge(one, number, band, reality))
        last = {name: f"{each[-1].off_mm:+.2f} ({each[-1].half_mm:.2f})" for name, each in judged.items()}
        print(f"trial {number}: mean level off by (half of its interval), mm: {last}", flush=True)
    for name, trials in judged.items():
        yield from _figures(name, trials, REALITIES[name])


def _judge(one: Measured, number: int, band: PredictedLevel, reality: Reality) -> _Judged:
    real_mm = finished(JUDGED_SEED)[number]["real_mm"]
    moved_mm = np.zeros(len(PLACES_MM))
    if reality.world is not None:
        bed = second_reality(one, reality.world)
        real_mm = bed.at(STATIONS_MM)
        moved_mm = _moved_mm(one, reality, bed.volume_mm3)
    real_mm = np.interp(PLACES_MM, STATIONS_MM, real_mm)
    predicted_mm, half_mm, profile_mm = (
        np.interp(PLACES_MM, band.s_mm, values) for values in (band.level_mm, band.band_95_mm, band.profile_band_95_mm)
    )
    off_mm = real_mm - predicted_mm - moved_mm
    low_mm, high_mm = band.mean_level_95_mm
    return _Judged(
        float(off_mm.mean()),
        (high_mm - low_mm) / 2,
        float(np.mean(np.abs(off_mm) <= half_mm)),
        bool((np.abs(off_mm) <= profile_mm).all()),
        float(np.sqrt(np.mean(off_mm**2))),
    )


def _moved_mm(one: Measured, reality: Reality, arrived_mm3: float) -> Floats:
    """Return by how much measurements of the pour move the prediction, by the fast model."""
    base, steps = one.base, dict[str, float]()
    if reality.weighed:
        steps["volume_ml"] = (arrived_mm3 - base.sample.trajectory.dispensed_mm3) / 1e3
    if reality.strips:
        steps["wall_share"] = 0.5 - base.wall_share
    if not steps:
        return np.zeros(len(PLACES_MM))
    return level_of(base, steps, PLACES_MM) - level_of(base, {}, PLACES_MM)


def second_reality(one: Measured, world: World) -> Any:
    """Pour the true inputs of a trial in the second reality."""
    return poured(*true_inputs(one.real, one), world, Numerics(settle_s=SETTLE_S))


def true_inputs(real: Sample, one: Measured) -> tuple[Cavity, Paste, Pour]:
    outline, trajectory, truth = real.outline, real.trajectory, one.truth
    s_mm, ones = outline.s_mm, np.ones(len(outline.s_mm))
    # Walls that flare: the traced width is that of the floor.
    mouth_mm = outline.width_mm + 2 * truth.depth_mm * np.tan(np.radians(truth.angle_deg))
    cavity = Cavity(s_mm, mouth_mm, truth.depth_mm * ones, truth.angle_deg * ones, truth.angle_deg * ones)
    fluid = one.real_fluid
    paste = Paste(fluid["density_kg_m3"], fluid["yield_stress_pa"], fluid["viscosity_pa_s"])
    # A waypoint's flow holds until the next one.
    at_s, flow = trajectory.t_s, trajectory.flow_mm3_s
    times, given = np.repeat(at_s, 2)[1:-1], np.repeat(flow[:-1], 2)
    return cavity, paste, Pour(at_s, trajectory.s_mm, times, given, one.base.trial.nozzle.diameter_mm)


def _figures(name: str, trials: Sequence[_Judged], reality: Reality) -> Iterator[Row]:
    count, judged = len(trials), reality.least_stations > 0
    least = LEAST / 20 * count if judged else 0.0
    off_mm, half_mm = (np.array([getattr(one, key) for one in trials]) for key in ("off_mm", "half_mm"))
    stations = 100 * float(np.mean([one.stations for one in trials]))
    yield Row(f"{name}: mean levels in their intervals, of {count}", int((np.abs(off_mm) <= half_mm).sum()), "", least)
    yield Row(f"{name}: whole profiles in their bands", sum(one.whole for one in trials), "", least)
    yield Row(f"{name}: places in their bands", stations, "%", reality.least_stations)
    yield Row(f"{name}: mean level off by, mean of the trials", float(off_mm.mean()), "mm")
    if count > 1:
        wide = float(np.median(half_mm) / (1.96 * off_mm.std(ddof=1)))
        most = WIDEST if reality.world is None else np.inf
        yield Row(f"{name}: half of a mean level's interval over 1.96 sd of the errors", wide, "", 0, most)
    yield Row(f"{name}: half of a mean level's interval, median", float(np.median(half_mm)), "mm")
    yield Row(f"{name}: level off by, RMS", float(np.sqrt(np.mean([one.rms_mm**2 for one in trials]))), "mm")


if __name__ == "__main__":
    run_benchmark(main)
