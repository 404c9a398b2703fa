"""The way along a modelled crack: in the middle of its mouth, or as the user gives it."""

from dataclasses import replace

import numpy as np

from digitise.finding.crack_path import CrackPath
from digitise.finding.painted import painted_path
from digitise.geometry.polyline import at_arc_length, resampled
from digitise.photo import Photo
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline, arc_length_at

MOST_BESIDE = 0.05
"""Of a given line, between where it enters the crack and leaves it, that may run beside the crack."""
WHOLE = 0.9
"""Of the mouth's area, beside a line that is said to follow the crack: oblique open ends take some of it."""
SPACING_MM = 0.25
"""Of a given line's points: that of the centreline at 0.1 mm/px."""


def middle_path(photo: Photo, line_mm: Floats | None) -> CrackPath:
    """In the middle of the mouth: from left to right along its longest line, or from end to end of the given one."""
    ends_px = None
    if line_mm is not None:
        (x0, y0), (x1, y1) = photo.to_px(_in_mouth(photo, line_mm)[[0, -1]]).tolist()
        ends_px = ((x0, y0), (x1, y1))
    return replace(painted_path(photo, ends_px), source="mesh")


def along(outline: Outline, photo: Photo, line_mm: Floats) -> tuple[Outline, str]:
    """The outline with the given line for its centreline, and how far that lies from the middle.

    A warning says where it follows a part of the crack only. Raises InputError where the line runs beside the crack.
    """
    line_mm = _in_mouth(photo, line_mm)
    beside = 1 - float(_covered(photo, line_mm).mean())
    if beside > MOST_BESIDE:
        raise InputError(
            f"The given path runs beside the crack on {beside:.0%} of its way (at most {MOST_BESIDE:.0%}). It is read "
            "as x and y in mm, in the mesh's own axes turned upright."
        )
    middle_s_mm = np.maximum.accumulate(arc_length_at(line_mm, outline.centreline_mm).clip(0, outline.length_mm))
    middle_mm, left_mm, right_mm = (
        at_arc_length(wall, outline.s_mm, middle_s_mm)
        for wall in (outline.centreline_mm, outline.left_wall_mm, outline.right_wall_mm)
    )
    away_mm = np.linalg.norm(line_mm - middle_mm, axis=1)
    given = replace(
        outline,
        centreline_mm=line_mm,
        left_wall_mm=left_mm,
        right_wall_mm=right_mm,
        centreline_px=photo.to_px(line_mm),
        left_wall_px=photo.to_px(left_mm),
        right_wall_px=photo.to_px(right_mm),
        path_source="line",
    )
    assert photo.drawn is not None, "the mouth is painted"
    beside_line = given.mean_width_mm * given.length_mm / (int(photo.drawn.sum()) * photo.mm_per_px**2)
    if beside_line < WHOLE:
        doubt = (
            f"the given path, {given.length_mm:.1f} mm long, follows {100 * beside_line:.0f} % of the crack's mouth: "
            'volume_ml = "cavity" would give all of the sealant there; give volume_ml, or a path along the whole crack'
        )
        given = replace(given, warnings=(*given.warnings, doubt))
    return given, (
        f"the centreline is the given path; it lies {np.sqrt(np.mean(away_mm**2)):.2f} mm (RMS), at most "
        f"{away_mm.max():.2f} mm, from the middle between the walls"
    )


def _in_mouth(photo: Photo, line_mm: Floats) -> Floats:
    """The line from where it first lies in the crack's mouth to where it last does, evenly spaced."""
    even_mm = resampled(line_mm, SPACING_MM)
    inside = np.flatnonzero(_covered(photo, even_mm))
    if len(inside) < 2:
        raise InputError("The given path does not run in the crack. It is read as x and y in mm.")
    return even_mm[inside[0] : inside[-1] + 1]


def _covered(photo: Photo, points_mm: Floats) -> np.ndarray:
    """Whether each point lies in the mouth, (n,)."""
    assert photo.drawn is not None, "the mouth is painted"
    column, row = np.rint(photo.to_px(points_mm)).astype(int).T
    height, width = photo.drawn.shape
    shown = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    return shown & photo.drawn[row.clip(0, height - 1), column.clip(0, width - 1)]
