"""Read the level along the crack from a scan of the sealed face."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_erosion, median_filter, uniform_filter
from skimage.measure import label

from sealtwin.core.arc_length import arc_length, arc_length_at, at_arc_length
from sealtwin.core.arrays import runs, unit
from sealtwin.core.doubts import CONFIRMS, Doubt, Location
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Booleans, Floats, Integers, Outline, Profile, Solid
from sealtwin.core.scan_figures import Scan, ScanFigures
from sealtwin.core.solid_figures import Span
from sealtwin.scan.edge_fit import SURE_AGREEING
from sealtwin.scan.height_map import MAD, grid_along
from sealtwin.scan.mouth_search import Target
from sealtwin.scan.points_file import read_points
from sealtwin.scan.registration import Placed, place
from sealtwin.scan.settings import Placement
from validate.metrics.volumes import cuts_of_cavity, fill_volumes
from validate.readings.grid import SheetFaults
from validate.readings.reading_checks import check_scan
from validate.settings import Readings
from validate.units import counted

STATION_MM = 1.0  # Distance between stations along the crack
CUTS = 33  # Number of cuts of the cavity, whose edges show where a wall rises above the sealant
OPEN_MM = 0.3  # A cell has sealant if the wall in it is this far below the level
WALLS_MM = 0.25  # Smallest distance from the walls at which a cell has no part of them
LEAST_SEEN = 0.3  # Smallest share of a station's cells that must be seen for a level
WINDOW_MM, MIDDLE, INNER = 3.0, 0.6, 0.5
"""Half the length of the window in which the surface is fitted, the share of the width with which the fit begins, and
the largest share of the half width that is left out beside the walls."""
ROUNDS, FEWEST_CELLS = 5, 12
PATCH_STEP_MM, PATCH_MM2 = 0.3, 12.0
"""A patch of the surface that is smaller than this area is dirt, a bubble or a stray, and not seen, if a step of this
height, or of a cell's side, separates it from the rest. Without this, the RMS error of 40 drawn scans doubles."""
STRAY_SD, STRAY_MM = 4.0, 0.2  # A stray cell is farther from the surface than both limits
BELOW_FLOOR, BELOW_FLOOR_MM = 0.2, 1.0  # A scan is refused if this share of it is this far below the floor of the crack
MAX_LAGS = 8  # Stations farther apart than this share no noise
BESIDE_MM = 12.0  # Sealant counts up to this distance beside the mouth
EDGE, SPILL_EDGE_MM = 0.29, 0.4
"""Standard uncertainty of the share of a cell in the mouth, whose edge crosses it anywhere, and of the edge of a spill,
below which narrow spills are not seen."""
RAISED_SD, RAISED_MM = 3.0, 0.06
"""Sealant on the face is higher than this many standard deviations of the face's height, and this many mm."""
RIM_CELLS = 3.0  # Sealant up to this distance from the mouth touches it, in cells
COARSE_MM, PATCH_MM = 0.4, 4.0  # Cells in which the face beside the mouth is smoothed, and the side of its window
MOSTLY, OFF_POINTS_MM = 0.7, 0.15
"""A scan is doubtful if a smaller share of the face is in one plane, or of the crack has a level, or if this plane is
farther from the named points."""
BESIDE_WALLS, OF_WIDTH_MM, LEAST_BESIDE, FIT_SD_MM = 0.45, 12.0, 0.2, 0.007
"""Standard uncertainty of the part of the level that the fit adds beside the walls, as a share of it in a crack of this
width, smallest share, and standard uncertainty of all fits. A parabola misses at most the share times
(width / 12 mm)**1.65 of a meniscus like cosh(x / c) with c from 1.5 mm."""
COVERAGE = 2.0  # Half-width of a 95 % interval in standard uncertainties
MARGIN = 2.0  # Half the width of the heights along the crack, divided by the crack's mean width


