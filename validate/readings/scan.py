"""Read the level along the crack from a scan of the sealed face."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, uniform_filter
from skimage.measure import label

from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.arrays import unit
from sealtwin.core.errors import InputError
from sealtwin.core.records import Booleans, Floats, Outline, Profile, Solid
from sealtwin.core.scan_figures import Scan, ScanFigures
from sealtwin.core.solid_figures import Span
from sealtwin.scan.height_map import HeightMap
from sealtwin.scan.points_file import read_points
from sealtwin.scan.registration import Placed, Target, place
from sealtwin.scan.settings import Placement
from validate.metrics.volumes import cuts_of_cavity
from validate.settings import Readings
from validate.units import counted

STATION_MM = 1.0  # Distance between stations along the crack
CUTS = 33  # Number of cuts of the cavity, whose edges show where a wall rises above the sealant
OPEN_MM = 0.3  # A cell has sealant if the wall in it is this far below the level
WALLS_MM = 0.25  # Smallest distance from the walls at which a cell has no part of them
LEAST_SEEN = 0.5  # Smallest share of a station's cells that must be seen for a level
FEWEST_STATIONS = 2
BELOW_FLOOR, BELOW_FLOOR_MM = 0.2, 1.0  # A scan is refused if this share of it is this far below the floor of the crack
MAX_LAGS = 8  # Stations farther apart than this share no noise
BESIDE_MM = 12.0  # Sealant counts up to this distance beside the mouth
SMOOTH_MM, RAISED_SD, RAISED_MM = 0.5, 4.0, 0.1
"""Sealant on the face: smoothed heights above this many standard deviations of the face's, and this many mm."""
TIP_MM = 2.0  # Width of a usual caliper's tip
COVERAGE = 2.0  # Half-width of a 95 % interval in standard uncertainties
MARGIN = 2.0  # Half the width of the heights along the crack, divided by the crack's mean width


def read_scan(path: Path, settings: Readings, outline: Outline, solid: Solid) -> Profile:
    """Return the level of the sealant every millimetre along the crack, as the mean across its surface.

    The plane of the uncracked face is 0. A station of which less than half is seen has no level. Walls that show above
    the sealant do not count.

    Raises InputError if the scan cannot be read, does not fit to the sample, or shows fewer than two stations.
    """
    levels_mm, cuts = cuts_of_cavity(solid, CUTS)
    face_mm = outline.face_mm
    target = Target(tuple(map(np.asarray, cuts[-1])), outline.centreline_mm, outline.mean_width_mm, face_mm)
    placement = settings.placement or Placement()
    placed = place(read_points(path, placement), placement, target, path)
    surface = _Surface.of(placed, target, cuts, levels_mm)
    surface.require_above_floor(path)
    stations = surface.stations(outline.length_mm, outline.mean_width_mm)
    s_mm, level_mm = stations
    seen = np.isfinite(level_mm)
    holes = _stretches(s_mm, ~seen)
    if seen.sum() < FEWEST_STATIONS:
        raise InputError(
            f"{path}: shows the sealant at {counted(int(seen.sum()), 'station')}; at least two are needed."
        )
    s_mm, level_mm = s_mm[seen], level_mm[seen]
    noise_mm2 = surface.noise_mm2(outline.mean_width_mm)
    covariance = _covariance(placed, outline, s_mm, level_mm, noise_mm2)
    weights = _weights(s_mm)
    tip_mm = settings.probe_mm or TIP_MM
    tip_level_mm = surface.tip_levels_mm(outline, s_mm, level_mm, tip_mm)
    over, under = surface.volumes(noise_mm2)
    figures = ScanFigures(
        points=placed.points,
        placed_by=placed.placed_by,
        residual_mm=placed.residual_mm,
        coverage=placed.coverage,
        tilt_deg=placed.tilt_deg,
        agreement=placed.agreement,
        points_off_mm=placed.points_off_mm,
        along_sd_mm=placed.along_sd_mm,
        cell_mm=placed.heights.cell_mm,
        holes_mm=holes,
        mean_level_mm=float(weights @ level_mm),
        mean_level_95_mm=COVERAGE * float(np.sqrt(weights @ covariance @ weights)),
        tip_mm=tip_mm,
        tip_higher_mm=float(weights @ (tip_level_mm - level_mm)),
        over_face_mm3=over[0],
        over_face_95_mm3=over[1],
        under_face_mm3=under[0],
        under_face_95_mm3=under[1],
    )
    scan = Scan(figures, *_along(placed.heights, outline), covariance, tip_level_mm)
    data, dialect = settings.data, _dialect(figures, path)
    return Profile(s_mm, level_mm, level_mm[:, None], data, path.name, dialect, scan=scan)


