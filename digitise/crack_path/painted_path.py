"""Find the path along a crack that a user has painted."""

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.crack_path import medial_axis
from digitise.crack_path.hints import CrackPath, check_hints, listed, snap_px
from digitise.crack_path.paint_check import judge_paint, require_filled
from digitise.crack_path.step_costs import along_middle
from digitise.image.raster import shrunk
from digitise.photo import Photo
from digitise.settings import Pixel
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats, Integers

WORK_PX = 2000  # Longer side of the copy on which the middle of the paint is searched for
LEAST_COVERED = 0.25  # Least painted share of a painted cell of that copy, so that a line of one pixel stays whole
PINHOLE = 0.5  # Diameter in crack widths up to which a place without paint is a slip of the brush


def painted_path(photo: Photo, ends_px: tuple[Pixel, Pixel] | None) -> CrackPath:
    """Return the middle of the painted crack, between the ends or along the largest piece from left to right.

    Raises InputError if an end is not on the paint, the two are on different pieces, or the photo shows no crack there.
    """
    paint = present(photo.drawn, "the paint")
    count, label, stats, _ = cv2.connectedComponentsWithStats(paint.astype(np.uint8), connectivity=8)
    if ends_px is None:
        chosen = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    else:
        check_hints(photo, ends_px)
        chosen = _piece_of(photo, label, np.array(ends_px, dtype=float))
    left, top, width, height = (int(value) for value in stats[chosen, :4])
    piece = label[top : top + height, left : left + width] == chosen
    scale = min(1.0, WORK_PX / max(piece.shape))
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    region = shrunk(piece.astype(np.float32), size) > LEAST_COVERED
    require_filled(photo, region, shrunk(photo.brightness[top : top + height, left : left + width], size))
    region = _without_pinholes(region)

    def to_photo(cells: Integers) -> Floats:
        return (cells[:, ::-1].astype(float) + 0.5) / scale - 0.5 + (left, top)

    if ends_px is None:
        way = medial_axis.without_hooks(medial_axis.longest_line(region), medial_axis.radius(region))
        way = way if way[0, 1] <= way[-1, 1] else way[::-1]
    else:
        way = along_middle(region, (np.array(ends_px) - (left, top) + 0.5) * scale - 0.5)
    width_px = (2 * float(np.median(medial_axis.radius(region)[tuple(way.T)])) - 1) / scale
    share = stats[chosen, cv2.CC_STAT_AREA] / stats[1:, cv2.CC_STAT_AREA].sum()
    others = (
        f"the mask has {count - 1} pieces; the piece from {listed(to_photo(way)[[0, -1]])} px, which has {share:.0%} "
        "of the paint, is used"
    )
    doubts = judge_paint(photo, paint, to_photo(way), width_px, confirmed=ends_px is not None)
    return CrackPath(to_photo(way), width_px, "mask", (others, *doubts) if count > 2 else doubts)


def _piece_of(photo: Photo, label: NDArray, ends_px: Floats) -> int:
    """Return the number of the piece that both ends are on."""
    numbers, most_px = [], snap_px(photo)
    for x, y in ends_px:
        left, top = max(int(x - most_px), 0), max(int(y - most_px), 0)
        near = label[top : int(y + most_px) + 2, left : int(x + most_px) + 2]
        rows, columns = np.nonzero(near)
        away_px = np.hypot(columns + left - x, rows + top - y)
        if away_px.min(initial=np.inf) > most_px:
            raise InputError(
                f"{photo.file}: the end ({x:g}, {y:g}) is not on the crack that the mask paints (at most "
                f"{most_px:.0f} px beside it); give a point inside the paint, or paint the crack up to that point."
            )
        nearest = int(np.argmin(away_px))
        numbers.append(int(near[rows[nearest], columns[nearest]]))
    if numbers[0] != numbers[1]:
        raise InputError(
            f"{photo.file}: the two ends are on different pieces of the mask; paint the gap between them, or give ends "
            "on one piece."
        )
    return numbers[0]


def _without_pinholes(region: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the region with its small holes filled."""
    # In a strip the median distance from the rim is a quarter of the width.
    hole = PINHOLE * 4 * float(np.median(medial_axis.radius(region)[region]))
    _, label, stats, _ = cv2.connectedComponentsWithStats((~region).astype(np.uint8), connectivity=4)
    small = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] <= np.pi / 4 * hole**2)
    return region | (np.isin(label, small) & ~region)
