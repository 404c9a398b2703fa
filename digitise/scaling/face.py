"""Find the sample's face in a photo by its four edges."""

from pathlib import Path

import cv2
import numpy as np

from digitise.pictures.raster import Map, blurred
from digitise.scaling.straight import fit_line_to_most, meeting
from sealtwin.errors import InputError
from sealtwin.records import Floats

WORK_PX = 800
"""Longer side of the copy on which the face is searched; its edges are refined on the photo itself."""
MIN_AREA = 0.1
"""Of the photo: a smaller face is something else."""
GAP_BRIGHTNESS = 0.8
"""Of the darker of face and board: what lies between them with less light is a gap or its shadow, no edge between two
greys. Without one, the darkest of a row of grain, averaged along the edge, stays above 0.9.
"""
LEAST_FILLED = 0.7
"""Of its quadrilateral, by a face that nobody has measured: a crack and pores take some of it, never so much."""
MOST_SLENDER = 5.0
"""Length over width of a face that nobody has measured: a straight crack is a filled rectangle too, but longer."""
LEAST_PART = 0.1
"""Of the largest part of a face that a crack cut in two: whatever is smaller is no part of it."""
LEAST_PART_UNMEASURED = 0.3
"""The same where no size tells markers, a tenth of a face each, from the smaller of its parts."""
STRAIGHT_PX = 2.0
"""RMS that a sawn or cast edge stays within; the hull of anything else does not."""
ASPECT_TOLERANCE = 0.2
"""Perspective of a top-down photo changes width over height by far less."""


def find_face(brightness: Map, size_mm: tuple[float, float], file: Path) -> tuple[Floats, float]:
    """Corners in px, (4, 2): lower left, lower right, upper right, upper left; and how far its edges are from straight.

    The face must differ in brightness from what surrounds it on all four sides. The second figure is the RMS distance,
    in px, of edge points from the four lines. Raises InputError where no rectangle of about the right shape stands out.
    """
    rough = _rough_corners(brightness)
    if rough is None:
        raise InputError(f"{file}: the face does not stand out from what is around it; give face_corners_px.")
    soft = blurred(brightness, 1.0)
    lines, misses_px = zip(*(_edge_line(soft, rough, side) for side in range(4)), strict=True)
    corners = np.array([meeting(lines[side - 1], lines[side]) for side in range(4)])
    width_px, height_px = (
        np.linalg.norm(corners[[1, 3]] - corners[[0, 0]], axis=1)
        + np.linalg.norm(corners[[2, 2]] - corners[[3, 1]], axis=1)
    ) / 2
    found, expected = width_px / height_px, size_mm[0] / size_mm[1]
    if not np.isfinite(found) or abs(np.log(found / expected)) > ASPECT_TOLERANCE:
        raise InputError(
            f"{file}: what stands out is {found:.2f} times as wide as high, face_mm says {expected:.2f}: "
            "check face_mm (width, height in the photo), or give face_corners_px."
        )
    return corners, float(np.sqrt(np.mean(np.concatenate(misses_px) ** 2)))


def see_face(brightness: Map) -> Floats | None:
    """Corners in px of a face that nobody has measured, (4, 2), or None where no filled, straight-sided one stands out.

    For leaving out what is no sample; there is no scale in it.
    """
    rough = _rough_corners(brightness, LEAST_PART_UNMEASURED, LEAST_FILLED)
    if rough is None or _slenderness(rough) > MOST_SLENDER:
        return None
    soft = blurred(brightness, 1.0)
    lines, misses_px = zip(*(_edge_line(soft, rough, side) for side in range(4)), strict=True)
    if np.sqrt(np.mean(np.concatenate(misses_px) ** 2)) > STRAIGHT_PX:
        return None
    return np.array([meeting(lines[side - 1], lines[side]) for side in range(4)])


def _slenderness(corners: Floats) -> float:
    first, second, *_ = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    return float(max(first, second) / max(min(first, second), 1e-6))


