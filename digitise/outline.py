"""From a rough path to the crack's outline: both walls to a fraction of a pixel, its centreline, its ends."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from digitise.darkness import sample_mask
from digitise.ends import PathEnd, judge_end
from digitise.path import CrackPath
from digitise.photo import Photo
from digitise.polyline import (
    at_arc_length,
    clipped_to_box,
    depth_inside,
    extended,
    resampled,
    signed_area,
    smoothed,
    tangents,
    uncrossed,
    without_loops,
    without_repeats,
)
from digitise.raster import Map, blurred
from digitise.strip import BLUR_PX, Strip, Walls, find_walls, straighten
from digitise.wall_ends import walls_on_face
from sealtwin.errors import InputError
from sealtwin.records import EndKind, Floats, Outline, arc_length

MIN_WIDTH_PX = 8.0
"""Narrower, blur and threshold decide the width more than the crack does."""
MIN_SLENDERNESS = 3.0
"""Length over width: shorter, there is no direction to follow."""
STATION_PX = 2.5
"""Between stations: 0.25 mm at 0.1 mm/px."""
PASSES = 3
"""Each centres the line between the walls that the last one found; the third moves it by less than 0.01 mm."""
REACH = 1.5
"""Crack widths to either side that are searched for a wall."""
BEYOND: dict[EndKind, float] = {"open": 3.0, "cut": 0.75, "closed": 1.0}
"""Crack widths that the line is carried past its ends: over an open edge so far that both walls of an oblique crack
reach it, else as much as smoothing needs.
"""
PATH_SMOOTHING = 0.75
"""Gaussian sigma of the rough path, in crack widths: its steps are cells of the search map."""
CENTRE_SMOOTHING = 0.25
"""Gaussian sigma of the centreline, in crack widths."""
WALL_SMOOTHING_PX = 2.0
"""Gaussian sigma of the walls along the crack: below what grain and noise leave, above a grain of sand's own edge."""
MOST_UNSEEN = 0.2
"""Share of the path on which a wall may be missing."""
MOST_TRIMMED = 0.02
"""Share of the crack's area that may go where its walls cross each other."""
WORTH_SAYING = 0.05
"""The same share, from which it is told. An open end hides a wall by itself, on about 3 % of the fixture."""


@dataclass(frozen=True)
class _Traced:
    """A line that runs past the crack's ends, and the walls along it."""

    strip: Strip
    walls: Walls

    @property
    def left_mm(self) -> Floats:
        return self.strip.line_mm + self.walls.left_mm[:, None] * self.strip.normal

    @property
    def right_mm(self) -> Floats:
        return self.strip.line_mm - self.walls.right_mm[:, None] * self.strip.normal

    @property
    def middle_mm(self) -> Floats:
        return (self.left_mm + self.right_mm) / 2


def trace_outline(photo: Photo, path: CrackPath) -> Outline:
    """Measure the crack along ``path``.

    At an open end s = 0 is where the centreline meets the edge of the face. There the outline and both walls end on the
    edge; an oblique crack's walls do so at different s: see ``walls_on_face``. Raises InputError where the crack is too
    narrow, too short, or its walls are not found.
    """
    if path.width_px < MIN_WIDTH_PX:
        raise InputError(
            f"{photo.file}: the crack is {path.width_px:.1f} px wide; need {MIN_WIDTH_PX:g} px to measure its width: "
            "move the camera closer."
        )
    length_px = float(arc_length(path.points_px)[-1])
    if length_px < MIN_SLENDERNESS * path.width_px:
        raise InputError(
            f"{photo.file}: the crack is {length_px:.0f} px long and {path.width_px:.0f} px wide; need "
            f"{MIN_SLENDERNESS:g} times its width: give ends_px farther apart."
        )
    traced, ends = _trace(photo, path)
    unseen = _unseen(traced)
    if unseen > MOST_UNSEEN:
        raise InputError(_walls_missing(photo, unseen))
    return _assemble(photo, path, traced, ends, unseen)


