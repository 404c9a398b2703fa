"""Where pixels lie on the face: by markers in its plane, by its own four edges, or as the user says. Never guessed."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.face import find_face
from digitise.markers import corners_mm, find_markers
from digitise.polyline import Box, depth_inside, project, rectangle
from digitise.raster import Map
from digitise.settings import COARSEST_MM_PER_PX, FINEST_MM_PER_PX, MarkerBoard, PhotoInput, Pixel
from sealtwin.errors import InputError
from sealtwin.records import Floats

MARKER_RESIDUAL_MM = 0.1
"""Largest RMS misfit of the markers: a sharp photo of a flat board leaves a quarter of it."""
MARKER_RESIDUAL_PX = 0.5
"""The same for coarse photos, whose corners are found to a part of a pixel."""


@dataclass(frozen=True)
class Scale:
    """The mapping from photo to face, and what is known about it."""

    mm_from_px: Floats
    """Homography, (3, 3)."""
    mm_per_px: float
    """At the centre of the face, or of the photo where the face is not known."""
    source: str
    residual_mm: float | None = None
    face_mm: Box | None = None
    markers_px: tuple[Floats, ...] = ()
    warnings: tuple[str, ...] = ()


def find_scale(image: NDArray[np.uint8], brightness: Map, settings: PhotoInput, file: Path) -> Scale:
    """The one scale that ``settings`` give. Raises InputError where the photo does not show it, or contradicts it."""
    scale = _find(image, brightness, settings, file)
    if not FINEST_MM_PER_PX <= scale.mm_per_px <= COARSEST_MM_PER_PX:
        raise InputError(
            f"{file}: by its {scale.source}, a pixel of the photo is {scale.mm_per_px:.2g} mm; "
            f"{FINEST_MM_PER_PX:g} to {COARSEST_MM_PER_PX:g} can be. Check the lengths and pixels that give the scale."
        )
    return scale


def _find(image: NDArray[np.uint8], brightness: Map, settings: PhotoInput, file: Path) -> Scale:
    size_px = (image.shape[1], image.shape[0])
    face_mm = None if settings.face_mm is None else (0.0, 0.0, *settings.face_mm)
    if settings.markers is not None:
        found = find_markers(image, brightness, settings.markers, file)
        return _by_markers(found, settings.markers, face_mm, size_px, file)
    if face_mm is not None:
        return _by_face(brightness, face_mm, settings.face_corners_px, size_px, file)
    if settings.mm_per_px is None:
        raise InputError(f"{file}: no scale: give [photo.markers], face_mm or mm_per_px.")
    return _given(settings.mm_per_px, settings.scale_is == "assumed", size_px)


def _by_markers(
    found: dict[int, Floats], board: MarkerBoard, face_mm: Box | None, size_px: tuple[int, int], file: Path
) -> Scale:
    known = [marker for marker in board.markers if marker.id in found]
    seen_px = np.concatenate([found[marker.id] for marker in known])
    true_mm = np.concatenate([corners_mm(board, marker) for marker in known])
    mm_from_px = _homography(seen_px, true_mm)
    mm_per_px = _local_scale(mm_from_px, size_px, face_mm)
    miss_mm = np.linalg.norm(project(mm_from_px, seen_px) - true_mm, axis=1)
    residual_mm = float(np.sqrt(np.mean(miss_mm**2)))
    limit_mm = max(MARKER_RESIDUAL_MM, MARKER_RESIDUAL_PX * mm_per_px)
    if residual_mm > limit_mm:
        worst = known[int(np.argmax(miss_mm)) // 4].id
        raise InputError(
            f"{file}: the markers miss their places by {residual_mm:.2f} mm (at most {limit_mm:.2f}), most of all "
            f"marker {worst}: check x_mm, y_mm and size_mm, and that all lie flat, level with the face."
        )
    if face_mm is not None:
        middle_px = project(_inverse(mm_from_px), rectangle(face_mm).mean(axis=0, keepdims=True))
        if depth_inside(middle_px, (0, 0, *size_px))[0] < 0:
            raise InputError(f"{file}: by its markers, the face lies outside the photo: check x_mm, y_mm and face_mm.")
    missing = [str(marker.id) for marker in board.markers if marker.id not in found]
    return Scale(
        mm_from_px=mm_from_px,
        mm_per_px=mm_per_px,
        source=f"{len(known)} {board.dictionary} markers of {board.size_mm:g} mm",
        residual_mm=residual_mm,
        face_mm=face_mm,
        markers_px=tuple(found[marker.id] for marker in known),
        warnings=(f"markers not found: {', '.join(missing)}",) if missing else (),
    )


def _by_face(
    brightness: Map,
    face_mm: Box,
    given_px: tuple[Pixel, ...] | None,
    size_px: tuple[int, int],
    file: Path,
) -> Scale:
    """Four corners fix the homography exactly; how straight the found edges are stands in for its misfit."""
    width_mm, height_mm = face_mm[2:]
    if given_px is None:
        corners_px, bend_px = find_face(brightness, (width_mm, height_mm), file)
    else:
        corners_px, bend_px = np.array(given_px, dtype=float), None
        _check_in_sight(corners_px, size_px, file)
        _check_order(corners_px, file)
    mm_from_px = _homography(corners_px, rectangle(face_mm))
    mm_per_px = _local_scale(mm_from_px, size_px, face_mm)
    return Scale(
        mm_from_px=mm_from_px,
        mm_per_px=mm_per_px,
        source=f"face of {width_mm:g} x {height_mm:g} mm, {'corners given' if given_px else 'found by its edges'}",
        residual_mm=None if bend_px is None else bend_px * mm_per_px,
        face_mm=face_mm,
    )


def _given(mm_per_px: float, assumed: bool, size_px: tuple[int, int]) -> Scale:
    return Scale(
        mm_from_px=np.array([[mm_per_px, 0, 0], [0, -mm_per_px, mm_per_px * (size_px[1] - 1)], [0, 0, 1.0]]),
        mm_per_px=mm_per_px,
        source=f"given: {mm_per_px:g} mm/px{' (assumed)' if assumed else ''}",
        warnings=("the scale is assumed: every length is only as good as it",) if assumed else (),
    )


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


def _homography(points_px: Floats, points_mm: Floats) -> Floats:
    return np.asarray(cv2.findHomography(points_px, points_mm)[0], dtype=float)


def _inverse(homography: Floats) -> Floats:
    return np.asarray(np.linalg.inv(homography), dtype=float)


def _local_scale(mm_from_px: Floats, size_px: tuple[int, int], face_mm: Box | None) -> float:
    """Millimetres per pixel, the geometric mean of both directions, at the centre of the face or photo."""
    middle_px = np.array([size_px]) / 2
    if face_mm is not None:
        middle_px = project(_inverse(mm_from_px), rectangle(face_mm).mean(axis=0, keepdims=True))
    corner_mm = project(mm_from_px, middle_px + np.array([[0, 0], [1, 0], [0, 1]]))
    return float(np.sqrt(abs(np.linalg.det(corner_mm[1:] - corner_mm[0]))))
