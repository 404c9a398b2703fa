"""How many particles are out, frozen and moving in each frame of a run: known before it starts."""

import math
from typing import NamedTuple

import numpy as np

from sealtwin.records import Integers
from simulate.nozzle import Schedule
from simulate.paste import NEVER
from simulate.settings import Fluid

ROUNDING = 1e-9
"""A whole number of frames must not become one more."""


class Course(NamedTuple):
    """Of one run."""

    out: Integers
    """(frames,): particles that have left the nozzle."""
    moving: Integers
    """(frames,): the most of them that may move, those that have not frozen by their age."""

    @property
    def frames(self) -> int:
        """To the end of settling."""
        return len(self.out)


def course_of(schedule: Schedule, fluid: Fluid, settle_s: float) -> Course:
    """Particles leave the nozzle in order, and freeze by age in the same order."""
    settling = math.ceil(settle_s / schedule.frame_s - ROUNDING)
    out = np.pad(schedule.released, (0, settling), mode="edge")
    ages = frames_to_freeze(fluid, schedule.frame_s)
    frozen = np.zeros_like(out)
    if ages < len(out):
        frozen[ages:] = out[:-ages]
    return Course(out, out - frozen)


def frames_to_freeze(fluid: Fluid, frame_s: float) -> int:
    """A particle's age when it is fixed, or NEVER."""
    if fluid.freeze_after_s == "never":
        return NEVER
    return math.ceil(fluid.freeze_after_s / frame_s - ROUNDING)
