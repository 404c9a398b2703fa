"""Compute the fill of a crack over time. In each step, sealant lands and then flows along the crack under gravity.

The balance of each cell is dA/dt + dQ/ds = q, with the filled area A, the flow Q and the supply q. A step uses the
upwind area and perimeter after its sealant has landed, and the slopes at its end. The state at the end of a step
minimises a convex function. It is found by Newton steps, which are halved if they go too far. The areas are computed
from the flows, so volume is conserved even if the search leaves a residual.

The paste supports a mound under the nozzle and a crown across the crack, which a flow averaged over sections would
flatten. In paste that is pulled apart, the sideways pressure is 2 tau less than the weight above, where tau is the
yield stress. In paste that is pushed together, it is 2 tau more (Rankine's limits of a plastic soil without friction).
At the nozzle's last position, both kinds meet along the crack, and their levels differ by 4 tau / rho g. Across the
crack, paste that was laid along the middle is pulled apart, so its level in the middle is 2 tau / rho g higher than at
the walls.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dptsv  # pyright: ignore[reportAttributeAccessIssue]

from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import midpoints
from sealtwin.core.records import Floats, Integers, Outline, Solid, Trajectory, unit
from sealtwin.core.regime import GRAVITY_M_S2
from simulate.settings import LEVEL, SampleSlope
from simulate.shear_law import Law, PlaneFlow, flow_between_plates
from simulate.slot.sections import NARROWEST_MM, Trapezoids, sections_of

CELLS = 60
STEPS = 200
"""Number of time steps while sealant flows. In a slot of 60 mm, levels are then within 0.2 mm of the levels with finer
steps. A front advances by at most one cell per step."""
STEP_RATIO = 1.05  # Ratio of each time step of settling to the step before it
TOLERANCE = 1e-6  # Largest residual of a step, divided by the area of the largest section
MAX_NEWTON, MAX_HALVED = 60, 12
OVERSHOT = 0.3
"""Largest slope of the convex function at the end of a Newton step, divided by the negative slope at its start. If the
ratio is larger, the step has gone too far beyond the minimum and is halved."""
SAMPLES = 8  # Number of samples of the nozzle's motion per step
GRAVITY_MM_S2 = 9810.0
REACH_PER_MM = 1e6  # Value of ``Trapezoids.reach_per_mm`` for a fluid without a yield stress, in 1/mm
MOUND, CROWN = 4.0, 2.0
"""Heights of a mound and of a crown, divided by tau / rho g. tau is the yield stress."""
MAX_MOUND = 0.5
"""Largest fraction of the sealant that may be in a mound. In a short crack, no sealant would be left under a larger
mound."""
DUCT = (1.0, -1.3553, 1.9467, -1.7012, 0.9564, -0.2537)
"""Coefficients of a polynomial in the ratio of a duct's short side to its long side. The polynomial gives the friction
of rectangular ducts divided by the friction of plates (Shah and London 1978)."""


@dataclass(frozen=True)
class HerschelBulkley:
    """Paste with the stress tau + K gamma^n: yield stress tau, consistency K, shear rate gamma, flow index n.

    With ``friction``, a fraction of the pressure is added to this stress.
    """

    density_kg_m3: float
    yield_stress_pa: float
    consistency_pa_s_n: float
    flow_index: float = 1.0
    friction: float = 0.0
    """Fraction of the pressure that resists shear, as between grains. It is 0 for paste, and above 0 for particles."""
    wall_share: float = 1.0
    """Stress at a wall, divided by the stress in the paste."""
    law: Law = Law.HERSCHEL_BULKLEY

    @property
    def weight_pa_mm(self) -> float:
        """Hydrostatic pressure per millimetre of depth, in Pa/mm."""
        return 1e-3 * self.density_kg_m3 * GRAVITY_M_S2


@dataclass(frozen=True)
class Filled:
    """The settled sealant at the end, and the balance of its volume."""

    sections: Trapezoids
    area_mm2: Floats  # Filled area of each section
    level_mm: Floats  # Level in the middle of the crack's width, relative to the face, in the middle of each cell
    dispensed_mm3: float
    in_flight_mm3: float
    """Volume that has been dispensed but has not landed when the run ends."""

    @property
    def read_mm2(self) -> Floats:
        """Area of each section below the level in its middle, (n,), as a reading of this level would imply it."""
        return self.sections.area_mm2(self.level_mm - self.sections.bottom_mm)[0]

    @property
    def bed_mm3(self) -> float:
        return float(self.area_mm2.sum()) * self.sections.step_mm

    @property
    def mass_error(self) -> float:
        """Error of the settled sealant's volume, divided by the dispensed volume."""
        return abs(self.bed_mm3 + self.in_flight_mm3 - self.dispensed_mm3) / self.dispensed_mm3


