"""The pressure on two levels: each particle's own part, and a smooth part that is solved for in the whole crack.

A plain iteration spreads pressure by about one neighbour, so that a deep column remains compressed after a few
iterations. Here every iteration also solves for the smooth part of all multipliers (``kernels.coarse_pressure``).
"""

import math
from functools import partial
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
"""Spacing of nodes divided by h. The densest 1 % of a column at rest is too dense by 1.7 %. With a spacing of 1.25 or
1.6 it would be too dense by 2.0 to 2.2 %."""
OUTSIDE = 0.25
"""Distance of the nearest nodes beyond the floor and beyond the crack's first end, divided by the spacing. With 0.75
the densest 1 % is too dense by 2.0 %, because particles on the floor have a small weight at the nodes on either side.
"""
STEP = 0.6  # Share of a particle's own Jacobi step; with 1 the surface of a fluid without drag never rests (3 cm/s)
SWEEPS, OVERSHOOT = 3, 1.5  # Sweeps and factor of the over-relaxation; 2 or 20 sweeps settle a column as well
LEAST_WEIGHT = 3.0  # Least weight of particles at a node: nodes with less would support spray (prototype)
AT_ONCE = 0.5
"""Share of the compression left by the last substep that is corrected at once. With 1 a surface that was hit keeps
moving at 1 to 2 cm/s, with 0.5 at 0.7 cm/s."""
LANES = 256  # Threads of the block that solves a run's nodes on a GPU


class CoarsePressure:
    """Changes the multipliers of all movers. All runs are solved at once, independently of each other."""

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
        zeros = partial(wp.zeros, device=device)
        nodes.sums = zeros((count, int(device_code.SUMS)), wp.int64)
        nodes.excess = zeros(count, wp.int64)
        nodes.matrix = zeros((count, int(device_code.WEIGHT)))
        nodes.right = zeros(count)
        nodes.change = zeros(count)
        nodes.total = zeros(count)
        self.rows = coarse = device_code.CoarseRows()
        coarse.node = zeros(rows, int)
        coarse.part = zeros(rows, wp.vec2)
        coarse.along = zeros(rows, wp.vec2)
        coarse.slope = zeros(rows, wp.vec4)
        coarse.old = zeros(rows)
        coarse.multiplier = zeros(rows)
        coarse.yielding = zeros(rows)
        coarse.compression = zeros(rows)

        lanes = 1 if device == "cpu" else LANES
        self._locate = launcher.bind(device_code.locate, state.particles, arc, nodes, coarse)
        # Launched in one piece: two threads of a CPU must not add to the same node.
        self._sum_matrix = launcher.bind_whole(device_code.sum_matrix, rows, state.particles, nodes, coarse)
        self._sum_excess = launcher.bind_whole(device_code.sum_excess, rows, state.particles, nodes, coarse)
        self._solve_first, self._solve_again = (
            launcher.bind_whole(
                device_code.solve,
                state.runs,
                nodes,
                summed,
                lanes,
                SWEEPS,
                OVERSHOOT,
                LEAST_WEIGHT,
                AT_ONCE,
                lanes=LANES,
            )
            for summed in (True, False)
        )
        self._change_multipliers = [
            launcher.bind(device_code.change_multipliers, state.particles, nodes, coarse, float(iteration + 1), STEP)
            for iteration in range(iterations)
        ]

    def begin(self, rows: int) -> None:
        """Set the smooth part to 0 and find each mover's nodes. Call it after the prediction of a substep."""
        self.nodes.total.zero_()
        self._locate(rows)

    def change(self, iteration: int, rows: int) -> None:
        """Store each mover's change of multiplier, which follows from its density, together with its position.

        Iterations count from 0.
        """
        if iteration == 0:
            # Positions change too little within a substep to need another matrix.
            self.nodes.sums.zero_()
            self._sum_matrix()
        self._sum_excess()
        (self._solve_again if iteration else self._solve_first)()
        self._change_multipliers[iteration](rows)


def map_arc_length(centreline: Floats, low: Floats, high: Floats, spacing: float, device: str) -> tuple[Any, Floats]:
    """Return the arc-length map of the rectangle from ``low`` to ``high``, (2,) each, and its range of arc lengths.

    A position has the arc length of the nearest point of the centreline, (n, 2), whose first and last piece are
    extended. All lengths have one unit. Directions are those of the line smoothed over ``spacing``, without a trace's
    roughness.
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
    """Return nodes around the arc lengths ``reach``, (2,), and from ``floor`` to ``top``.

    Their number is even in both directions.
    """
    before = math.ceil(max(0.0, -reach[0] / spacing - OUTSIDE))
    # The outermost nodes are never next to a particle.
    low = np.array([0.0, floor]) - (OUTSIDE + 1) * spacing - np.array([before * spacing, 0.0])
    count = [2 * math.ceil(((end - begin) / spacing + 3) / 2) for begin, end in zip(low, (reach[1], top), strict=True)]
    number = np.arange(count[0] * count[1]).reshape(count)
    colours = [number[a::2, b::2].ravel() for a in (0, 1) for b in (0, 1)]
    nodes = device_code.Nodes()
    nodes.low, nodes.spacing = wp.vec2(*low), spacing
    nodes.count, nodes.per_run = wp.vec2i(*count), number.size
    nodes.by_colour = wp.array(np.concatenate(colours), dtype=int, device=device)
    return nodes
