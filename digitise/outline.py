"""Measure the crack along a rough path: walls to a fraction of a pixel, centreline, ends, islands and side cracks."""

from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from skimage.measure import points_in_poly

from digitise.crack_path.hints import CrackPath, listed
from digitise.crack_path.profiles import band_px, finite_median, is_wider, profiles_across
from digitise.geometry import polyline
from digitise.image.raster import Mask, sampled
from digitise.photo import Photo, smaller
from digitise.settings import PhotoInput
from digitise.walls.centreline_and_walls import MIN_WIDTH_PX, STATION_PX, TooThinError, WallsMissingError, trace
from digitise.walls.dark_region import trace_dark_region
from digitise.walls.doubts import (
    LINE_PX,
    PLAUSIBLE,
    WORTH_SAYING,
    darker_line,
    judge_reach,
    judge_stretches,
    plausible_walls,
    with_bands,
    with_doubts,
)
from digitise.walls.drawn import ByHand, with_drawn
from digitise.walls.ends import Traced
from digitise.walls.islands_and_side_cracks import find_surroundings, photo_of_paint, with_side_cracks
from digitise.walls.thin_crack import BoxFit, NotFittedError, trace_line, trace_thin
from sealtwin.core.arc_length import arc_length, at_arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import SIDES, Floats, Integers, Outline, WallMethod, WallStretch, WidthSource
from sealtwin.core.solid_figures import Span

# Sigma of the walls' smoothing along the crack. It removes noise from grain and preserves the edge of a sand grain
WALL_SMOOTHING_PX = 2.0
MAX_TRIMMED = 0.02  # Largest fraction of the crack's area that may be cut off where its walls cross
# A table of widths may be this much shorter than the crack without a warning, since ends are equally uncertain
TABLE_SHORT_MM = 2.0
CLICKED = ("ends", "via", "mask")  # Sources of paths whose ends a person chose
MIN_FITTED_PX = 1.7  # Smallest fitted width: 2 px, minus the 15 % by which such a fit may be off
RIM = 0.5  # Fraction of the contrast that defines the rim of the paint. Blur does not move this rim
BRUSH_PX = 1.0  # Half of the 95 % interval of a painted width that the photo does not confirm


BY_DEFAULT = PhotoInput(file=Path("photo"), data="undeclared", mm_per_px=1.0)
"""Photo settings with defaults for everything that affects how a crack is measured."""


REGION = (
    "the ground is too coarse to follow the walls. They are the rims of the dark region along the path, "
    "each moved as a whole to its contrast threshold (95 % interval of the mean width: {:.3g} to {:.3g} {}). "
    "Check the lines over the photo (overlay.png)"
)
# If a fitted width is this many times the width of a darker line between the walls, the fit did not measure that line
FITTED_INSIDE = 1.7
LINE_INSIDE = (
    "between the walls, which are {:.3g} {} apart, a line about {:.2g} {} wide is far darker than the rest, like "
    "a crack in a joint or a wet strip. The interval covers both widths. Check the lines over the photo "
    "(overlay.png). If that line is the crack, give width_mm"
)
BAND = (
    "the fitted width is {:.3g} {}, but the photo is dark over about {:.2g} {} across the crack, for example because "
    "of debris in it, a broken edge or a joint. The interval covers both widths. Check the lines over the photo "
    "(overlay.png). If the whole band is crack, draw its walls in walls_px, or give width_mm"
)
PAINTED = (
    "the painted crack is no darker than the ground beside it. The width of the paint is used, {:.3g} {} (95 %: "
    "{:.3g} to {:.3g}), and the photo does not confirm it"
)
GAUGE = "the crack's width is the given width_mm. Side cracks and islands are not searched for"
ORIGINS: dict[WidthSource, tuple[WallMethod, str]] = {
    "walls": ("edge", "in the middle of the step from dark to bright across the crack"),
    "region": ("region", "the rim of the dark region along the path, since the ground is too coarse for single steps"),
    "fit": ("fit", "half the width that was fitted to the crack's blurred profile, from its darkest line"),
    "gauge": ("gauge", "half the given width from the line down the crack's middle"),
}
OF_PAINT: tuple[WallMethod, str] = "drawn", "on the rim of the painted mask"
BY_HAND: tuple[WallMethod, str] = "drawn", "on a line drawn along it"
BRIDGED: tuple[WallMethod, str] = (
    "bridged",
    "no step from dark to bright is in view, for example across the mouth of a side crack",
)


