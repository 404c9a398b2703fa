"""What a pour is given: a cavity, a paste, a path with its flow, and how finely it is computed."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from benchmarks.reality.section import Floats

NARROWEST_MM = 0.1
"""Paste does not enter where the walls are closer: the floor is there."""


@dataclass(frozen=True)
class Cavity:
    """A slot between two walls with closed ends; linear between its stations."""

    s_mm: Floats
    """Stations, growing, from the first: one end of the slot to the other."""
    width_mm: Floats
    """At the face."""
    depth_mm: Floats
    left_deg: Floats
    right_deg: Floats
    """Tilt of each wall, above 0 if the slot narrows downward. Flow depends on the sum of both tangents alone."""
    rise_deg: float = 0.0
    """Slope of the face, above 0 if it rises towards growing s."""

    @classmethod
    def even(
        cls, length_mm: float, width_mm: float, depth_mm: float, wall_deg: float = 0.0, rise_deg: float = 0.0
    ) -> "Cavity":
        ends = np.array([0.0, length_mm])
        one = np.ones(2)
        return cls(ends, width_mm * one, depth_mm * one, wall_deg * one, wall_deg * one, rise_deg)

    def __post_init__(self) -> None:
        if np.any(np.diff(self.s_mm) <= 0) or np.any(self.width_mm <= NARROWEST_MM) or np.any(self.depth_mm <= 0):
            raise ValueError("stations must grow, widths be above 0.1 mm and depths above 0")
        if np.abs(self.left_deg - self.right_deg).max() > 40:
            raise ValueError("a slot that leans by over 20 degrees flows otherwise than an upright one")

    @property
    def narrowing(self) -> Floats:
        """Width lost per depth."""
        return np.tan(np.radians(self.left_deg)) + np.tan(np.radians(self.right_deg))

    @property
    def floor_mm(self) -> Floats:
        """Height of the floor, or of the line where the walls meet, below 0."""
        meet = np.where(self.narrowing > 0, (self.width_mm - NARROWEST_MM) / np.maximum(self.narrowing, 1e-12), inf)
        return -np.minimum(self.depth_mm, meet)


@dataclass(frozen=True)
class Paste:
    """A Herschel-Bulkley fluid: stress = yield stress + consistency x rate^exponent."""

    density_kg_m3: float
    yield_stress_pa: float
    consistency_pa_sn: float
    exponent: float = 1.0
    """0 to 1."""
    stiffening_pa_s: float = 0.0
    """Rise of the yield stress in a second of rest."""
    freezes_at_s: float = inf
    """Age at which paste stops; of a station, the mean age of its paste."""
    wall_share: float = 1.0
    """Part of the yield stress that paste bears against walls and floor before it slips."""
    wall_friction: float = inf
    """Viscous stress of slipping paste over that of paste that sticks, at one mean speed; infinity: no slip."""
    wetting: float = 0.0
    """0: the yield stress holds the surface across the slot; 1: the surface is a liquid's meniscus."""
    contact_deg: float = 30.0
    surface_tension_n_m: float = 0.06

    def __post_init__(self) -> None:
        if not 0 < self.exponent <= 1:
            raise ValueError(f"exponent {self.exponent:g} is outside 0 to 1")
        if not 0 < self.wall_share <= 1:
            raise ValueError(f"wall_share {self.wall_share:g} is outside 0 to 1")
        if self.wall_share < 1 and self.wall_friction == inf:
            raise ValueError("wall_share below 1 needs wall_friction: how slipping paste is slowed")


@dataclass(frozen=True)
class Pour:
    """A nozzle's path and flow, each linear between its times; two equal times make a step."""

    time_s: Floats
    nozzle_s_mm: Floats
    flow_time_s: Floats
    flow_mm3_s: Floats
    nozzle_mm: float = 2.4
    delay_s: float = 0.0
    """By which the whole flow is late; what would come after the path's end is missing."""
    kept: float = 1.0
    """Part of the flow that is left as paste: less with pores or shrinkage."""

    @classmethod
    def steady(
        cls,
        begin_mm: float,
        end_mm: float,
        seconds: float,
        volume_mm3: float,
        ramp_s: float = 0.0,
        nozzle_mm: float = 2.4,
    ) -> "Pour":
        """Return a pour at even speed; the flow is a trapezoid that rises and falls within ``ramp_s`` each."""
        flow = volume_mm3 / (seconds - ramp_s)
        times = np.array([0.0, ramp_s, seconds - ramp_s, seconds])
        flows = np.array([0.0, flow, flow, 0.0])
        if ramp_s == 0.0:
            times, flows = np.array([0.0, seconds]), np.array([flow, flow])
        return cls(np.array([0.0, seconds]), np.array([begin_mm, end_mm], dtype=float), times, flows, nozzle_mm)

    @property
    def speed_mm_s(self) -> float:
        """Mean speed of the nozzle."""
        return float(np.abs(np.diff(self.nozzle_s_mm)).sum() / (self.time_s[-1] - self.time_s[0]))


@dataclass(frozen=True)
class Numerics:
    """How finely a pour is computed; a benchmark shows what changes with each."""

    cell_mm: float = 0.5
    step_share: float = 1.0
    """Of the longest step."""
    settle_s: float = 60.0
    """After the path's end, at most; it ends before once nothing moves."""
    yield_strain: float = 0.1
    """Strain along the slot in which the difference of normal stresses builds up."""


@dataclass(frozen=True)
class Poured:
    """The bed at its end, by cell; levels in mm relative to the face, above 0 above it."""

    s_mm: Floats
    mean_mm: Floats
    """Mean over the width at the surface, or over the mouth."""
    middle_mm: Floats
    """As a probe in the middle of the crack reads it."""
    yield_stress_pa: Floats
    volume_mm3: float
    """That left the nozzle and was kept."""
    in_slot_mm3: float
    """Below the face."""
    above_face_mm3: float
    """Above the face, over the mouth and beside it."""
    beside_mouth_mm3: float
    """Of that, on the face beside the mouth."""
    at_rest: bool
    """False if it still moved when the time to settle was over: a paste with a yield stress comes to rest."""
    seconds: float
    steps: int

    def at(self, s_mm: Sequence[float] | Floats) -> Floats:
        """Return the level that a probe reads in the middle of the crack at some stations."""
        return np.interp(np.asarray(s_mm, dtype=np.float64), self.s_mm, self.middle_mm)