def fill(
    solid: Solid,
    outline: Outline,
    trajectory: Trajectory,
    paste: HerschelBulkley,
    *,
    nozzle_mm: float,
    settle_s: float,
    slope: SampleSlope = LEVEL,
    cells: int = CELLS,
    steps: int = STEPS,
) -> Filled:
    """Pour sealant along the trajectory, let it settle, and return the settled sealant, including the mound."""
    weight = paste.weight_pa_mm
    reach = min(REACH_PER_MM, weight / (2 * paste.yield_stress_pa)) if paste.yield_stress_pa > 0 else REACH_PER_MM
    sections = sections_of(outline, solid, cells, reach_per_mm=reach)
    times_s = _times_s(trajectory, settle_s, steps)
    along, into = _down(outline, sections, slope)
    edges_mm = np.linspace(0.0, outline.length_mm, cells + 1)
    dispensed_mm3 = trajectory.dispensed_mm3
    flat = min(1.0, dispensed_mm3 / sections.full_mm2.sum() / sections.step_mm)
    surface_mm = -float(sections.depth_mm.mean()) * (1 - flat)
    way = np.array([float(along.mean()), into])
    landed_mm3 = supplied_mm3(trajectory, times_s, edges_mm, nozzle_mm=nozzle_mm, surface_mm=surface_mm, down=way)
    held_mm = paste.yield_stress_pa / (weight * into)
    all_mm3, last_mm = float(landed_mm3.sum()), float(trajectory.s_mm[trajectory.giving][-1])
    heap_mm2 = mound_mm2(
        sections, all_mm3, held_mm=held_mm, middle_mm=last_mm, nozzle_mm=nozzle_mm, surface_mm=surface_mm
    )
    flowing_mm3 = landed_mm3 * (1 - float(heap_mm2.sum()) * sections.step_mm / max(all_mm3, np.finfo(float).tiny))
    bed = _Bed(sections, paste, weight * into, weight * along)
    for step_s, more_mm3 in zip(np.diff(times_s), flowing_mm3, strict=True):
        bed.advance(float(step_s), more_mm3 / sections.step_mm)
    area_mm2 = bed.area_mm2 + heap_mm2
    height_mm = sections.height_mm(area_mm2)
    return Filled(
        sections=sections,
        area_mm2=area_mm2,
        level_mm=sections.bottom_mm + height_mm + crown_mm(height_mm, sections.depth_mm, held_mm),
        dispensed_mm3=dispensed_mm3,
        in_flight_mm3=max(0.0, dispensed_mm3 - all_mm3),
    )


def _times_s(trajectory: Trajectory, settle_s: float, steps: int) -> Floats:
    """Return the times at which steps begin and end, (steps + 1,).

    Steps are equal while sealant flows, and grow while it settles.
    """
    begin_s, end_s = trajectory.t_s[trajectory.giving][[0, -1]]
    times_s = np.linspace(begin_s, end_s, steps + 1)
    left_s = trajectory.t_s[-1] + settle_s - end_s
    if left_s <= 0:
        return times_s
    count = int(np.ceil(np.log1p(left_s / (times_s[1] - begin_s) * (STEP_RATIO - 1)) / np.log(STEP_RATIO)))
    after_s = np.cumsum(STEP_RATIO ** np.arange(count))
    return np.concatenate([times_s, end_s + after_s / after_s[-1] * left_s])


def mound_mm2(
    sections: Trapezoids, landed_mm3: float, *, held_mm: float, middle_mm: float, nozzle_mm: float, surface_mm: float
) -> Floats:
    """Return the mound's area in each section, (n,), above sealant with its surface at ``surface_mm``.

    The mound moves with the nozzle and stays at the nozzle's last position, ``middle_mm``. Its top is as wide as the
    nozzle. Its flanks have the shape of a slump, h dh/dx = ``held_mm``, where ``held_mm`` is tau / rho g.
    """
    aside_mm = np.maximum(np.abs(sections.s_mm - middle_mm) - nozzle_mm / 2, 0.0)
    rise_mm = np.sqrt(np.maximum((MOUND * held_mm) ** 2 - 2 * held_mm * aside_mm, 0.0))
    _, width_mm = sections.area_mm2(surface_mm - sections.bottom_mm)
    area_mm2 = rise_mm * width_mm
    total_mm3 = float(area_mm2.sum()) * sections.step_mm
    return area_mm2 * (min(1.0, MAX_MOUND * landed_mm3 / total_mm3) if total_mm3 > 0 else 0.0)


