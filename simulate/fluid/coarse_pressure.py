"""The pressure on two levels: each particle's own part, and a smooth part that is solved for in the whole crack.

Plain iterations spread a pressure by about one neighbour each, so that a few of them leave a deep column compressed as
if it stood on springs. Here every iteration solves for the smooth part of all multipliers too
(``kernels.coarse_pressure``).
"""

import math
from typing import Any

import numpy as np
import warp as wp
from scipy.spatial import KDTree

from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats
from simulate.fluid.launcher import Launcher
from simulate.fluid.state import State
from simulate.kernels import coarse_pressure as device_code

SPACING = 2.0
"""Spacing of nodes over h: with 1.25 or 1.6 the densest hundredth of a column at rest is too dense by 2.0 to 2.2 %,
for 1.7.
"""
OUTSIDE = 0.25
"""Distance of the nearest nodes beyond the floor and the crack's first end, over the spacing: with 0.75 it is 2.0 %
again, since particles on the floor count for little on either side of it.
"""
STEP = 0.6  # Share of a particle's own Jacobi step: at 1 the surface of a fluid without drag never calms (3 cm/s)
SWEEPS, OVERSHOOT = 3, 1.5  # Sweeps and factor of the over-relaxation: two sweeps or twenty settle a column alike
LEAST_WEIGHT = 3.0  # Particles that a node must carry: nodes with fewer hold spray (prototype)
AT_ONCE = 0.5
"""Share taken out at once of the compression that the last substep left. With all of it a surface that was hit never
calms: 1 to 2 cm/s persist where 0.7 are left.
"""
LANES = 256  # Threads that share a run's nodes on a GPU: a block


class CoarsePressure:
    """Changes all movers' multipliers, for all runs at once; each run is solved as if it were alone."""

    def __init__(
        self,
        state: State,
        launcher: Launcher,
        centreline: Floats,
        low: Floats,
        high: Floats,
        *,
        floor: float,
        rows: int,
        support: float,
        iterations: int,
    ) -> None:
        """``centreline``, (n, 2), the box from ``low`` to ``high`` and the height of the ``floor`` are in cm."""
        device = state.device
        arc, reach = map_arc_length(centreline, low[:2], high[:2], support, device)
        self.nodes = nodes = _lattice(reach, floor, high[2], SPACING * support, device)
        count = state.runs * nodes.per_run
        nodes.sums = wp.zeros((count, int(device_code.SUMS)), dtype=wp.int64, device=device)
        nodes.excess = wp.zeros(count, dtype=wp.int64, device=device)
        nodes.matrix = wp.zeros((count, int(device_code.WEIGHT)), dtype=float, device=device)
        for name in ("right", "change", "total"):
            setattr(nodes, name, wp.zeros(count, dtype=float, device=device))
        self.rows = coarse = device_code.CoarseRows()
        types = {"node": int, "part": wp.vec2, "along": wp.vec2, "slope": wp.vec4}
        for name in (*types, "old", "multiplier", "yielding", "compression"):
            setattr(coarse, name, wp.zeros(rows, dtype=types.get(name, float), device=device))

        lanes = 1 if device == "cpu" else LANES
        self._locate = launcher.bind(device_code.locate, state.particles, arc, nodes, coarse)
        # Sums into nodes are made in one piece: on a CPU two threads must not add to one of them.
        self._sum_matrix = launcher.bind_whole(device_code.sum_matrix, rows, state.particles, nodes, coarse)
        self._sum_excess = launcher.bind_whole(device_code.sum_excess, rows, state.particles, nodes, coarse)
        constants = (lanes, SWEEPS, OVERSHOOT, LEAST_WEIGHT, AT_ONCE)
        self._solve_first, self._solve_again = (
            launcher.bind_whole(device_code.solve, state.runs, nodes, summed, *constants, lanes=LANES)
            for summed in (True, False)
        )
        self._change_multipliers = [
            launcher.bind(device_code.change_multipliers, state.particles, nodes, coarse, float(iteration + 1), STEP)
            for iteration in range(iterations)
        ]

    def begin(self, rows: int) -> None:
        """Begin a substep, after the prediction."""
        self.nodes.total.zero_()
        self._locate(rows)

    def change(self, iteration: int, rows: int) -> None:
        """Store each mover's change of multiplier with its position; iterations count from 0, densities are known."""
        if iteration == 0:
            # In a substep positions change too little for another matrix.
            self.nodes.sums.zero_()
            self._sum_matrix()
        self._sum_excess()
        (self._solve_again if iteration else self._solve_first)()
        self._change_multipliers[iteration](rows)


def map_arc_length(centreline: Floats, low: Floats, high: Floats, spacing: float, device: str) -> tuple[Any, Floats]:
    """The arc-length map of the rectangle from ``low`` to ``high``, (2,) each, and its least and largest arc length.

    A position belongs to the nearest point of the centreline, (n, 2), whose first and last piece are extended. All in
    one unit. The direction is that of the line over ``spacing``, so that a traced line's roughness does not count.
    """
    pieces = max(1, math.ceil(arc_length(centreline)[-1] / (spacing / 2)))
    even = np.linspace(0.0, arc_length(centreline)[-1], pieces + 1)
    line = np.column_stack([np.interp(even, arc_length(centreline), column) for column in centreline.T])
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    count = np.ceil((high - low) / spacing).astype(int) + 1
    nodes = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1).reshape(-1, 2)
    position = low + spacing * nodes
    _, nearest = KDTree(line).query(position)
    s = even[nearest] + np.einsum("ij,ij->i", position - line[nearest], along[nearest])
    arc = device_code.ArcLengthMap()
    arc.corner, arc.spacing, arc.count = wp.vec2(*low), spacing, wp.vec2i(*map(int, count))
    arc.at = wp.array(np.column_stack([s, along[nearest]]), dtype=wp.vec3, device=device)
    return arc, np.array([s.min(), s.max()])


def _lattice(reach: Floats, floor: float, top: float, spacing: float, device: str) -> Any:
    """Nodes around the arc lengths of ``reach``, (2,), and from ``floor`` to ``top``; an even number each way."""
    before = math.ceil(max(0.0, -reach[0] / spacing - OUTSIDE))
    # No particle reaches the outermost nodes.
    low = np.array([0.0, floor]) - (OUTSIDE + 1) * spacing - np.array([before * spacing, 0.0])
    count = [2 * math.ceil(((end - begin) / spacing + 3) / 2) for begin, end in zip(low, (reach[1], top), strict=True)]
    number = np.arange(count[0] * count[1]).reshape(count)
    colours = [number[a::2, b::2].ravel() for a in (0, 1) for b in (0, 1)]
    nodes = device_code.Nodes()
    nodes.low, nodes.spacing = wp.vec2(*low), spacing
    nodes.count, nodes.per_run = wp.vec2i(*count), number.size
    nodes.by_colour = wp.array(np.concatenate(colours), dtype=int, device=device)
    return nodes
