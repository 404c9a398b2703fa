"""View of the face's plane by a camera: mapping between pixels and millimetres, its fit to points, its uncertainty."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from digitise.geometry.polyline import Box, project
from sealtwin.core.records import Floats

MIDDLE = 12  # Index of the middle point of ``places_px``
MOST_SPREAD_DEG = 1.0  # Largest standard deviation of a reported tilt, that of a level on the phone
MOST_SPREAD_OF_DISTANCE = 0.1  # Largest relative standard deviation of a distance that is used, for one digit


@dataclass(frozen=True)
class Lens:
    """Radial distortion of a lens, which shifts each point along its ray from the photo's centre."""

    centre_px: Floats  # (2,)
    bend_px2: float  # Distortion in px⁻²: k1 over the square of the focal length. Negative is the barrel of a wide lens

    def bent(self, straight_px: Floats) -> Floats:
        """Map points of an undistorted picture to this lens's picture, (n, 2) to (n, 2)."""
        away_px = straight_px - self.centre_px
        return self.centre_px + away_px * (1 + self.bend_px2 * (away_px**2).sum(axis=1, keepdims=True))

    def straightened(self, seen_px: Floats) -> Floats:
        """Invert ``bent``, exactly within ``reach_px`` of the centre, (n, 2) to (n, 2).

        The root of r (1 + b r²) = d is r = 3 d sinh(a / 3) / sinh(a), sinh(a) = d sqrt(27 |b|) / 2; or sin, if b < 0.
        """
        away_px = seen_px - self.centre_px
        x = np.hypot(*away_px.T) * np.sqrt(27 * abs(self.bend_px2)) / 2
        x = np.maximum(x, 1e-9)  # The centre does not move; 0 / 0 would be NaN.
        third = np.sinh(np.arcsinh(x) / 3) if self.bend_px2 > 0 else np.sin(np.arcsin(np.minimum(x, 1)) / 3)
        return self.centre_px + away_px * (3 * third / x)[:, None]

    @property
    def reach_px(self) -> float:
        """Distance from the photo's centre at which a barrel folds back: nothing on the face appears beyond it."""
        return np.inf if self.bend_px2 >= 0 else 2 / np.sqrt(-27 * self.bend_px2)


@dataclass(frozen=True)
class View:
    """A homography and a lens."""

    mm_from_px: Floats  # Homography from undistorted pixels, (3, 3)
    lens: Lens | None = None

    def to_mm(self, points_px: Floats) -> Floats:
        """Map pixels to places on the face, (n, 2) to (n, 2)."""
        return project(self.mm_from_px, points_px if self.lens is None else self.lens.straightened(points_px))

    def to_px(self, points_mm: Floats) -> Floats:
        """Map places on the face to pixels, (n, 2) to (n, 2)."""
        straight_px = project(self.px_from_mm, points_mm)
        return straight_px if self.lens is None else self.lens.bent(straight_px)

    def mm_per_px_at(self, points_px: Floats) -> Floats:
        """Return the local scale at each point, the geometric mean of all directions, (n,); tilt and lens vary it."""
        half_px = 0.5 * np.eye(2)
        along_x, along_y = (self.to_mm(points_px + step) - self.to_mm(points_px - step) for step in half_px)
        return np.sqrt(np.abs(along_x[:, 0] * along_y[:, 1] - along_x[:, 1] * along_y[:, 0]))

    @cached_property
    def px_from_mm(self) -> Floats:
        """Inverse of ``mm_from_px``."""
        return np.asarray(np.linalg.inv(self.mm_from_px), dtype=float)


@dataclass(frozen=True, kw_only=True)
class Scale:
    """The mapping between a photo and the face, its source and its uncertainty."""

    view: View  # The only mapping between pixels and millimetres
    mm_per_px: float  # Scale at the centre of the face, or of the photo if the face is not given
    scale_source: str
    scale_residual_mm: float | None = None
    scale_uncertainty: float | None = None  # Relative standard uncertainty of a length; None if unknown
    camera_tilt_deg: float | None = None  # Between the camera's axis and the face's normal, if the photo shows it
    face_mm: Box | None = None
    markers_px: tuple[Floats, ...] = ()  # Corners of the detected markers: they are not part of the sample
    warnings: tuple[str, ...] = ()


