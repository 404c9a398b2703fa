"""From a rough path to the crack's outline: both walls to a fraction of a pixel, its centreline, its ends."""

import numpy as np

from digitise.finding.crack_path import CrackPath
from digitise.geometry.polyline import (
    at_arc_length,
    clipped_to_box,
    on_side,
    signed_area,
    smoothed,
    uncrossed,
    without_loops,
    without_repeats,
)
from digitise.photo import Photo
from digitise.walls.branches import with_branches
from digitise.walls.drawn import RIM, painted_photo
from digitise.walls.islands import find_islands, with_islands
from digitise.walls.mouths import trace_past_mouths
from digitise.walls.side_cracks import find_side_cracks
from digitise.walls.traced import STATION_PX, Traced, trace
from sealtwin.errors import InputError
from sealtwin.records import Outline, arc_length

MIN_WIDTH_PX = 8.0
"""Narrower, blur and threshold decide the width more than the crack does."""
HAIRLINE = 0.6
"""Of that: a path that looks narrower has no walls to look for. Over cracks of 2 to 15 px, paths whose walls are seen
were within a fifth of the true width, but too wide by half below 3 px.
"""
MIN_SLENDERNESS = 3.0
"""Length over width: shorter, there is no direction to follow."""
WALL_SMOOTHING_PX = 2.0
"""Gaussian sigma of the walls along the crack: below what grain and noise leave, above a grain of sand's own edge."""
MOST_TRIMMED = 0.02
"""Share of the crack's area that may go where its walls cross each other."""
WORTH_SAYING = 0.05
"""Share of the crack without a wall from which it is told."""

PROPOSAL = "the crack was found automatically: look at overlay.png, then give ends_px to confirm it"


def trace_outline(photo: Photo, path: CrackPath, edge_fraction: float = 0.5, keep_branches: bool = False) -> Outline:
    """Measure the crack along ``path``, which may be painted.

    At an open end s = 0 is where the centreline meets the edge of the face. With ``keep_branches`` the ring holds the
    side cracks too. Raises InputError where the crack is too narrow, too short, or its walls are not found.
    """
    if path.source == "mask":
        photo, edge_fraction = painted_photo(photo, path), RIM
    islands = find_islands(photo, path, edge_fraction)
    sides = find_side_cracks(islands.photo, path, edge_fraction)
    past = trace_past_mouths(islands.photo, sides, lambda seen: _traced(seen, path, edge_fraction))
    outline = _assemble(photo, path, past.traced)
    # What is painted is as wide as it is painted, with no blur to mistake for it.
    least_px = 0.0 if path.source == "mask" else MIN_WIDTH_PX
    return with_islands(with_branches(photo, outline, sides, past, keep_branches, least_px), islands)


def _traced(photo: Photo, path: CrackPath, edge_fraction: float) -> Traced:
    """Both walls. Raises InputError where the crack is too narrow or too short to have any."""
    _check_wide(photo, path.width_px, HAIRLINE * MIN_WIDTH_PX)
    length_px = float(arc_length(path.points_px)[-1])
    if length_px < MIN_SLENDERNESS * path.width_px:
        raise InputError(
            f"{photo.file}: the crack is {length_px:.0f} px long and {path.width_px:.0f} px wide; need "
            f"{MIN_SLENDERNESS:g} times its width: give ends_px farther apart."
        )
    traced = trace(photo, path, edge_fraction)
    _check_wide(photo, traced.width_px, MIN_WIDTH_PX)
    return traced


def _check_wide(photo: Photo, width_px: float, least_px: float) -> None:
    if width_px < least_px:
        raise InputError(
            f"{photo.file}: the crack is {width_px:.1f} px wide; need {MIN_WIDTH_PX:g} px to measure its width: "
            "move the camera closer."
        )


def _assemble(photo: Photo, path: CrackPath, traced: Traced) -> Outline:
    """Stations from end to end, and the ring round them."""
    s_mm = arc_length(traced.line_mm)
    first_mm, last_mm = traced.span_mm
    sigma = WALL_SMOOTHING_PX / STATION_PX
    left_mm, right_mm = (without_loops(smoothed(wall, sigma)) for wall in (traced.left_mm, traced.right_mm))
    count = max(2, 1 + round((last_mm - first_mm) / (STATION_PX * photo.mm_per_px)))
    stations = np.linspace(first_mm, last_mm, count)
    centreline_mm, left_at, right_at = (
        at_arc_length(points, s_mm, stations) for points in (traced.line_mm, left_mm, right_mm)
    )
    tips = [station for kind, station in zip(traced.kinds, (0, -1), strict=True) if kind == "closed"]
    left_at[tips] = right_at[tips] = centreline_mm[tips]  # a tip belongs to both walls
    if photo.face_mm is not None:
        low, high = photo.face_mm[:2], photo.face_mm[2:]
        left_at, right_at = np.clip(left_at, low, high), np.clip(right_at, low, high)
        for kind, station in zip(traced.kinds, (0, -1), strict=True):
            for line_mm in (centreline_mm, left_at, right_at) if kind == "open" else ():
                line_mm[station] = on_side(line_mm[station], photo.face_mm)
    # Round a sharp corner one wall may touch the other by a hair.
    whole = np.concatenate([right_at, left_at[::-1]])
    ring = uncrossed(whole)
    if len(ring) < 3 or signed_area(ring) < (1 - MOST_TRIMMED) * signed_area(whole):
        raise InputError(f"{photo.file}: the walls of the crack cross each other; give ends_px of a clearer part.")
    if photo.face_mm is not None:
        ring = clipped_to_box(ring, photo.face_mm)
    ring = without_repeats(ring, 1e-3 * photo.mm_per_px)
    return Outline(
        centreline_mm=centreline_mm,
        left_wall_mm=left_at,
        right_wall_mm=right_at,
        outline_mm=ring,
        centreline_px=photo.to_px(centreline_mm),
        left_wall_px=photo.to_px(left_at),
        right_wall_px=photo.to_px(right_at),
        outline_px=photo.to_px(ring),
        ends=traced.kinds,
        face_mm=photo.face_mm,
        mm_per_px=photo.mm_per_px,
        scale_source=photo.scale_source,
        scale_residual_mm=photo.scale_residual_mm,
        path_source=path.source,
        scale_uncertainty=photo.scale_uncertainty,
        camera_tilt_deg=photo.camera_tilt_deg,
        warnings=(*photo.warnings, *path.warnings, *_doubts(path, traced)),
    )


def _doubts(path: CrackPath, traced: Traced) -> list[str]:
    doubts = []
    if path.source == "automatic":
        doubts.append(PROPOSAL)
    if traced.unseen > WORTH_SAYING:
        doubts.append(f"a wall was not seen on {traced.unseen:.0%} of the crack and is bridged there")
    if traced.beyond_mm > 0:
        doubts.append(
            f"{traced.beyond_mm:.1f} mm of the path are left out at the edge of the photo, which cuts a wall off"
        )
    return doubts
