"""Change the photo where a user drew a wall, so that the wall is then measured where it was drawn.

Everything between the path and a line along a wall is surely crack. Everything beyond the line is surely ground.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from digitise.crack_path.hints import CrackPath, listed, snap_px
from digitise.geometry.polyline import resampled
from digitise.image.raster import Mask, draw_line, filled_polygon, sampled, window_around
from digitise.photo import Photo
from digitise.settings import Clicks
from sealtwin.core.arc_length import arc_length
from sealtwin.core.arrays import Floats, lengths
from sealtwin.core.errors import InputError

# Constants of drawn lines. "widths" are widths of the path.
#
# Largest number of points to which a line is resampled, a pixel apart, or farther apart for a longer line
MAX_POINTS = 5000
BRUSH_PX = 3  # Width of a drawn line
MAX_AWAY = 3.0  # A line must be within this many widths, or twice ``snap_px``, of the path
END_WIDTHS = 0.5  # A line may extend this many widths, or ``END_PX``, past the path's ends
END_PX = 6.0
REACH = 3.0  # The photo is changed within this many widths, or ``REACH_PX``, around a line
REACH_PX = 30.0
GROUND = 60.0  # Percentile of the photo's brightness that is taken for the ground's


class ByHand(NamedTuple):
    """The photo after the changes by drawn walls."""

    photo: Photo
    decided: Mask | None = None  # 255 on pixels that lines decide, 0 elsewhere. None if there are no lines


class _Line(NamedTuple):
    """A line along a wall."""

    place_px: Floats  # (n, 2)
    foot_px: Floats  # Nearest point of the path for each point of the line, (n, 2)


def with_drawn(photo: Photo, path: CrackPath, walls_px: Sequence[Clicks | Floats]) -> ByHand:
    """Return the photo, changed by drawn walls. Each is a line in px, (n, 2).

    Raises InputError for lines that leave the photo, that are not on this crack, or that cross it.
    """
    if not walls_px:
        return ByHand(photo)
    width_px, light = max(path.width_px, 4.0), photo.brightness.copy()
    crack, ground, decided = (np.zeros(light.shape, np.uint8) for _ in range(3))
    for line in _lines(photo, path, walls_px, width_px):
        low, window = window_around(line.place_px, max(REACH * width_px, REACH_PX), photo.size_px)
        line_px, foot = line.place_px - low, line.foot_px - low
        outward = (line_px - foot) / np.maximum(lengths(line_px - foot), 1.0)[:, None]
        beyond_px = line_px + width_px * outward
        for marked, other, beside_px in ((crack, ground, foot), (ground, crack, beyond_px)):
            area = filled_polygon(light[window].shape, np.concatenate([line_px, beside_px[::-1]])) > 0
            marked[window][area], other[window][area] = 255, 0
        draw_line(decided[window], line_px, width=1)
    light[ground > 0] = np.maximum(light[ground > 0], float(np.percentile(light, GROUND)))
    light[crack > 0] = float(np.median(sampled(photo.brightness, path.points_px)))
    return ByHand(replace(photo, brightness=light), decided | crack | ground)


def _lines(photo: Photo, path: CrackPath, walls_px: Sequence[Clicks | Floats], width_px: float) -> list[_Line]:
    """Return the drawn walls.

    Raises InputError for a line that leaves the photo, is not on this crack, or crosses the crack.
    """
    way_px = resampled(path.points_px, 1.0)
    tree, (width, height) = KDTree(way_px), photo.size_px
    most_px, beyond_px = max(MAX_AWAY * width_px, 2 * snap_px(photo)), max(END_WIDTHS * width_px, END_PX)
    lines = []
    for number, points_px in enumerate(walls_px, start=1):
        line_px, name = np.array(points_px, float), f"photo.walls_px, line {number}"
        if photo.depth_px(line_px).min() < -0.5:
            raise InputError(
                f"{photo.file}: {name}, leaves the photo of {width} x {height} px. Draw it inside the photo."
            )
        length_px = arc_length(line_px)[-1]
        place_px = resampled(line_px, max(1.0, length_px / MAX_POINTS)) if length_px > 0 else line_px[[0, 0]]
        away_px, nearest = tree.query(place_px)
        at_end = np.isin(nearest, (0, len(way_px) - 1))
        off_px = away_px - np.where(at_end, beyond_px, most_px)
        if off_px.max() > 0:
            raise InputError(
                f"{photo.file}: {name}, is not on this crack at {listed(place_px[[off_px.argmax()]])} px. Draw it "
                f"between the crack's ends, at most {most_px:.0f} px from its path. If the crack takes another way, "
                "give via_px there."
            )
        if away_px.min() < BRUSH_PX / 2:
            raise InputError(
                f"{photo.file}: {name}, crosses the crack at {listed(place_px[[away_px.argmin()]])} px. Draw it on one "
                "side of the path. If the crack takes another way, give via_px there, or paint the crack in "
                "photo.mask."
            )
        lines.append(_Line(place_px, way_px[nearest]))
    return lines
