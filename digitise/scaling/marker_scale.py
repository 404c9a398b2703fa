"""The scale by printed markers in the plane of the face."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import Box, depth_inside
from digitise.pictures.raster import Map
from digitise.scaling.control import Fit, fit_view
from digitise.scaling.face_scale import given_corners
from digitise.scaling.level import check_level
from digitise.scaling.markers import corners_mm, find_markers
from digitise.scaling.pose import find_pose
from digitise.scaling.view import MIDDLE, Scale, places_px
from digitise.settings import MarkerBoard, PhotoInput
from sealtwin.errors import InputError
from sealtwin.records import Floats

RESIDUAL_MM = 0.1
"""Largest RMS misfit of the markers: a sharp photo of a flat board leaves a twentieth of it."""
RESIDUAL_PX = 0.5
"""The same for coarse photos, whose corners are found to a part of a pixel."""
LENS_SIGMAS = 2.0
"""A lens is fitted where its bend is this many standard deviations from none (decision 0030)."""
BOARD_MM = 0.1
"""Standard uncertainty of the longest distance between markers, as a calliper reads it off the frame."""
CORNERS = 4
"""Of a marker."""


def scale_by_markers(
    image: NDArray[np.uint8],
    brightness: Map,
    settings: PhotoInput,
    board: MarkerBoard,
    face_mm: Box | None,
    focal_px: float | None,
    file: Path,
) -> Scale:
    """From the markers that are found. Raises InputError where they are too few, twice, or not where they should be."""
    size_px = (image.shape[1], image.shape[0])
    found = find_markers(image, brightness, board, file)
    known = [marker for marker in board.markers if marker.id in found]
    seen_px = np.concatenate([found[marker.id] for marker in known])
    true_mm = np.concatenate([corners_mm(board, marker) for marker in known])
    fit, covariance = fit_markers(seen_px, true_mm, size_px, settings.lens == "auto")
    view = fit.view
    miss_mm = np.linalg.norm(view.to_mm(seen_px) - true_mm, axis=1)
    residual_mm = float(np.sqrt(np.mean(miss_mm**2)))
    places = places_px(view, size_px, face_mm)
    mm_per_px = float(view.mm_per_px_at(places)[MIDDLE])
    limit_mm = max(RESIDUAL_MM, RESIDUAL_PX * mm_per_px)
    if residual_mm > limit_mm:
        worst = known[int(np.argmax(miss_mm)) // CORNERS].id
        raise InputError(
            f"{file}: the markers miss their places by {residual_mm:.2f} mm (at most {limit_mm:.2f}), most of all "
            f"marker {worst}: check x_mm, y_mm and size_mm, and that all lie flat, level with the face"
            f"{'; or let lens be auto' if settings.lens == 'none' else ''}."
        )
    if face_mm is not None and depth_inside(places, (0, 0, *size_px))[MIDDLE] < 0:
        raise InputError(f"{file}: by its markers, the face lies outside the photo: check x_mm, y_mm and face_mm.")
    pose = find_pose(fit, covariance, view.to_mm(places)[MIDDLE], focal_px, settings.camera_distance_mm)
    distance_mm = settings.camera_distance_mm if pose is None else pose.distance_mm
    level = check_level(brightness, view, face_mm, given_corners(settings, size_px, file), distance_mm, file)
    missing = [str(marker.id) for marker in board.markers if marker.id not in found]
    span_mm = float(np.linalg.norm(np.ptp(true_mm, axis=0)))
    return Scale(
        view=view,
        mm_per_px=mm_per_px,
        source=f"{len(known)} {board.dictionary} markers of {board.size_mm:g} mm{', lens fitted' if view.lens else ''}",
        residual_mm=residual_mm,
        uncertainty=float(np.linalg.norm([fit.spread_of_scale(places, covariance), BOARD_MM / span_mm, level.excess])),
        camera_tilt_deg=None if pose is None else pose.tilt_deg,
        face_mm=face_mm,
        markers_px=tuple(found[marker.id] for marker in known),
        warnings=((f"markers not found: {', '.join(missing)}",) if missing else ()) + level.warnings,
    )


def fit_markers(seen_px: Floats, true_mm: Floats, size_px: tuple[int, int], lens_wanted: bool) -> tuple[Fit, Floats]:
    """The view by the corners of markers, with a lens where they show one; and the covariance of its parameters."""
    if lens_wanted:
        bent = fit_view(seen_px, true_mm, size_px, lens=True)
        covariance = bent.covariance_by_group(CORNERS)
        if bent.folds_beyond(size_px) and abs(bent.parameters[-1]) > LENS_SIGMAS * np.sqrt(covariance[-1, -1]):
            return bent, covariance
    plain = fit_view(seen_px, true_mm, size_px, lens=False)
    return plain, plain.covariance_by_group(CORNERS)
