"""Flow through any section of a slot by its gradient: a table of the finite elements, or a closed form.

    python -m benchmarks.reality.law        (solves the laws that are kept in laws.json anew; some minutes)

Units of this module: the section's width at its free surface, the gradient times that width, and the consistency.
"""

import json
from functools import lru_cache
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from benchmarks.reality.section import Floats, Section, Solid, flows
from benchmarks.reality.yielding import yield_gradient

KEPT = Path(__file__).parent / "laws.json"
LAWS = ((1.0, 1.0, inf), (1.0, 0.5, 1.0 / 3.0))
"""Exponent, wall share and wall friction of the laws that the worlds need."""
DEPTHS = np.geomspace(0.06, 9.0, 7)
NARROWINGS = np.array([-0.4, -0.15, 0.0, 0.15, 0.35, 0.6, 0.8, 0.95])
YIELDS = np.array([0.0, 0.15, 0.3, 0.5, 0.7, 0.88])
"""Nodes of the table: depth over width, part of the width lost, and yield gradient over gradient."""


class Law(NamedTuple):
    """Flow = scale of the section x Newtonian part x yielding part; the last two are tables without kinks."""

    exponent: float
    wall_share: float
    floor_share: float
    power: float
    """Power of (1 - yield gradient / gradient) with which flow sets in: 1 + 1/n without slip, 1/n with slip."""
    log_depth: Floats
    narrowing: Floats
    yielded: Floats
    newtonian: Floats
    """(flow without yield stress / scale)^n by depth and narrowing."""
    yielding: Floats
    """(flow / flow without yield stress)^(1 / power) by depth, narrowing and yield gradient over gradient."""


def closed_law(exponent: float = 1.0, *, walls: bool, floor: bool) -> Law:
    """Return the law of two plates (walls alone), of a wide sheet (floor alone), or a blend of both for quick tests.

    Mean speed over that without yield stress: (1 - y)^(1 + 1/n) (1 + n y / (n + 1)); Bird, Dai and Yarusso (1983).
    """
    yielded = np.linspace(0.0, 1.0, 101)
    power = 1.0 + 1.0 / exponent
    curve = (1.0 - yielded) * (1.0 + exponent * yielded / (exponent + 1.0)) ** (1.0 / power)
    return Law(
        exponent=exponent,
        wall_share=float(walls),
        floor_share=float(floor),
        power=power,
        log_depth=np.array([0.0, 1.0]),
        narrowing=np.array([0.0, 1.0]),
        yielded=yielded,
        newtonian=np.ones((2, 2)),
        yielding=np.broadcast_to(curve, (2, 2, len(yielded))).copy(),
    )


@lru_cache(maxsize=16)
def resolved_law(exponent: float = 1.0, wall_share: float = 1.0, wall_friction: float = inf) -> Law:
    """Return the law of sections that are solved in two dimensions; a minute, unless it is one of those kept in a file.

    Between the nodes the two tables are cubics without overshoot, and are then read linearly from a finer grid.
    """
    kept = json.loads(KEPT.read_text(encoding="utf-8"))
    name = _name(exponent, wall_share, wall_friction)
    tables = kept[name] if name in kept else solved(exponent, wall_share, wall_friction)
    newtonian, yielding = np.array(tables["newtonian"]), np.array(tables["yielding"])
    nodes = (np.log(DEPTHS), NARROWINGS, np.append(YIELDS, 1.0))
    fine = tuple(np.linspace(axis[0], axis[-1], count) for axis, count in zip(nodes, (25, 28, 41), strict=True))
    for number, (axis, more) in enumerate(zip(nodes, fine, strict=True)):
        newtonian = PchipInterpolator(axis, newtonian, axis=number)(more) if number < 2 else newtonian
        yielding = PchipInterpolator(axis, yielding, axis=number)(more)
    power = _power(exponent, wall_friction)
    return Law(exponent, wall_share, wall_share, power, fine[0], fine[1], fine[2], newtonian, yielding)