def trace_outline(photo: Photo, path: CrackPath, settings: PhotoInput = BY_DEFAULT) -> Outline:
    """Measure the crack along ``path``: between its walls or, if it is too thin for that, by a fit of its profile.

    Only the settings on how a crack is measured are used. The outline is a path without walls if ``path_only`` is set,
    if the crack is too thin for the fit, or if the fit fails for a path that the user clicked. Raises InputError if
    ``outline_by_walls`` does, if a thin crack or the ground next to it is hidden, or if walls were drawn for an outline
    without walls.
    """
    width_mm = settings.width_stations_mm
    by_hand = bool(settings.walls_px)
    # Along a path that may not be the crack, only what the user has measured or drawn is its width.
    alone = settings.path_only or (path.doubtful and not by_hand)
    if by_hand and (settings.path_only or width_mm is not None):
        raise InputError(
            f"{photo.file}: photo.walls_px cannot be combined with width_mm or path_only. Give only one of them."
        )
    if alone or width_mm is not None:
        traced = _middle(photo, path, settings)
        if width_mm is None:
            return outline_along(photo, path, traced, "none")
        return _gauged(photo, path, traced, width_mm)
    if path.width_px >= MIN_WIDTH_PX or path.source == "mask" or by_hand:
        with suppress(TooThinError):
            drawn_px: list[Any] = [*(settings.walls_px or ())]
            outline = outline_by_walls(with_drawn(photo, path, drawn_px), path, settings)
            if settings.wall is not None and outline.bands_mm:
                drawn_px += map(photo.to_px, plausible_walls(outline)[settings.wall - 1])
                middle = replace(path, points_px=outline.centreline_px)
                outline = outline_by_walls(with_drawn(photo, middle, drawn_px), path, settings)
            # If a dark crack is in a grey band, such as a joint, the crack is measured. The warning states both widths.
            inner = None if by_hand or path.source == "mask" else darker_line(photo, path, outline)
            if inner is None:
                return outline
            narrow_mm, wide_mm = inner.width_px * photo.mm_per_px, outline.mean_width_mm
            with suppress(InputError):
                fitted = _fitted(photo, inner, wide_mm)
                if fitted.width_source == "fit" and fitted.mean_width_mm < FITTED_INSIDE * narrow_mm:
                    return fitted
            # The fit failed, or it measured the band instead of the crack.
            inside = doubt(f"{PLAUSIBLE}.line-inside", LINE_INSIDE.format(wide_mm, photo.unit, narrow_mm, photo.unit))
            # The picture was blurred before the line was searched for, so the line may be this much narrower.
            least_mm = max(inner.width_px - LINE_PX, 1.0) * photo.mm_per_px
            walls = tuple(replace(wall, doubt_mm=(least_mm / 2, wide_mm / 2)) for wall in outline.walls)
            return with_doubts(outline, inside, width_95_mm=(least_mm, wide_mm), walls=walls)
    if by_hand:
        raise InputError(f"{photo.file}: photo.walls_px: the crack is too thin for measured walls. Leave it out.")
    if path.source != "mask" or not _is_light(photo, path):
        return _fitted(photo, path)
    outline = outline_by_walls(ByHand(photo), path, settings, least_px=0.0)
    mean_mm, brush_mm = outline.mean_width_mm, BRUSH_PX * photo.mm_per_px
    interval_mm = max(mean_mm - brush_mm, 0.0), mean_mm + brush_mm
    unconfirmed = doubt(f"{PLAUSIBLE}.painted", PAINTED.format(mean_mm, photo.unit, *interval_mm))
    return with_doubts(outline, unconfirmed, width_95_mm=interval_mm)


def _is_light(photo: Photo, path: CrackPath) -> bool:
    """Return True if the photo is no darker on a path than on the ground beside it."""
    profiles = profiles_across(photo, path.points_px, path.width_px, 3 * path.width_px + 4)
    away_px = profiles.away_px
    inside, beside = away_px <= max(path.width_px / 4, 1.0), away_px > path.width_px + 2
    return finite_median(profiles.light[:, inside]) >= finite_median(profiles.light[:, beside])