def _rough_corners(brightness: Map, least_part: float = LEAST_PART, least_filled: float = 0.0) -> Floats | None:
    """Largest bright or dark region that the photo's border is not part of, as a quadrilateral.

    None where it fills less than ``least_filled`` of that: a forked crack has a large hull too.
    """
    scale = min(1.0, WORK_PX / max(brightness.shape))
    small = cv2.resize(brightness, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small = np.sqrt(cv2.GaussianBlur(small, (0, 0), 2))
    grey = cv2.normalize(small, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)  # pyright: ignore[reportCallIssue, reportArgumentType]
    _, bright = cv2.threshold(grey, 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    border = np.concatenate([bright[0], bright[-1], bright[:, 0], bright[:, -1]])
    face = (bright == (0 if border.mean() > 0.5 else 1)).astype(np.uint8)
    face = cv2.morphologyEx(face, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    count, label, stats, _ = cv2.connectedComponentsWithStats(face)
    if count < 2:
        return None
    area = stats[1:, cv2.CC_STAT_AREA]
    # An open crack cuts the face in two: every part of some size belongs to it.
    parts = 1 + np.flatnonzero(area > least_part * area.max())
    y, x = np.nonzero(np.isin(label, parts))
    hull = cv2.convexHull(np.column_stack([x, y]).astype(np.int32))
    if cv2.contourArea(hull) < MIN_AREA * face.size:
        return None
    box = cv2.boxPoints(cv2.minAreaRect(hull)).astype(float)
    quad = cv2.approxPolyDP(hull, 0.02 * cv2.arcLength(hull, True), True)[:, 0].astype(float)
    corners = _ordered(quad if len(quad) == 4 else box)
    corners_area = cv2.contourArea(corners.astype(np.float32))
    if cv2.contourArea(hull) < 0.9 * corners_area or len(x) < least_filled * corners_area:
        return None
    return (corners + 0.5) / scale - 0.5


def _ordered(corners: Floats) -> Floats:
    """Lower left, lower right, upper right, upper left, as they lie in the photo (y down)."""
    centre = corners.mean(axis=0)
    angle = np.arctan2(-(corners - centre)[:, 1], (corners - centre)[:, 0])
    around = corners[np.argsort(angle)]  # counter-clockwise as seen, from -180 degrees: lower left first or second
    lower_left = int(np.argmax(around[:, 1] - around[:, 0]))
    return np.roll(around, -lower_left, axis=0)


def _edge_line(soft: Map, corners: Floats, side: int) -> tuple[Floats, Floats]:
    """Line (point, direction) through the steepest brightness along one side, and its points' distances, px.

    Where a dark gap lies between sample and board, it is the steepest on the face's own side of that.
    """
    start, end = corners[side], corners[(side + 1) % 4]
    along = (end - start) / np.linalg.norm(end - start)
    normal = np.array([-along[1], along[0]])
    reach = max(6.0, 0.012 * max(soft.shape))
    offsets = np.arange(-reach, reach + 0.25, 0.5)
    foot = start + np.outer(np.linspace(0.04, 0.96, 200), end - start)
    sample = foot[:, None] + offsets[:, None] * normal
    light = cv2.remap(
        soft,
        sample[..., 0].astype(np.float32),
        sample[..., 1].astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    # Neighbours along the edge share it, but not their grain.
    light = np.asarray(cv2.blur(light, (1, 9)), dtype=float)
    slope = _inner_slope(light) if _has_gap(light) else np.abs(np.gradient(light, axis=1))
    points = foot + (_peak(slope) * (offsets[1] - offsets[0]) + offsets[0])[:, None] * normal
    return fit_line_to_most(points, least=1.0)


def _has_gap(light: Floats) -> bool:
    """Whether rows of brightness, from the face outward, mostly pass something darker than both their ends.

    The crack and pores are dark as well, but only on a few rows.
    """
    quarter = light.shape[1] // 4
    inner, outer = np.median(light[:, :quarter], axis=1), np.median(light[:, -quarter:], axis=1)
    return float(np.median(light.min(axis=1) / np.maximum(np.minimum(inner, outer), 1e-6))) < GAP_BRIGHTNESS


def _inner_slope(light: Floats) -> Floats:
    """How fast brightness falls outward, up to the darkest place of each row; 0 beyond."""
    fall = np.maximum(-np.gradient(light, axis=1), 0)
    return np.where(np.arange(light.shape[1]) <= light.argmin(axis=1)[:, None], fall, 0)


def _peak(rows: Floats) -> Floats:
    """Place of the largest value of each row, in samples, to a fraction by the parabola through its neighbours."""
    top = np.clip(np.argmax(rows, axis=1), 1, rows.shape[1] - 2)
    row = np.arange(len(rows))
    before, at, after = rows[row, top - 1], rows[row, top], rows[row, top + 1]
    bend = np.minimum(before - 2 * at + after, -1e-12)
    return top + np.clip(0.5 * (before - after) / bend, -0.5, 0.5)
