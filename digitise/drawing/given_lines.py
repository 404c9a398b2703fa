"""The outline of a crack that is given in mm: a line with a width, or two walls. Nothing is traced."""

from pathlib import Path

import numpy as np
from manifold3d import CrossSection, FillRule

from digitise.crack_path.hints import CrackPath
from digitise.geometry.polyline import Box, depth_inside, extended, resampled, signed_area, without_repeats
from digitise.geometry.region import box_region
from digitise.mesh_import.cavity_sections import ACROSS_PX, seen_from_above
from digitise.mesh_import.mouth_line import MouthLine, line_of_mouth
from digitise.outline import outline_along
from digitise.photo import Photo
from digitise.walls.centreline_and_walls import Traced
from digitise.walls.straightened import Crossing, Crossings, edge_crossing, rays_across
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError, ShapeError
from sealtwin.core.records import Floats, Outline
from sealtwin.core.solid_figures import EndKind

# Limits of given lines, and sizes of the picture in which a report shows them.
#
# The first three decide which lines bound a crack. The others change the look of the picture alone.
SLENDERNESS = 3.0  # Least length over mean width, as of a crack in a mesh
ON_EDGE_MM = 0.01  # Distance from the edge of the face within which an end is on it
MOST_TRIMMED = 0.02  # Largest share of the area that is cut off where walls cross, as of a traced crack
AROUND_MM = 15.0  # Width of face shown around the crack
FACE_GREY = 205.0
CRACK_GREY = 40.0


_NONE: Crossings = None, None
Given = tuple[Outline, Photo]  # An outline, and the picture in which it is shown


def outline_of_line(points_mm: Floats, width_mm: Floats, face_mm: Box | None, name: str) -> Given:
    """Return the outline of a crack along a line, (n, 2), with widths at arc lengths, (k, 2), linear between them.

    An end on the edge of the face or beyond it is open; any other end is cut. Raises InputError that begins with
    ``name`` if the line is too short for its width, turns back on itself, or is outside the face.
    """
    points_mm = without_repeats(points_mm, ON_EDGE_MM)
    s_mm = arc_length(points_mm)
    mean_mm = float(np.trapezoid(np.interp(s_mm, *width_mm.T), s_mm) / max(s_mm[-1], np.finfo(float).tiny))
    if len(points_mm) < 2 or s_mm[-1] < SLENDERNESS * mean_mm:
        raise InputError(
            f"{name}: the line is {s_mm[-1]:.3g} mm long and the crack is {mean_mm:.3g} mm wide on average; give a "
            f"line, in mm, at least {SLENDERNESS:g} times as long as the crack is wide."
        )
    line_mm, crossings = resampled(points_mm, mean_mm / ACROSS_PX), _NONE
    first_mm, last_mm, begins_mm = 0.0, float(s_mm[-1]), 0.0
    if face_mm is not None:
        at_edge = [bool(depth_inside(points_mm[[end]], face_mm)[0] < ON_EDGE_MM) for end in (0, -1)]
        begins_mm, beyond_mm = (2 * mean_mm * at for at in at_edge)
        line_mm = extended(line_mm, begins_mm, beyond_mm, mean_mm, mean_mm / ACROSS_PX)
        crossings = edge_crossing(line_mm, face_mm, at_start=True), edge_crossing(line_mm, face_mm, at_start=False)
        if at_edge != [crossing is not None for crossing in crossings]:
            raise InputError(f"{name}: the line is outside the face, {_size(face_mm)}, or crosses its edge twice.")
        first_mm, last_mm = (
            end_mm if crossing is None else crossing.s_mm
            for end_mm, crossing in zip((begins_mm, begins_mm + last_mm), crossings, strict=True)
        )
    half_mm = np.interp(arc_length(line_mm) - begins_mm, *width_mm.T)[:, None] / 2
    rays = rays_across(line_mm, mean_mm, crossings)
    left_mm, right_mm = line_mm + half_mm * rays, line_mm - half_mm * rays
    photo = _picture(_region(left_mm, right_mm, face_mm, name), mean_mm, face_mm, name)
    kinds: tuple[EndKind, EndKind] = (_kind(crossings[0]), _kind(crossings[1]))
    traced = Traced(line_mm, left_mm, right_mm, kinds, (first_mm, last_mm), mean_mm / photo.mm_per_px, 0.0, 0.0)
    return outline_along(photo, CrackPath(photo.to_px(line_mm), traced.width_px, "drawn"), traced, "gauge"), photo


