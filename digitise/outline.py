"""Measure the crack along a rough path: walls to a fraction of a pixel, centreline, ends, islands, side cracks."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from skimage.measure import points_in_poly

from digitise.crack_path.hints import CrackPath
from digitise.crack_path.standing_out import band_px, is_wider
from digitise.geometry import polyline
from digitise.photo import Photo, in_copy, smaller
from digitise.settings import PhotoInput
from digitise.walls.bands import find_bands
from digitise.walls.beyond import judge_beyond
from digitise.walls.box_fit import BoxFit
from digitise.walls.centreline_and_walls import STATION_PX, TooThinError, Traced
from digitise.walls.followed_walls import Follow, FollowedWalls
from digitise.walls.islands import photo_of_paint
from digitise.walls.mended import mended
from digitise.walls.side_cracks import with_branches
from digitise.walls.stretches import MIN_WIDTH_PX, WORTH_SAYING, judge_reach, judge_stretches
from digitise.walls.strokes import NO_STROKES, Strokes, by_strokes
from digitise.walls.thin_crack import NotFittedError, trace_line, trace_thin
from digitise.weighing.moved_walls import widened
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline, WidthSource
from sealtwin.core.solid_figures import Span

WALL_SMOOTHING_PX = 2.0  # Sigma of the walls along the crack: it removes noise of grain, and keeps a sand grain's edge
MOST_TRIMMED = 0.02  # Largest share of the crack's area that is cut off where its walls cross each other
TABLE_SHORT_MM = 2.0  # Length of crack beyond a table of widths without a warning: ends are uncertain by as much
CLICKED = ("ends", "via", "mask")  # Sources of paths with ends that a person chose
LEAST_FITTED_PX = 1.7  # Least width by a fit: 2 px, less the 15 % that such a fit may be off


BY_DEFAULT = PhotoInput(file=Path("photo"), data="undeclared", mm_per_px=1.0)
"""Photo settings in which everything about how a crack is measured has its default."""


class Unconfirmed(str):
    """Warning about a crack that was found automatically. A program recognises it by this type, not by its words."""


class DoubtfulWalls(str):
    """Warning about walls that strokes may move to where they are."""


REGION = (
    "the ground is too coarse to follow the walls one by one: they are the rims of the dark region along the path, "
    "each moved as a whole to its share of the contrast (95 % of the mean width: {:.3g} to {:.3g} mm). Look at "
    "overlay.png"
)
BAND = (
    "the fitted width is {:.3g} mm, but the photo is dark over about {:.2g} mm across the crack, perhaps because of "
    "debris in it or a broken edge: the interval covers both. Look at overlay.png; if the whole band is crack, draw "
    "over it in crack_strokes_px, or give width_mm"
)
PROPOSAL = Unconfirmed("the crack was found automatically: look at overlay.png, then give ends_px to confirm it")


def trace_outline(
    photo: Photo, path: CrackPath, settings: PhotoInput = BY_DEFAULT, follow: Follow = FollowedWalls
) -> Outline:
    """Measure the crack along ``path``: between its walls or, if it is too thin for them, by a fit of its profile.

    Only the settings on how a crack is measured are used. ``follow`` may return walls that it remembers. The outline is
    a path without walls if ``path_only`` is set, the crack is too thin for the fit, or a fit is impossible between
    clicks. Raises InputError if ``outline_by_walls`` does, if a thin crack or the ground next to it is hidden, or if
    walls were drawn for an outline without walls.
    """
    outline = _measured(photo, path, settings, follow)
    if path.source not in CLICKED:
        return outline
    shown = photo_of_paint(photo, path) if path.source == "mask" else photo
    beyond = judge_beyond(shown, outline.centreline_px, outline.ends, path.width_px)
    return replace(outline, warnings=(*outline.warnings, *beyond))


def _measured(photo: Photo, path: CrackPath, settings: PhotoInput, follow: Follow) -> Outline:
    """Return the outline for ``trace_outline``, which then checks the ground beyond its ends."""
    if settings.mean_width_mm is not None:
        shown = _measured(photo, path, settings.model_copy(update={"mean_width_mm": None}), follow)
        if shown.width_source == "none" or shown.branches_kept:
            raise InputError(
                f"{photo.file}: photo.mean_width_mm: only a crack with walls and without side cracks can be scaled to "
                'a mean width. Leave mean_width_mm out, or give width_mm and branches = "drop".'
            )
        moved = widened(shown, settings.mean_width_mm - shown.mean_width_mm)
        return replace(moved, width_source="gauge", width_95_mm=None)
    width_mm = settings.width_stations_mm
    by_hand = " and ".join(f"photo.{name}" for name in settings.drawn_by_hand)
    if by_hand and (settings.path_only or width_mm is not None):
        raise InputError(f"{photo.file}: {by_hand} cannot be combined with width_mm or path_only: give one.")
    if settings.path_only or width_mm is not None:
        traced = _middle(photo, path, settings, follow)
        return (
            outline_along(photo, path, traced, "none") if width_mm is None else _gauged(photo, path, traced, width_mm)
        )
    if path.width_px >= MIN_WIDTH_PX or path.source == "mask" or Strokes.of(settings):
        with suppress(TooThinError):
            return outline_by_walls(follow(photo, path, settings.edge_fraction), settings)
    if by_hand:
        raise InputError(f"{photo.file}: {by_hand}: the crack is too thin for measured walls; leave it out.")
    return _fitted(photo, path)


def outline_by_walls(walls: FollowedWalls, settings: PhotoInput) -> Outline:
    """Measure a crack between its walls. The ring includes side cracks if they are kept.

    At an open end the centreline begins or ends at the edge of the face. Raises InputError if the crack is too short or
    its walls are not found, and TooThinError if blur would decide its width.
    """
    photo, path, strokes = walls.photo, walls.path, Strokes.of(settings)
    painted = path.source == "mask"
    traced, rings_px = walls.main(insisted=bool(strokes))
    lines_mm = [photo.to_mm(np.array(line_px, dtype=float)) for line_px in settings.walls_px or ()]
    outline = outline_along(photo, path, traced, "walls", lines_mm=lines_mm, strokes=strokes)
    if strokes and outline.mean_width_mm < MIN_WIDTH_PX * photo.mm_per_px:
        raise TooThinError(f"{photo.file}: the crack is under {MIN_WIDTH_PX:g} px wide between its strokes.")
    if (spread := traced.width_spread) is not None:
        interval_mm = outline.mean_width_mm * (1 - spread), outline.mean_width_mm * (1 + spread)
        warnings = (*outline.warnings, DoubtfulWalls(REGION.format(*interval_mm)))
        outline = replace(outline, width_source="region", width_95_mm=interval_mm, warnings=warnings)
    bands = None if painted else find_bands(photo, outline, strokes, walls.sides)
    if bands is not None:
        warnings = (*outline.warnings, DoubtfulWalls(bands.warning))
        outline = replace(outline, bands_mm=bands.rings_mm, width_95_mm=bands.width_95_mm, warnings=warnings)
    missed = judge_reach(photo, path.points_px, outline.centreline_px, traced.kinds)
    # Paint has no blur that could be mistaken for width.
    least_px = 0.0 if painted else MIN_WIDTH_PX
    if not painted:
        missed += judge_stretches(photo, outline.centreline_mm, outline.width_mm)
    outline = with_branches(photo, outline, walls.sides, rings_px, settings.branches == "keep", least_px)
    within = (ring for ring in walls.islands_mm if points_in_poly(ring, outline.outline_mm).all())
    islands_mm = tuple(ring for ring in within if not strokes.crack_in(photo.to_px(ring)))
    return replace(
        outline,
        warnings=(*missed, *outline.warnings, *_island_warning(islands_mm)),
        islands_mm=(*islands_mm, *outline.islands_mm),
    )


def outline_along(
    photo: Photo,
    path: CrackPath,
    traced: Traced,
    source: WidthSource,
    width_95_mm: Span | None = None,
    remarks: tuple[str, ...] = (),
    lines_mm: Sequence[Floats] = (),
    strokes: Strokes = NO_STROKES,
) -> Outline:
    """Return the outline of a traced crack, without side cracks and islands.

    Strokes move its walls; then drawn stretches of wall replace them.
    """
    stations, doubts = by_strokes(photo, _stations(photo, traced), strokes, traced.kinds)
    centreline_mm, left_mm, right_mm, drawn, far = mended(photo, stations, lines_mm, traced.kinds)
    if source == "none":
        # The ring of a path runs forth and back, without area.
        left_mm = right_mm = centreline_mm
        ring_mm = np.concatenate([centreline_mm, centreline_mm[-2:0:-1]])
    else:
        ring_mm = _ring(photo, left_mm, right_mm)
    return Outline(
        **photo.in_both_units(centreline=centreline_mm, left_wall=left_mm, right_wall=right_mm, outline=ring_mm),
        ends=traced.kinds,
        **photo.facts_of_outline,
        path_source=path.source,
        warnings=(*photo.warnings, *path.warnings, *_doubts(path, traced, drawn), *doubts, *far, *remarks),
        width_source=source,
        width_95_mm=width_95_mm,
    )


def _fitted(photo: Photo, path: CrackPath) -> Outline:
    """Return the outline of a thin crack with a fitted width. Below ``LEAST_FITTED_PX`` it has no walls."""
    # An enlarged photo shows no more than the smaller one that it was made from.
    factor = max(1, int(path.width_px / MIN_WIDTH_PX))
    copy = photo if factor == 1 else smaller(photo, factor)
    narrow = replace(path, points_px=in_copy(path.points_px, factor), width_px=path.width_px / factor)
    try:
        traced, fit = trace_thin(copy, narrow)
    except NotFittedError as unfitted:
        if path.source not in CLICKED:
            raise
        why = str(unfitted).removeprefix(f"{photo.file}: ")
        alone = f"the result is a path, without walls or solid: {why}"
        return outline_along(photo, path, trace_line(copy, narrow), "none", remarks=(alone,))
    if fit.mean_px < LEAST_FITTED_PX:
        thin = (
            f"the crack is about {factor * max(fit.mean_px, 0):.1f} px wide, too thin to measure its width: the result "
            "is its path, without walls or solid; move the camera closer, or measure the width and give width_mm"
        )
        return outline_along(photo, path, traced, "none", remarks=(thin,))
    low_mm, mean_mm, high_mm = (px * copy.mm_per_px for px in (fit.interval_px[0], fit.mean_px, fit.interval_px[1]))
    if low_mm <= 0:
        raise InputError(
            f"{photo.file}: the width of this line cannot be measured: a fit of its blurred profile gives "
            f"{mean_mm:.3g} mm (95 %: {low_mm:.3g} to {high_mm:.3g} mm), which includes 0. The line is not clearly "
            "darker than the ground beside it: give ends_px on a dark crack, or give width_mm or path_only."
        )
    why = "too thin" if factor * fit.mean_px < MIN_WIDTH_PX else "too blurred"
    remark = (
        f"the crack is {factor * fit.mean_px:.1f} px wide, {why} for measured walls: its width is fitted to its "
        f"blurred profile, {mean_mm:.3g} mm on average (95 %: {low_mm:.3g} to {high_mm:.3g} mm); side cracks and "
        "islands are not searched for"
    )
    dark_mm = _dark_mm(copy, narrow, traced, fit)
    remarks = (remark,) if dark_mm is None else (remark, DoubtfulWalls(BAND.format(mean_mm, dark_mm)))
    return outline_along(photo, path, traced, "fit", (low_mm, max(high_mm, dark_mm or 0.0)), remarks)


def _dark_mm(photo: Photo, path: CrackPath, traced: Traced, fit: BoxFit) -> float | None:
    """Return the width of the dark band along a fitted crack; None if it is not far wider than the fit.

    Raises InputError if the mask is a line in it.
    """
    dark_px = band_px(photo, photo.to_px(traced.line_mm), fit.mean_px)
    dark_mm = dark_px * photo.mm_per_px
    if path.source == "mask" and is_wider(dark_px, path.width_px):
        raise InputError(
            f"{photo.file}: photo.mask paints a line {path.width_px * photo.mm_per_px:.2g} mm wide "
            f"({path.width_px:.1f} px) down a dark band about {dark_mm:.2g} mm wide ({dark_px:.0f} px), not its area. "
            "Paint the crack from wall to wall; or leave the mask out and give ends_px, with path_only for its path "
            "alone."
        )
    return dark_mm if is_wider(dark_px, fit.mean_px) else None


def _middle(photo: Photo, path: CrackPath, settings: PhotoInput, follow: Follow) -> Traced:
    """Return the line down the middle of a crack, between its walls if they are found, without the walls."""
    if path.width_px >= MIN_WIDTH_PX or path.source == "mask":
        with suppress(InputError):
            walls = follow(photo, path, settings.edge_fraction)
            outline = outline_by_walls(walls, settings.model_copy(update={"branches": "drop"}))
            line_mm = outline.centreline_mm
            return Traced(line_mm, line_mm, line_mm, outline.ends, (0.0, outline.length_mm), 0.0, 0.0, 0.0)
    return trace_line(photo, path)


def _gauged(photo: Photo, path: CrackPath, traced: Traced, width_mm: Floats) -> Outline:
    """Return the outline with given widths about its middle."""
    s_mm, normal = arc_length(traced.line_mm), polyline.left_normals(traced.line_mm)
    half_mm = np.interp(s_mm, *width_mm.T)[:, None] / 2 * normal
    traced = replace(traced, left_mm=traced.line_mm + half_mm, right_mm=traced.line_mm - half_mm)
    remarks = ["the crack's width is the given width_mm; side cracks and islands are not searched for"]
    last_mm, width_there_mm = width_mm[-1]
    if 0 < last_mm < s_mm[-1] - TABLE_SHORT_MM:
        remarks.append(
            f"width_mm extends to s = {last_mm:g} mm, but the crack is {s_mm[-1]:.1f} mm long: its last width, "
            f"{width_there_mm:g} mm, is used for the rest. Extend the table"
        )
    return outline_along(photo, path, traced, "gauge", remarks=tuple(remarks))


def glance(
    photo: Photo, path: CrackPath, settings: PhotoInput = BY_DEFAULT, follow: Follow = FollowedWalls
) -> Outline | None:
    """Trace the outline in a smaller copy of the photo; its pixels are the copy's. None if the walls are not found."""
    walls = follow(photo, path, settings.edge_fraction).glanced
    if walls is None:
        return None
    factor = round(path.width_px / walls.path.width_px)
    with suppress(InputError):
        drawn_px = {
            name: [in_copy(np.array(line_px), factor).tolist() for line_px in getattr(settings, name)]
            for name in settings.drawn_by_hand
        }
        return outline_by_walls(walls, settings.model_copy(update={**drawn_px, "branches": "drop"}))
    return None


