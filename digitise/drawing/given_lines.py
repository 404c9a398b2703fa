"""Make the outline of a crack that is given in mm as a line with a width, or as two walls. Nothing is traced.

If a line and a width are given, the walls are half of the width to either side of the line. The crack's ends are square
to the line. At the edge of the face, the crack ends along that edge.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from manifold3d import CrossSection, FillRule
from scipy.spatial import KDTree

from digitise.geometry.polyline import (
    Box,
    depth_inside,
    extended,
    resampled,
    signed_area,
    without_repeats,
)
from digitise.geometry.region import box_region, pieces
from digitise.mesh_import.cavity import ACROSS_PX, top_view
from digitise.mesh_import.mouth_line import MouthLine, line_of_mouth, outline_of
from digitise.photo import Photo
from digitise.walls.wall_profile import edge_crossings, rays_across
from sealtwin.core.arc_length import arc_length, at_arc_length
from sealtwin.core.arrays import lengths
from sealtwin.core.errors import InputError, ShapeError
from sealtwin.core.records import Floats, Outline
from sealtwin.core.solid_figures import EndKind

# Limits that decide which lines bound a crack.
SLENDERNESS = 3.0  # Minimum ratio of length to mean width, as for a crack in a mesh
ON_EDGE_MM = 0.01  # An end is on the edge of the face if it is closer to it than this
MAX_TRIMMED = 0.02  # Largest fraction of the area that may be cut off where walls cross, as for a traced crack
# Points of a line that are more than this many widths apart are in different parts of the crack. Steps per width
PART_WIDTHS, STEPS = 2.0, 16
NO_FACE_MM = (-np.inf, -np.inf, np.inf, np.inf)


Given = tuple[Outline, Photo]  # An outline, and the picture that shows it


def outline_of_line(points_mm: Floats, width_mm: Floats, face_mm: Box | None, name: str) -> Given:
    """Return the outline of a crack along a line, (n, 2). ``width_mm`` is rows of arc length and width, (k, 2).

    Between the rows, the width is linear. An end on or beyond the edge of the face is open. Any other end is
    cut. Raises InputError, with ``name`` first, if the line is too short for its width, turns back on itself, or is
    outside the face.
    """
    points_mm = without_repeats(points_mm, ON_EDGE_MM)
    s_mm = arc_length(points_mm)
    mean_mm = np.trapezoid(np.interp(s_mm, *width_mm.T), s_mm) / max(s_mm[-1], np.finfo(float).tiny)
    if len(points_mm) < 2 or s_mm[-1] < SLENDERNESS * mean_mm:
        raise InputError(
            f"{name}: the line is {s_mm[-1]:.3g} mm long and the crack is {mean_mm:.3g} mm wide on average. Give a "
            f"line, in mm, that is at least {SLENDERNESS:g} times as long as the crack is wide."
        )
    step_mm, box_mm = mean_mm / ACROSS_PX, face_mm or NO_FACE_MM
    at_edge = depth_inside(points_mm[[0, -1]], box_mm) < ON_EDGE_MM
    before_mm, after_mm = 2 * mean_mm * at_edge
    line_mm = extended(resampled(points_mm, step_mm), before_mm, after_mm, mean_mm, step_mm)
    crossed = edge_crossings(line_mm, box_mm)
    if at_edge.tolist() != [crossing is not None for crossing in crossed]:
        raise InputError(
            f"{name}: the line is outside the face of {box_mm[2] - box_mm[0]:g} x {box_mm[3] - box_mm[1]:g} mm, or "
            "crosses the face's edge twice. Check the line's points and face_mm."
        )
    # The resampled line is shorter: it cuts the corners.
    s_mm = arc_length(line_mm)
    first_mm, last_mm = (
        end_mm if crossing is None else crossing.s_mm for end_mm, crossing in zip((0.0, s_mm[-1]), crossed, strict=True)
    )
    wide_mm = np.interp(s_mm - before_mm, *width_mm.T)
    across_mm = wide_mm[:, None] / 2 * rays_across(line_mm, mean_mm, crossed)
    lines_mm = np.hstack([line_mm, line_mm + across_mm, line_mm - across_mm])
    _require_apart(line_mm, wide_mm, name)
    mouth = _between(lines_mm[:, 2:4], lines_mm[:, 4:], face_mm, name)
    stations_mm = np.linspace(first_mm, last_mm, max(2, 1 + round((last_mm - first_mm) / step_mm)))
    centre_mm, left_mm, right_mm = np.hsplit(at_arc_length(lines_mm, s_mm, stations_mm), 3)
    kinds: list[EndKind] = ["cut" if crossing is None else "open" for crossing in crossed]
    line = MouthLine(centre_mm, left_mm, right_mm, (kinds[0], kinds[1]), (), ())
    outline, photo = _drawn(mouth, line, face_mm, name)
    return replace(outline, width_source="gauge"), photo


def outline_between(left_mm: Floats, right_mm: Floats, face_mm: Box | None, name: str) -> Given:
    """Return the outline of a crack between two walls, (n, 2) and (m, 2). Straight lines join the walls' ends.

    Seen along the left wall, the crack is on its right. The second wall may run in either direction. An end on or
    beyond the edge of the face is open. Raises InputError, with ``name`` first, if the walls cross or are exchanged, or
    if they bound no single crack with two ends.
    """
    parts = pieces(_between(left_mm, same_way(left_mm, right_mm), face_mm, name))
    if len(parts) != 1:
        raise InputError(f"{name}: the crack has {len(parts)} pieces on the face of the sample. Draw it as one piece.")
    (mouth,) = parts
    try:
        line = line_of_mouth(mouth, face_mm or NO_FACE_MM)
    except ShapeError as fault:
        raise InputError(f"{name}: {fault.wrong}") from None
    first_mm, last_mm = lengths(line.centreline_mm[[0, -1]] - left_mm[0])
    if first_mm > last_mm:
        line = replace(
            line,
            centreline_mm=line.centreline_mm[::-1],
            left_mm=line.right_mm[::-1],
            right_mm=line.left_mm[::-1],
            ends=line.ends[::-1],
        )
    return _drawn(mouth, line, face_mm, name)


def same_way(wall_mm: Floats, other_mm: Floats) -> Floats:
    """Return the second wall of a crack, reversed if it runs against the first."""
    first_mm, last_mm = lengths(other_mm[[0, -1]] - wall_mm[-1])
    return other_mm[:: 1 if last_mm <= first_mm else -1]


def _between(left_mm: Floats, right_mm: Floats, face_mm: Box | None, name: str) -> CrossSection:
    """Return the region between two walls on the face. Raises InputError if the walls cross or are exchanged."""
    ring_mm = np.concatenate([right_mm, left_mm[::-1]])
    region, area_mm2 = CrossSection([ring_mm], FillRule.Positive), signed_area(ring_mm)
    if area_mm2 <= 0:
        raise InputError(f"{name}: the left wall is to the right of the right wall. Exchange the two walls.")
    if abs(region.area() - area_mm2) > MAX_TRIMMED * area_mm2 or region.num_contour() > 1:
        raise InputError(
            f"{name}: the walls cross: the crack crosses itself, or a bend is too tight for the crack's width."
        )
    return region if face_mm is None else region ^ box_region(face_mm)


def _require_apart(line_mm: Floats, width_mm: Floats, name: str) -> None:
    """Raise InputError if two parts of a crack along a line overlap. ``width_mm`` is the width at each point, (n,)."""
    s_mm, most_mm = arc_length(line_mm), width_mm.max()
    stations_mm = np.arange(0.0, s_mm[-1], most_mm / STEPS)
    places_mm = at_arc_length(np.column_stack([line_mm, s_mm, width_mm + ON_EDGE_MM]), s_mm, stations_mm)
    pairs = places_mm[KDTree(places_mm[:, :2]).query_pairs(most_mm + ON_EDGE_MM, output_type="ndarray")]
    away_mm = lengths(np.diff(pairs[:, :, :2], axis=1)[:, 0])
    overlap = (np.ptp(pairs[:, :, 2], axis=1) > PART_WIDTHS * most_mm) & (away_mm < pairs[:, :, 3].mean(axis=1))
    if overlap.any():
        nearest = np.where(overlap, away_mm, np.inf).argmin()
        first_mm, last_mm = np.sort(pairs[nearest, :, 2])
        raise InputError(
            f"{name}: the line comes within {away_mm[nearest]:.2g} mm of itself, at s = {first_mm:.1f} and "
            f"{last_mm:.1f} mm. The crack is {pairs[nearest, 0, 3]:.2g} mm wide there, so it overlaps itself. Draw "
            "its parts farther apart."
        )


def _drawn(mouth: CrossSection, line: MouthLine, face_mm: Box | None, name: str) -> Given:
    """Return the outline of a crack's mouth, and a picture of it."""
    width_mm = mouth.area() / arc_length(line.centreline_mm)[-1]
    photo = top_view(mouth, width_mm, face_mm, Path(name), "given: lines in mm")
    return outline_of(line, mouth, photo, "drawn"), photo