def _trace(photo: Photo, path: CrackPath) -> tuple[_Traced, tuple[PathEnd, PathEnd]]:
    soft, mask = blurred(photo.brightness, BLUR_PX), sample_mask(photo)
    spacing_mm = STATION_PX * photo.mm_per_px
    width_mm = path.width_px * photo.mm_per_px

    def look(line_mm: Floats) -> _Traced:
        strip = straighten(photo, soft, mask, line_mm, REACH * width_mm)
        return _Traced(strip, find_walls(strip, width_mm, spacing_mm))

    line_mm = smoothed(resampled(photo.to_mm(path.points_px), spacing_mm), PATH_SMOOTHING * width_mm / spacing_mm)
    threshold = look(line_mm).walls.threshold
    first = _judge(photo, soft, mask, path.points_px, path.width_px, float(threshold[0]))
    last = _judge(photo, soft, mask, path.points_px[::-1], path.width_px, float(threshold[-1]))
    if first.kind == "closed":
        line_mm = np.concatenate([photo.to_mm(first.place_px[None]), line_mm])
    if last.kind == "closed":
        line_mm = np.concatenate([line_mm, photo.to_mm(last.place_px[None])])
    before_mm, after_mm = (BEYOND[end.kind] * width_mm for end in (first, last))
    traced = look(resampled(extended(line_mm, before_mm, after_mm, 2 * width_mm, spacing_mm), spacing_mm))
    for _ in range(PASSES - 1):
        seen = traced.walls.left_seen & traced.walls.right_seen
        if not seen.any():
            raise InputError(_walls_missing(photo, 1.0))
        width_mm = float(np.median((traced.walls.left_mm + traced.walls.right_mm)[seen]))
        middle_mm = resampled(traced.middle_mm, spacing_mm)
        traced = look(smoothed(middle_mm, CENTRE_SMOOTHING * width_mm / spacing_mm))
    return traced, (first, last)


def _judge(
    photo: Photo, soft: Map, mask: NDArray[np.uint8], points_px: Floats, width_px: float, threshold: float
) -> PathEnd:
    """What happens at the first of ``points_px``."""
    behind_px = points_px[int(np.searchsorted(arc_length(points_px), 2 * width_px))]
    ahead = (points_px[0] - behind_px) / np.linalg.norm(points_px[0] - behind_px)
    return judge_end(photo, soft, mask, points_px[0], ahead, width_px, threshold)


