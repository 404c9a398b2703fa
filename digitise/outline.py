"""Measure the crack along a rough path: its walls to a fraction of a pixel, centreline, ends, islands and branches."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
from skimage.measure import points_in_poly

from digitise.crack_path.hints import CrackPath
from digitise.geometry import polyline
from digitise.image.raster import shrunk
from digitise.photo import Photo
from digitise.scale.view import Lens, View
from digitise.walls.centreline_and_walls import STATION_PX, Traced
from digitise.walls.islands import find_islands, photo_of_paint
from digitise.walls.mouths import trace_past_mouths
from digitise.walls.side_cracks import find_side_cracks, measure_branches
from digitise.walls.stretches import MIN_WIDTH_PX, WORTH_SAYING, judge_reach, judge_stretches
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline, arc_length

RIM = 0.5  # Share of the contrast at which the rim of the paint lies, however blurred
WALL_SMOOTHING_PX = 2.0  # Sigma of the walls along the crack: below what grain leaves, above a sand grain's own edge
MOST_TRIMMED = 0.02  # Share of the crack's area that may be cut off where its walls cross each other
GLANCE_WIDTH_PX = 2 * MIN_WIDTH_PX  # Of the crack in the smaller copy: its walls are within 0.1 mm of the final ones


class Unconfirmed(str):
    """Warning about a crack that was found automatically; a program recognises it by this type, not by its words."""


PROPOSAL = Unconfirmed("the crack was found automatically: look at overlay.png, then give ends_px to confirm it")


def trace_outline(photo: Photo, path: CrackPath, edge_fraction: float = 0.5, keep_branches: bool = False) -> Outline:
    """Measure the crack along ``path``, which may be painted; ``keep_branches`` puts side cracks into the ring too.

    At an open end s = 0 is where the centreline meets the edge of the face. Raises InputError where the crack is too
    narrow, too short, or its walls are not found.
    """
    painted = path.source == "mask"
    source, edge_fraction = (photo_of_paint(photo, path), RIM) if painted else (photo, edge_fraction)
    islands_mm, source = find_islands(source, path, edge_fraction)
    sides = find_side_cracks(source, path, edge_fraction)
    traced, rings_px = trace_past_mouths(source, path, sides, edge_fraction)
    centreline_mm, left_mm, right_mm = _stations(photo, traced)
    missed = judge_reach(photo, path.points_px, photo.to_px(centreline_mm), traced.kinds)
    # Paint is as wide as it is painted, with no blur to mistake for it.
    least_px = 0.0 if painted else MIN_WIDTH_PX
    if not painted:
        missed += judge_stretches(photo, centreline_mm, np.linalg.norm(left_mm - right_mm, axis=1))
    main_mm = _ring(photo, left_mm, right_mm)
    branches = measure_branches(photo, main_mm, photo.to_px(centreline_mm), sides, rings_px, keep_branches, least_px)
    standing = tuple(ring for ring in islands_mm if points_in_poly(ring, branches.ring_mm).all())
    ring_mm = branches.ring_mm
    return Outline(
        **photo.in_both_units(centreline=centreline_mm, left_wall=left_mm, right_wall=right_mm, outline=ring_mm),
        ends=traced.kinds,
        face_mm=photo.face_mm,
        mm_per_px=photo.mm_per_px,
        scale_source=photo.scale_source,
        scale_residual_mm=photo.scale_residual_mm,
        path_source=path.source,
        warnings=(
            *missed,
            *photo.warnings,
            *path.warnings,
            *_doubts(path, traced),
            *branches.warnings,
            *_stated(standing),
        ),
        islands_mm=(*standing, *branches.enclosed_mm),
        branches_mm=branches.lines_mm,
        branches_kept=branches.kept,
        scale_uncertainty=photo.scale_uncertainty,
        camera_tilt_deg=photo.camera_tilt_deg,
        photo_size_px=photo.size_px,
    )


def glance(photo: Photo, path: CrackPath, edge_fraction: float = 0.5) -> Outline | None:
    """Trace the outline in a smaller copy of the photo, in whose pixels it is; None where its walls are not found."""
    if path.width_px < 2 * GLANCE_WIDTH_PX or photo.drawn is not None:
        return None
    factor = 2 ** int(np.log2(path.width_px / GLANCE_WIDTH_PX))
    narrow = replace(path, points_px=_placed(path.points_px, factor), width_px=path.width_px / factor)
    with suppress(InputError):
        return trace_outline(smaller(photo, factor), narrow, edge_fraction)
    return None


def smaller(photo: Photo, factor: int) -> Photo:
    """Return the photo with brightness and view in pixels ``factor`` times as large; its colours keep theirs."""
    offset = (factor - 1) / 2
    to_photo_px = np.array([[factor, 0, offset], [0, factor, offset], [0, 0, 1.0]])
    lens = photo.view.lens
    width, height = (side // factor for side in photo.size_px)
    whole = photo.brightness[: height * factor, : width * factor]
    return replace(
        photo,
        brightness=shrunk(whole, (width, height)),
        view=View(
            mm_from_px=photo.view.mm_from_px @ to_photo_px,
            lens=lens and Lens(_placed(lens.centre_px, factor), lens.bend_px2 * factor**2),
        ),
        mm_per_px=photo.mm_per_px * factor,
        markers_px=tuple(_placed(corners, factor) for corners in photo.markers_px),
    )


def _placed(points_px: Floats, factor: int) -> Floats:
    """Map pixels of the photo to pixels of the copy; the origin of each is the centre of its first pixel."""
    return (points_px - (factor - 1) / 2) / factor


def _stations(photo: Photo, traced: Traced) -> tuple[Floats, Floats, Floats]:
    """Centreline, left and right wall at evenly spaced stations from end to end."""
    s_mm = arc_length(traced.line_mm)
    first_mm, last_mm = traced.span_mm
    sigma = WALL_SMOOTHING_PX / STATION_PX
    left_mm, right_mm = (
        polyline.without_loops(polyline.smoothed(wall, sigma)) for wall in (traced.left_mm, traced.right_mm)
    )
    count = max(2, 1 + round((last_mm - first_mm) / (STATION_PX * photo.mm_per_px)))
    stations = np.linspace(first_mm, last_mm, count)
    centreline_mm, left_at, right_at = (
        polyline.at_arc_length(points, s_mm, stations) for points in (traced.line_mm, left_mm, right_mm)
    )
    tips = [station for kind, station in zip(traced.kinds, (0, -1), strict=True) if kind == "closed"]
    left_at[tips] = right_at[tips] = centreline_mm[tips]  # a tip belongs to both walls
    if photo.face_mm is not None:
        low, high = photo.face_mm[:2], photo.face_mm[2:]
        left_at, right_at = np.clip(left_at, low, high), np.clip(right_at, low, high)
        for kind, station in zip(traced.kinds, (0, -1), strict=True):
            for line_mm in (centreline_mm, left_at, right_at) if kind == "open" else ():
                line_mm[station] = polyline.on_side(line_mm[station], photo.face_mm)
    return centreline_mm, left_at, right_at


def _ring(photo: Photo, left_mm: Floats, right_mm: Floats) -> Floats:
    """Both walls as one ring on the face; raises InputError where they cross each other."""
    # Round a sharp corner one wall may touch the other by a hair.
    whole = np.concatenate([right_mm, left_mm[::-1]])
    ring = polyline.uncrossed(whole)
    if len(ring) < 3 or polyline.signed_area(ring) < (1 - MOST_TRIMMED) * polyline.signed_area(whole):
        raise InputError(f"{photo.file}: the walls of the crack cross each other; give ends_px of a clearer part.")
    if photo.face_mm is not None:
        ring = polyline.clipped_to_box(ring, photo.face_mm)
    return polyline.without_repeats(ring, 1e-3 * photo.mm_per_px)


def _doubts(path: CrackPath, traced: Traced) -> list[str]:
    """Warnings about the main crack."""
    doubts: list[str] = [PROPOSAL] if path.source == "automatic" else []
    if traced.missing > WORTH_SAYING:
        doubts.append(f"a wall was not found on {traced.missing:.0%} of the crack and is bridged there")
    if traced.beyond_mm > 0:
        doubts.append(
            f"{traced.beyond_mm:.1f} mm of the path are left out at the edge of the photo, which cuts a wall off"
        )
    return doubts


def _stated(islands_mm: tuple[Floats, ...]) -> list[str]:
    """The warning about islands, if there are any."""
    if not islands_mm:
        return []
    count = "1 island stands" if len(islands_mm) == 1 else f"{len(islands_mm)} islands stand"
    area_mm2 = sum(-polyline.signed_area(ring) for ring in islands_mm)
    return [f"{count} in the crack, {area_mm2:.1f} mm² in all: no sealant goes there"]