def solved(exponent: float, wall_share: float, wall_friction: float) -> dict[str, Any]:
    """Return both tables at their nodes."""
    solid, power = Solid(wall_share, wall_friction), _power(exponent, wall_friction)
    newtonian = np.empty((len(DEPTHS), len(NARROWINGS)))
    yielding = np.zeros((*newtonian.shape, len(YIELDS) + 1))
    for i, depth in enumerate(DEPTHS):
        for j, narrowing in enumerate(NARROWINGS):
            least = yield_gradient(depth, narrowing, wall_share, wall_share)
            flow = flows(Section(depth, narrowing), YIELDS / least, exponent, solid)
            newtonian[i, j] = (flow[0] / scale(depth, narrowing, exponent, 1.0, 1.0)) ** exponent
            yielding[i, j, :-1] = (np.maximum(flow, 0.0) / flow[0]) ** (1.0 / power)
    return {"newtonian": newtonian.round(6).tolist(), "yielding": yielding.round(6).tolist()}


def _power(exponent: float, wall_friction: float) -> float:
    return 1.0 / exponent + (1.0 if wall_friction == inf else 0.0)


def _name(exponent: float, wall_share: float, wall_friction: float) -> str:
    return f"n {exponent:g}, wall share {wall_share:g}, wall friction {wall_friction:.6g}"


def scale(
    depth: Floats | float, narrowing: Floats | float, exponent: float, walls: float, floor: float
) -> Floats | float:
    """Return the flow of a power law if the gradients that plates and sheet need are added; each is exact alone."""
    power = 2.0 + 1.0 / exponent
    plates = depth * exponent / (2.0 * (2.0 * exponent + 1.0)) * 0.5 ** (1.0 / exponent)
    narrows = np.abs(narrowing) > 1e-6
    lost = np.where(narrows, narrowing, 1.0)
    plates *= np.where(narrows, (1.0 - (1.0 - lost) ** (power + 1.0)) / ((power + 1.0) * lost), 1.0)
    sheet = exponent / (2.0 * exponent + 1.0) * depth**power * (1.0 - 0.5 * narrowing)
    if floor == 0.0:
        return plates
    if walls == 0.0:
        return sheet
    return (plates**-exponent + sheet**-exponent) ** (-1.0 / exponent)


def flow_of(
    law: Law, depth: Floats | float, narrowing: Floats | float, yield_over_gradient: Floats
) -> tuple[Floats, Floats]:
    """Return the flow of sections, and the power of the gradient with which it grows there.

    ``yield_over_gradient``: yield stress over gradient and width.
    """
    y = yield_over_gradient * yield_gradient(depth, narrowing, law.wall_share, law.floor_share)
    i, a = _between(law.log_depth, np.log(depth))
    j, b = _between(law.narrowing, narrowing)
    k, c = _between(law.yielded, y)
    newtonian, low, high = 0.0, 0.0, 0.0
    for one in range(2):
        for two in range(2):
            weight = (a if one else 1.0 - a) * (b if two else 1.0 - b)
            newtonian = newtonian + weight * law.newtonian[i + one, j + two]
            low = low + weight * law.yielding[i + one, j + two, k]
            high = high + weight * law.yielding[i + one, j + two, k + 1]
    yielding = (1.0 - c) * low + c * high
    falling = (low - high) / (law.yielded[1] - law.yielded[0])
    size = scale(depth, narrowing, law.exponent, law.wall_share, law.floor_share)
    flow = size * newtonian ** (1.0 / law.exponent) * yielding**law.power
    growth = 1.0 / law.exponent + law.power * y * falling / np.maximum(yielding, 1e-300)
    moves = (y < 1.0) & (yielding > 0.0)
    return np.where(moves, flow, 0.0), np.where(moves, growth, 0.0)


def _between(grid: Floats, value: Floats | float) -> tuple[NDArray[np.intp], Floats]:
    """Return the interval of an even grid and the place in it; a value outside is taken at the grid's end."""
    place = np.clip((value - grid[0]) / (grid[1] - grid[0]), 0.0, len(grid) - 1.0)
    index = np.minimum(place.astype(np.intp), len(grid) - 2)
    return index, place - index


if __name__ == "__main__":
    laws = {_name(*law): solved(*law) for law in LAWS}
    KEPT.write_text(json.dumps(laws) + "\n", encoding="utf-8")
