"""Mouths of made-up slots in the plane, for the tests of mesh import."""

import numpy as np
from manifold3d import CrossSection, FillRule

from sealtwin.core.records import Floats


def zigzag(turn_deg: float, legs: int = 4, leg_mm: float = 25.0) -> Floats:
    """Corners of a line whose legs turn left and right in turn, (legs + 1, 2), along x on the whole."""
    heading = np.radians([(-1) ** (leg + 1) * turn_deg / 2 for leg in range(legs)])
    steps_mm = leg_mm * np.column_stack([np.cos(heading), np.sin(heading)])
    return np.vstack([np.zeros(2), np.cumsum(steps_mm, axis=0)])


def strip(line_mm: Floats, width_mm: float) -> CrossSection:
    """A strip of constant width along a line, with mitred corners and square ends."""
    ahead = np.diff(line_mm, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    normal = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    inner = (normal[1:] + normal[:-1]) / (1 + (normal[1:] * normal[:-1]).sum(axis=1))[:, None]
    half_mm = width_mm / 2 * np.vstack([normal[:1], inner, normal[-1:]])
    return CrossSection([np.vstack([line_mm - half_mm, (line_mm + half_mm)[::-1]])], FillRule.NonZero)


def straight(length_mm: float, width_mm: float) -> CrossSection:
    """A strip along x from the origin."""
    return strip(np.array([[0.0, 0.0], [length_mm, 0.0]]), width_mm)
