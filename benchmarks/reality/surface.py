"""The surface across the slot, and paste beside its mouth. Metres, pascals, newtons."""

from functools import lru_cache
from math import cos, pi, radians, sin

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

from benchmarks.reality.section import Floats

FACE_REACH_M = 0.02
"""A liquid without yield stress would spread on the face for ever: it is stopped this far from the mouth."""


def roof_height(yield_pa: Floats, share: float, weight_pa_m: float, width_m: Floats, depth_m: Floats) -> Floats:
    """Return by how much paste in the middle of the slot may lie above paste at its walls.

    A slope that the yield stress holds is tau / (weight x thickness of the layer that would flow): Liu and Mei (1989,
    section 3, both signs). Levelling a bump between walls moves paste down to half a width, or to the floor. Paste at
    the walls bears ``share`` of the yield stress. A layer on the floor cannot be lower at the walls than the floor.
    """
    layer = np.minimum(depth_m, 0.5 * width_m)
    return np.minimum(share * yield_pa * 0.5 * width_m / (weight_pa_m * layer), 2.0 * depth_m)


def roof_after(roof: Floats, rise_m: Floats, height_m: Floats) -> Floats:
    """Return the roof, from -1 (trough) to 1 (crown), after the mean level rose.

    Walls hold paste back, so that the middle moves first: a rise of about the roof's height turns a trough to a crown.
    """
    moved = rise_m / np.maximum(height_m, 1e-9)
    return np.where(height_m > 1e-9, (roof + moved) / (1.0 + np.abs(moved)), 0.0)


def area_beside(level_m: Floats, roof_m: Floats, yield_pa: Floats, weight_pa_m: float) -> Floats:
    """Return the area of paste on the face, on both sides of the mouth, under paste that is ``level_m`` above it.

    Each side is at rest as a sheet on a plane, h^2 = 2 tau x / weight (Liu and Mei 1989), of area 2/3 h L; its highest
    point is the surface at the mouth's edge.
    """
    edge = np.maximum(level_m - 0.5 * roof_m, 0.0)
    reach = weight_pa_m * edge * edge / np.maximum(2.0 * yield_pa, 1e-300)
    return 2.0 * edge * np.minimum(reach, FACE_REACH_M) * 2.0 / 3.0


def share_of_disc(place: Floats) -> Floats:
    """Return the part of a disc of radius 1 about 0 that lies left of ``place``."""
    x = np.clip(place, -1.0, 1.0)
    return 0.5 + (x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / pi


@lru_cache(maxsize=4096)
def meniscus_m(width_m: float, capillary_m: float, contact_deg: float, lean_deg: float) -> tuple[float, float]:
    """Return by how much a liquid's level in the middle is below its mean, and at the walls above its mean."""
    middle, mean, wall = capillary_curve_m(width_m, capillary_m, contact_deg, lean_deg)
    return mean - middle, wall - mean


def capillary_curve_m(
    width_m: float, capillary_m: float, contact_deg: float, lean_deg: float = 0.0
) -> tuple[float, float, float]:
    """Return the height of a liquid between two walls, above that of a wide pool: in the middle, mean, and at a wall.

    The exact Young-Laplace curve, by the slope's angle a: dz/da = sin a / z, dy/da = cos a / z in capillary lengths
    (Batchelor 1967, section 1.9). ``lean_deg``: the walls' tilt, above 0 if the slot narrows downward, where a wall
    leans away from the paste.
    """
    slope = radians(90.0 - contact_deg - lean_deg)
    if abs(slope) < 1e-6:
        return 0.0, 0.0, 0.0
    sign, end, half = (1.0 if slope > 0 else -1.0), abs(slope), 0.5 * width_m / capillary_m

    def curve(middle: float) -> tuple[float, float]:
        """Return half of the width, and the height at the wall, of the curve from ``middle`` on."""

        def bend(angle: float, state: list[float]) -> list[float]:
            return [cos(angle) / state[1], sin(angle) / state[1]]

        ended = solve_ivp(bend, (0.0, end), [0.0, middle], rtol=1e-10, atol=1e-12)
        return float(ended.y[0, -1]), float(ended.y[1, -1])

    middle = root_scalar(lambda height: curve(height)[0] - half, bracket=(1e-7, 50.0 / half), xtol=1e-13).root
    # The walls' pull bears the weight of what is above the pool's level.
    mean, wall = sin(end) / half, curve(middle)[1]
    return sign * middle * capillary_m, sign * mean * capillary_m, sign * wall * capillary_m
