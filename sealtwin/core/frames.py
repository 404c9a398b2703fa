"""Particles of a fluid run at one moment."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from sealtwin.core.records import Floats, Integers


class ParticleState(IntEnum):
    """State of a particle at one moment."""

    MOVING = 0
    ASLEEP = 1  # Particle at rest below the yield stress, until a faster one meets it
    FROZEN = 2  # Particle that froze by its age, permanently
    SPILLED = 3  # Particle that left over the sample's edge
    ESCAPED = 4  # Particle that went through a wall: a fault


@dataclass(frozen=True)
class Frame:
    """Particles that have left the nozzle at one moment of a fluid run, in the order in which they left it."""

    t_s: float
    position_mm: Floats  # (n, 3)
    velocity_mm_s: Floats  # (n, 3)
    age_s: Floats  # (n,): since release
    density: Floats  # (n,): over rest density
    state: Integers  # (n,), ParticleState values

    @property
    def speed_mm_s(self) -> Floats:
        return np.linalg.norm(self.velocity_mm_s, axis=1)
