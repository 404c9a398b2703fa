"""Printed square markers in the plane of the face: drawn for a synthetic photo, found in any photo."""

from collections import Counter
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.settings import Marker, MarkerBoard
from sealtwin.errors import InputError
from sealtwin.records import Floats

DICTIONARY = {
    "4x4_50": cv2.aruco.DICT_4X4_50,
    "5x5_100": cv2.aruco.DICT_5X5_100,
    "6x6_250": cv2.aruco.DICT_6X6_250,
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36H11,
}
MIN_MARKERS = 4


def find_markers(
    image: NDArray[np.uint8], brightness: NDArray[np.float32], board: MarkerBoard, file: Path
) -> dict[int, Floats]:
    """Corners in px, (4, 2) by marker id, of the board's markers: found in the RGB photo, refined in its linear light.

    Corners run upper left, upper right, lower right, lower left. Other markers in the photo are left out.
    Raises InputError where fewer than four are found, or one is there twice.
    """
    detector = cv2.aruco.ArucoDetector(_dictionary(board), cv2.aruco.DetectorParameters())
    corners, ids, _ = detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    seen = [] if ids is None else [int(number) for number in np.ravel(ids)]
    expected = [marker.id for marker in board.markers]
    found = {
        number: _refined(brightness, np.asarray(quad, dtype=np.float32).reshape(4, 2), board)
        for number, quad in zip(seen, corners, strict=True)
        if number in expected
    }
    if twice := sorted(number for number in found if Counter(seen)[number] > 1):
        raise InputError(
            f"{file}: marker {_listed(twice)} is in the photo more than once, so its place is unknown. "
            "Cover the copy, or leave that marker out of [photo.markers]."
        )
    if len(found) < MIN_MARKERS:
        missing = sorted(set(expected) - set(found))
        raise InputError(
            f"{file}: found {len(found)} of {len(expected)} markers of {board.dictionary}, need {MIN_MARKERS} "
            f"(missing {_listed(missing)}). Check that they are in the photo, sharp, with white around them."
        )
    return found


def corners_mm(board: MarkerBoard, marker: Marker) -> Floats:
    """Upper left, upper right, lower right, lower left corner on the face, (4, 2)."""
    half = board.size_mm / 2
    return np.array([marker.x_mm, marker.y_mm]) + half * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])


def black_modules(board: MarkerBoard, marker: Marker) -> tuple[Floats, list[Floats]]:
    """A marker as rings in mm: its black square, and the white cells inside it."""
    cells = _dictionary(board).markerSize + 2
    bits = cv2.aruco.generateImageMarker(_dictionary(board), marker.id, cells)
    outer = corners_mm(board, marker)
    step = board.size_mm / cells
    cell = step * np.array([[0, 0], [1, 0], [1, -1], [0, -1]])
    return outer, [outer[0] + step * np.array([column, -row]) + cell for row, column in np.argwhere(bits > 0)]


def _refined(brightness: NDArray[np.float32], quad: NDArray[np.float32], board: MarkerBoard) -> Floats:
    """Corners to a hundredth of a pixel. In the gamma of a stored photo, black squares look half a pixel too small."""
    module_px = float(np.linalg.norm(quad[1] - quad[0])) / (_dictionary(board).markerSize + 2)
    # Within one module, so that no corner but the marker's own is in sight.
    window = max(2, min(5, int(0.5 * module_px)))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 0.005)
    return cv2.cornerSubPix(brightness, quad[:, None].copy(), (window, window), (-1, -1), stop)[:, 0].astype(float)


def _dictionary(board: MarkerBoard) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(DICTIONARY[board.dictionary])


def _listed(numbers: list[int]) -> str:
    return ", ".join(str(number) for number in numbers)