def outline_by_walls(hand: ByHand, path: CrackPath, settings: PhotoInput, least_px: float = MIN_WIDTH_PX) -> Outline:
    """Measure a crack between its walls. The outline includes side cracks if ``settings.branches`` is "keep".

    At an open end, the centreline begins or ends at the edge of the face. Raises InputError if the crack is too short
    or its walls are not found. Raises TooThinError if the width is below ``least_px`` or mostly blur.
    """
    photo, painted = hand.photo, path.source == "mask"
    shown, share = (photo_of_paint(photo, path), RIM) if painted else (photo, settings.edge_fraction)
    around = find_surroundings(shown, path, share)
    try:
        traced = trace(shown, path, share, around.hidden, least_px)
    except WallsMissingError as unclear:
        # The ground may be too coarse to follow walls.
        try:
            traced = trace_dark_region(shown, path, share, around.hidden)
        except InputError as neither:
            raise WallsMissingError(f"{unclear} A second method was tried: {neither.fault}") from None
    source: WidthSource = "walls" if traced.width_spread is None else "region"
    outline = outline_along(photo, path, traced, source, by_hand=hand.decided)
    missed = judge_reach(photo, path.points_px, outline.centreline_px, traced.kinds)
    if not painted:
        outline = with_bands(photo, outline, around.hidden)
        missed += judge_stretches(photo, outline.centreline_mm, outline.width_mm)
    # Paint is not blurred, so thin side cracks can be measured.
    least_px = 0.0 if painted else MIN_WIDTH_PX
    outline = with_side_cracks(photo, outline, around.side_cracks, settings.branches == "keep", least_px)
    islands_mm = tuple(ring for ring in around.islands_mm if points_in_poly(ring, outline.outline_mm).all())
    warnings = (*missed, *outline.warnings)
    if islands_mm:
        count = "1 island is" if len(islands_mm) == 1 else f"{len(islands_mm)} islands are"
        area_mm2 = -sum(map(polyline.signed_area, islands_mm))
        text = f"{count} in the crack, {area_mm2:.1f} {photo.unit}² in all; no sealant goes there"
        warnings += (doubt("walls.islands", text, area_mm2, "mm²"),)
    return replace(outline, warnings=warnings, islands_mm=(*islands_mm, *outline.islands_mm))


def outline_along(
    photo: Photo,
    path: CrackPath,
    traced: Traced,
    source: WidthSource,
    *doubts: Fact,
    width_95_mm: Span | None = None,
    by_hand: Mask | None = None,
) -> Outline:
    """Return the outline of a traced crack, without side cracks and islands."""
    (centreline_mm, left_mm, right_mm), methods = _stations(photo, traced)
    warnings = [*photo.warnings, *path.warnings]
    # Most shorter gaps are corners and chips of a few px.
    if traced.missing > 2 * WORTH_SAYING:
        text = f"a wall was not found along {traced.missing:.0%} of the crack, and is bridged there"
        warnings.append(doubt(f"{PLAUSIBLE}.bridged", text, traced.missing))
    if traced.beyond_mm > 0:
        left_out = f"{traced.beyond_mm:.1f} {photo.unit} of the path are left out"
        text = f"{left_out} at the edge of the photo, which cuts off a wall"
        warnings.append(doubt("walls.cut-by-photo", text, traced.beyond_mm, "mm"))
    if by_hand is not None:
        drawn = np.stack([sampled(by_hand, photo.to_px(wall_mm)) > 0 for wall_mm in (left_mm, right_mm)])
        methods = np.where(drawn, 2, methods)
        share = max(float(drawn.mean()), 0.01)
        text = f"{share:.0%} of the walls follow lines drawn by hand or chosen by number"
        warnings.append(doubt("walls.drawn", text, share))
    if source == "none":
        # The ring of a path follows it forth and back, and encloses no area.
        left_mm = right_mm = centreline_mm
        ring_mm = np.concatenate([centreline_mm, centreline_mm[-2:0:-1]])
    else:
        ring_mm = _ring(photo, left_mm, right_mm)
    outline = Outline(
        **photo.in_both_units(centreline=centreline_mm, left_wall=left_mm, right_wall=right_mm, outline=ring_mm),
        ends=traced.kinds,
        **photo.facts_of_outline,
        path_source=path.source,
        path_verdict=path.verdict,
        warnings=(*warnings, *doubts),
        width_source=source,
        width_95_mm=width_95_mm,
    )
    if traced.width_spread is not None:
        low_mm, high_mm = (outline.mean_width_mm * (1 + traced.width_spread * sign) for sign in (-1, 1))
        region = doubt(f"{PLAUSIBLE}.region", REGION.format(low_mm, high_mm, photo.unit))
        outline = with_doubts(outline, region, width_95_mm=(low_mm, high_mm))
    return outline if source == "none" else replace(outline, walls=_origins(outline, methods))


