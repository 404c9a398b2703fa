"""A camera's view of the face's plane: mapping between pixels and millimetres, fit to known points, and uncertainty."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import Box, project
from sealtwin.core.arrays import Floats, cross, rms
from sealtwin.core.facts import Facts

MIDDLE = 12  # Index of the middle point of ``places_px``
MAX_SPREAD_DEG = 1.0  # A tilt with a larger standard deviation is not reported. A phone's level is as uncertain
LENS_SIGMAS = 3.0  # A lens is fitted if its distortion is more than this many standard deviations
CORNERS = 4  # Number of corners of a marker
MAX_GROUPS = 16  # Largest number of groups of markers that are left out in turn


@dataclass(frozen=True)
class Lens:
    """Radial distortion of a lens, which shifts each point along the ray from the photo's centre."""

    centre_px: Floats  # (2,)
    # Distortion in px⁻²: k1 divided by the square of the focal length in px. Negative for barrel distortion
    bend_px2: float

    def bent(self, straight_px: Floats) -> Floats:
        """Map points of an undistorted picture, (n, 2), to points of this lens's picture, (n, 2)."""
        away_px = straight_px - self.centre_px
        return self.centre_px + away_px * (1 + self.bend_px2 * (away_px**2).sum(axis=1, keepdims=True))

    def straightened(self, seen_px: Floats) -> Floats:
        """Map points of this lens's picture, (n, 2), to an undistorted picture, (n, 2). Inverse of ``bent``."""
        if len(seen_px) == 0:
            return seen_px
        camera = np.eye(3)
        camera[:2, 2] = self.centre_px
        ends = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-9)
        bend = np.array([self.bend_px2, 0, 0, 0])
        seen_px = np.asarray(seen_px, float)[:, None]
        return cv2.undistortPoints(seen_px, camera, bend, P=camera, criteria=ends)[:, 0].astype(float)


