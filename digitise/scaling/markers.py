"""Printed square markers in the plane of the face: drawn for a synthetic photo, found in any photo."""

from collections import Counter
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.pictures.raster import Map
from digitise.scaling.corners import refined_corners
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
SEARCH_PX = 1000
"""Longer side of the smallest copy on which markers are searched for; each next one has twice that."""
LEAST_APART = 0.05
"""Of a square's circumference, between it and another that is not the same. OpenCV's own 0.125 takes a marker for the
white card that it is printed on: of 296 markers in synthetic photos it loses 44, this none.
"""
MOST_NAMED = 12
"""Markers that are not there; whoever misses more knows which."""
LIKE_SIZE = 2.0
"""Largest factor between the sides of markers of one size in a photo taken from above; a stray one is another."""


def find_markers(image: NDArray[np.uint8], brightness: Map, board: MarkerBoard, file: Path) -> dict[int, Floats]:
    """Corners in px, (4, 2) by marker id, of the board's markers: found in the RGB photo, refined in its linear light.

    Corners run upper left, upper right, lower right, lower left. Other markers in the photo are left out.
    Raises InputError where fewer than four are found, or one is there twice.
    """
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
            f"(missing {_listed(expected - set(clear))}). Check that they are in the photo, sharp, with white around "
            "them."
        )
    return clear


def _search(grey: NDArray[np.uint8], board: MarkerBoard, expected: set[int], file: Path) -> dict[int, Floats]:
    """Rough corners of the expected markers, from a small copy of the photo up to itself, until all are found."""
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
        alike = _of_like_size(seen)
        if twice := {number for number, times in Counter(number for number, _ in alike).items() if times > 1}:
            raise InputError(
                f"{file}: marker {_listed(twice)} is in the photo more than once, so its place is unknown. "
                "Cover the copy, or leave that marker out of [photo.markers]."
            )
        found |= dict(alike)
        if set(found) == expected:
            break
    return found


def _of_like_size(seen: list[tuple[int, Floats]]) -> list[tuple[int, Floats]]:
    """Without those much smaller or larger than the middle one: grain makes a marker now and then."""
    sides_px = [float(np.linalg.norm(quad[1] - quad[0])) for _, quad in seen]
    usual_px = float(np.median(sides_px)) if seen else 0.0
    return [
        marker
        for marker, side_px in zip(seen, sides_px, strict=True)
        if usual_px / LIKE_SIZE < side_px < usual_px * LIKE_SIZE
    ]


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


def _dictionary(board: MarkerBoard) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(DICTIONARY[board.dictionary])


def _listed(numbers: set[int]) -> str:
    told = ", ".join(str(number) for number in sorted(numbers)[:MOST_NAMED])
    return told if len(numbers) <= MOST_NAMED else f"{told} and {len(numbers) - MOST_NAMED} more"