def crown_mm(height_mm: Floats, depth_mm: Floats, held_mm: float) -> Floats:
    """Return the level in the middle of the crack minus the mean level across it, (n,).

    For a parabola, this is a third of its height. It is at most the height of the sealant. It decreases to 0 where
    sealant reaches the face, because paste above the face slumps beside the mouth.
    """
    return np.clip(np.minimum(height_mm, depth_mm - height_mm), 0.0, CROWN * held_mm / 3)


def supplied_mm3(
    trajectory: Trajectory, times_s: Floats, edges_mm: Floats, *, nozzle_mm: float, surface_mm: float, down: Floats
) -> Floats:
    """Return the volume that lands in each cell in each step, (steps, cells). Sealant that lands later is left out.

    ``edges_mm`` are the ends of the cells along the crack. Sealant leaves the nozzle as a disc, square to the face, and
    falls to ``surface_mm``, the level of flat sealant. ``down`` is the unit vector of gravity along the crack and
    square to the face. Sealant that would land beyond an end of the crack lands in the last cell.
    """
    begin_s, end_s = trajectory.t_s[trajectory.giving][[0, -1]]
    moment_s = np.linspace(begin_s, end_s, SAMPLES * len(times_s) + 1)
    given_mm3 = np.cumulative_sum(trajectory.given_mm3, include_initial=True)
    volume_mm3 = np.diff(np.interp(moment_s, trajectory.t_s, given_mm3))
    middle_s = midpoints(moment_s)
    speed_mm_s = volume_mm3 / np.diff(moment_s) / (np.pi / 4 * nozzle_mm**2)
    height_mm = np.maximum(np.interp(middle_s, trajectory.t_s, trajectory.position_mm[:, 2]) - surface_mm, 0.0)
    pull_mm_s2 = GRAVITY_MM_S2 * down[1]
    falls_s = (np.sqrt(speed_mm_s**2 + 2 * pull_mm_s2 * height_mm) - speed_mm_s) / pull_mm_s2
    lands_mm = np.interp(middle_s, trajectory.t_s, trajectory.s_mm) + GRAVITY_MM_S2 * down[0] * falls_s**2 / 2
    share = np.diff(_below(2 * (edges_mm - lands_mm[:, None]) / nozzle_mm), axis=1)
    step = np.searchsorted(times_s, middle_s + falls_s) - 1
    landed_mm3 = np.zeros((len(times_s) - 1, len(edges_mm) - 1))
    in_time = step < len(landed_mm3)
    np.add.at(landed_mm3, step[in_time], volume_mm3[in_time, None] * share[in_time])
    return landed_mm3


def _below(position: Floats) -> Floats:
    """Return the fraction of a disc of radius 1 that is below each position, (n, edges).

    At the first edge the fraction is set to 0, and at the last edge to 1.
    """
    x = np.clip(position, -1.0, 1.0)
    share = 0.5 + (np.arcsin(x) + x * np.sqrt(1 - x**2)) / np.pi
    share[:, 0], share[:, -1] = 0.0, 1.0
    return share


def _down(outline: Outline, sections: Trapezoids, slope: SampleSlope) -> tuple[Floats, float]:
    """Return gravity's direction: components along the crack at boundaries of cells, (n - 1,), and into the sample."""
    x, y, z = slope.down
    ahead = unit(np.diff(outline.centreline_mm, axis=0))
    middle_mm = midpoints(arc_length(outline.centreline_mm))
    faces_mm = midpoints(sections.s_mm)
    return np.interp(faces_mm, middle_mm, ahead @ np.array([x, y])), -z