@dataclass(frozen=True)
class View:
    """Mapping between pixels and millimetres: a homography and, optionally, a lens."""

    mm_from_px: Floats  # Homography from undistorted pixels to mm, (3, 3)
    lens: Lens | None = None

    def to_mm(self, points_px: Floats) -> Floats:
        """Map pixels, (n, 2), to points on the face in mm, (n, 2)."""
        return project(self.mm_from_px, points_px if self.lens is None else self.lens.straightened(points_px))

    def to_px(self, points_mm: Floats) -> Floats:
        """Map points on the face in mm, (n, 2), to pixels, (n, 2)."""
        straight_px = project(self.px_from_mm, points_mm)
        return straight_px if self.lens is None else self.lens.bent(straight_px)

    def mm_per_px_at(self, points_px: Floats) -> Floats:
        """Return the local scale in mm/px at each point, (n,). It is the geometric mean over all directions.

        Tilt and lens make the scale vary over the photo.
        """
        half_px = 0.5 * np.eye(2)
        along_x, along_y = (self.to_mm(points_px + step) - self.to_mm(points_px - step) for step in half_px)
        return np.sqrt(np.abs(cross(along_x, along_y)))

    @cached_property
    def px_from_mm(self) -> Floats:
        """Inverse of ``mm_from_px``, (3, 3)."""
        return _inverse(self.mm_from_px)


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Mapping between a photo and the face, with its source and uncertainty."""

    view: View  # The only mapping between pixels and millimetres
    mm_per_px: float  # Scale at the centre of the face, or of the markers or photo if face_mm is unknown
    scale_source: str
    # Unit of lengths in messages. "px" if the photo has no scale yet, in which case 1 px is stored as 1 mm
    unit: Literal["mm", "px"] = "mm"
    scale_residual_mm: float | None = None
    scale_uncertainty: float | None = None  # Relative standard uncertainty of a length; None if unknown
    # Angle between the camera's axis and the face's normal; None if the photo does not show it
    camera_tilt_deg: float | None = None
    face_mm: Box | None = None
    markers_px: tuple[Floats, ...] = ()  # Corners of the detected markers, which are not part of the sample
    warnings: Facts = ()


def places_px(view: View, box_mm: Box) -> Floats:
    """Return a grid of points over a box on the face, (25, 2) in px. The middle point has the index ``MIDDLE``."""
    fifths = np.argwhere(np.ones((5, 5))) / 4
    return view.to_px(box_mm[:2] + fifths * np.subtract(box_mm[2:], box_mm[:2]))


@dataclass(frozen=True)
class Fit:
    """The view that fits known points best, and other views that show the effect of errors in the points."""

    view: View
    others: list[View]  # Fits without some points, or with one coordinate moved by its standard deviation
    weight: float  # Ratio of a quantity's variance to the sum of its squared differences in the other views

    def spread(self, quantity: Callable[[View], Floats]) -> Floats:
        """Return the standard deviation of a quantity that is computed from a view, (n,)."""
        value = quantity(self.view)
        return np.sqrt(self.weight * np.sum([(quantity(other) - value) ** 2 for other in self.others], axis=0))

    def spread_of_scale(self, places_px: Floats) -> float:
        """Return the relative standard deviation of the local scale, as RMS over ``places_px`` in the photo."""
        spread = self.spread(lambda view: np.log(view.mm_per_px_at(places_px)))
        return rms(spread)


def fit_markers(seen_px: Floats, true_mm: Floats, size_px: tuple[int, int], lens_wanted: bool) -> Fit:
    """Fit a view to the corners of n markers, (4 n, 2), with a radial lens term if the distortion is significant.

    For the uncertainty, whole markers are left out in turn (jackknife), since the corners of a marker may have the same
    error. If ``lens_wanted`` is False, no lens is fitted.
    """

    def bend_px2(view: View) -> Floats:
        return np.array([view.lens.bend_px2 if view.lens else 0.0])

    plain = View(_inverse(cv2.findHomography(true_mm, seen_px)[0]))
    if lens_wanted:
        centre_px = (np.array(size_px) - 1) / 2
        bent = _without_each(seen_px, true_mm, replace(plain, lens=Lens(centre_px, 0.0)))
        (bend,), (sigma,) = bend_px2(bent.view), bent.spread(bend_px2)
        # With a barrel distortion b, no point is farther than 2 / sqrt(-27 b) from the centre. If that is less than
        # half the photo's diagonal, the fit is not a lens.
        if abs(bend) > LENS_SIGMAS * sigma and bend > -4 / 27 / (centre_px @ centre_px):
            return bent
    return _without_each(seen_px, true_mm, plain)


def _without_each(seen_px: Floats, true_mm: Floats, start: View) -> Fit:
    group = np.arange(len(seen_px)) // CORNERS % MAX_GROUPS
    view = fit_view(seen_px, true_mm, start)
    rest = [group != number for number in range(group.max() + 1)]
    return Fit(view, [fit_view(seen_px[kept], true_mm[kept], view) for kept in rest], 1 - 1 / len(rest))


def fit_corners(seen_px: Floats, true_mm: Floats, sd_px: float) -> Fit:
    """Fit a view to four corners, (4, 2). Each coordinate of a corner has the standard deviation ``sd_px``."""
    # First without a change, and then with each coordinate moved in turn.
    moves_px = sd_px * np.eye(9, 8, -1).reshape(9, 4, 2)
    start = View(_inverse(cv2.findHomography(true_mm, seen_px)[0]))
    view, *others = (fit_view(seen_px + move_px, true_mm, start) for move_px in moves_px)
    return Fit(view, others, 1.0)


def fit_view(seen_px: Floats, true_mm: Floats, start: View) -> View:
    """Fit a homography to four or more points by least squares.

    If ``start`` has a lens, its radial term is fitted too.
    """
    # Imported here, since it takes a tenth of a second.
    from scipy.optimize import least_squares

    first = (start.px_from_mm / start.px_from_mm[2, 2]).ravel()[:8]
    if start.lens:
        first = np.append(first, start.lens.bend_px2)

    def view_of(parameters: Floats) -> View:
        lens = start.lens and Lens(start.lens.centre_px, parameters[8])
        return View(_inverse(np.append(parameters[:8], 1.0).reshape(3, 3)), lens)

    def misses_px(parameters: Floats) -> Floats:
        return (view_of(parameters).to_px(true_mm) - seen_px).ravel()

    return view_of(least_squares(misses_px, first, method="lm", x_scale="jac").x)


def _inverse(matrix: NDArray[Any]) -> Floats:
    return np.asarray(np.linalg.inv(matrix), float)


def find_tilt(
    fit: Fit, middle_px: Floats, focal_px: float | None, distance_mm: float | None
) -> tuple[float | None, float | None]:
    """Return the camera's distance from the middle of the face in mm, and its tilt in degrees.

    The tilt is the angle between the camera's axis and the face's normal. The distance is ``distance_mm`` if given.
    Otherwise it is computed from the focal length, ``focal_px``. Both are None if neither is known. The tilt is also
    None if its standard deviation is not below ``MAX_SPREAD_DEG``.
    """
    if distance_mm is None:
        if focal_px is None:
            return None, None
        distance_mm = focal_px * float(fit.view.mm_per_px_at(middle_px[None])[0])
    middle = np.append(fit.view.to_mm(middle_px[None]), 1)

    def sine(view: View) -> Floats:
        # Growth of the depth per mm along the face, divided by the depth, times the distance.
        across, up, _ = depth = view.px_from_mm[2]
        return np.hypot([across], up) / abs(depth @ middle) * distance_mm

    (value,), (spread,) = sine(fit.view), fit.spread(sine)
    sure = value < 1 and spread < np.radians(MAX_SPREAD_DEG)
    return distance_mm, float(np.degrees(np.arcsin(value))) if sure else None
