"""The least gradient that moves paste along a section of a slot, in closed form.

Units of this module: the width at the surface, and the yield stress.
"""

from math import acos, pi

import numpy as np

from benchmarks.reality.section import Floats


def yield_gradient(
    depth: Floats | float, narrowing: Floats | float, wall_share: float, floor_share: float
) -> Floats | float:
    """Return the gradient at which a trapezoid of width 1 at its free surface begins to flow, over the yield stress.

    ``narrowing``: the part of the width that is lost from surface to floor. Solid bears ``share`` times the yield
    stress. The part that moves minimises its border over its area, the free surface not counted: Mosolov and
    Miasnikov (1965); a Cheeger set if walls and floor bear the whole stress, whose corners are arcs: Kawohl and
    Lachand-Robert (2006). If they bear less, the arcs meet them at an angle with that cosine.
    """
    floor = 1.0 - narrowing
    slope = narrowing / (2.0 * depth)
    lean = np.arctan(slope)
    border = 2.0 * depth * np.sqrt(1.0 + slope * slope) * wall_share + floor * floor_share
    area = depth * (1.0 - 0.5 * narrowing)
    rounded = 0.0
    if wall_share > 0.0 and floor_share > 0.0:
        rounded = 2.0 * _corner(pi / 2.0 + lean, wall_share)
    if wall_share > 0.0:
        # A corner at the free surface is half of the corner that its mirror image makes of it.
        rounded = rounded + _corner(pi - 2.0 * np.maximum(lean, 0.0), wall_share)
    # 1 / radius of the arcs is the gradient: rounded r^2 - border r + area = 0.
    return (border + np.sqrt(border * border - 4.0 * rounded * area)) / (2.0 * area)


def _corner(angle: Floats, share: float) -> Floats:
    """Return what an arc of radius 1 takes off the area of a corner: 0 if it would not pay to leave the corner out."""
    touching = acos(min(share, 1.0))
    turn = np.maximum(pi - angle - 2.0 * touching, 0.0)
    leg = np.sin(turn / 2.0) / np.sin(angle / 2.0)
    return leg * leg * 0.5 * np.sin(angle) - (turn - np.sin(turn)) / 2.0