@dataclass(frozen=True, eq=False)
class _Surface:
    """Cells of the mouth with their heights, and the wall or floor below each."""

    placed: Placed
    mouth: Booleans  # (rows, columns)
    bottom_mm: Floats  # Lowest level at which the cavity is open, (rows, columns). 0 outside the mouth
    s_mm: Floats  # Arc length of each cell of the mouth, in the order of ``mouth``

    @classmethod
    def of(cls, placed: Placed, target: Target, cuts: Sequence[Sequence[Floats]], levels_mm: Floats) -> "_Surface":
        heights = placed.heights
        mouth = heights.inside(target.rings_mm)
        bottom_mm = np.zeros(mouth.shape)
        for level_mm, rings in zip(levels_mm[::-1], cuts[::-1], strict=True):
            if len(rings):
                bottom_mm[heights.inside([np.asarray(ring) for ring in rings]) & mouth] = level_mm
        x_mm, y_mm = np.meshgrid(*heights.middles_mm)
        s_mm = arc_length_at(np.column_stack([x_mm[mouth], y_mm[mouth]]), target.centreline_mm)
        return cls(placed, mouth, bottom_mm, s_mm)

    def stations(self, length_mm: float, width_mm: float) -> tuple[Floats, Floats]:
        """Return the stations and the mean level across the sealant at each, NaN in a hole, (n,) each."""
        heights, cell_mm = self.placed.heights, self.placed.heights.cell_mm
        count = max(int(length_mm / max(STATION_MM, 2 * cell_mm)), 2)
        ends_mm = np.linspace(0.0, length_mm, count + 1)
        station = np.searchsorted(ends_mm, self.s_mm, side="right") - 1
        from_wall_mm = cell_mm * np.asarray(distance_transform_edt(self.mouth), dtype=float)[self.mouth]
        height_mm, bottom_mm = heights.height_mm[self.mouth], self.bottom_mm[self.mouth]
        # Below the floor, a scan shows what is beside the sample, such as a table.
        height_mm = np.where(height_mm < bottom_mm - BELOW_FLOOR_MM, np.nan, height_mm)
        level_mm = np.full(count, np.nan)
        inner_mm = min(max(WALLS_MM, cell_mm) + 2 * self.placed.along_sd_mm, width_mm / 4)
        clear = np.zeros(len(height_mm), dtype=bool)
        wet = np.zeros(len(height_mm), dtype=bool)
        for number in range(count):
            cells = np.flatnonzero(station == number)
            if not len(cells):
                continue
            middle = cells[from_wall_mm[cells] >= np.median(from_wall_mm[cells])]
            seen = height_mm[middle][np.isfinite(height_mm[middle])]
            if not len(seen):
                continue
            first_mm = float(np.median(seen))
            wet[cells] = bottom_mm[cells] < first_mm
            clear[cells] = (bottom_mm[cells] < first_mm - OPEN_MM) & (from_wall_mm[cells] >= inner_mm)
            known = clear[cells] & np.isfinite(height_mm[cells])
            if clear[cells].any() and known.sum() >= LEAST_SEEN * clear[cells].sum():
                level_mm[number] = first_mm
        # Cells beside the walls get the height of the nearest cell that is clear of them.
        used = np.full(self.mouth.shape, np.nan)
        used[self.mouth] = np.where(clear, height_mm, np.nan)
        if np.isfinite(used).any():
            filled_mm = HeightMap(heights.corner_mm, cell_mm, used).filled()[self.mouth]
            for number in np.flatnonzero(np.isfinite(level_mm)):
                level_mm[number] = filled_mm[(station == number) & wet].mean()
        return (ends_mm[:-1] + ends_mm[1:]) / 2, level_mm

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
        heights, face = self.placed.heights, self.placed.face & self.placed.heights.known
        limit_mm = 4 * self.placed.residual_mm
        face = face & (np.abs(np.nan_to_num(heights.height_mm, nan=np.inf)) < limit_mm)
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

    def volumes(self, noise_mm2: Floats) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the volumes above and below the face in mm³, each with the half-width of its 95 % interval."""
        heights, cell_mm = self.placed.heights, self.placed.heights.cell_mm
        filled_mm = heights.filled()
        smooth_mm = gaussian_filter(filled_mm, SMOOTH_MM / cell_mm)
        face = self.placed.face & heights.known
        spread_mm = float(np.sqrt(np.median(smooth_mm[face] ** 2)) * 1.4826)
        beside = (smooth_mm > max(RAISED_SD * spread_mm, RAISED_MM)) & (heights.away_mm(self.mouth) < BESIDE_MM)
        over_mouth = self.mouth & (smooth_mm > 0)
        parts = np.asarray(label(over_mouth | (beside & ~self.mouth)))
        touching = np.unique(parts[over_mouth])
        over = np.isin(parts, touching[touching > 0])
        under = self.mouth & (smooth_mm <= 0)
        return self._volume(filled_mm, over, noise_mm2), self._volume(-filled_mm, under, noise_mm2)

    def _volume(self, height_mm: Floats, cells: Booleans, noise_mm2: Floats) -> tuple[float, float]:
        if not cells.any():
            return 0.0, 0.0
        heights, cell_mm2 = self.placed.heights, self.placed.heights.cell_mm**2
        x_mm, y_mm = (grid[cells] for grid in np.meshgrid(*heights.middles_mm))
        centre = self.placed.centre_mm
        lever = cell_mm2 * np.array([len(x_mm), (x_mm - centre[0]).sum(), (y_mm - centre[1]).sum()])
        of_plane = float(lever @ self.placed.plane_covariance @ lever)
        area_mm2 = cell_mm2 * len(x_mm)
        patch_mm2 = STATION_MM * max(float(self.mouth.sum()) * cell_mm2 / max(np.ptp(self.s_mm), STATION_MM), 1.0)
        of_noise = area_mm2 * patch_mm2 * max(float(noise_mm2[0] + 2 * noise_mm2[1:].sum()), 0.0)
        return float(cell_mm2 * height_mm[cells].sum()), COVERAGE * float(np.sqrt(of_plane + of_noise))

    def tip_levels_mm(self, outline: Outline, s_mm: Floats, level_mm: Floats, tip_mm: float) -> Floats:
        """Return the highest point below a flat tip in the middle of the crack at each station, (n,)."""
        heights = self.placed.heights
        places_mm = np.column_stack([np.interp(s_mm, outline.s_mm, column) for column in outline.centreline_mm.T])
        reach = np.arange(-tip_mm / 2, tip_mm / 2 + 1e-9, heights.cell_mm)
        offsets = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
        offsets = offsets[np.hypot(*offsets.T) <= tip_mm / 2]
        smooth = HeightMap(heights.corner_mm, heights.cell_mm, uniform_filter(heights.filled(), 3))
        below = places_mm[:, None] + offsets
        return np.maximum(smooth.at_mm(below[..., 0], below[..., 1]).max(axis=1), level_mm)


def _covariance(placed: Placed, outline: Outline, s_mm: Floats, level_mm: Floats, noise_mm2: Floats) -> Floats:
    """Return the covariance of the levels' errors, (n, n): of the face's plane, the position, and shared noise."""
    places_mm = np.column_stack([np.interp(s_mm, outline.s_mm, column) for column in outline.centreline_mm.T])
    design = np.column_stack([np.ones(len(s_mm)), places_mm - placed.centre_mm])
    slope = np.gradient(level_mm, s_mm)
    apart = np.abs(s_mm[:, None] - s_mm) / STATION_MM
    noise = np.interp(apart, np.arange(len(noise_mm2)), noise_mm2, right=0.0)
    values, vectors = np.linalg.eigh(noise)
    noise = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return design @ placed.plane_covariance @ design.T + np.outer(slope, slope) * placed.along_sd_mm**2 + noise


def _weights(s_mm: Floats) -> Floats:
    """Return each station's weight in the mean along the crack."""
    gap_mm = np.diff(s_mm)
    weight = (np.append(gap_mm, 0.0) + np.append(0.0, gap_mm)) / 2
    return weight / weight.sum()


