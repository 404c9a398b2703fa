"""The band of ``sealtwin validate --uncertainty`` on trials of the blind prediction: EMULATED, reported, not judged.

    python -m benchmarks.blind_own_band [--trials 3 --trials 17 ...]

``benchmarks.blind_prediction`` judges a band whose numerics are one number, the same for all trials. The command takes
them from three runs at each of three particle sizes. This benchmark makes those runs and 1,000 draws of the fast model,
and reports the band that the command would give. It has no part by readings. A minute of one core a trial, of which
there are twenty.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks import slumps
from benchmarks.blind_cases import JUDGED_SEED, STATIONS_MM, finished, level_mm
from benchmarks.blind_measured import Measured, measured
from benchmarks.table import Row, run_benchmark
from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile
from sealtwin.study.drawn_runs import draw
from sealtwin.study.extra_runs import RATIO, REPLICATES
from validate.uncertainty.computed import SizeRuns, Spread
from validate.uncertainty.validation import predict


def bands(number: int) -> Iterator[Row]:
    """Half of the band of a trial and its part by the numerics, in the median along the crack."""
    with tempfile.TemporaryDirectory() as place:
        one = measured(JUDGED_SEED, number, Path(place))
        draws = draw(one.base, Path(place, "draws"), 0, Progress())
    fine, own, coarse = (sized(one, factor) for factor in (1 / RATIO, 1.0, RATIO))
    simulated = Profile(STATIONS_MM, own.levels_mm[0], data="synthetic", source="simulation")
    level = predict(
        simulated, Spread(STATIONS_MM, (fine, own, coarse), (), None, None, draws), one.base.trial.uncertainty
    )
    assert level is not None
    assert level.numerics_mm is not None
    yield Row(f"trial {number}: half of the command's band, median", float(np.median(level.band_95_mm)), "mm")
    yield Row(f"trial {number}: the same by numerics alone", 2 * float(np.median(level.numerics_mm)), "mm")


def sized(one: Measured, factor: float) -> SizeRuns:
    """Return levels by particles of ``factor`` times the size, for the measured values and several seeds."""
    trial = one.base.trial
    assert trial.fluid is not None
    solver = trial.solver.model_copy(update={"radius_mm": factor * trial.solver.size_mm})
    levels_mm = [level_mm(one.base.sample, trial.fluid, solver, one, seed=seed) for seed in range(REPLICATES)]
    return SizeRuns(solver.size_mm, np.array(levels_mm))


def main(
    trials: Annotated[
        list[int] | None, Option(help="number of a judged trial; may be given again; default: all")
    ] = None,
) -> list[Row]:
    judged = sorted(finished(JUDGED_SEED))
    # Trials are emulated by them: they come first.
    slumps.KEPT.require()
    rows = [row for number in trials or judged for row in bands(number)]
    halves_mm = [row.value for row in rows[::2]]
    return [*rows, Row("half of the command's band, median of the trials", float(np.median(halves_mm)), "mm")]


if __name__ == "__main__":
    run_benchmark(main)
