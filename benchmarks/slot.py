"""The fast model of the fill against particles, on forty slots drawn after it was chosen, and its time.

    python -m benchmarks.slot

The level by particles is the mean over the two seeds that ``benchmarks.slot_cases`` ran; a case without both of them is
not judged, and the table says how many are. Differences are taken every 0.5 mm of the whole slot. No constant of the
model is fitted to these runs: mound and crown are those of plastic soil, and the friction that it shares with particles
is that of shear waves.
"""

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.slot_cases import SEEDS, STATIONS_MM, Case, drawn, kept_levels_mm
from benchmarks.table import Row, rms, run_benchmark

LEFT = "particles were not run for the others, or twice the same run; python -m benchmarks.slot_cases goes on with them"


class Judged(NamedTuple):
    """A case beside its particles."""

    fits: bool
    rms_mm: float  # Of the level of the fast model less that of the particles
    seeds_mm: float  # RMS of the levels of particles with two seeds


def judge(cases: Sequence[Case]) -> list[Judged]:
    """Judge the cases that both seeds of particles were run for. Two runs that are copies of one count as one seed."""
    judged, kept = [], kept_levels_mm()
    for number, case in enumerate(cases):
        runs = [kept[number, seed] for seed in SEEDS if (number, seed) in kept]
        if len(runs) == len(SEEDS) and not np.array_equal(runs[0], runs[1]):
            bed = case.filled()
            off_mm = np.interp(STATIONS_MM, bed.sections.s_mm, bed.level_mm) - np.mean(runs, axis=0)
            judged.append(Judged(not case.fitness.unfit, rms(off_mm), rms(runs[0] - runs[1])))
            print(f"case {number:2d}, bias {off_mm.mean():+.2f} mm: {judged[-1]}")
    return judged


def accuracy(cases: Sequence[Case], judged: Sequence[Judged]) -> list[Row]:
    """The figures inside the domain, and how far off the model is outside, where it says so."""
    inside, outside = ([case for case in judged if case.fits is fits] for fits in (True, False))
    fit = sum(not case.fitness.unfit for case in cases)
    fit_mm, unfit_mm = (np.array([case.rms_mm for case in some] or [np.inf]) for some in (inside, outside))
    seeds_mm = np.array([case.seeds_mm for case in inside] or [np.inf])
    return [
        Row("fresh: drawn cases that the model calls fit, share", fit / len(cases), "", 1 / 3, 1.0, "1/2"),
        Row("fresh: fit cases judged at both seeds", len(inside), "", fit, fit, "all", because=LEFT),
        Row("fresh, fit: RMS, median", float(np.median(fit_mm)), "mm", 0, 0.45, "0.3"),
        Row("fresh, fit: RMS, 90 % of the cases", float(np.quantile(fit_mm, 0.9)), "mm", 0, 0.75, "0.5"),
        Row("fresh, fit: two seeds apart, RMS, median", float(np.median(seeds_mm)), "mm"),
        Row("fresh: unfit cases judged", len(outside), ""),
        Row("fresh, unfit: RMS, median", float(np.median(unfit_mm)), "mm"),
        Row("fresh, unfit: RMS, largest", float(unfit_mm.max()), "mm"),
    ]


def _time_s(case: Case) -> float:
    began = time.process_time()
    case.filled()
    return time.process_time() - began


def main() -> list[Row]:
    cases = drawn()
    rows = accuracy(cases, judge(cases))
    time_s = float(np.median([_time_s(case) for case in cases]))
    return [*rows, Row("processor time of a run, median", time_s, "s", 0, 0.2, "0.05")]


if __name__ == "__main__":
    run_benchmark(main)
