"""The yield stress that just holds a heap of paste in a slot: limit analysis, which knows no time and no viscosity.

A heap flows if any motion frees more of its weight than a yield stress takes up (von Mises, in plane strain). The
motion moves the paste between the walls as a plug: at a yield stress, shear within would cost as much as at the walls
and move less. It is a stream function on a square lattice, zero at the end wall and the floor. The largest ratio of
both rates is the yield stress that holds the heap; it is found by least squares whose weights are renewed.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from sealtwin.core.records import Floats, Integers

ROUNDS = 60
SECOND = np.array([[0, 0, 0, 0], [1, -2, 1, 0], [0, 1, -2, 1], [0.5, -0.5, -0.5, 0.5]])
"""Second difference in a cell, of the nodes from one before it to one after: beside it lies no cell, one, both."""


def holding_pa(x_mm: Floats, level_mm: Floats, width_mm: float, weight_n_m3: float, cell_mm: float = 0.5) -> float:
    """Yield stress that holds a heap with that surface against the end wall of a slot.

    ``weight_n_m3`` is density times gravity.
    """
    along = np.arange(cell_mm / 2, x_mm[-1], cell_mm)
    high = np.round(np.interp(along, x_mm, level_mm) / cell_mm).astype(int)
    length = int(np.flatnonzero(high).max()) + 1
    inside = np.zeros((length + 2, int(high.max()) + 2), dtype=bool)
    # A rim of no cells all around: what cell i, j has for neighbours is at hand.
    inside[1:-1, 1:-1] = np.arange(int(high.max())) < high[:length, None]
    i, j = np.nonzero(inside)
    nodes = np.arange((length + 4) * (int(high.max()) + 4)).reshape(length + 4, -1)

    def difference(terms: Sequence[tuple[int, int, Any]], at: tuple[Integers, Integers] = (i, j)) -> Any:
        """Sum of coefficient times node, off each cell's own lowest corner."""
        columns = np.concatenate([nodes[at[0] + dx, at[1] + dz] for dx, dz, _ in terms])
        values = np.concatenate([np.broadcast_to(np.asarray(value, dtype=float), at[0].shape) for *_, value in terms])
        return sp.csr_matrix((values, (np.tile(np.arange(len(at[0])), len(terms)), columns)), (len(at[0]), nodes.size))

    down = difference([(0, 0, -0.5), (0, 1, -0.5), (1, 0, 0.5), (1, 1, 0.5)]) / cell_mm
    outwards = difference([(0, 0, -0.5), (1, 0, -0.5), (0, 1, 0.5), (1, 1, 0.5)]) / cell_mm
    stretch = difference([(0, 0, 2), (1, 0, -2), (0, 1, -2), (1, 1, 2)]) / cell_mm**2
    by_z = SECOND[inside[i, j - 1] + 2 * inside[i, j + 1]] / 2
    by_x = SECOND[inside[i - 1, j] + 2 * inside[i + 1, j]] / 2
    shear = [(side, step - 1, by_z[:, step]) for side in (0, 1) for step in range(4)]
    shear += [(step - 1, side, -by_x[:, step]) for side in (0, 1) for step in range(4)]
    floor, end = np.flatnonzero(j == 1), np.flatnonzero(i == 1)
    none = sp.csr_matrix((len(floor) + len(end), nodes.size))
    slips = sp.vstack(
        [
            difference([(0, 1, 0.5), (1, 1, 0.5)], (i[floor], j[floor])) / cell_mm,
            difference([(1, 0, 0.5), (1, 1, 0.5)], (i[end], j[end])) / cell_mm,
        ]
    )
    # What a yield stress of 1 takes up: at both walls, within, at floor and end.
    cost = np.concatenate(
        [
            np.full(len(i), 2 / width_mm * cell_mm**2),
            np.full(len(i), cell_mm**2),
            np.full(len(floor) + len(end), cell_mm),
        ]
    )
    # Cells stand for themselves and their corners: those on floor and end wall, and far from the heap, do not move.
    corners = np.zeros(nodes.shape, dtype=bool)
    for dx, dz in ((0, 0), (0, 1), (1, 0), (1, 1)):
        corners[i + dx, j + dz] = True
    corners[1], corners[:, 1] = False, False
    free = np.flatnonzero(corners)
    parts = [
        sp.csr_matrix(part)[:, free]
        for part in (
            sp.vstack([down, stretch, slips]),
            sp.vstack([outwards, difference(shear) / cell_mm**2, none]),
        )
    ]
    freed = np.asarray(down[:, free].sum(axis=0)).ravel() * cell_mm**2
    return weight_n_m3 * 1e-3 * _largest(parts, cost, freed)


def _largest(parts: Sequence[Any], cost: Floats, freed: Floats) -> float:
    """Largest of freed . psi over cost . |parts psi|."""
    weight, best = cost.copy(), 0.0
    for turn in range(ROUNDS):
        matrix = sum(part.T @ sp.diags(weight) @ part for part in parts)
        psi = np.asarray(spsolve(sp.csc_matrix(matrix), freed), dtype=np.float64)
        rate = np.sqrt(sum((part @ psi) ** 2 for part in parts)) / (freed @ psi)
        best = max(best, 1 / float(cost @ rate))
        weight = cost / np.hypot(rate, 1e-4 * rate.max() * 0.3 ** min(turn / 8, 8))
    return best
