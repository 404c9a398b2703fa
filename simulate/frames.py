"""What lies where at one moment of a run, and at which moments somebody looks."""

import math
from collections.abc import Callable, Iterable

import numpy as np

from sealtwin.output import PAST_THE_END
from sealtwin.records import Frame
from simulate.course import ROUNDING
from simulate.injection import Injection


def take_frame(injection: Injection) -> Frame:
    """All particles of the first run that have left the nozzle, as its last frame left them."""
    injection.wait()
    state, out = injection.engine.state, injection.out
    return Frame(
        t_s=injection.t_s,
        position_mm=state.position_mm()[:out],
        velocity_mm_s=state.velocity_mm_s()[:out],
        age_s=(injection.done - injection.schedule.frame_of[:out]).astype(float) * injection.schedule.frame_s,
        # The numbers of ParticleState and of the kernels are the same.
        density=state.density.numpy()[:out].astype(float),
        state=state.fate.numpy()[:out].astype(np.int64),
    )


class Moments:
    """Watches a run and hands over a frame at each of some moments."""

    def __init__(self, times_s: Iterable[float], take: Callable[[float, Frame], None]) -> None:
        """``times_s`` increase, and may have no end; ``take`` gets the moment, and the frame at or just after it."""
        self._times_s, self._take = iter(times_s), take
        self._next_s = math.inf

    def begin(self, injection: Injection) -> None:
        """A resumed run has moments behind it, which were taken before; the one at which it was kept, perhaps not."""
        self._next_s = next(self._times_s, math.inf)
        while self._due(injection) < injection.done:
            self._next_s = next(self._times_s, math.inf)
        self.after_frame(injection)

    def after_frame(self, injection: Injection) -> None:
        if injection.done < self._due(injection):
            return
        frame = take_frame(injection)
        while self._due(injection) <= injection.done:
            self._take(self._next_s, frame)
            self._next_s = next(self._times_s, math.inf)

    def _due(self, injection: Injection) -> float:
        """The number of frames after which the next moment has come: before the first, nothing is there to be seen."""
        if math.isinf(self._next_s):
            return math.inf
        number = max(1, math.ceil(self._next_s / injection.schedule.frame_s - ROUNDING))
        return min(number, injection.frames) if number <= PAST_THE_END * injection.frames else number
