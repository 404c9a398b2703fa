"""Fit a view of the face to points of known place, and say how far noise in them could have moved it."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from digitise.geometry.polyline import project
from digitise.scaling.lens import Lens
from digitise.scaling.view import View
from sealtwin.records import Floats


@dataclass(frozen=True)
class Frame:
    """Both planes moved and scaled to about 1, so that all parameters of a fit are of one size."""

    centre_px: Floats
    unit_px: float
    centre_mm: Floats
    unit_mm: float

    def placed(self, parameters: Floats, points_mm: Floats) -> Floats:
        """Where a view of these parameters shows points, in this frame's units of the photo."""
        straight = project(_homography(parameters), (points_mm - self.centre_mm) / self.unit_mm)
        bend = parameters[8] if len(parameters) > 8 else 0.0
        return straight * (1 + bend * (straight**2).sum(axis=1, keepdims=True))

    def view(self, parameters: Floats) -> View:
        to_unit = np.diag([1 / self.unit_px, 1 / self.unit_px, 1.0]) @ _shift(-self.centre_px)
        to_mm = _shift(self.centre_mm) @ np.diag([self.unit_mm, self.unit_mm, 1.0])
        mm_from_px = to_mm @ np.linalg.inv(_homography(parameters)) @ to_unit
        lens = Lens(self.centre_px, parameters[8] / self.unit_px**2) if len(parameters) > 8 else None
        return View(mm_from_px / mm_from_px[2, 2], lens)


@dataclass(frozen=True)
class Fit:
    """The view that puts the control points closest to where they were seen, by least squares in the photo."""

    frame: Frame
    parameters: Floats
    """Homography from mm to px, row by row without its last element, 1; then the lens's bend, if it is fitted."""
    misses: Floats
    """(2 n,): where each point is put less where it was seen, in the frame's units."""
    slopes: Floats
    """(2 n, parameters): of the misses."""

    @property
    def view(self) -> View:
        return self.frame.view(self.parameters)

    def covariance_by_group(self, size: int) -> Floats:
        """Of the parameters, by leaving out each group of ``size`` successive points in turn.

        A delete-a-group jackknife: the points of a group may share their error, as the corners of a marker do that was
        glued on askew. Each refit is one Gauss-Newton step from the whole one.
        """
        slopes = self.slopes.reshape(-1, 2 * size, len(self.parameters))
        pulls = np.einsum("gip,gi->gp", slopes, self.misses.reshape(-1, 2 * size))
        others = self.slopes.T @ self.slopes - np.einsum("gip,giq->gpq", slopes, slopes)
        moved = np.linalg.solve(others, pulls[..., None])[..., 0]
        return (1 - 1 / len(moved)) * moved.T @ moved

    def covariance_of_clicks(self, sd_px: float) -> Floats:
        """Of the parameters, where each coordinate of each point was seen with this standard deviation."""
        inverse = np.asarray(np.linalg.inv(self.slopes.T @ self.slopes), dtype=float)
        return (sd_px / self.frame.unit_px) ** 2 * inverse

    def spread(self, quantity: Callable[[View], Floats], covariance: Floats) -> Floats:
        """Standard deviation of what ``quantity`` reads off a view, (n,), for a covariance of the parameters."""
        sizes = np.maximum(np.sqrt(np.diag(covariance)), 1e-9)
        gradient = np.transpose(
            [
                (quantity(self.frame.view(self.parameters + step)) - quantity(self.frame.view(self.parameters - step)))
                / (2 * size)
                for step, size in zip(np.diag(sizes), sizes, strict=True)
            ]
        )
        return np.sqrt(np.einsum("np,pq,nq->n", gradient, covariance, gradient))

    def folds_beyond(self, size_px: tuple[int, int]) -> bool:
        """Whether the whole photo lies where the lens still shows farther places farther out."""
        lens = self.view.lens
        return lens is None or lens.reach_px > float(np.linalg.norm(np.array(size_px) / 2))

    def spread_of_scale(self, places_px: Floats, covariance: Floats) -> float:
        """Standard deviation of the local scale over that scale, RMS over some places in the photo."""
        spread = self.spread(lambda view: view.mm_per_px_at(places_px), covariance)
        return float(np.sqrt(np.mean((spread / self.view.mm_per_px_at(places_px)) ** 2)))


def fit_view(seen_px: Floats, true_mm: Floats, size_px: tuple[int, int], lens: bool) -> Fit:
    """Fit a homography, and with ``lens`` a radial term, to four or more points in a photo of this width and height."""
    # Imported here: it costs a tenth of a second, which every command would pay.
    from scipy.optimize import least_squares

    centre_px = (np.array(size_px) - 1) / 2
    frame = Frame(
        centre_px,
        float(np.abs(seen_px - centre_px).max()),
        true_mm.mean(axis=0),
        float(np.abs(true_mm - true_mm.mean(axis=0)).max()),
    )
    seen = (seen_px - frame.centre_px) / frame.unit_px
    start = np.asarray(cv2.findHomography((true_mm - frame.centre_mm) / frame.unit_mm, seen)[0], dtype=float)
    parameters = (start / start[2, 2]).ravel()[:8]
    solved = least_squares(
        lambda tried: (frame.placed(tried, true_mm) - seen).ravel(),
        np.append(parameters, 0.0) if lens else parameters,
        method="lm",
    )
    return Fit(frame, solved.x, solved.fun, np.asarray(solved.jac))


def _homography(parameters: Floats) -> Floats:
    return np.append(parameters[:8], 1.0).reshape(3, 3)


def _shift(by: Floats) -> Floats:
    return np.array([[1, 0, by[0]], [0, 1, by[1]], [0, 0, 1.0]])
