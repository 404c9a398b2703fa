"""Replace stretches of a wall by lines drawn by hand, for photos that mislead the tracing."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from scipy.spatial import KDTree

from digitise.crack_path.hints import listed
from digitise.geometry import polyline
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.core.solid_figures import EndKind

NEAR = 1.0  # Crack widths from its wall within which a drawn line must begin and end
LEAST_NEAR_PX = 10.0  # The least such distance: the error of a click on a screen
FAR = 1.5  # Crack widths from the wall that it replaces beyond which a drawn line is doubted
Side = Literal["left", "right"]


class Mended(NamedTuple):
    """Centreline and walls at the same stations as before, (n, 2) each, and the drawn share."""

    centreline_mm: Floats
    left_mm: Floats
    right_mm: Floats
    drawn: float
    """Share of both walls' stations that was drawn."""
    warnings: tuple[str, ...] = ()
    """One warning for each line that was drawn far from the wall that it replaces."""


def mended(
    photo: Photo, stations: tuple[Floats, Floats, Floats], lines_mm: Sequence[Floats], kinds: tuple[EndKind, EndKind]
) -> Mended:
    """Replace a stretch of a wall by each line, (k, 2), from one place on the wall to another.

    ``stations`` are centreline, left and right wall, (n, 2) each. A later line replaces an earlier one. Raises
    InputError for a line that does not begin and end at one wall.
    """
    centreline_mm, left_mm, right_mm = (points.copy() for points in stations)
    walls: dict[Side, Floats] = {"left": left_mm, "right": right_mm}
    # Both walls end in a tip, which a line must not move.
    first, last = (int(kind == "closed") for kind in kinds)
    inner = slice(first, len(centreline_mm) - last)
    width_mm = float(np.median(np.linalg.norm(left_mm - right_mm, axis=1)))
    near_mm = max(NEAR * width_mm, LEAST_NEAR_PX * photo.mm_per_px)
    touched = {side: np.zeros(len(centreline_mm), dtype=bool) for side in walls}
    warnings = list[str]()
    for number, line_mm in enumerate(lines_mm, start=1):
        side, begin, end = _stretch(walls, inner, line_mm, near_mm, f"{photo.file}: photo.walls_px, line {number}")
        along = slice(min(begin, end), max(begin, end) + 1)
        drawn_mm = line_mm if begin < end else line_mm[::-1]
        s_mm = arc_length(drawn_mm)
        count = along.stop - along.start
        before_mm = walls[side][along].copy()
        walls[side][along] = polyline.at_arc_length(drawn_mm, s_mm, np.linspace(0.0, s_mm[-1], count))
        away_mm = np.asarray(KDTree(before_mm).query(walls[side][along])[0])
        if away_mm.max() > FAR * width_mm:
            farthest_px = photo.to_px(walls[side][along][away_mm.argmax()][None])
            warnings.append(
                f"photo.walls_px, line {number}, is up to {away_mm.max():.1f} mm from the wall that the photo shows, "
                f"at {listed(farthest_px)} px: check that it follows this crack"
            )
        touched[side][along] = True
    moved = touched["left"] | touched["right"]
    centreline_mm[moved] = (left_mm[moved] + right_mm[moved]) / 2
    drawn = float(np.mean([touched["left"], touched["right"]]))
    return Mended(centreline_mm, left_mm, right_mm, drawn, tuple(warnings))


def _stretch(
    walls: dict[Side, Floats], inner: slice, line_mm: Floats, near_mm: float, where: str
) -> tuple[Side, int, int]:
    """Return the wall near a line, and the stations nearest to the line's first and last point."""
    nearest: dict[Side, tuple[float, int, int]] = {}
    for side, wall_mm in walls.items():
        away_mm, station = KDTree(wall_mm[inner]).query(line_mm[[0, -1]])
        begin, end = np.asarray(station) + inner.start
        nearest[side] = float(np.max(away_mm)), int(begin), int(end)
    side: Side = "left" if nearest["left"][0] <= nearest["right"][0] else "right"
    away_mm, begin, end = nearest[side]
    if away_mm > near_mm:
        raise InputError(
            f"{where}: it begins or ends {away_mm:.1f} mm from the walls (at most {near_mm:.1f} mm); draw from one "
            "place on a wall to another place on the same wall."
        )
    if begin == end:
        raise InputError(f"{where}: it begins and ends at the same place of the wall; draw a longer stretch.")
    return side, begin, end
