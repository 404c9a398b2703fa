"""Flow of a Herschel-Bulkley paste along a slot, through one section, under a uniform gradient: finite elements.

Units of this module: the section's width at its free surface, the gradient times that width, and the consistency.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import splu

Floats = NDArray[np.float64]

STIFFEST = 3e3
"""Largest penalty: where a whole section slides as a plug, nothing else would stop its growth."""


@dataclass(frozen=True)
class Solid:
    """How walls and floor hold paste: it slips above ``share`` of its yield stress, against ``friction``.

    ``friction`` is the viscous stress at a solid over that of flow without slip or yield stress between two plates at
    the same mean speed and width; infinity: no slip.
    """

    share: float = 1.0
    friction: float = np.inf

    @property
    def slips(self) -> bool:
        return np.isfinite(self.friction)


@dataclass(frozen=True)
class Section:
    """Half of a trapezoid, from the middle of the slot to a wall, in triangles with linear speeds."""

    depth: float
    narrowing: float
    """Part of the width that is lost from surface to floor; negative if the slot widens."""
    across: int = 16
    down: int = 20

    @cached_property
    def nodes(self) -> tuple[Floats, Floats]:
        """Distance from the middle and height above the floor of each node, as grids of (down + 1, across + 1)."""
        out = np.linspace(0.0, 1.0, self.across + 1)
        # Closer to walls and floor, where paste shears.
        out = out * (1.35 - 0.35 * out)
        height = self.depth * _graded(self.down, min(1.0, 0.6 / self.depth))
        half_width = 0.5 * (1.0 - self.narrowing * (1.0 - height / self.depth))
        return half_width[:, None] * out, np.repeat(height[:, None], len(out), axis=1)

    @cached_property
    def triangles(self) -> NDArray[np.int64]:
        number = np.arange((self.down + 1) * (self.across + 1)).reshape(self.down + 1, self.across + 1)
        a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
        # Diagonals alternate, so that no direction is preferred.
        even = (np.add.outer(np.arange(self.down), np.arange(self.across)) % 2 == 0).ravel()
        quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
        first = np.where(even[:, None], quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
        second = np.where(even[:, None], quads[:, [0, 2, 3]], quads[:, [1, 2, 3]])
        return np.concatenate([first, second])

    @cached_property
    def area_and_gradient(self) -> tuple[Floats, csr_array, csr_array]:
        """Area of each triangle, and the two matrices from speeds at nodes to its shear rates."""
        y, z = (grid.ravel()[self.triangles] for grid in self.nodes)
        twice = (y[:, 1] - y[:, 0]) * (z[:, 2] - z[:, 0]) - (y[:, 2] - y[:, 0]) * (z[:, 1] - z[:, 0])
        along_y = np.stack([z[:, 1] - z[:, 2], z[:, 2] - z[:, 0], z[:, 0] - z[:, 1]], axis=1) / twice[:, None]
        along_z = np.stack([y[:, 2] - y[:, 1], y[:, 0] - y[:, 2], y[:, 1] - y[:, 0]], axis=1) / twice[:, None]
        rows = np.repeat(np.arange(len(self.triangles)), 3)
        shape = (len(self.triangles), self.nodes[0].size)
        both = [coo_array((part.ravel(), (rows, self.triangles.ravel())), shape).tocsr() for part in (along_y, along_z)]
        return 0.5 * np.abs(twice), both[0], both[1]

    @cached_property
    def solid_length(self) -> Floats:
        """Length of wall or floor that belongs to each node: half of both neighbouring edges."""
        y, z = self.nodes
        number = np.arange(y.size).reshape(y.shape)
        length = np.zeros(y.size)
        for edge in (number[0], number[:, -1]):
            step = np.hypot(np.diff(y.ravel()[edge]), np.diff(z.ravel()[edge]))
            np.add.at(length, edge[:-1], step / 2)
            np.add.at(length, edge[1:], step / 2)
        return length


def _graded(count: int, finer: float) -> Floats:
    """Return steps from 0 to 1 whose first is ``finer`` of the mean one, in geometric progression."""
    low, high = 1.0, 3.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        first = (middle - 1.0) / (middle**count - 1.0) * count if middle > 1.0 else 1.0
        low, high = (middle, high) if first > finer else (low, middle)
    steps = low ** np.arange(count)
    return np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])


def flows(section: Section, yields: Floats, exponent: float, solid: Solid, tolerance: float = 2e-4) -> Floats:
    """Return the flow through the whole section at each of some yield stresses, over gradient times width.

    The speed minimises K |grad u|^(n+1) / (n+1) + tau0 |grad u| - u and the work against sliding on the solid
    (Mosolov and Miasnikov 1965; slip: Roquet and Saramito 2008), by an augmented Lagrangian (Glowinski 1984) whose
    penalty follows the residuals.
    """
    area, along_y, along_z = section.area_and_gradient
    load = np.bincount(section.triangles.ravel(), np.repeat(area / 3.0, 3), section.nodes[0].size)
    stiffness = (along_y.T @ diags_array(area) @ along_y + along_z.T @ diags_array(area) @ along_z).tocsc()
    length = section.solid_length
    on_solid = np.flatnonzero(length)
    edge = length[on_solid, None]
    free = np.arange(len(load)) if solid.slips else np.flatnonzero(length == 0.0)
    # The penalty of slip over that of shear: a length of about the boundary layer.
    edge_penalty = 4.0
    if solid.slips:
        stiffness = (stiffness + edge_penalty * diags_array(length)).tocsc()
    solve = splu(stiffness[free][:, free].tocsc()).solve
    friction = solid.friction * (2.0 * (2.0 * exponent + 1.0) / exponent) ** exponent if solid.slips else 0.0

    runs = len(yields)
    speed = np.zeros((len(load), runs))
    rate_y, rate_z, stress_y, stress_z = (np.zeros((len(area), runs)) for _ in range(4))
    slip, drag = np.zeros((len(on_solid), runs)), np.zeros((len(on_solid), runs))
    penalty = np.full(runs, 4.0)
    weight, flow_before = area[:, None], np.zeros(runs)
    for turn in range(1, 6001):
        push = load[:, None] - along_y.T @ (weight * (stress_y - penalty * rate_y))
        push -= along_z.T @ (weight * (stress_z - penalty * rate_z))
        if solid.slips:
            push[on_solid] -= edge * (drag - penalty * edge_penalty * slip)
        speed[free] = solve(push[free]) / penalty
        shear_y, shear_z = along_y @ speed, along_z @ speed
        trial_y, trial_z = stress_y + penalty * shear_y, stress_z + penalty * shear_z
        size = np.hypot(trial_y, trial_z)
        share = shear_of(size, yields, 1.0, penalty, exponent) / np.maximum(size, 1e-300)
        old_y, old_z = rate_y, rate_z
        rate_y, rate_z = share * trial_y, share * trial_z
        stress_y, stress_z = trial_y - penalty * rate_y, trial_z - penalty * rate_z
        if solid.slips:
            trial = drag + penalty * edge_penalty * speed[on_solid]
            slip = shear_of(np.abs(trial), solid.share * yields, friction, penalty * edge_penalty, exponent) * np.sign(
                trial
            )
            drag = trial - penalty * edge_penalty * slip
        if turn % 20 == 0:
            flow = 2.0 * load @ speed
            apart = _norm(weight, shear_y - rate_y, shear_z - rate_z) * penalty
            moved = _norm(weight, rate_y - old_y, rate_z - old_z) * penalty
            scale = _norm(weight, stress_y, stress_z) + 1e-300
            done = np.maximum(apart, moved) / scale < tolerance / 10
            still = np.abs(flow - flow_before) < tolerance * np.abs(flow) + 1e-9
            if np.all(done & still):
                break
            flow_before = flow
            # Residual balancing (Boyd et al. 2011, section 3.4.1).
            penalty = np.where(apart > 5 * moved, penalty * 1.6, np.where(moved > 5 * apart, penalty / 1.6, penalty))
            penalty = np.minimum(penalty, STIFFEST)
    return 2.0 * load @ speed


def shear_of(size: Floats, yields: Floats, consistency: float, penalty: Floats, exponent: float) -> Floats:
    """Return the rate g >= 0 with consistency g^n + yield + penalty g = size; 0 below the yield stress. n <= 1."""
    excess = np.maximum(size - yields, 0.0)
    if exponent == 1.0:
        return excess / (consistency + penalty)
    # In x = consistency g^n the equation is convex: Newton's method comes down from x = excess without overshoot.
    viscous = excess.copy()
    power = 1.0 / exponent
    for _ in range(12):
        rate = (viscous / consistency) ** power
        slope = 1.0 + penalty * power * rate / np.maximum(viscous, 1e-300)
        viscous = np.maximum(viscous - (viscous + penalty * rate - excess) / slope, 0.0)
    return (viscous / consistency) ** power


def _norm(weight: Floats, one: Floats, other: Floats) -> Floats:
    return np.sqrt((weight * (one**2 + other**2)).sum(axis=0))