def read_scan(
    path: Path, settings: Readings, outline: Outline, solid: Solid, progress: Progress | None = None
) -> Profile:
    """Return the level of the sealant every millimetre along the crack, as the mean across its surface.

    The plane of the uncracked face is 0. A station of which less than a third is seen has no level. Walls that show
    above the sealant do not count. What makes the level less certain is in ``doubts``.

    Raises SheetFaults if the level is above the face on the whole, unless ``settings.as_written`` confirms its sign.
    Raises InputError if the scan cannot be read, does not fit to the sample, or shows fewer than two stations.
    """
    progress = progress or Progress()
    progress.start("Reading the scan", 3)
    levels_mm, cuts = cuts_of_cavity(solid, CUTS)
    target = Target.of(outline, cuts[-1])
    placement = settings.placement or Placement()
    points_mm = read_points(path, placement)
    progress.advance(1, "placing it on the sample")
    placed = place(points_mm, placement, target, path, settings.limit_mm)
    progress.advance(2, "reading the level")
    surface = _Surface.of(placed, target, cuts, levels_mm, solid.block_mm)
    surface.require_above_floor(path)
    levels = surface.levels(outline.length_mm)
    seen = np.isfinite(levels.level_mm)
    holes = _stretches(levels.s_mm, ~seen)
    if seen.sum() < 2:
        count = counted(int(seen.sum()), "station")
        raise InputError(f"{path}: shows sealant at {count}, but two are needed. Is it the scan of the empty crack?")
    s_mm, level_mm = levels.s_mm[seen], levels.level_mm[seen]
    noise_mm2 = surface.noise_mm2(outline.mean_width_mm)
    covariance = _covariance(placed, outline, s_mm, level_mm, noise_mm2)
    share = max(LEAST_BESIDE, BESIDE_WALLS * (outline.mean_width_mm / OF_WIDTH_MM) ** 1.65)
    covariance += (share * np.mean(levels.clear_mm[seen] - level_mm)) ** 2 + FIT_SD_MM**2
    weights = _weights(s_mm)
    mean_sd_mm = float(np.hypot(np.sqrt(weights @ covariance @ weights), (settings.limit_mm or 0.0) / np.sqrt(3)))
    over, under, is_cut = surface.volumes(levels.surface_mm, mean_sd_mm)
    of_level_mm3 = COVERAGE * mean_sd_mm * outline.mean_width_mm * outline.length_mm
    # Beyond the outer stations, the level is taken as constant.
    below = Profile(s_mm, np.clip(level_mm, -solid.depth_at_mm(s_mm), 0.0))
    below_mm3 = fill_volumes(below, outline, solid, 0.0, outline.length_mm).sealant_mm3
    figures = ScanFigures(
        points=placed.points,
        placed_by=placed.placed_by,
        residual_mm=placed.residual_mm,
        coverage=placed.coverage,
        tilt_deg=placed.tilt_deg,
        edges_agreeing=placed.agreeing,
        points_off_mm=placed.points_off_mm,
        along_sd_mm=placed.along_sd_mm,
        cell_mm=placed.heights.cell_mm,
        holes_mm=holes,
        mean_level_mm=float(weights @ level_mm),
        mean_level_95_mm=COVERAGE * mean_sd_mm,
        over_face_mm3=over[0],
        over_face_95_mm3=over[1],
        under_face_mm3=under[0],
        under_face_95_mm3=under[1],
        sealant_mm3=below_mm3 + over[0],
        sealant_95_mm3=float(np.hypot(of_level_mm3, over[1])),
    )
    scan = Scan(figures, *_along(surface, outline), covariance)
    doubts = (
        *_doubts(placed, is_cut, float(seen.mean()), settings, path),
        *check_scan(s_mm, level_mm, solid.depth_mm, Location(path)),
    )
    questions = tuple(doubt for doubt in doubts if doubt.kind not in (settings.as_written or ()))
    if not all(doubt.is_remark for doubt in questions):
        raise SheetFaults(questions)
    return Profile(
        s_mm,
        level_mm,
        level_mm[:, None],
        settings.data,
        path.name,
        _dialect(figures),
        doubts=tuple(map(str, questions)),
        questions=questions,
        scan=scan,
    )


@dataclass(frozen=True)
class _Levels:
    """Levels at stations along the crack, NaN in a hole, (n,) each, and the sealant's height in the mouth's cells."""

    s_mm: Floats
    level_mm: Floats
    clear_mm: Floats  # Means of the cells clear of the walls, without what the fit adds beside them
    surface_mm: Floats  # Height without strays and holes in each cell of the mouth