def _unseen(traced: _Traced) -> float:
    """Share of the crack, where it is on the sample, on which a wall is missing."""
    walls = traced.walls
    inside = traced.strip.valid[:, len(traced.strip.offset_mm) // 2] & walls.open_line
    return 1 - float(np.mean((walls.left_seen & walls.right_seen)[inside])) if inside.any() else 1.0


def _walls_missing(photo: Photo, unseen: float) -> str:
    return (
        f"{photo.file}: walls not found on {unseen:.0%} of the path (at most {MOST_UNSEEN:.0%}); look at the photo for "
        "shadows and dirt along the crack, or give ends_px of a clearer part."
    )


def _end_place_mm(photo: Photo, line_mm: Floats, end: PathEnd, at_start: bool) -> float:
    """Arc length on the traced line at which the crack begins or ends."""
    s_mm = arc_length(line_mm)
    if end.kind == "open":
        return _edge_crossing_mm(photo, line_mm, s_mm, at_start)
    place_mm = photo.to_mm(end.place_px[None])[0]
    nearest = int(np.argmin(np.linalg.norm(line_mm - place_mm, axis=1)))
    beside_mm = float((place_mm - line_mm[nearest]) @ tangents(line_mm)[nearest])
    return float(np.clip(s_mm[nearest] + beside_mm, 0, s_mm[-1]))


def _edge_crossing_mm(photo: Photo, line_mm: Floats, s_mm: Floats, at_start: bool) -> float:
    """Where the line enters the face, or leaves it, as seen from its middle."""
    assert photo.face_mm is not None, "an open end needs an edge"
    depth_mm = depth_inside(line_mm, photo.face_mm)
    outside = np.flatnonzero(depth_mm < 0)
    middle = len(line_mm) // 2
    beyond = outside[outside < middle] if at_start else outside[outside > middle]
    if len(beyond) == 0 or depth_mm[middle] < 0:
        raise InputError(
            f"{photo.file}: the crack runs along the edge of the face without crossing it; give ends_px farther inside."
        )
    out = int(beyond[-1] if at_start else beyond[0])
    inner = out + 1 if at_start else out - 1
    fraction = depth_mm[inner] / (depth_mm[inner] - depth_mm[out])
    return float(s_mm[inner] + fraction * (s_mm[out] - s_mm[inner]))


def _assemble(photo: Photo, path: CrackPath, traced: _Traced, ends: tuple[PathEnd, PathEnd], unseen: float) -> Outline:
    """Stations from end to end, and the ring round them."""
    line_mm = traced.strip.line_mm
    s_mm = arc_length(line_mm)
    first_mm, last_mm = _end_place_mm(photo, line_mm, ends[0], True), _end_place_mm(photo, line_mm, ends[1], False)
    sigma = WALL_SMOOTHING_PX / STATION_PX
    left_mm, right_mm = (without_loops(smoothed(wall, sigma)) for wall in (traced.left_mm, traced.right_mm))
    count = max(2, 1 + round((last_mm - first_mm) / (STATION_PX * photo.mm_per_px)))
    stations = np.linspace(first_mm, last_mm, count)
    centreline_mm, left_at, right_at = (
        at_arc_length(points, s_mm, stations) for points in (line_mm, left_mm, right_mm)
    )
    kinds = (ends[0].kind, ends[1].kind)
    tips = [station for kind, station in zip(kinds, (0, -1), strict=True) if kind == "closed"]
    left_at[tips] = right_at[tips] = centreline_mm[tips]  # a tip belongs to both walls
    over_start = (s_mm < first_mm) & (kinds[0] == "open")
    over_end = (s_mm > last_mm) & (kinds[1] == "open")
    right_side, left_side = (
        np.concatenate([wall[over_start], at, wall[over_end]])
        for wall, at in ((right_mm, right_at), (left_mm, left_at))
    )
    # Round a sharp corner one wall may touch the other by a hair.
    whole = np.concatenate([right_side, left_side[::-1]])
    ring = uncrossed(whole)
    if len(ring) < 3 or signed_area(ring) < (1 - MOST_TRIMMED) * signed_area(whole):
        raise InputError(f"{photo.file}: the walls of the crack cross each other; give ends_px of a clearer part.")
    if photo.face_mm is not None:
        ring = clipped_to_box(ring, photo.face_mm)
        open_ends = (kinds[0] == "open", kinds[1] == "open")
        left_at, right_at = walls_on_face(left_mm, right_mm, s_mm, stations, photo.face_mm, open_ends)
        left_at[tips] = right_at[tips] = centreline_mm[tips]
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
        ends=kinds,
        face_mm=photo.face_mm,
        mm_per_px=photo.mm_per_px,
        scale_source=photo.scale_source,
        scale_residual_mm=photo.scale_residual_mm,
        path_source=path.source,
        warnings=(*photo.warnings, *path.warnings, *_doubts(path, unseen)),
    )


def _doubts(path: CrackPath, unseen: float) -> list[str]:
    doubts = []
    if path.source == "automatic":
        doubts.append("the crack was found automatically: look at overlay.png, then give ends_px to confirm it")
    if unseen > WORTH_SAYING:
        doubts.append(f"a wall was not seen on {unseen:.0%} of the crack and is bridged there")
    return doubts
