"""Worlds: how the second reality differs from the inputs that a lab declares.

A world changes the true inputs of a pour. Their names in the benchmarks are those of an outside review.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.reality.inputs import Cavity, Paste, Pour

Inputs = tuple[Cavity, Paste, Pour]
World = Callable[[Cavity, Paste, Pour], Inputs]


def as_declared(cavity: Cavity, paste: Paste, pour: Pour) -> Inputs:
    return cavity, paste, pour


def slips(cavity: Cavity, paste: Paste, pour: Pour) -> Inputs:
    """Walls and floor bear half of the yield stress and a third of the friction."""
    return cavity, replace(paste, wall_share=0.5, wall_friction=1.0 / 3.0), pour


def stiffens(part: float) -> World:
    return lambda cavity, paste, pour: (cavity, replace(paste, stiffening_pa_s=0.3 * part), pour)


def late(part: float) -> World:
    return lambda cavity, paste, pour: (cavity, paste, replace(pour, delay_s=pour.delay_s + 0.4 * part))


def flows(factor: float) -> World:
    return lambda cavity, paste, pour: (cavity, paste, replace(pour, flow_mm3_s=factor * pour.flow_mm3_s))


def uneven(part: float) -> World:
    """Return floor by 8 % and width by 6 %, in waves whose means over the length are 0."""

    def world(cavity: Cavity, paste: Paste, pour: Pour) -> Inputs:
        fine = _fine(cavity)
        depth = fine.depth_mm * (1.0 + 0.08 * part * _wave(fine, 3.0, 0.7))
        return (
            replace(fine, depth_mm=depth, width_mm=fine.width_mm * (1.0 + 0.06 * part * _wave(fine, 2.0, 2.1))),
            paste,
            pour,
        )

    return world


def wets(part: float) -> World:
    return lambda cavity, paste, pour: (cavity, replace(paste, wetting=part), pour)


def together(*worlds: World) -> World:
    def world(cavity: Cavity, paste: Paste, pour: Pour) -> Inputs:
        inputs = (cavity, paste, pour)
        for one in worlds:
            inputs = one(*inputs)
        return inputs

    return world


A_DAY = together(stiffens(0.5), late(0.5), uneven(0.5), wets(0.5), flows(0.97))
"""Half of several changes at once."""


def _fine(cavity: Cavity) -> Cavity:
    """Return the same cavity with a station each 0.5 mm, on which waves can be drawn."""
    s_mm = np.linspace(cavity.s_mm[0], cavity.s_mm[-1], max(round(2 * (cavity.s_mm[-1] - cavity.s_mm[0])), 2) + 1)
    parts = {
        name: np.interp(s_mm, cavity.s_mm, getattr(cavity, name))
        for name in ("width_mm", "depth_mm", "left_deg", "right_deg")
    }
    return replace(cavity, s_mm=s_mm, **parts)


def _wave(cavity: Cavity, waves: float, phase: float) -> np.ndarray:
    """Return ``waves`` waves over the length, of amplitude 1 and mean 0."""
    return np.sin(2.0 * np.pi * waves * (cavity.s_mm - cavity.s_mm[0]) / np.ptp(cavity.s_mm) + phase)