def outline_between(left_mm: Floats, right_mm: Floats, face_mm: Box | None, name: str) -> Given:
    """Return the outline of a crack between two walls, (n, 2) and (m, 2), whose ends are joined by straight lines.

    Seen along the left wall, the crack is on its right. The second wall may run the other way. An end on the edge of
    the face or beyond it is open. Raises InputError that begins with ``name`` if the walls cross or have changed sides.
    """
    if np.linalg.norm(left_mm[-1] - right_mm[-1]) > np.linalg.norm(left_mm[-1] - right_mm[0]):
        right_mm = right_mm[::-1]
    mouth = _region(left_mm, right_mm, face_mm, name)
    try:
        line = line_of_mouth(mouth, face_mm or _around(mouth))
    except ShapeError as fault:
        raise InputError(f"{name}: {fault.wrong}") from None
    if np.linalg.norm(line.centreline_mm[0] - left_mm[0]) > np.linalg.norm(line.centreline_mm[-1] - left_mm[0]):
        line = MouthLine(
            line.centreline_mm[::-1],
            line.right_mm[::-1],
            line.left_mm[::-1],
            (line.ends[1], line.ends[0]),
            (),
            line.warnings,
        )
    width_mm = mouth.area() / arc_length(line.centreline_mm)[-1]
    photo = _picture(mouth, width_mm, face_mm, name)
    ring_mm = max(map(np.asarray, mouth.to_polygons()), key=signed_area)
    lines = {"centreline": line.centreline_mm, "left_wall": line.left_mm, "right_wall": line.right_mm}
    outline = Outline(
        **photo.in_both_units(**lines, outline=ring_mm),
        ends=line.ends,
        **photo.facts_of_outline,
        path_source="drawn",
        warnings=line.warnings,
    )
    return outline, photo


def _region(left_mm: Floats, right_mm: Floats, face_mm: Box | None, name: str) -> CrossSection:
    """Return the crack between two walls on the face."""
    ring_mm = np.concatenate([right_mm, left_mm[::-1]])
    region, area_mm2 = CrossSection([ring_mm], FillRule.Positive), signed_area(ring_mm)
    if area_mm2 <= 0:
        raise InputError(f"{name}: the left wall is on the right of the right wall; exchange them.")
    if region.area() < (1 - MOST_TRIMMED) * area_mm2:
        raise InputError(f"{name}: the walls cross: the crack crosses itself, or a bend is too tight for its width.")
    return region if face_mm is None else region ^ box_region(face_mm)


def _picture(mouth: CrossSection, width_mm: float, face_mm: Box | None, name: str) -> Photo:
    """Draw the crack dark on a bright face."""
    low, high = np.reshape(_around(mouth), (2, 2))
    view, mm_per_px, crack = seen_from_above(mouth, width_mm, low, high)
    grey = FACE_GREY + crack * (CRACK_GREY - FACE_GREY)
    return Photo(
        file=Path(name),
        image=np.repeat(grey.round().astype(np.uint8)[:, :, None], 3, axis=2),
        brightness=1.0 - crack,
        view=view,
        face_mm=face_mm,
        mm_per_px=mm_per_px,
        scale_source="given: lines in mm",
    )


def _kind(crossing: Crossing | None) -> EndKind:
    return "cut" if crossing is None else "open"


def _around(mouth: CrossSection) -> Box:
    x_min, y_min, x_max, y_max = mouth.bounds()
    away_mm = AROUND_MM
    return x_min - away_mm, y_min - away_mm, x_max + away_mm, y_max + away_mm


def _size(face_mm: Box) -> str:
    return f"{face_mm[2] - face_mm[0]:g} x {face_mm[3] - face_mm[1]:g} mm"
