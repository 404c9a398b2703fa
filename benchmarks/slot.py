"""The fast model of the fill against particles, on forty slots drawn after it was chosen, and its time.

    python -m benchmarks.slot

The level by particles is the mean over the two seeds that ``benchmarks.slot_cases`` ran; a case without both of them is
not judged, and the table says how many are. Differences are taken every 0.5 mm of the whole slot, and away from the
path's start and from its head. No constant of the model is fitted to these runs: mound and crown are those of plastic
soil, and the friction that it shares with particles is that of shear waves.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.slot_cases import LENGTH_MM, SEEDS, STATIONS_MM, TRIM_MM, Case, drawn, kept_levels_mm
from benchmarks.table import Row, rms, run_benchmark
from sealtwin.core.records import Floats

AWAY_MM = 8.0
MIDDLE = (STATIONS_MM >= TRIM_MM + AWAY_MM) & (STATIONS_MM <= LENGTH_MM - TRIM_MM - AWAY_MM)
"""Stations 8 mm and more from where the nozzle starts and from where it stops."""
LEFT = "particles were not run for the others, or twice the same run; python -m benchmarks.slot_cases goes on with them"


@dataclass(frozen=True)
class Judged:
    """A case beside its particles."""

    number: int
    fits: bool
    off_mm: Floats  # Level of the fast model less that of the particles, at ``STATIONS_MM``
    seeds_mm: float  # RMS of the levels of particles with two seeds

    @property
    def rms_mm(self) -> float:
        return rms(self.off_mm)

    @property
    def middle_mm(self) -> float:
        """The same away from start and head."""
        return rms(self.off_mm[MIDDLE])


def judge(cases: Sequence[Case], **paste: float) -> list[Judged]:
    """Judge the cases that both seeds of particles were run for; ``paste`` changes their sealant.

    Two runs that are copies of one count as one seed.
    """
    judged, kept = [], kept_levels_mm()
    for number, case in enumerate(cases):
        runs = [kept[number, seed] for seed in SEEDS if (number, seed) in kept]
        if len(runs) == len(SEEDS) and not np.array_equal(runs[0], runs[1]):
            bed = case.filled(**paste)
            off_mm = np.interp(STATIONS_MM, bed.sections.s_mm, bed.level_mm) - np.mean(runs, axis=0)
            judged.append(Judged(number, not case.fitness.unfit, off_mm, rms(runs[0] - runs[1])))
    return judged


def accuracy(cases: Sequence[Case], judged: Sequence[Judged]) -> list[Row]:
    """The figures inside the domain, and how far off the model is outside, where it says so."""
    inside, outside = ([one for one in judged if one.fits is fits] for fits in (True, False))
    whole_mm, middle_mm = [one.rms_mm for one in inside], [one.middle_mm for one in inside]
    fit = sum(not case.fitness.unfit for case in cases)
    alone_mm = [one.rms_mm for one in judge(cases, friction=0.0) if one.fits]
    worse_mm = [one.rms_mm for one in outside]
    rows = [
        Row("fresh: drawn cases that the model calls fit, share", fit / len(cases), "", 1 / 3, 1.0, "1/2"),
        Row("fresh: fit cases judged at both seeds", len(inside), "", fit, fit, "all", because=LEFT),
        Row("fresh, fit: RMS, median", _quantile(whole_mm, 0.5), "mm", 0, 0.45, "0.3"),
        Row("fresh, fit: RMS, 90 % of the cases", _quantile(whole_mm, 0.9), "mm", 0, 0.75, "0.5"),
        Row("fresh, fit: RMS away from start and head, median", _quantile(middle_mm, 0.5), "mm", 0, 0.4, "0.3"),
        Row("fresh, fit: RMS without particles' friction, median", _quantile(alone_mm, 0.5), "mm"),
        Row("fresh, fit: two seeds apart, RMS, median", _quantile([one.seeds_mm for one in inside], 0.5), "mm"),
        Row("fresh: unfit cases judged", len(outside), ""),
    ]
    if outside:
        rows.append(Row("fresh, unfit: RMS, median", _quantile(worse_mm, 0.5), "mm"))
        rows.append(Row("fresh, unfit: RMS, largest", max(worse_mm), "mm"))
    return rows


def _quantile(values: Sequence[float], share: float) -> float:
    return float(np.quantile(values, share)) if values else np.inf


def _time_s(case: Case) -> float:
    began = time.process_time()
    case.filled()
    return time.process_time() - began


def main() -> list[Row]:
    cases = drawn()
    judged = judge(cases)
    for one in judged:
        rms_mm = f"RMS {one.rms_mm:.2f} mm, away from start and head {one.middle_mm:.2f} mm"
        bias = f"bias {one.off_mm.mean():+.2f} mm, seeds {one.seeds_mm:.2f} mm"
        print(f"case {one.number:2d} {'fit  ' if one.fits else 'unfit'} {rms_mm}, {bias}")
    time_s = float(np.median([_time_s(case) for case in cases]))
    return [*accuracy(cases, judged), Row("processor time of a run, median", time_s, "s", 0, 0.2, "0.05")]


if __name__ == "__main__":
    run_benchmark(main)
