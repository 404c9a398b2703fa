"""Frames of a run at chosen moments."""

import math
from collections.abc import Callable, Iterable

from sealtwin.core.records import Frame
from simulate.injection import Injection
from simulate.setup.release_schedule import ROUNDING

PAST_THE_END = 1.02
"""Factor of a run's duration up to which a moment counts as its end: the paper shows 15 s, and the nozzle of the
reconstructed trial stops after 14.8 s."""


def take_frame(injection: Injection) -> Frame:
    """All particles of the first run that have left the nozzle, after its last frame."""
    injection.wait()
    state, out = injection.engine.state, injection.out
    return Frame(
        t_s=injection.t_s,
        position_mm=state.position_mm()[:out],
        velocity_mm_s=state.velocity_mm_s()[:out],
        age_s=(injection.done - injection.schedule.frame_of[:out]).astype(float) * injection.schedule.frame_s,
        # The numbers of ParticleState and of the kernels are the same.
        density=state.by_release(state.density)[:out].astype(float),
        state=state.status_of()[:out],
    )


class Moments:
    """A watcher that hands over a frame at each of some moments."""

    def __init__(self, times_s: Iterable[float], take: Callable[[float, Frame], None]) -> None:
        """``times_s`` increase and may be endless; ``take`` receives the moment, and the frame at or just after it."""
        self._times_s, self._take = iter(times_s), take
        self._next_s = math.inf

    def begin(self, injection: Injection) -> None:
        """Skip the moments before a resumed run's frame; a moment of that frame itself may not be taken yet."""
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
        """Number of frames at which the next moment is due, at least one."""
        if math.isinf(self._next_s):
            return math.inf
        number = max(1, math.ceil(self._next_s / injection.schedule.frame_s - ROUNDING))
        return min(number, injection.frames) if number <= PAST_THE_END * injection.frames else number
