"""What a draft costs in physics, volume, channels, sleep and heaps: accurate, draft, and the target of the accurate.

    python -m benchmarks.draft_physics [--only physics|volume|channels|sleep|heaps]

The cases are those of the benchmarks with these names, called as they call them, and called again for drafts: larger
particles, substeps 1.3 to 1.5 times as long, shear rates once in two of them (``physics_tanks.resolution``). In slots
of 3.1 mm a draft has R = 0.6 mm, as in the paper's crack. Drafts have no target but one: no particle goes into a wall,
and every figure is a number. All take six minutes of one core.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from math import isfinite
from typing import Annotated, Any
from unittest.mock import patch

from benchmarks import channels, heaps, physics, sleep, volume
from benchmarks.physics_tanks import DRAFT, Tank
from benchmarks.table import Row, leave, one_of, run_benchmark

WALLS = "in the walls"
BEDS = (("deep", "12 Pa"), ("deep", "30 Pa"), ("deep", "freezing"), ("wide", "12 Pa"), ("wide", "Newtonian"))
BED = "R 0.4 mm, local, {}, {}"
CHOSEN: dict[str, list[tuple[Callable[..., Iterable[Row]], list[str]]]] = {
    "physics": [
        (physics.CASES["hydrostatic"], [f"column, 4 substeps, local: {figure}" for figure in ("level", "floor comp")]),
        (physics.CASES["dam_break"], ["dam, let go at once: front off potential flow"]),
        (physics.CASES["sloshing"], ["sloshing, 80 x 16 mm: frequency"]),
        (physics.CASES["drop"], ["drop from 16 mm: time", f"drop from 16 mm: particles {WALLS}"]),
        (physics.CASES["slot_current"], ["slot current: exponent", "slot current: front over theory"]),
    ],
    "volume": [
        (partial(volume.rows_of, 0.4, "local", *bed), [f"{BED.format(*bed)}: kept", f"{BED.format(*bed)}: {WALLS}"])
        for bed in BEDS
    ],
    "channels": [
        (channels.CASES["channel"], [f"32 mm2/s, {across} across" for across in (4, 5, 8)]),
        (channels.CASES["thin"], ["3 mm2/s, R 0.4"]),
        (
            channels.CASES["bingham"],
            [*(f"Bingham, {share} of the walls' stress, R 0.4" for share in (0.2, 0.5, 0.8)), "Bingham, 1.2 of it"],
        ),
    ],
    "sleep": [
        (physics.CASES["drift"], ["12 Pa, drift in 10 s, asleep"]),
        (partial(sleep.rows_of, "wide"), ["wide: levels with sleep off those without, RMS"]),
    ],
    "heaps": [
        (physics.CASES["banks"], [f"bank of {stress} Pa, R 0.5 mm, local" for stress in (5, 9)]),
        (
            partial(heaps.course_rows, 12.0),
            [f"12 Pa, R 0.4 mm: {figure}" for figure in ("time of half", "height after 0.5 s", "tan", "at rest")],
        ),
    ],
}
"""Cases by field, and how the names of their chosen figures begin, in the order in which a case has them."""


def main(only: Annotated[str | None, one_of(CHOSEN)] = None) -> list[Row]:
    print(f"{'figure':<66} {'accurate':>9} {'draft':>9} {'unit':<6} target of accurate", flush=True)
    rows: list[Row] = []
    for field in [only] if only else CHOSEN:
        for case, names in CHOSEN[field]:
            rows += _rows(case, names)
    unsound = [row.name for row in rows if not isfinite(row.value) or (WALLS in row.name and row.value > 0)]
    print(f"no numbers, or particles {WALLS}: {', '.join(unsound) or 'none'}")
    return [*rows, Row(f"drafts: figures that are no numbers, or particles {WALLS}", len(unsound), "", 0, 0, "0")]


def _rows(case: Callable[..., Iterable[Row]], names: list[str]) -> Iterator[Row]:
    began_s = time.process_time()
    accurate = _figures(case(), names)
    half_s, tanks = time.process_time(), list[Tank]()
    with patch.object(Tank, "run", _watched(tanks)):
        draft = _figures(case(preset=DRAFT), names)
    ended_s = time.process_time()
    for one, other in zip(accurate, draft, strict=True):
        print(f"{one.name:<66} {one.value:>9.4g} {other.value:>9.4g} {one.unit:<6} {one.target}")
        yield Row(f"{one.name}, draft", other.value, one.unit, goal=f"{one.value:.4g} accurate, {one.target}")
    if tanks:
        yield Row(f"{names[0]}, draft: particles {WALLS}, all tanks", sum(tank.leaked() for tank in tanks), "")
    print(f"    {half_s - began_s:.0f} and {ended_s - half_s:.0f} CPU s", flush=True)


def _figures(rows: Iterable[Row], names: list[str]) -> list[Row]:
    """Return the rows whose names begin so. What a case computes after the last of them is left out."""
    each = iter(rows)
    return [next(row for row in each if row.name.startswith(name)) for name in names]


def _watched(tanks: list[Tank]) -> Callable[..., Iterator[float]]:
    """Return ``Tank.run``, which also lists the tanks that it ran."""
    run = Tank.run

    def runs(tank: Tank, *inputs: Any) -> Iterator[float]:
        tanks.append(tank)
        return run(tank, *inputs)

    return runs


if __name__ == "__main__":
    run_benchmark(main, leave)
