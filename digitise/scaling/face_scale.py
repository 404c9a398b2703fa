"""The scale by the size of the sample's face: its four corners, found by its edges or given."""

from pathlib import Path

import numpy as np

from digitise.geometry.polyline import Box, depth_inside, rectangle
from digitise.pictures.raster import Map
from digitise.scaling.control import fit_view
from digitise.scaling.face import find_face
from digitise.scaling.pose import find_pose
from digitise.scaling.view import MIDDLE, Scale, places_px
from digitise.settings import PhotoInput
from sealtwin.errors import InputError
from sealtwin.records import Floats

CLICKED_PX, FOUND_PX = 1.0, 0.5
"""Standard deviation of a corner's coordinates: of a click, and of edges with a soft shadow along them."""
FACE_MM = 0.25
"""Standard uncertainty of each side of the face: a calliper on mortar edges tells half a millimetre, at two sigma."""

MOST_FORESHORTENED = 2.0
"""Between the sides of a face, by a camera 60 degrees off square. Corners that start elsewhere than at the lower left
turn a face by a quarter, which changes that of one half longer than wide by more."""


def scale_by_face(brightness: Map, settings: PhotoInput, face_mm: Box, focal_px: float | None, file: Path) -> Scale:
    """Four corners fix the homography exactly; how straight the found edges are stands in for its misfit.

    Raises InputError where no such face stands out, or the corners given are in another order or out of sight.
    """
    size_px = (brightness.shape[1], brightness.shape[0])
    width_mm, height_mm = face_mm[2:]
    corners_px, bend_px, noise_px = given_corners(settings, size_px, file), None, CLICKED_PX
    if corners_px is None:
        corners_px, bend_px = find_face(brightness, (width_mm, height_mm), file)
        noise_px = FOUND_PX
    fit = fit_view(corners_px, rectangle(face_mm), size_px, lens=False)
    covariance = fit.covariance_of_clicks(noise_px)
    places = places_px(fit.view, size_px, face_mm)
    mm_per_px = float(fit.view.mm_per_px_at(places)[MIDDLE])
    pose = find_pose(fit, covariance, fit.view.to_mm(places)[MIDDLE], focal_px, settings.camera_distance_mm)
    found = "corners given" if bend_px is None else "found by its edges"
    # Of the geometric mean of both directions, to which each side adds half of its own.
    by_calliper = FACE_MM * np.hypot(0.5 / width_mm, 0.5 / height_mm)
    return Scale(
        view=fit.view,
        mm_per_px=mm_per_px,
        source=f"face of {width_mm:g} x {height_mm:g} mm, {found}",
        residual_mm=None if bend_px is None else bend_px * mm_per_px,
        uncertainty=float(np.hypot(fit.spread_of_scale(places, covariance), by_calliper)),
        camera_tilt_deg=None if pose is None else pose.tilt_deg,
        face_mm=face_mm,
    )


def given_corners(settings: PhotoInput, size_px: tuple[int, int], file: Path) -> Floats | None:
    """The user's corners of the face, (4, 2).

    Raises InputError where they are out of sight, do not go round it, or go round another shape than that of face_mm.
    """
    if settings.face_corners_px is None:
        return None
    corners_px = np.array(settings.face_corners_px, dtype=float)
    _check_in_sight(corners_px, size_px, file)
    _check_order(corners_px, file)
    if settings.face_mm is not None:
        _check_shape(corners_px, settings.face_mm, file)
    return corners_px


def _check_in_sight(corners_px: Floats, size_px: tuple[int, int], file: Path) -> None:
    """A corner may be cut off by the photo's border, but not lie a photo's width away."""
    for (x, y), beyond in zip(corners_px, -depth_inside(corners_px, (0, 0, *size_px)), strict=True):
        if beyond > max(size_px) / 2:
            raise InputError(
                f"{file}: face_corners_px has ({x:g}, {y:g}), {beyond:.3g} px outside the photo of {size_px[0]} x "
                f"{size_px[1]} px; x runs right and y down, from 0."
            )


def _check_order(corners_px: Floats, file: Path) -> None:
    """Going round from the lower left by the lower right turns left in the photo, and never otherwise."""
    side = np.roll(corners_px, -1, axis=0) - corners_px
    after = np.roll(side, -1, axis=0)
    if not np.all(side[:, 0] * after[:, 1] - side[:, 1] * after[:, 0] < 0):
        listed = " ".join(f"({x:g}, {y:g})" for x, y in corners_px)
        raise InputError(
            f"{file}: face_corners_px {listed} do not go round a face from its lower left corner by lower right and "
            "upper right to upper left (px, y down)."
        )


def _check_shape(corners_px: Floats, face_mm: tuple[float, float], file: Path) -> None:
    """However the camera was tilted, a long face does not look high."""
    lower, right, upper, left = np.linalg.norm(np.roll(corners_px, -1, axis=0) - corners_px, axis=1)
    seen, expected = (lower + upper) / (left + right), face_mm[0] / face_mm[1]
    if max(seen / expected, expected / seen) > MOST_FORESHORTENED:
        raise InputError(
            f"{file}: face_corners_px go round a face {seen:.2f} times as wide as high, face_mm says {expected:.2f}. "
            "List corners from the lower left by lower right and upper right to upper left (px, y down), or correct "
            "face_mm (width, height in the photo)."
        )