def _stretches(s_mm: Floats, which: Booleans) -> tuple[Span, ...]:
    """Return the first and last position of each run of stations."""
    half_mm = (s_mm[1] - s_mm[0]) / 2
    edges = np.flatnonzero(np.diff(np.concatenate([[False], which, [False]]).astype(int)))
    return tuple(
        (float(s_mm[first] - half_mm), float(s_mm[last - 1] + half_mm))
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    )


def _along(heights: HeightMap, outline: Outline) -> tuple[Floats, Floats, Floats]:
    """Return positions along and to the left of the centreline, and the heights there, (m, k)."""
    s_mm = np.arange(0.0, outline.length_mm, max(heights.cell_mm, outline.length_mm / 1500))
    half_mm = MARGIN * outline.mean_width_mm
    across_mm = np.linspace(-half_mm, half_mm, max(int(2 * half_mm / heights.cell_mm), 8))
    ahead = unit(np.gradient(outline.centreline_mm, axis=0))
    place, way = (
        np.column_stack([np.interp(s_mm, outline.s_mm, column) for column in points.T])
        for points in (outline.centreline_mm, ahead)
    )
    x_mm = place[:, 0] - across_mm[:, None] * way[:, 1]
    y_mm = place[:, 1] + across_mm[:, None] * way[:, 0]
    return s_mm, across_mm, heights.at_mm(x_mm, y_mm)


def _dialect(figures: ScanFigures, path: Path) -> str:
    """Return a sentence that states how the scan was interpreted."""
    placed = "by named points" if figures.placed_by == "points" else "by the crack's mouth"
    if figures.points_off_mm is not None:
        placed += f" (off by {figures.points_off_mm:.2f} mm RMS)"
    if figures.agreement is not None:
        placed += f" (agreement {figures.agreement:.2f} of 1)"
    holes = ", ".join(f"{low:.0f} to {high:.0f}" for low, high in figures.holes_mm)
    parts = (
        f"scan of {figures.points:,} points in cells of {figures.cell_mm:.2f} mm",
        f"placed {placed}",
        f"sealant {abs(figures.mean_level_mm):.2f} mm {'above' if figures.mean_level_mm > 0 else 'below'} the face",
        f"face within {figures.residual_mm:.3f} mm (RMS) of its plane, {figures.coverage:.0%} of it seen",
        *([f"holes from {holes} mm"] if holes else []),
    )
    return "; ".join(parts)
