"""Marker boards and cameras for tests of the scale that need no picture."""

import numpy as np

from digitise.scale.marker_scale import corners_mm
from digitise.settings import Marker, MarkerBoard
from fixtures.generate.camera import Camera, camera_above
from sealtwin.core.records import Floats

FACE_MM = (160.0, 40.0)
MM_PER_PX = 0.1
FRAME_MM = 40.0


def board_around(count: int = 8, face_mm: tuple[float, float] = FACE_MM) -> MarkerBoard:
    """Markers of 16 mm at the corners of the face, and with 8 in the middle of its sides."""
    width, height = face_mm
    places = [(-14.0, -14.0), (width + 14, -14.0), (-14.0, height + 14), (width + 14, height + 14)]
    places += [(width / 2, -14.0), (width / 2, height + 14), (-14.0, height / 2), (width + 14, height / 2)]
    return MarkerBoard(
        size_mm=16, markers=tuple(Marker(id=i, x_mm=x, y_mm=y) for i, (x, y) in enumerate(places[:count]))
    )


def places_mm(board: MarkerBoard) -> Floats:
    """Corners of all markers, marker by marker, (4 n, 2)."""
    return np.concatenate([corners_mm(board, marker) for marker in board.markers])


def camera(tilt_deg: float = 5.0, lens_k1: float = 0.0, distance_mm: float = 262.0) -> Camera:
    """Above the middle of the face, at a tenth of a millimetre per pixel."""
    return camera_above(FACE_MM, FRAME_MM, MM_PER_PX, distance_mm, tilt_deg, lens_k1)


def face_grid_mm() -> Floats:
    """Places all over the face, (25, 2)."""
    x, y = np.meshgrid(np.linspace(0, FACE_MM[0], 5), np.linspace(0, FACE_MM[1], 5))
    return np.column_stack([x.ravel(), y.ravel()])
