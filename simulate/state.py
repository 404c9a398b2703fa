"""The particles of a run on the device, and the lists of those near each other. Centimetres and seconds."""

import warp as wp

from simulate.distance import CM
from simulate.nozzle import Schedule

NEIGHBOURS = 128
"""Slots of a list. Fluid at rest fills about 50, at twice its density 100."""
WALL_NEIGHBOURS = 96
"""Slots of a list. A flat wall fills about 13, a narrow corner three times that."""


class State:
    """All particles of a run in the order of release; rows of pairs for at most ``rows`` that move at one time."""

    def __init__(self, schedule: Schedule, rows: int, device: str) -> None:
        count = schedule.particles
        self.device = device
        # Those still to come lie where and move as they will be released.
        self.position = wp.array(schedule.position_mm * CM, dtype=wp.vec3, device=device)
        self.velocity = wp.array(schedule.velocity_mm_s * CM, dtype=wp.vec3, device=device)
        self.start = wp.zeros_like(self.position)
        self.density = wp.full(count, 1.0, dtype=float, device=device)
        self.multiplier = wp.zeros(count, dtype=float, device=device)
        self.fate = wp.zeros(count, dtype=int, device=device)
        self.neighbour = wp.zeros((rows, NEIGHBOURS), dtype=int, device=device)
        self.neighbour_count = wp.zeros(rows, dtype=int, device=device)
        self.gradient = wp.zeros((rows, NEIGHBOURS), dtype=wp.vec3, device=device)
        self.wall_neighbour = wp.zeros((rows, WALL_NEIGHBOURS), dtype=int, device=device)
        self.wall_count = wp.zeros(rows, dtype=int, device=device)
        self.wall_gradient = wp.zeros(rows, dtype=wp.vec3, device=device)
        self.first = 0
        """The oldest particle that still moves."""
        self.end = 0
        """One past the youngest that is out."""

    @property
    def moving(self) -> int:
        return self.end - self.first
