"""Lines too straight for a crack: joints, formwork edges, scratches along a ruler, the edge of the sample."""

import cv2
import numpy as np
from numpy.typing import NDArray

from sealtwin.records import Floats

LEAST_LENGTH = 0.4
"""Of the picture's diagonal. Over a shorter way a crack is sometimes straight."""
STRAY = 1.0
"""Cells to either side of a straight line in which a joint stays, but for chips. Cracks in three photos of concrete and
one of asphalt strayed by 3 to 8, RMS, over so long a way.
"""
COVERED = 0.8
"""Share of the line on which there is something that close."""
LARGEST_GAP = 0.05
"""Of the diagonal, by a chip or a crack that crosses."""
BESIDE_PX = 12.0
"""Cells from the line that still belong to the joint: both its rims are lines as well, 14 apart where it is wide."""


def straight_lines(bones: NDArray[np.bool_]) -> list[Floats]:
    """Ends (column, row) of each straight line among the cells of a skeleton, (2, 2)."""
    diagonal = float(np.hypot(*bones.shape))
    near = cv2.dilate(bones.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    seen = cv2.HoughLinesP(
        near.astype(np.uint8),
        rho=1,
        theta=np.pi / 720,
        threshold=int(COVERED * LEAST_LENGTH * diagonal),
        minLineLength=LEAST_LENGTH * diagonal,
        maxLineGap=LARGEST_GAP * diagonal,
    )
    if seen is None:
        return []
    lines = [line.reshape(2, 2).astype(float) for line in seen]
    return [line for line in lines if _share_near(near, line) >= COVERED]


def beside_straight(shape: tuple[int, ...], lines: list[Floats]) -> NDArray[np.bool_]:
    """Cells of the picture that belong to one of the lines."""
    mask = np.zeros(shape, dtype=np.uint8)
    for line in lines:
        start, end = np.rint(line).astype(int).tolist()
        cv2.line(mask, start, end, 255, 2 * round(BESIDE_PX) + 1)
    return mask > 0


def _share_near(near: NDArray[np.bool_], line: Floats) -> float:
    """Share of the line that has a cell of the skeleton within ``STRAY``."""
    count = round(float(np.linalg.norm(line[1] - line[0]))) + 1
    column, row = np.rint(np.linspace(line[0], line[1], count)).astype(int).T
    return float(np.mean(near[row, column]))
