"""Printed square markers in the plane of the face: their black modules, and their corners in a photo."""

from collections import Counter
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.image.raster import Map
from digitise.scale.corners import refined_corners
from digitise.settings import Marker, MarkerBoard
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

DICTIONARY = {
    "4x4_50": cv2.aruco.DICT_4X4_50,
    "5x5_100": cv2.aruco.DICT_5X5_100,
    "6x6_250": cv2.aruco.DICT_6X6_250,
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36H11,
}
MIN_MARKERS = 4
SEARCH_PX = 1000  # Longer side of the smallest copy on which markers are searched for; each next one has twice that
LEAST_APART = 0.05  # Over a square's circumference; OpenCV's 0.125 loses 44 of 296 markers to the card around them
MOST_NAMED = 12  # Largest number of missing markers that a message lists


def find_markers(image: NDArray[np.uint8], brightness: Map, board: MarkerBoard, file: Path) -> dict[int, Floats]:
    """Find markers by id: corners in px, (4, 2), clockwise from the upper left; raise InputError if under four."""
    expected = {marker.id for marker in board.markers}
    found = _search(np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8), board, expected, file)
    cells = _dictionary(board).markerSize + 2
    refined = {
        number: refined_corners(brightness, quad, float(np.linalg.norm(quad[1] - quad[0])) / cells)
        for number, quad in found.items()
    }
    clear = {number: quad for number, quad in refined.items() if quad is not None}
    if len(clear) < MIN_MARKERS:
        raise InputError(
            f"{file}: found {len(clear)} of {len(expected)} markers of {board.dictionary}, need {MIN_MARKERS} "
            f"(missing {_listed(expected - set(clear))}). Take a sharp photo that shows them, with white around each."
        )
    return clear


def _search(grey: NDArray[np.uint8], board: MarkerBoard, expected: set[int], file: Path) -> dict[int, Floats]:
    """Find rough corners of the expected markers in ever larger copies of the photo, until all are found."""
    how = cv2.aruco.DetectorParameters()
    how.minMarkerDistanceRate = LEAST_APART
    detector = cv2.aruco.ArucoDetector(_dictionary(board), how)
    longest = max(grey.shape)
    found: dict[int, Floats] = {}
    for side_px in [SEARCH_PX * 2**step for step in range(10) if SEARCH_PX * 2**step < longest] + [longest]:
        shrink = side_px / longest
        copy = grey if shrink == 1 else cv2.resize(grey, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
        corners, ids, _ = detector.detectMarkers(copy)
        numbers = [] if ids is None else [int(number) for number in np.ravel(ids)]
        quads = [(np.reshape(quad, (4, 2)).astype(float) + 0.5) / shrink - 0.5 for quad in corners]
        seen = [(number, quad) for number, quad in zip(numbers, quads, strict=True) if number in expected]
        # Squares much smaller or larger than the median are false detections in grain.
        sides_px = [float(np.linalg.norm(quad[1] - quad[0])) for _, quad in seen]
        usual_px = float(np.median(sides_px)) if seen else 0.0
        alike = [marker for marker, px in zip(seen, sides_px, strict=True) if usual_px / 2 < px < 2 * usual_px]
        if twice := {number for number, times in Counter(number for number, _ in alike).items() if times > 1}:
            raise InputError(
                f"{file}: marker {_listed(twice)} is in the photo more than once; cover the copy, or remove that "
                "marker from [photo.markers]."
            )
        found |= dict(alike)
        if set(found) == expected:
            break
    return found


def corners_mm(board: MarkerBoard, marker: Marker) -> Floats:
    """Return the corners on the face, (4, 2): upper left, upper right, lower right, lower left."""
    half = board.size_mm / 2
    return np.array([marker.x_mm, marker.y_mm]) + half * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]])


def black_modules(board: MarkerBoard, marker: Marker) -> tuple[Floats, list[Floats]]:
    """Return rings in mm: the black square of a marker, and the white cells inside it."""
    cells = _dictionary(board).markerSize + 2
    bits = cv2.aruco.generateImageMarker(_dictionary(board), marker.id, cells)
    outer = corners_mm(board, marker)
    step = board.size_mm / cells
    cell = step * np.array([[0, 0], [1, 0], [1, -1], [0, -1]])
    return outer, [outer[0] + step * np.array([column, -row]) + cell for row, column in np.argwhere(bits > 0)]


def _dictionary(board: MarkerBoard) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(DICTIONARY[board.dictionary])


def _listed(numbers: set[int]) -> str:
    listed = ", ".join(str(number) for number in sorted(numbers)[:MOST_NAMED])
    return listed if len(numbers) <= MOST_NAMED else f"{listed} and {len(numbers) - MOST_NAMED} more"