def _stations(photo: Photo, traced: Traced) -> tuple[Floats, Floats, Floats]:
    """Return centreline, left and right wall at evenly spaced stations from end to end."""
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
    """Return both walls as one ring on the face; raise InputError if they cross each other."""
    # At a sharp corner one wall may just touch the other.
    whole = np.concatenate([right_mm, left_mm[::-1]])
    ring = polyline.uncrossed(whole)
    if len(ring) < 3 or polyline.signed_area(ring) < (1 - MOST_TRIMMED) * polyline.signed_area(whole):
        raise InputError(f"{photo.file}: the walls of the crack cross each other; give ends_px of a clearer part.")
    if photo.face_mm is not None:
        ring = polyline.clipped_to_box(ring, photo.face_mm)
    return polyline.without_repeats(ring, 1e-3 * photo.mm_per_px)


def _doubts(path: CrackPath, traced: Traced, drawn: float) -> list[str]:
    """Return warnings about the main crack; ``drawn`` is the share of its walls that was drawn by hand."""
    doubts: list[str] = [PROPOSAL] if path.source == "automatic" else []
    if drawn:
        doubts.append(f"{max(drawn, 0.01):.0%} of the walls were drawn by hand, not measured")
    if traced.missing > WORTH_SAYING:
        missing = f"a wall was not found on {traced.missing:.0%} of the crack and is bridged there"
        doubts.append(DoubtfulWalls(missing))
    if traced.beyond_mm > 0:
        doubts.append(
            f"{traced.beyond_mm:.1f} mm of the path are left out at the edge of the photo, which cuts off a wall"
        )
    return doubts


def _island_warning(islands_mm: tuple[Floats, ...]) -> list[str]:
    """Return a warning about islands, if there are any."""
    if not islands_mm:
        return []
    count = "1 island is" if len(islands_mm) == 1 else f"{len(islands_mm)} islands are"
    area_mm2 = sum(-polyline.signed_area(ring) for ring in islands_mm)
    return [f"{count} in the crack, {area_mm2:.1f} mm² in all: no sealant goes there"]