class _Bed:
    """Paste in each cell of the crack, which is advanced step by step."""

    def __init__(self, sections: Trapezoids, paste: HerschelBulkley, weight: float, pull: Floats) -> None:
        self._sections, self._paste, self._weight, self._pull = sections, paste, weight, pull
        self._tolerance_mm2 = TOLERANCE * float(sections.full_mm2.max())
        self.area_mm2 = np.zeros_like(sections.s_mm)
        self.height_mm = np.zeros_like(sections.s_mm)

    def advance(self, step_s: float, landed_mm2: Floats) -> None:
        sections, share = self._sections, step_s / self._sections.step_mm
        # The search begins at the state of the last step. With the sealant that has just landed, it would begin farther
        # from the solution.
        height_mm = self.height_mm
        self.area_mm2 = self.area_mm2 + landed_mm2
        through = self._faces(sections.height_mm(self.area_mm2))
        flow, stiff = through.flow_mm3_s(self._push(height_mm))
        filled_mm2, width_mm = sections.area_mm2(height_mm)
        for _ in range(MAX_NEWTON):
            left_mm2 = filled_mm2 - self.area_mm2 + share * _net(flow)
            if np.abs(left_mm2).max() <= self._tolerance_mm2:
                break
            coupled = share * self._weight / sections.step_mm * stiff
            width_mm[:-1] += coupled
            width_mm[1:] += coupled
            change_mm = np.asarray(dptsv(width_mm, -coupled, -left_mm2)[2], float)
            before, there_mm = float(left_mm2 @ change_mm), height_mm
            for _ in range(MAX_HALVED):
                there_mm = height_mm + change_mm
                flow, stiff = through.flow_mm3_s(self._push(there_mm))
                filled_mm2, width_mm = sections.area_mm2(there_mm)
                after = float((filled_mm2 - self.area_mm2 + share * _net(flow)) @ change_mm)
                if after <= OVERSHOT * -before:
                    break
                change_mm, before = change_mm / 2, before / 2
            height_mm = there_mm
        self.area_mm2 = self.area_mm2 - share * _net(flow)
        self.height_mm = sections.height_mm(self.area_mm2)

    def _push(self, height_mm: Floats) -> Floats:
        """Return the pressure gradient at boundaries between cells in Pa/mm, (n - 1,), positive towards larger s."""
        level_mm = self._sections.bottom_mm + height_mm
        return self._pull - self._weight / self._sections.step_mm * (level_mm[1:] - level_mm[:-1])

    def _faces(self, height_mm: Floats) -> PlaneFlow:
        """Return the flow through each boundary between cells. The upwind cell is filled to its ``height_mm``, (n,)."""
        upwind = np.arange(len(height_mm) - 1) + (self._push(height_mm) < 0)
        return conduits(self._paste, self._sections, np.maximum(self.area_mm2, 0.0), height_mm, upwind)


def _net(flow: Floats) -> Floats:
    """Return the outflow of each cell minus its inflow."""
    net = np.empty(len(flow) + 1)
    net[0], net[1:-1], net[-1] = flow[0], flow[1:] - flow[:-1], -flow[-1]
    return net


def conduits(
    paste: HerschelBulkley, sections: Trapezoids, area_mm2: Floats, height_mm: Floats, rows: Integers
) -> PlaneFlow:
    """Return the flow through sections ``rows``, (k,), which are filled to ``area_mm2`` and ``height_mm``, (n,) each.

    The flow is computed as a flow between plates. Half the gap is replaced by two radii of the section: one for the
    yield stress, and one for the viscous flow.
    """
    wetted_mm = sections.wetted_mm(height_mm)
    # The mean pressure on the walls is half of the pressure at the floor.
    pressure_pa = paste.weight_pa_mm * np.maximum(height_mm, 0.0) * (1 + sections.floor_mm / wetted_mm) / 2
    holds_pa = paste.wall_share * paste.yield_stress_pa + paste.friction * pressure_pa
    with np.errstate(divide="ignore", invalid="ignore"):
        threshold = np.where(area_mm2 > 0, holds_pa / sections.holding_mm(area_mm2, wetted_mm), np.inf)
    # Ratio of short to long side of a duct that consists of a filled section, at its mean width, and its mirror image.
    high_mm = 2 * np.maximum(height_mm, NARROWEST_MM)
    wide_mm = np.maximum(2 * area_mm2 / high_mm, NARROWEST_MM)
    slenderness = np.minimum(wide_mm / high_mm, high_mm / wide_mm)
    radius_mm = area_mm2 / wetted_mm * np.sqrt(1 / np.polynomial.polynomial.polyval(slenderness, DUCT))
    viscosity = paste.wall_share * paste.consistency_pa_s_n
    return flow_between_plates(paste.law, threshold[rows], radius_mm[rows], viscosity, paste.flow_index, area_mm2[rows])