@dataclass(frozen=True, eq=False)
class _Surface:
    """Cells of the mouth with their heights, and the wall or floor below each."""

    placed: Placed
    mouth: Booleans  # (rows, columns)
    beside: Booleans  # Cells of the face near the mouth, but not beyond an end at which the crack goes on
    bottom_mm: Floats  # Lowest level at which the cavity is open, (rows, columns). 0 outside the mouth
    s_mm: Floats  # Arc length of each cell of the mouth, in the order of ``mouth``
    from_wall_mm: Floats  # Distance of each cell of the mouth from the walls
    across_mm: Floats  # Distance of each cell of the mouth to the left of the centreline

    @classmethod
    def of(
        cls,
        placed: Placed,
        target: Target,
        cuts: Sequence[Sequence[Floats]],
        levels_mm: Floats,
        block_mm: Sequence[float],
    ) -> "_Surface":
        heights = placed.heights
        mouth = heights.inside(target.rings_mm)
        bottom_mm = np.zeros(mouth.shape)
        for level_mm, rings in zip(levels_mm[::-1], cuts[::-1], strict=True):
            if len(rings):
                bottom_mm[heights.inside([np.asarray(ring) for ring in rings]) & mouth] = level_mm
        patches = heights.patches(mouth, max(PATCH_STEP_MM, heights.cell_mm), PATCH_MM2)
        placed = replace(placed, heights=replace(heights, height_mm=np.where(patches, np.nan, heights.height_mm)))
        x_mm, y_mm = np.meshgrid(*heights.middles_mm)
        cells_mm = np.column_stack([x_mm[mouth], y_mm[mouth]])
        s_mm = arc_length_at(cells_mm, target.centreline_mm)
        ahead = unit(np.gradient(target.centreline_mm, axis=0))
        middle_mm, way = (
            at_arc_length(points, arc_length(target.centreline_mm), s_mm) for points in (target.centreline_mm, ahead)
        )
        across_mm = way[:, 0] * (cells_mm - middle_mm)[:, 1] - way[:, 1] * (cells_mm - middle_mm)[:, 0]
        # The end of an open crack is no wall.
        x_min, y_min, x_max, y_max = block_mm
        beyond = (x_mm < x_min) | (x_mm > x_max) | (y_mm < y_min) | (y_mm > y_max)
        from_wall_mm = heights.away_mm(~(mouth | beyond))
        near = (heights.away_mm(mouth) < BESIDE_MM) & ~mouth & ~beyond
        near[near] = ~target.beyond(np.column_stack([x_mm[near], y_mm[near]]))
        return cls(placed, mouth, near, bottom_mm, s_mm, from_wall_mm[mouth], across_mm)

    def levels(self, length_mm: float) -> "_Levels":
        """Return the mean level across the sealant at stations along the crack."""
        cell_mm = self.placed.heights.cell_mm
        count = max(int(length_mm / max(STATION_MM, 2 * cell_mm)), 2)
        ends_mm = np.linspace(0.0, length_mm, count + 1)
        station = np.clip(np.searchsorted(ends_mm, self.s_mm, side="right") - 1, 0, count - 1)
        middles_mm = (ends_mm[:-1] + ends_mm[1:]) / 2
        level_mm, clear_mm = np.full(count, np.nan), np.full(count, np.nan)
        height_mm, bottom_mm = self.placed.heights.height_mm[self.mouth], self.bottom_mm[self.mouth]
        surface_mm = np.full(len(height_mm), np.nan)
        for number, s_mm in enumerate(middles_mm):
            cells = np.flatnonzero(station == number)
            window = np.flatnonzero(np.abs(self.s_mm - s_mm) <= max(WINDOW_MM, 3 * cell_mm))
            fit = self._fit(window, s_mm)
            if fit is None or not len(cells):
                continue
            terms, limit_mm, least_mm = fit
            fitted_mm = self._terms(cells, s_mm) @ terms
            wet = bottom_mm[cells] < fitted_mm
            clear = wet & (self.from_wall_mm[cells] >= least_mm)
            good = clear & (np.abs(height_mm[cells] - fitted_mm) <= limit_mm)
            # A stray or unseen cell, or one beside a wall, has the height of the fit.
            cells_mm = np.where(good, height_mm[cells], fitted_mm)
            walls_mm = np.where(np.isfinite(height_mm[cells]), height_mm[cells], bottom_mm[cells])
            surface_mm[cells] = np.where(wet, cells_mm, walls_mm)
            if clear.any() and good.sum() >= LEAST_SEEN * clear.sum():
                level_mm[number], clear_mm[number] = cells_mm[wet].mean(), height_mm[cells][good].mean()
        if (seen := np.isfinite(level_mm)).any():
            in_hole_mm = np.maximum(np.interp(self.s_mm, middles_mm[seen], level_mm[seen]), bottom_mm)
            surface_mm = np.where(np.isnan(surface_mm), in_hole_mm, surface_mm)
        return _Levels(middles_mm, level_mm, clear_mm, surface_mm)

    def _terms(self, cells: Integers, s_mm: float) -> Floats:
        """Return a parabola's terms across the crack, and a slope along it, at some cells, (n, 4)."""
        along_mm, across_mm = self.s_mm[cells] - s_mm, self.across_mm[cells]
        return np.column_stack([np.ones(len(cells)), across_mm, across_mm**2, along_mm])

    def _fit(self, window: Integers, s_mm: float) -> tuple[Floats, float, float] | None:
        """Return the sealant's surface in a window along the crack, or None if too little is seen.

        The parts are the weights of ``_terms``, the distance of strays, and the width of the cells beside the walls.
        """
        height_mm = self.placed.heights.height_mm[self.mouth][window]
        from_wall_mm, bottom_mm = self.from_wall_mm[window], self.bottom_mm[self.mouth][window]
        widest_mm = float(from_wall_mm.max(initial=0.0))
        least_mm = max(WALLS_MM, self.placed.heights.cell_mm) + 2 * self.placed.across_sd_mm
        least_mm = min(least_mm, INNER * widest_mm)
        used = np.isfinite(height_mm) & (from_wall_mm >= max(least_mm, (1 - MIDDLE) * widest_mm))
        if used.sum() < FEWEST_CELLS:
            return None
        terms = self._terms(window, s_mm)
        fit, limit_mm = np.array([np.median(height_mm[used]), 0.0, 0.0, 0.0]), np.inf
        seen = np.isfinite(height_mm) & (from_wall_mm >= least_mm)
        for number in range(ROUNDS):
            off_mm = height_mm - terms @ fit
            if number > 0:
                used = seen & (bottom_mm < terms @ fit - OPEN_MM)
            if used.sum() < FEWEST_CELLS:
                return None
            limit_mm = max(STRAY_SD * MAD * float(np.median(np.abs(off_mm[used]))), STRAY_MM)
            kept = used & (np.abs(off_mm) <= limit_mm)
            columns = [0, 3] if number == 0 or np.ptp(self.across_mm[window][kept]) < widest_mm else [0, 1, 2, 3]
            fit = np.zeros(4)
            fit[columns] = np.linalg.lstsq(terms[kept][:, columns], height_mm[kept], rcond=None)[0]
        return fit, limit_mm, least_mm

    def require_above_floor(self, path: Path) -> None:
        """Raise InputError if the scanned surface lies mostly below the floor of the crack."""
        off_mm = (self.placed.heights.height_mm - self.bottom_mm)[self.mouth]
        off_mm = off_mm[np.isfinite(off_mm)]
        if len(off_mm) and np.quantile(off_mm, BELOW_FLOOR) < -BELOW_FLOOR_MM:
            raise InputError(
                f"{path}: {np.mean(off_mm < 0):.0%} of the surface in the crack are below its floor, by "
                f"{-np.median(off_mm[off_mm < 0]):.1f} mm. Correct the crack's depth, or the unit of the heights."
            )

    def noise_mm2(self, width_mm: float) -> Floats:
        """Return the covariance of the levels of stations that are 0, 1, 2, ... stations apart, (lags,).

        It is that of the means of patches of the face as large as a station.
        """
        heights = self.placed.heights
        face = self.placed.face & (np.abs(heights.height_mm) < 4 * self.placed.residual_mm)
        along = max(round(STATION_MM / heights.cell_mm), 1)
        size = max(round(width_mm / heights.cell_mm), 1), along
        # SciPy's types lack one size for each axis.
        share = uniform_filter(face.astype(float), size, mode="constant")  # pyright: ignore[reportArgumentType]
        face_mm = np.where(face, heights.height_mm, 0.0)
        mean_mm = uniform_filter(face_mm, size, mode="constant")  # pyright: ignore[reportArgumentType]
        whole = share > 0.6
        patch_mm = np.where(whole, mean_mm / np.maximum(share, 1e-9), np.nan)
        lags_mm2 = []
        for lag in range(MAX_LAGS):
            shifted = patch_mm[:, lag * along :]
            product = patch_mm[:, : shifted.shape[1]] * shifted
            lags_mm2.append(float(np.nanmean(product)) if np.isfinite(product).any() else 0.0)
        return np.array(lags_mm2) * (1 - np.arange(MAX_LAGS) / MAX_LAGS)

    def volumes(self, surface_mm: Floats, mean_sd_mm: float) -> tuple[tuple[float, float], tuple[float, float], bool]:
        """Return the volumes above and below the face in mm³, each with the half-width of its 95 % interval.

        ``mean_sd_mm`` is the standard uncertainty of the mean level. The last part is True if sealant reaches
        ``BESIDE_MM`` beside the mouth. Beside the mouth, sealant is higher than the face's noise and touches the mouth.
        """
        heights = self.placed.heights
        height_mm = self._beside_mm()
        height_mm[self.mouth] = surface_mm
        spread_mm = MAD * float(np.median(np.abs(height_mm[self.placed.face])))
        raised = self.beside & (height_mm > max(RAISED_SD * spread_mm, RAISED_MM))
        over_mouth = self.mouth & (height_mm > 0)
        at_rim = self.beside & (heights.away_mm(self.mouth) < RIM_CELLS * heights.cell_mm)
        parts = np.asarray(label(over_mouth | raised))
        numbers = np.unique(parts[over_mouth | at_rim])
        over = np.isin(parts, numbers[numbers > 0])
        cell_mm2, volumes = heights.cell_mm**2, list[tuple[float, float]]()
        for cells in (over, self.mouth & (height_mm <= 0)):
            border_mm = height_mm[cells & ~np.asarray(binary_erosion(cells), dtype=bool)]
            if cells is over:
                edge_mm3 = SPILL_EDGE_MM * heights.cell_mm * float(np.abs(border_mm).sum())
            else:  # The cells' errors are independent.
                edge_mm3 = EDGE * cell_mm2 * float(np.sqrt((border_mm**2).sum()))
            half_mm3 = COVERAGE * float(np.hypot(cell_mm2 * cells.sum() * mean_sd_mm, edge_mm3))
            volumes.append((cell_mm2 * abs(float(height_mm[cells].sum())), half_mm3))
        return volumes[0], volumes[1], bool((over & (heights.away_mm(self.mouth) > BESIDE_MM - 1)).any())

    def _beside_mm(self) -> Floats:
        """Return the heights of the face without the mouth, (rows, columns): medians of windows of ``PATCH_MM``."""
        heights = self.placed.heights
        face = replace(heights, height_mm=np.where(self.mouth, np.nan, heights.height_mm)).filled()
        step = max(round(COARSE_MM / heights.cell_mm), 1)
        window = max(round(PATCH_MM / step / heights.cell_mm), 1)
        coarse_mm = median_filter(face[step // 2 :: step, step // 2 :: step], window)
        row, column = (np.minimum(np.arange(face.shape[k]) // step, coarse_mm.shape[k] - 1) for k in (0, 1))
        return coarse_mm[np.ix_(row, column)]


def _covariance(placed: Placed, outline: Outline, s_mm: Floats, level_mm: Floats, noise_mm2: Floats) -> Floats:
    """Return the covariance of the levels' errors, (n, n): of the face's plane, the position, and shared noise."""
    places_mm = at_arc_length(outline.centreline_mm, outline.s_mm, s_mm)
    design = np.column_stack([np.ones(len(s_mm)), places_mm - placed.centre_mm])
    slope = np.gradient(level_mm, s_mm)
    apart = np.abs(s_mm[:, None] - s_mm) / STATION_MM
    noise = np.interp(apart, np.arange(len(noise_mm2)), noise_mm2, right=0.0)
    values, vectors = np.linalg.eigh(noise)
    noise = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return design @ placed.plane_covariance @ design.T + np.outer(slope, slope) * placed.along_sd_mm**2 + noise


def _doubts(placed: Placed, is_cut: bool, seen: float, settings: Readings, path: Path) -> list[Doubt]:
    """Return the warnings about the face, the sealant and the position of a scan."""
    off_mm, least_mm = placed.off_points_mm or 0.0, max(OFF_POINTS_MM, settings.limit_mm or 0.0)
    look = "Look at the scanned heights on the report's first page."
    bare = "Remove tape and loose material, and scan or name points on the bare face."
    findings = (
        (
            placed.in_plane < MOSTLY,
            "face",
            f"only {placed.in_plane:.0%} of the face beside the crack are in one plane, from which levels are "
            "measured: it may be stepped, or covered by sealant or tape.",
            bare,
        ),
        (
            abs(off_mm) > max(least_mm, 3 * (placed.points_off_mm or 0.0)),
            "face",
            f"the face beside the crack is {abs(off_mm):.2f} mm {'above' if off_mm > 0 else 'below'} the named points: "
            "it may be covered by sealant or tape, or curved.",
            bare,
        ),
        (
            placed.agreeing is None,
            "position",
            "no crack is recognised at the named points: the sealant is level with the face or covers the edges, or "
            "the points are wrong.",
            look,
        ),
        (
            0 < (placed.agreeing or 0) < SURE_AGREEING,
            "position",
            f"the edges agree with the mouth's along {placed.agreeing or 0:.0%} of the crack: is it this sample?",
            look,
        ),
        (
            is_cut,
            "spill",
            f"sealant, or dirt that touches it, reaches {BESIDE_MM:g} mm beside the crack; volumes end there.",
            "Crop other things from the scan.",
        ),
        (
            seen < MOSTLY,
            "holes",
            f"only {seen:.0%} of the crack have a level: others are not seen, or have small patches that step away.",
            look,
        ),
    )
    return [
        Doubt(kind, Location(path), finding, remedy, {CONFIRMS: [kind]}, is_remark=True)
        for applies, kind, finding, remedy in findings
        if applies
    ]


def _weights(s_mm: Floats) -> Floats:
    """Return each station's weight in the mean along the crack."""
    gap_mm = np.diff(s_mm, prepend=s_mm[0], append=s_mm[-1])
    weight = gap_mm[1:] + gap_mm[:-1]
    return weight / weight.sum()


def _stretches(s_mm: Floats, which: Booleans) -> tuple[Span, ...]:
    """Return the first and last position of each run of stations."""
    half_mm = (s_mm[1] - s_mm[0]) / 2
    return tuple((float(s_mm[first] - half_mm), float(s_mm[last - 1] + half_mm)) for first, last in runs(which))


def _along(surface: _Surface, outline: Outline) -> tuple[Floats, Floats, Floats, Floats]:
    """Return positions along and to the left of the centreline, and heights of scan and model there, (m, k) each."""
    heights = surface.placed.heights
    half_mm = MARGIN * outline.mean_width_mm
    s_mm, across_mm, x_mm, y_mm = grid_along(outline.centreline_mm, half_mm, heights.cell_mm)
    bottom = replace(heights, height_mm=surface.bottom_mm)
    seen = replace(heights, height_mm=heights.filled(2.0))  # Without speckles
    return s_mm, across_mm, seen.at_mm(x_mm, y_mm), np.nan_to_num(bottom.at_mm(x_mm, y_mm))


def _dialect(figures: ScanFigures) -> str:
    """Return a sentence that states how the scan was interpreted."""
    placed = "by named points" if figures.placed_by == "points" else "by the crack's mouth"
    if figures.edges_agreeing is None:
        placed += ", where no crack is recognised"
    else:
        placed += f" (edges agree along {figures.edges_agreeing:.0%} of the crack)"
    holes = ", ".join(f"{low:.0f} to {high:.0f}" for low, high in figures.holes_mm)
    parts = (
        f"scan of {figures.points:,} points in cells of {figures.cell_mm:.2f} mm",
        f"placed {placed}",
        f"sealant {abs(figures.mean_level_mm):.2f} mm {'above' if figures.mean_level_mm > 0 else 'below'} the face",
        f"face within {figures.residual_mm:.3f} mm (RMS) of its plane, {figures.coverage:.0%} of it seen",
        *([f"holes from {holes} mm"] if holes else []),
    )
    return "; ".join(parts)