def places_px(view: View, size_px: tuple[int, int], face_mm: Box | None) -> Floats:
    """Return points (25, 2) spread over the face, or over the photo's inner half. The middle one is at ``MIDDLE``."""
    fifths = np.stack(np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5)), axis=-1).reshape(-1, 2)
    if face_mm is not None:
        low, high = np.reshape(face_mm, (2, 2))
        return view.to_px(low + fifths * (high - low))
    return (np.array(size_px) - 1) * (0.25 + 0.5 * fifths)


@dataclass(frozen=True)
class Fit:
    """The view that projects the control points closest to their places in the photo, by least squares.

    Both planes are shifted and scaled to about 1, so that all parameters have one order of magnitude.
    """

    centre_px: Floats
    unit_px: float
    centre_mm: Floats
    unit_mm: float
    parameters: Floats  # Homography from mm to px by rows, without its last element, 1; then any lens's distortion
    misses: Floats  # Projected less measured points, in normalised units, (2 n,)
    slopes: Floats  # Derivatives of the misses by the parameters, (2 n, parameters)

    @property
    def view(self) -> View:
        return self.view_by(self.parameters)

    def view_by(self, parameters: Floats) -> View:
        """Return the view that these parameters describe."""
        to_unit = np.diag([1 / self.unit_px, 1 / self.unit_px, 1.0]) @ _shift(-self.centre_px)
        to_mm = _shift(self.centre_mm) @ np.diag([self.unit_mm, self.unit_mm, 1.0])
        mm_from_px = to_mm @ np.linalg.inv(_homography(parameters)) @ to_unit
        lens = Lens(self.centre_px, parameters[8] / self.unit_px**2) if len(parameters) > 8 else None
        return View(mm_from_px / mm_from_px[2, 2], lens)

    def covariance_by_group(self, size: int) -> Floats:
        """Return the parameters' covariance by a jackknife over groups of ``size`` points, which may share an error."""
        slopes = self.slopes.reshape(-1, 2 * size, len(self.parameters))
        pulls = np.einsum("gip,gi->gp", slopes, self.misses.reshape(-1, 2 * size))
        others = self.slopes.T @ self.slopes - np.einsum("gip,giq->gpq", slopes, slopes)
        moved = np.linalg.solve(others, pulls[..., None])[..., 0]
        return (1 - 1 / len(moved)) * moved.T @ moved

    def covariance_of_clicks(self, sd_px: float) -> Floats:
        """Return the parameters' covariance for this standard deviation of each point's coordinates."""
        inverse = np.asarray(np.linalg.inv(self.slopes.T @ self.slopes), dtype=float)
        return (sd_px / self.unit_px) ** 2 * inverse

    def spread(self, quantity: Callable[[View], Floats], covariance: Floats) -> Floats:
        """Return the standard deviation of a ``quantity`` of views, (n,), for a covariance of the parameters."""
        sizes = np.maximum(np.sqrt(np.diag(covariance)), 1e-9)

        def slope(step: Floats) -> Floats:
            after, before = (quantity(self.view_by(self.parameters + by)) for by in (step, -step))
            return (after - before) / (2 * step.sum())

        gradient = np.transpose([slope(step) for step in np.diag(sizes)])
        return np.sqrt(np.einsum("np,pq,nq->n", gradient, covariance, gradient))

    def spread_of_scale(self, places_px: Floats, covariance: Floats) -> float:
        """Return the relative standard deviation of the local scale, RMS over ``places_px`` in the photo."""
        spread = self.spread(lambda view: view.mm_per_px_at(places_px), covariance)
        return float(np.sqrt(np.mean((spread / self.view.mm_per_px_at(places_px)) ** 2)))


