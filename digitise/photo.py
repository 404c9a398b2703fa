"""A photo with a scale: the one place where pixels become millimetres."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.decoding import read_photo
from digitise.face import find_face
from digitise.markers import corners_mm, find_markers
from digitise.settings import MarkerBoard, PhotoInput
from sealtwin.errors import InputError
from sealtwin.records import Floats

DISPLAY_GAMMA = 2.2
"""Cameras store the 2.2th root of light, near enough. Half contrast is half the light, not half the number."""
BLACK = 15
"""Of 255. A photo whose brightest parts are darker shows nothing."""
MARKER_RESIDUAL_MM = 0.1
"""Largest RMS misfit of the markers: a sharp photo of a flat board leaves a tenth of it."""


@dataclass(frozen=True)
class Photo:
    """Pixels and where they lie on the face."""

    file: Path
    image: NDArray[np.uint8]
    """(height, width, 3), RGB, as the camera stored it."""
    brightness: NDArray[np.float32]
    """(height, width), proportional to light, 0 to 1."""
    mm_from_px: Floats
    """Homography, (3, 3)."""
    face_mm: tuple[float, float, float, float] | None
    """x_min, y_min, x_max, y_max."""
    mm_per_px: float
    """At the centre of the face, or of the photo where the face is not known."""
    scale_source: str
    scale_residual_mm: float | None
    markers_px: tuple[Floats, ...] = ()
    """Corners of the markers found: they are not part of the sample."""
    warnings: tuple[str, ...] = ()

    @property
    def size_px(self) -> tuple[int, int]:
        """Width, height."""
        return self.brightness.shape[1], self.brightness.shape[0]

    def to_mm(self, points_px: Floats) -> Floats:
        """(n, 2) to (n, 2)."""
        return _project(self.mm_from_px, points_px)

    def to_px(self, points_mm: Floats) -> Floats:
        """(n, 2) to (n, 2)."""
        return _project(self._px_from_mm, points_mm)

    @cached_property
    def _px_from_mm(self) -> Floats:
        return np.linalg.inv(self.mm_from_px)

    @cached_property
    def face_px(self) -> Floats | None:
        """Corners of the face: lower left, lower right, upper right, upper left."""
        return None if self.face_mm is None else self.to_px(_rectangle(self.face_mm))


def load_photo(settings: PhotoInput, folder: Path) -> Photo:
    """Read the photo, which lies in ``folder`` unless its path is absolute, and find its scale.

    Raises InputError where it cannot be read, is black, or shows too little to measure by.
    """
    path = folder / settings.file
    image = read_photo(path)
    brightness = _light(image)
    if np.percentile(brightness, 99.5) < (BLACK / 255) ** DISPLAY_GAMMA:
        raise InputError(f"{path}: the photo is all black; give it more light or a longer exposure.")
    if settings.markers is not None:
        return _scaled_by_markers(path, image, brightness, settings.markers, settings.face_mm)
    if settings.face_mm is not None:
        return _scaled_by_face(path, image, brightness, settings.face_mm, settings.face_corners_px)
    assert settings.mm_per_px is not None  # PhotoInput has one scale; says so to the type checker
    return _scaled_evenly(path, image, brightness, settings)


def _light(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Luminance of each pixel, linear."""
    to_light = (np.arange(256) / 255.0) ** DISPLAY_GAMMA
    light = np.zeros(image.shape[:2], dtype=np.float32)
    for channel, weight in enumerate((0.2126, 0.7152, 0.0722)):
        light += (weight * to_light).astype(np.float32)[image[..., channel]]
    return light


