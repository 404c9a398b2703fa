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
    without_loops,
    without_repeats,
)
from digitise.raster import Map, blurred
from digitise.strip import BLUR_PX, Strip, Walls, find_walls, straighten
from sealtwin.errors import InputError
from sealtwin.records import EndKind, Floats, Outline, arc_length

MIN_WIDTH_PX = 8.0
"""Narrower, blur and threshold decide the width more than the crack does."""
STATION_PX = 2.5
"""Between stations: 0.25 mm at 0.1 mm/px."""
PASSES = 3
"""Each centres the line between the walls that the last one found; the third moves it by less than 0.01 mm."""
REACH = 1.5
"""Crack widths to either side that are searched for a wall."""
BEYOND_OPEN = 3.0
"""Crack widths that the line is carried over an open edge, so that both walls of an oblique crack reach it."""
BEYOND_CUT = 0.75
BEYOND_TIP = 1.0
CENTRE_SMOOTHING = 0.25
"""Gaussian sigma of the centreline, in crack widths."""
WALL_SMOOTHING_PX = 2.0
"""Gaussian sigma of the walls along the crack: below what grain and noise leave, above a grain of sand's own edge."""
MOST_UNSEEN = 0.2
"""Share of the path on which a wall may be missing."""


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

    At an open end s = 0 is where the centreline meets the edge of the face. There the outline ends on the edge, while
    the walls of the first stations, which lie on the centreline's normals, may reach past it: an oblique crack's walls
    end at different s. Raises InputError where the crack is too narrow or its walls are not found.
    """
    if path.width_px < MIN_WIDTH_PX:
        raise InputError(
            f"{photo.file}: the crack is {path.width_px:.1f} px wide; need {MIN_WIDTH_PX:g} px to measure its width: "
            "move the camera closer."
        )
    soft = blurred(photo.brightness, BLUR_PX)
    mask = sample_mask(photo)
    traced, ends = _trace(photo, path, soft, mask)
    first_s, last_s = (_end_place_mm(photo, traced, ends, which) for which in (0, 1))
    return _assemble(photo, path, traced, (ends[0].kind, ends[1].kind), first_s, last_s)


def _trace(
    photo: Photo, path: CrackPath, soft: Map, mask: NDArray[np.uint8]
) -> tuple[_Traced, tuple[PathEnd, PathEnd]]:
    spacing_mm = STATION_PX * photo.mm_per_px
    width_mm = path.width_px * photo.mm_per_px
    inner_mm = smoothed(resampled(photo.to_mm(path.points_px), spacing_mm), 0.75 * width_mm / spacing_mm)
    strip = straighten(photo, soft, mask, inner_mm, REACH * width_mm)
    walls = find_walls(strip, width_mm, spacing_mm)
    ends = _judge_ends(photo, path, soft, mask, walls)
    line_mm = _prolonged(photo, inner_mm, ends, width_mm, spacing_mm)
    traced = None
    for _ in range(PASSES):
        strip = straighten(photo, soft, mask, line_mm, REACH * width_mm)
        walls = find_walls(strip, width_mm, spacing_mm)
        traced = _Traced(strip, walls)
        width_mm = float(np.median((walls.left_mm + walls.right_mm)[walls.left_seen & walls.right_seen]))
        line_mm = smoothed(resampled(traced.middle_mm, spacing_mm), CENTRE_SMOOTHING * width_mm / spacing_mm)
    assert traced is not None
    _check_seen(photo, traced)
    return traced, ends


def _judge_ends(
    photo: Photo, path: CrackPath, soft: Map, mask: NDArray[np.uint8], walls: Walls
) -> tuple[PathEnd, PathEnd]:
    s_px = arc_length(path.points_px)
    over = min(2 * path.width_px, s_px[-1] / 2)
    near = path.points_px[int(np.searchsorted(s_px, over))]
    far = path.points_px[int(np.searchsorted(s_px, s_px[-1] - over))]
    judged = []
    for end_px, behind_px, station in ((path.points_px[0], near, 0), (path.points_px[-1], far, -1)):
        ahead = (end_px - behind_px) / np.linalg.norm(end_px - behind_px)
        threshold = float(walls.threshold[station])
        judged.append(judge_end(photo, soft, mask, end_px, ahead, path.width_px, threshold))
    return judged[0], judged[1]


def _prolonged(
    photo: Photo, inner_mm: Floats, ends: tuple[PathEnd, PathEnd], width_mm: float, spacing_mm: float
) -> Floats:
    """The line carried on past its ends, as far as each kind of end needs."""
    beyond = {"open": BEYOND_OPEN, "cut": BEYOND_CUT, "closed": BEYOND_TIP}
    line_mm = inner_mm
    for which, end in enumerate(ends):
        if which:
            line_mm = line_mm[::-1]
        if end.kind == "closed":
            line_mm = np.concatenate([photo.to_mm(end.place_px[None]), line_mm])
        longer = extended(line_mm, beyond[end.kind] * width_mm, 2 * width_mm, spacing_mm)
        added = len(longer) - len(line_mm)
        line_mm = longer[: len(longer) - added // 2]
        if which:
            line_mm = line_mm[::-1]
    return resampled(line_mm, spacing_mm)


def _end_place_mm(photo: Photo, traced: _Traced, ends: tuple[PathEnd, PathEnd], which: int) -> float:
    """Arc length on the traced line at which the crack begins (``which`` 0) or ends (1)."""
    line_mm = traced.strip.line_mm
    s_mm = arc_length(line_mm)
    end = ends[which]
    place_mm = photo.to_mm(end.place_px[None])[0]
    nearest = int(np.argmin(np.linalg.norm(line_mm - place_mm, axis=1)))
    if end.kind == "cut":
        along = tangents(line_mm)[nearest]
        return float(np.clip(s_mm[nearest] + (place_mm - line_mm[nearest]) @ along, 0, s_mm[-1]))
    if end.kind == "open":
        assert photo.face_mm is not None
        return _edge_crossing_mm(line_mm, s_mm, photo.face_mm, which)
    return _tip_mm(traced, s_mm, which)


def _edge_crossing_mm(line_mm: Floats, s_mm: Floats, face_mm: tuple[float, float, float, float], which: int) -> float:
    """Where the line enters (0) or leaves (1) the face, from its middle outward."""
    depth = depth_inside(line_mm, face_mm)
    outside = np.flatnonzero(depth < 0)
    middle = len(line_mm) // 2
    beyond = outside[outside < middle] if which == 0 else outside[outside > middle]
    if len(beyond) == 0:
        return float(s_mm[0] if which == 0 else s_mm[-1])
    out = int(beyond[-1] if which == 0 else beyond[0])
    inner = out + 1 if which == 0 else out - 1
    fraction = depth[inner] / (depth[inner] - depth[out])
    return float(s_mm[inner] + fraction * (s_mm[out] - s_mm[inner]))


def _tip_mm(traced: _Traced, s_mm: Floats, which: int) -> float:
    """Where the line leaves the dark for good."""
    dark = np.flatnonzero(traced.walls.open_line)
    return float(s_mm[dark[0] if which == 0 else dark[-1]])


def _check_seen(photo: Photo, traced: _Traced) -> None:
    on_sample = traced.strip.valid[:, len(traced.strip.offset_mm) // 2] & traced.walls.open_line
    seen = traced.walls.left_seen & traced.walls.right_seen
    unseen = 1 - float(np.mean(seen[on_sample])) if on_sample.any() else 1.0
    if unseen > MOST_UNSEEN:
        raise InputError(
            f"{photo.file}: walls not found on {unseen:.0%} of the path (at most {MOST_UNSEEN:.0%}); "
            "look at the photo for shadows and dirt along the crack, or give ends_px of a clearer part."
        )


def _assemble(
    photo: Photo, path: CrackPath, traced: _Traced, kinds: tuple[EndKind, EndKind], first_s: float, last_s: float
) -> Outline:
    line_mm = traced.strip.line_mm
    s_mm = arc_length(line_mm)
    spacing_mm = STATION_PX * photo.mm_per_px
    sigma = WALL_SMOOTHING_PX / STATION_PX
    left_mm, right_mm = (without_loops(smoothed(wall, sigma)) for wall in (traced.left_mm, traced.right_mm))
    count = max(2, 1 + round((last_s - first_s) / spacing_mm))
    stations = np.linspace(first_s, last_s, count)
    centreline_mm, left_at, right_at = (
        at_arc_length(points, s_mm, stations) for points in (line_mm, left_mm, right_mm)
    )
    # A tip belongs to both walls.
    for kind, station in zip(kinds, (0, -1), strict=True):
        if kind == "closed":
            left_at[station] = right_at[station] = centreline_mm[station]
    before, after = s_mm < first_s, s_mm > last_s
    keep_before, keep_after = kinds[0] == "open", kinds[1] == "open"
    left_ring, right_ring = (
        np.concatenate([wall[before & keep_before], at, wall[after & keep_after]])
        for wall, at in ((left_mm, left_at), (right_mm, right_at))
    )
    ring = np.concatenate([right_ring, left_ring[::-1]])
    if photo.face_mm is not None:
        ring = clipped_to_box(ring, photo.face_mm)
    ring = without_repeats(ring, 1e-3 * spacing_mm)
    if len(ring) < 3 or signed_area(ring) <= 0:
        raise InputError(f"{photo.file}: the walls of the crack cross; give ends_px of a clearer part.")
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
        warnings=photo.warnings,
    )