def _origins(outline: Outline, methods: Integers) -> tuple[WallStretch, ...]:
    """Return the stretches of both walls.

    ``methods``, (2, n), is 0 for the outline's usual method, 1 for a bridged wall, and 2 for a wall drawn by hand.
    """
    of_paint = outline.path_source == "mask" and outline.width_source == "walls"
    origins = [OF_PAINT if of_paint else ORIGINS[outline.width_source], BRIDGED, BY_HAND]
    stretches, s_mm, both_mm = [], outline.s_mm.round(3).tolist(), outline.width_95_mm
    for side, numbers in zip(SIDES, methods, strict=True):
        for begin, end in pairwise([0, *np.flatnonzero(np.diff(numbers)) + 1, len(numbers) - 1]):
            method, why = origins[numbers[begin]]
            # Each wall has half of the mean width's uncertainty.
            doubt_mm = None if both_mm is None or numbers[begin] else (both_mm[0] / 2, both_mm[1] / 2)
            stretches.append(WallStretch(s_mm[begin], s_mm[end], side, method, doubt_mm, why))
    return tuple(stretches)


def _fitted(photo: Photo, path: CrackPath, band_mm: float | None = None) -> Outline:
    """Return the outline of a thin crack with a fitted width. If the width is below ``MIN_FITTED_PX``, it has no walls.

    ``band_mm`` is the width of a grey band around the crack. None if it is not known. Raises InputError if the width
    may be 0.
    """
    # If a photo was enlarged, the smaller copy shows as much as the photo.
    factor = max(1, int(path.width_px / MIN_WIDTH_PX))
    copy, narrow = smaller(photo, factor), path.in_copy(factor)
    try:
        traced, fit = trace_thin(copy, narrow)
    except NotFittedError as unfitted:
        if path.source not in CLICKED:
            raise
        alone = f"the result is a path without walls or solid: {unfitted.fault}"
        return outline_along(photo, path, trace_line(copy, narrow), "none", doubt("walls.path-alone", alone))
    if fit.mean_px < MIN_FITTED_PX:
        thin = (
            f"the crack is about {factor * max(fit.mean_px, 0):.1f} px wide, too thin to measure its width. The "
            "result is its path, without walls or solid. Move the camera closer, or measure the width and give "
            "width_mm"
        )
        return outline_along(photo, path, traced, "none", doubt("walls.too-thin", thin, fit.mean_px, "px"))
    low_mm, mean_mm, high_mm = (px * copy.mm_per_px for px in (fit.interval_px[0], fit.mean_px, fit.interval_px[1]))
    if low_mm <= 0:
        raise InputError(
            f"{photo.file}: the width of this line cannot be measured: a fit of its blurred profile gives "
            f"{mean_mm:.3g} {photo.unit} (95 %: {low_mm:.3g} to {high_mm:.3g}), which includes 0. The line is not "
            "clearly darker than the ground beside it. Give ends_px on a dark crack, or give width_mm or path_only."
        )
    why = "too thin" if factor * fit.mean_px < MIN_WIDTH_PX else "too blurred"
    fitted = (
        f"the crack is {factor * fit.mean_px:.1f} px wide, {why} for measured walls. Its width is fitted to its "
        f"blurred profile: {mean_mm:.3g} {photo.unit} on average (95 %: {low_mm:.3g} to {high_mm:.3g}). Side cracks "
        "and islands are not searched for"
    )
    doubts, dark_mm = [doubt("walls.fitted", fitted, mean_mm, "mm")], band_mm or _dark_mm(copy, narrow, traced, fit)
    if dark_mm is not None:
        doubts.append(doubt(f"{PLAUSIBLE}.band", BAND.format(mean_mm, photo.unit, dark_mm, photo.unit), dark_mm, "mm"))
    return outline_along(photo, path, traced, "fit", *doubts, width_95_mm=(low_mm, max(high_mm, dark_mm or 0.0)))


def _dark_mm(photo: Photo, path: CrackPath, traced: Traced, fit: BoxFit) -> float | None:
    """Return the width of the dark band along a fitted crack. None if the band is not far wider than the fit.

    Raises InputError if the mask is only a line in that band.
    """
    dark_px = band_px(photo, photo.to_px(traced.line_mm), fit.mean_px)
    dark_mm = dark_px * photo.mm_per_px
    if path.source == "mask" and is_wider(dark_px, path.width_px):
        raise InputError(
            f"{photo.file}: photo.mask is a line {photo.length(path.width_px)} wide along a dark band about "
            f"{photo.length(dark_px)} wide, and does not fill the band. Paint the crack from wall to wall. Or leave "
            "the mask out and give ends_px, with path_only if only the path is needed."
        )
    return dark_mm if is_wider(dark_px, fit.mean_px) else None


