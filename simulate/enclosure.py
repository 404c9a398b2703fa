"""What holds the fluid in: the same for all runs in one crack whose particles have one size."""

from dataclasses import dataclass

from sealtwin.records import Outline, Solid
from simulate.distance import Barrier, build_barrier
from simulate.walls import Walls, place_walls


@dataclass(frozen=True)
class Enclosure:
    """Runs only read it, so that a study builds it once."""

    barrier: Barrier
    walls: Walls


def enclose(solid: Solid, outline: Outline, radius_mm: float, device: str) -> Enclosure:
    """Distances to the solid, and wall particles. Raises InputError where either would be too large."""
    barrier = build_barrier(solid, outline, radius_mm, device)
    return Enclosure(barrier, place_walls(solid, outline, barrier, radius_mm))
