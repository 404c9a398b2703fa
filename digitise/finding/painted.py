"""The way along a crack that the user has painted."""

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.graph import MCP_Geometric

from digitise.finding.crack_path import CrackPath
from digitise.finding.hints import SNAP_PX, check_hints
from digitise.finding.medial import longest_line, radius, without_hooks
from digitise.photo import Photo
from digitise.pictures.raster import shrunk
from digitise.settings import Pixel
from sealtwin.errors import InputError
from sealtwin.records import Floats, Integers

WORK_PX = 2000
"""Longer side of the piece on which its middle is found: a path needs no more."""
LEAST_COVERED = 0.25
"""Of a cell of that copy, by paint: a line of one pixel stays whole."""
PINHOLE = 0.5
"""Of the crack's width: smaller places without paint are slips of the brush."""


def painted_path(photo: Photo, ends_px: tuple[Pixel, Pixel] | None) -> CrackPath:
    """Middle of the painted crack: between the ends, or without them along its longest line, from left to right.

    Of a mask in several pieces, that which holds the ends, or the largest; the others are told of. Raises InputError
    where an end is not on the paint, or the two lie on different pieces.
    """
    assert photo.drawn is not None, "nothing is painted"
    count, label, stats, _ = cv2.connectedComponentsWithStats(photo.drawn.astype(np.uint8), connectivity=8)
    if ends_px is None:
        chosen = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    else:
        check_hints(photo, ends_px)
        chosen = _piece_of(photo, label, np.array(ends_px, dtype=float))
    left, top, width, height = (int(value) for value in stats[chosen, :4])
    piece = label[top : top + height, left : left + width] == chosen
    scale = min(1.0, WORK_PX / max(piece.shape))
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    region = _without_pinholes(shrunk(piece.astype(np.float32), size) > LEAST_COVERED)

    def to_photo(cells: Integers) -> Floats:
        return (cells[:, ::-1].astype(float) + 0.5) / scale - 0.5 + (left, top)

    if ends_px is None:
        way = without_hooks(longest_line(region), radius(region))
        way = way if way[0, 1] <= way[-1, 1] else way[::-1]
    else:
        way = _between(region, (np.array(ends_px) - (left, top) + 0.5) * scale - 0.5)
    width_px = (2 * float(np.median(radius(region)[tuple(way.T)])) - 1) / scale
    return CrackPath(
        points_px=to_photo(way),
        width_px=width_px,
        source="mask",
        warnings=_others(stats[1:, cv2.CC_STAT_AREA], chosen - 1, to_photo(way)) if count > 2 else (),
    )


def _piece_of(photo: Photo, label: NDArray, ends_px: Floats) -> int:
    found = []
    for x, y in ends_px:
        low = np.maximum(np.floor((x - SNAP_PX, y - SNAP_PX)), 0).astype(int)
        near = label[low[1] : int(y + SNAP_PX) + 2, low[0] : int(x + SNAP_PX) + 2]
        rows, columns = np.nonzero(near)
        away_px = np.hypot(columns + low[0] - x, rows + low[1] - y)
        if len(away_px) == 0 or away_px.min() > SNAP_PX:
            raise InputError(
                f"{photo.file}: the end ({x:g}, {y:g}) is not on the crack that the mask paints (at most "
                f"{SNAP_PX:g} px beside it); give a point inside the paint, or paint the crack up to there."
            )
        nearest = int(np.argmin(away_px))
        found.append(int(near[rows[nearest], columns[nearest]]))
    if found[0] != found[1]:
        raise InputError(
            f"{photo.file}: the two ends lie on different pieces of the mask; paint the gap between them, or give ends "
            "on one piece."
        )
    return found[0]


def _without_pinholes(region: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Filled where the brush left open what no path need go round."""
    # Over a strip, the distance from the rim is a quarter of the width in the median.
    hole = PINHOLE * 4 * float(np.median(radius(region)[region]))
    _, label, stats, _ = cv2.connectedComponentsWithStats((~region).astype(np.uint8), connectivity=4)
    small = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] <= np.pi / 4 * hole**2)
    return region | (np.isin(label, small) & ~region)


def _between(region: NDArray[np.bool_], ends: Floats) -> Integers:
    """Rows and columns from end to end, in the middle of the region."""
    cells = np.argwhere(region)
    start, end = (cells[int(np.argmin(np.sum((cells - point[::-1]) ** 2, axis=1)))] for point in ends)
    to_rim = radius(region)
    usual = max(2 * float(np.median(to_rim[region])), 1.0)
    search = MCP_Geometric(
        np.where(region, 1 / (0.03 + np.minimum(to_rim / usual, 1.5) ** 2), -1), fully_connected=True
    )
    search.find_costs([tuple(start)], [tuple(end)])
    return np.array(search.traceback(tuple(end)), dtype=np.int64)


def _others(areas_px: NDArray, chosen: int, way_px: Floats) -> tuple[str, ...]:
    (x0, y0), (x1, y1) = way_px[[0, -1]]
    return (
        f"the mask has {len(areas_px)} pieces; the one from ({x0:.0f}, {y0:.0f}) to ({x1:.0f}, {y1:.0f}) px, "
        f"{areas_px[chosen] / areas_px.sum():.0%} of the paint, was taken",
    )