def _scaled_by_markers(
    path: Path,
    image: NDArray[np.uint8],
    brightness: NDArray[np.float32],
    board: MarkerBoard,
    size_mm: tuple[float, float] | None,
) -> Photo:
    found = find_markers(image, brightness, board, path)
    known = [marker for marker in board.markers if marker.id in found]
    seen_px = np.concatenate([found[marker.id] for marker in known])
    true_mm = np.concatenate([corners_mm(board, marker) for marker in known])
    mm_from_px = cv2.findHomography(seen_px, true_mm)[0]
    if mm_from_px is None:
        raise InputError(f"{path}: the markers lie on one line or point; spread them round the crack.")
    miss_mm = np.linalg.norm(_project(mm_from_px, seen_px) - true_mm, axis=1)
    residual_mm = float(np.sqrt(np.mean(miss_mm**2)))
    face_mm = None if size_mm is None else (0.0, 0.0, *size_mm)
    photo = Photo(
        file=path,
        image=image,
        brightness=brightness,
        mm_from_px=mm_from_px,
        face_mm=face_mm,
        mm_per_px=_local_scale(mm_from_px, image, face_mm),
        scale_source=f"{len(known)} {board.dictionary} markers of {board.size_mm:g} mm",
        scale_residual_mm=residual_mm,
        markers_px=tuple(found[marker.id] for marker in known),
        warnings=_missing_markers(board, found),
    )
    # A corner is found to a tenth of a pixel at best: coarse photos may miss by more millimetres.
    limit_mm = max(MARKER_RESIDUAL_MM, 0.5 * photo.mm_per_px)
    if residual_mm > limit_mm:
        worst = known[int(np.argmax(miss_mm)) // 4]
        raise InputError(
            f"{path}: the markers miss their places by {residual_mm:.2f} mm (at most {limit_mm:.2f}), "
            f"most of all marker {worst.id}: check its x_mm and y_mm, size_mm, and that all lie flat, level with the face."
        )
    if photo.face_px is not None and not _in_photo(photo, photo.face_px.mean(axis=0)):
        raise InputError(
            f"{path}: by its markers, the face of {size_mm} mm lies outside the photo: check x_mm and y_mm."
        )
    return photo


def _scaled_by_face(
    path: Path,
    image: NDArray[np.uint8],
    brightness: NDArray[np.float32],
    size_mm: tuple[float, float],
    given_px: tuple[tuple[float, float], ...] | None,
) -> Photo:
    """Four corners fix the homography exactly; how straight the found edges are stands in for its misfit."""
    if given_px is None:
        corners_px, bend_px = find_face(brightness, size_mm, path)
        source = f"face of {size_mm[0]:g} x {size_mm[1]:g} mm, found"
    else:
        corners_px, bend_px = np.array(given_px, dtype=float), None
        source = f"face of {size_mm[0]:g} x {size_mm[1]:g} mm, corners given"
    face_mm = (0.0, 0.0, *size_mm)
    turns = np.cross(np.roll(corners_px, -1, 0) - corners_px, np.roll(corners_px, -2, 0) - np.roll(corners_px, -1, 0))
    if not np.all(turns < 0):
        raise InputError(
            f"{path}: face_corners_px {_pairs(corners_px)} do not go round a face from its lower left corner "
            "by lower right and upper right to upper left (px, y down)."
        )
    mm_from_px = cv2.getPerspectiveTransform(corners_px.astype(np.float32), _rectangle(face_mm).astype(np.float32))
    mm_per_px = _local_scale(mm_from_px, image, face_mm)
    return Photo(
        file=path,
        image=image,
        brightness=brightness,
        mm_from_px=mm_from_px,
        face_mm=face_mm,
        mm_per_px=mm_per_px,
        scale_source=source,
        scale_residual_mm=None if bend_px is None else bend_px * mm_per_px,
    )


def _scaled_evenly(
    path: Path, image: NDArray[np.uint8], brightness: NDArray[np.float32], settings: PhotoInput
) -> Photo:
    scale = settings.mm_per_px or 0.0
    height = image.shape[0]
    assumed = " (assumed)" if settings.scale_is == "assumed" else ""
    return Photo(
        file=path,
        image=image,
        brightness=brightness,
        mm_from_px=np.array([[scale, 0, 0], [0, -scale, scale * (height - 1)], [0, 0, 1.0]]),
        face_mm=None,
        mm_per_px=scale,
        scale_source=f"given: {scale:g} mm/px{assumed}",
        scale_residual_mm=None,
        warnings=("the scale is assumed: lengths are only as good as it",) if assumed else (),
    )


def _local_scale(
    mm_from_px: Floats, image: NDArray[np.uint8], face_mm: tuple[float, float, float, float] | None
) -> float:
    """Millimetres per pixel, the geometric mean of both directions, at the centre of the face or photo."""
    if face_mm is None:
        centre_px = np.array([[image.shape[1], image.shape[0]]]) / 2.0
    else:
        centre_px = _project(np.linalg.inv(mm_from_px), _rectangle(face_mm).mean(axis=0, keepdims=True))
    corners_mm = _project(mm_from_px, centre_px + np.array([[0, 0], [1, 0], [0, 1]]))
    return float(np.sqrt(abs(np.linalg.det(corners_mm[1:] - corners_mm[0]))))


def _missing_markers(board: MarkerBoard, found: dict[int, Floats]) -> tuple[str, ...]:
    missing = [str(marker.id) for marker in board.markers if marker.id not in found]
    return (f"markers not found: {', '.join(missing)}",) if missing else ()


def _in_photo(photo: Photo, point_px: Floats) -> bool:
    return bool(np.all(point_px >= 0) and np.all(point_px <= np.array(photo.size_px) - 1))


def _rectangle(box: tuple[float, float, float, float]) -> Floats:
    x_min, y_min, x_max, y_max = box
    return np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]])


def _project(homography: Floats, points: Floats) -> Floats:
    return cv2.perspectiveTransform(np.asarray(points, dtype=float)[:, None], homography)[:, 0]


def _pairs(points: Floats) -> str:
    return " ".join(f"({x:g}, {y:g})" for x, y in points)
