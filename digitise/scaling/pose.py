"""Where the camera stood: its distance from the face and its tilt, as far as the photo tells."""

from dataclasses import dataclass

import numpy as np

from digitise.scaling.control import Fit
from digitise.scaling.view import View
from sealtwin.records import Floats

MOST_SPREAD_DEG = 1.0
"""Standard deviation of a tilt worth telling: a level held to the phone is as good."""
MOST_SPREAD_OF_DISTANCE = 0.1
"""The same of the distance, over it: one digit."""


@dataclass(frozen=True)
class Pose:
    """Of the camera, to the middle of the face."""

    distance_mm: float
    tilt_deg: float
    """Between the camera's axis and the normal of the face."""


def find_pose(
    fit: Fit, covariance: Floats, middle_mm: Floats, focal_px: float | None, distance_mm: float | None
) -> Pose | None:
    """By the distance, where it was measured; else by the focal length, where the camera wrote it; else by perspective.

    Perspective alone tells the focal length of a tilted camera (Zhang 2000, eq. 3 and 4). None where noise could have
    told something else.
    """

    def read(view: View) -> Floats:
        if distance_mm is not None:
            return np.array([_lean(view, middle_mm) * distance_mm, np.log(distance_mm)])
        return _sine_and_distance(
            view, fit.frame.centre_px, middle_mm, focal_px or _focal_px(view, fit.frame.centre_px)
        )

    sine, log_distance = read(fit.view)
    if not np.all(np.isfinite((sine, log_distance))) or sine >= 1:
        return None
    sine_spread, distance_spread = fit.spread(read, covariance)
    if not (sine_spread < np.radians(MOST_SPREAD_DEG) and distance_spread < MOST_SPREAD_OF_DISTANCE):
        return None
    return Pose(float(np.exp(log_distance)), float(np.degrees(np.arcsin(sine))))


def _lean(view: View, middle_mm: Floats) -> float:
    """How fast the distance changes along the face, over the distance in its middle, mm⁻¹."""
    return float(np.hypot(*view.px_from_mm[2, :2]) / abs(view.px_from_mm[2] @ np.append(middle_mm, 1)))


def _sine_and_distance(view: View, centre_px: Floats, middle_mm: Floats, focal_px: float) -> Floats:
    """Sine of the tilt, and logarithm of the distance in mm."""
    rays = _from_centre(view, centre_px) / np.array([[focal_px], [focal_px], [1.0]])
    # Columns 1 and 2 are directions on the face, of unit length in mm.
    distance_mm = 2 * abs(rays[2] @ np.append(middle_mm, 1)) / np.linalg.norm(rays[:, :2], axis=0).sum()
    return np.array([_lean(view, middle_mm) * distance_mm, np.log(distance_mm)])


def _focal_px(view: View, centre_px: Floats) -> float:
    """The focal length with which the face's x and y are square to each other, and equally long; NaN without one."""
    (u, v), (p, q), (s, t) = _from_centre(view, centre_px)[:, :2]
    flat, deep = np.array([u * v + p * q, u * u + p * p - v * v - q * q]), np.array([s * t, s * s - t * t])
    # Square to the face both are 0: then any focal length will do.
    return float(np.sqrt(flat @ flat / -(flat @ deep))) if flat @ deep < 0 else np.nan


def _from_centre(view: View, centre_px: Floats) -> Floats:
    """Homography from the face to straightened pixels that count from the photo's centre."""
    shift = np.array([[1, 0, -centre_px[0]], [0, 1, -centre_px[1]], [0, 0, 1]])
    return shift @ view.px_from_mm
