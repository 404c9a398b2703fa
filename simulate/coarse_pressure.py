"""The pressure on two levels: what each particle needs of its own, and what the crack as a whole needs.

Plain iterations hand a pressure on by about a neighbour each, so that a few of them leave a deep column compressed as
if it stood on springs. Here every iteration solves for the smooth part of all multipliers too (``kernels_coarse``).
"""

import math
from typing import Any

import numpy as np
import warp as wp

from sealtwin.records import Floats
from simulate import kernels_coarse as device_code
from simulate.launch import Launcher
from simulate.movers import MoversList
from simulate.state import State
from simulate.stations import map_stations

SPACING = 2.0
"""Of nodes over h: with 1.25 or 1.6 the densest hundredth of a column at rest is denser by 2.0 to 2.2 %, for 1.7."""
OUTSIDE = 0.25
"""Of a spacing, how far beyond the floor and the crack's first end the nearest nodes lie: with 0.75 it is 2.0 % again,
since what lies on the floor counts for little on either side of it.
"""
STEP = 0.6
"""Of a particle's own Jacobi step: at 1 the surface of a fluid that drags nowhere dances (3 cm/s)."""
SWEEPS, OVERSHOOT = 8, 1.5
"""Of the over-relaxation: two sweeps or twenty settle a column alike."""
LEAST_WEIGHT = 3.0
"""Particles: nodes that carry less hold spray (prototype)."""
AT_ONCE = 0.5
"""Of the compression that the last substep left. With all of it at once a surface that was hit never calms: 1 to 2
cm/s go on where 0.7 are left.
"""
LANES = 256
"""Threads that share a run's nodes on a GPU: a block of Warp's."""


class CoarsePressure:
    """Finds the changes of all movers' multipliers, for all runs at once; each is solved as if it were alone."""

    def __init__(
        self,
        state: State,
        movers: MoversList,
        launcher: Launcher,
        centreline: Floats,
        low: Floats,
        high: Floats,
        *,
        floor: float,
        rows: int,
        support: float,
    ) -> None:
        """``centreline``, (n, 2), the box from ``low`` to ``high`` and the height of the ``floor`` are in cm."""
        device = state.device
        self._state, self._movers, self._launch, self._rows = state, movers, launcher, rows
        self._stations, reach = map_stations(centreline, low[:2], high[:2], support, device)
        self._nodes = _lattice(reach, floor, high[2], SPACING * support, device)
        self._lanes = 1 if device == "cpu" else LANES
        count = state.runs * self._nodes.a_run

        def by(many: int, dtype: Any) -> Any:
            return wp.zeros(many, dtype=dtype, device=device)

        self._spot = device_code.Spot()
        self._spot.node, self._spot.part, self._spot.along = by(rows, int), by(rows, wp.vec2), by(rows, wp.vec2)
        self._old, self._multiplier = by(rows, float), by(rows, float)
        self.slope, self.yielding = by(rows, wp.vec4), by(rows, float)
        """By row, from ``measure_terms``: own gradient and share in the nodes' multipliers; dx for C is that times."""
        self._sums = wp.zeros((count, int(device_code.SUMS)), dtype=wp.int64, device=device)
        self._excess = by(count, wp.int64)
        self._matrix = wp.zeros((count, int(device_code.WEIGHT)), dtype=float, device=device)
        self._right, self._change, self._total = by(count, float), by(count, float), by(count, float)

    def begin(self, rows: int) -> None:
        """A substep, after the prediction."""
        state = self._state
        self._total.zero_()
        self._launch.rows(
            "locate",
            device_code.locate,
            rows,
            self._movers.movers,
            state.points_a_run,
            self._stations,
            self._nodes,
            state.place,
            state.density,
            self._spot,
            self._old,
            self._multiplier,
        )

    def change(self, iteration: int, rows: int) -> None:
        """Leave each mover's change of multiplier with its place; iterations count from 0, densities are known."""
        state, spot = self._state, self._spot
        movers, nodes = self._movers.movers, self._nodes
        if iteration == 0:
            # Places change too little in a substep to tell.
            self._sums.zero_()
            self._whole("matrix", device_code.sum_matrix, movers, nodes, spot, self.slope, self._old, self._sums)
        self._whole("excess", device_code.sum_excess, movers, nodes, spot, self.slope, state.density, self._excess)
        self._launch.all(
            "nodes",
            device_code.solve,
            (state.runs, self._lanes),
            nodes,
            self._lanes,
            SWEEPS,
            OVERSHOOT,
            LEAST_WEIGHT,
            AT_ONCE,
            self._sums,
            self._excess,
            self._matrix,
            self._right,
            self._change,
            self._total,
        )
        self._launch.rows(
            f"multipliers {iteration}",
            device_code.change_multipliers,
            rows,
            movers,
            nodes,
            spot,
            float(iteration + 1),
            STEP,
            state.density,
            self.slope,
            self.yielding,
            self._change,
            self._multiplier,
            state.place,
        )

    def _whole(self, name: str, kernel: Any, *inputs: object) -> None:
        """Sums into nodes in one piece: on a CPU two threads must not add to one of them."""
        self._launch.all(name, kernel, self._rows, *inputs)


def _lattice(stations: Floats, floor: float, top: float, spacing: float, device: str) -> Any:
    """Nodes around arc lengths, (2,), and from ``floor`` to ``top``; an even number each way, for the colours."""
    before = math.ceil(max(0.0, -stations[0] / spacing - OUTSIDE))
    # Nobody touches the outermost ones.
    low = np.array([0.0, floor]) - (OUTSIDE + 1) * spacing - np.array([before * spacing, 0.0])
    count = [
        2 * math.ceil(((end - begin) / spacing + 3) / 2) for begin, end in zip(low, (stations[1], top), strict=True)
    ]
    number = np.arange(count[0] * count[1]).reshape(count)
    colours = [number[a::2, b::2].ravel() for a in (0, 1) for b in (0, 1)]
    nodes = device_code.Nodes()
    nodes.low, nodes.spacing = wp.vec2(*low), spacing
    nodes.count, nodes.a_run = wp.vec2i(*count), number.size
    nodes.by_colour = wp.array(np.concatenate(colours), dtype=int, device=device)
    return nodes