def fit_view(seen_px: Floats, true_mm: Floats, size_px: tuple[int, int], lens: bool) -> Fit:
    """Fit a homography, and with ``lens`` a radial term, to four or more points in a photo of this width and height."""
    # Imported here, since it takes a tenth of a second.
    from scipy.optimize import least_squares

    centre_px = (np.array(size_px) - 1) / 2
    centre_mm = true_mm.mean(axis=0)
    unit_px, unit_mm = float(np.abs(seen_px - centre_px).max()), float(np.abs(true_mm - centre_mm).max())
    measured, true = (seen_px - centre_px) / unit_px, (true_mm - centre_mm) / unit_mm
    start = np.asarray(cv2.findHomography(true, measured)[0], dtype=float)
    parameters = (start / start[2, 2]).ravel()[:8]

    def misses(tried: Floats) -> Floats:
        straight = project(_homography(tried), true)
        bend = tried[8] if lens else 0.0
        return (straight * (1 + bend * (straight**2).sum(axis=1, keepdims=True)) - measured).ravel()

    solved = least_squares(misses, np.append(parameters, 0.0) if lens else parameters, method="lm")
    return Fit(centre_px, unit_px, centre_mm, unit_mm, solved.x, solved.fun, np.asarray(solved.jac))


def _homography(parameters: Floats) -> Floats:
    return np.append(parameters[:8], 1.0).reshape(3, 3)


def _shift(by: Floats) -> Floats:
    return np.array([[1, 0, by[0]], [0, 1, by[1]], [0, 0, 1.0]])


def find_pose(
    fit: Fit, covariance: Floats, middle_mm: Floats, focal_px: float | None, distance_mm: float | None
) -> tuple[float | None, float | None]:
    """Find the camera's distance from the middle of the face, mm, and the tilt of its axis to the normal, degrees.

    They follow from the measured distance, from the camera's own focal length, or else from perspective (Zhang 2000).
    If the photo does not show them well enough, the tilt is None, and the distance is the measured one.
    """

    def read(view: View) -> Floats:
        # The homography from the face to undistorted pixels with the origin in the photo's centre.
        plane = _shift(-fit.centre_px) @ view.px_from_mm
        middle = np.append(middle_mm, 1)
        away_mm = distance_mm or _distance_mm(plane, middle, focal_px or _focal_px(plane))
        lean_per_mm = np.hypot(*view.px_from_mm[2, :2]) / abs(view.px_from_mm[2] @ middle)
        return np.array([lean_per_mm * away_mm, np.log(away_mm)])

    sine, log_distance = read(fit.view)
    if not np.all(np.isfinite((sine, log_distance))) or sine >= 1:
        return distance_mm, None
    sine_spread, distance_spread = fit.spread(read, covariance)
    if not (sine_spread < np.radians(MOST_SPREAD_DEG) and distance_spread < MOST_SPREAD_OF_DISTANCE):
        return distance_mm, None
    return float(np.exp(log_distance)), float(np.degrees(np.arcsin(sine)))


def _distance_mm(plane: Floats, middle: Floats, focal_px: float) -> float:
    rays = plane / np.array([[focal_px], [focal_px], [1.0]])
    # Columns 1 and 2 are directions on the face, of unit length in mm.
    return float(2 * abs(rays[2] @ middle) / np.linalg.norm(rays[:, :2], axis=0).sum())


def _focal_px(plane: Floats) -> float:
    """Return the focal length for which the face's axes are orthogonal and of equal scale; NaN if there is none."""
    (u, v), (p, q), (s, t) = plane[:, :2]
    flat, deep = np.array([u * v + p * q, u * u + p * p - v * v - q * q]), np.array([s * t, s * s - t * t])
    # For a camera square to the face both are 0, and any focal length fits.
    return float(np.sqrt(flat @ flat / -(flat @ deep))) if flat @ deep < 0 else np.nan