def _middle(photo: Photo, path: CrackPath, settings: PhotoInput) -> Traced:
    """Return the line along the middle of a crack, without walls. If walls are found, it is half way between them."""
    if path.width_px >= MIN_WIDTH_PX or path.source == "mask":
        with suppress(InputError):
            outline = outline_by_walls(ByHand(photo), path, settings)
            line_mm = outline.centreline_mm
            return Traced(line_mm, line_mm, line_mm, outline.ends, (0.0, outline.length_mm), 0.0)
    return trace_line(photo, path)


def _gauged(photo: Photo, path: CrackPath, traced: Traced, width_mm: Floats) -> Outline:
    """Return the outline whose walls are each half of the given width away from the crack's middle.

    ``width_mm`` has rows of arc length and width, (k, 2).
    """
    s_mm, normal = arc_length(traced.line_mm), polyline.left_normals(traced.line_mm)
    half_mm = np.interp(s_mm, *width_mm.T)[:, None] / 2 * normal
    traced = replace(traced, left_mm=traced.line_mm + half_mm, right_mm=traced.line_mm - half_mm)
    doubts = [doubt("walls.gauge", GAUGE)]
    last_mm, width_there_mm = width_mm[-1].tolist()
    if 0 < last_mm < s_mm[-1] - TABLE_SHORT_MM:
        text = (
            f"width_mm extends to s = {last_mm:g} {photo.unit}, but the crack is {s_mm[-1]:.1f} {photo.unit} long. "
            f"The last width, {width_there_mm:g} {photo.unit}, is used for the rest. Extend the table"
        )
        doubts.append(doubt("walls.short-table", text, last_mm, "mm"))
    return outline_along(photo, path, traced, "gauge", *doubts)


def _stations(photo: Photo, traced: Traced) -> tuple[list[Floats], Integers]:
    """Return centreline, left and right wall at even stations, (n, 2) each, and the walls' methods, (2, n).

    A method is 1 if the wall is bridged at the station, and 0 otherwise.
    """
    s_mm, walls_mm = arc_length(traced.line_mm), (traced.left_mm, traced.right_mm)
    sigma = WALL_SMOOTHING_PX / STATION_PX
    smooth_mm = (polyline.without_loops(polyline.smoothed(wall_mm, sigma)) for wall_mm in walls_mm)
    length_px = (traced.span_mm[1] - traced.span_mm[0]) / (STATION_PX * photo.mm_per_px)
    stations = np.linspace(*traced.span_mm, max(2, 1 + round(length_px)))
    lines_mm = at_arc_length(np.hstack([traced.line_mm, *smooth_mm]), s_mm, stations)
    centreline_mm, left_mm, right_mm = np.hsplit(lines_mm, 3)
    methods = np.zeros((2, len(stations)), int)
    if traced.clear_step is not None:
        methods[at_arc_length(traced.clear_step.T.astype(float), s_mm, stations).T < 0.5] = 1
    tips, opens = ([end for end in (0, -1) if traced.kinds[end] == kind] for kind in ("closed", "open"))
    left_mm[tips] = right_mm[tips] = centreline_mm[tips]  # a tip belongs to both walls
    lines_mm = [centreline_mm, left_mm, right_mm]
    if photo.face_mm is not None:
        lines_mm[1:] = (np.clip(wall_mm, photo.face_mm[:2], photo.face_mm[2:]) for wall_mm in lines_mm[1:])
        for line_mm in lines_mm:
            for end in opens:
                line_mm[end] = polyline.on_side(line_mm[end], photo.face_mm)
    return lines_mm, methods


def _ring(photo: Photo, left_mm: Floats, right_mm: Floats) -> Floats:
    """Return both walls as one ring on the face. Raises InputError if they cross each other."""
    # At a sharp corner, one wall may touch the other.
    whole = np.concatenate([right_mm, left_mm[::-1]])
    ring = polyline.uncrossed(whole)
    if len(ring) < 3 or polyline.signed_area(ring) < (1 - MAX_TRIMMED) * polyline.signed_area(whole):
        first = [*polyline.crossings(whole, closed=True), (0, 0)][0][0]
        raise InputError(
            f"{photo.file}: the walls of the crack cross each other, first at {listed(photo.to_px(whole[[first]]))} "
            "px. Give ends_px of a clearer part."
        )
    if photo.face_mm is not None:
        ring = polyline.clipped_to_box(ring, photo.face_mm)
    return polyline.without_repeats(ring, 1e-3 * photo.mm_per_px)
