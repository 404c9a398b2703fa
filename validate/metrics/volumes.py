"""Volumes below and above a level along the crack, the mass balance of a run, and the flat level of a volume.

The cavity is cut from the mesh at many levels. The horizontal areas of the cuts are divided into bins along the crack.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import cv2
import numpy as np
from manifold3d import CrossSection, Manifold, Mesh64
from scipy.ndimage import uniform_filter1d
from skimage.segmentation import watershed

from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.arrays import counted_up, midpoints
from sealtwin.core.records import FaceLabel, Floats, Integers, Outline, Profile, Run, Solid
from validate.comparison import FilledVolumes, MassBalance
from validate.settings import Readings

CELL_MM = 0.2  # Width in mm of raster cells for sealant on the face: half the paper's particle size


def mass_balance(run: Run, solid: Solid, volume_ratio: float, readings_mm3: float, settings: Readings) -> MassBalance:
    """Return the volume balance of a run, with the measured volume over the covered length.

    ``volume_ratio`` is the volume of the settled particles divided by the dispensed volume.
    """
    dispensed_mm3 = run.dispensed_volume_mm3
    spilled_mm3 = run.spilled_particles * run.particle_volume_mm3
    settled_mm3 = volume_ratio * dispensed_mm3
    below = run.share_below_face
    return MassBalance(
        dispensed_mm3=dispensed_mm3,
        in_crack_mm3=below * settled_mm3,
        above_mm3=(1 - below) * settled_mm3,
        spilled_mm3=spilled_mm3,
        lost_mm3=dispensed_mm3 - settled_mm3 - spilled_mm3,
        footprint_mm2=_footprint_mm2(run, solid),
        readings_mm3=readings_mm3,
        readings_state=settings.state,
        shrinkage_percent=settings.shrinkage_percent,
        readings_when_dispensed_mm3=readings_mm3 / (1 - (settings.shrinkage_percent or 0.0) / 100),
    )


def _footprint_mm2(run: Run, solid: Solid) -> float:
    """Return the area of the face in mm2 under the discs of the particles that rest on it."""
    x_min, y_min, x_max, y_max = solid.block_mm
    corner_mm = np.array([x_min, y_min])
    # Cells of the block's upper side outside the mouth. Rows are along y.
    on_face = np.zeros([int((y_max - y_min) / CELL_MM) + 1, int((x_max - x_min) / CELL_MM) + 1], np.uint8)
    triangles_mm = solid.vertices_mm[solid.faces[solid.face_label == FaceLabel.TOP]][:, :, :2]
    for triangle in np.rint((triangles_mm - corner_mm) / CELL_MM).astype(np.int32):
        cv2.fillConvexPoly(on_face, triangle, 1)
    above = run.position_mm[~run.spilled & (run.position_mm[:, 2] > 0), :2]
    covered = np.zeros_like(on_face)
    rows, columns = on_face.shape
    for column, row in np.rint((above - corner_mm) / CELL_MM).astype(int):
        # Sealant over the mouth is a heap, even if its disc reaches over the edge of the mouth.
        if 0 <= row < rows and 0 <= column < columns and on_face[row, column]:
            cv2.circle(covered, (int(column), int(row)), max(1, round(run.radius_mm / CELL_MM)), 1, thickness=-1)
    return float((covered & on_face).sum()) * CELL_MM**2


def gained_level_mm(run: Run, profile: Profile, outline: Outline, solid: Solid, volume_ratio: float) -> float:
    """Return the change of level due to volume that the numerics gained. It is negative if they lost volume.

    The change is this volume divided by the area of the fluid's surface, which has two parts: the area of the crack at
    the level, and the area of the face that sealant covers outside the mouth.
    """
    spilled_mm3 = run.spilled_particles * run.particle_volume_mm3
    if not run.has_particles:
        return 0.0
    gained_mm3 = (volume_ratio - 1) * run.dispensed_volume_mm3 + spilled_mm3
    cavity = cavity_by_level(outline, solid)
    level_mm = profile.level_at_mm(cavity.middle_mm)
    wetted_mm2 = float(cavity.area_at_mm2(level_mm)[level_mm > cavity.floor_mm].sum())
    return gained_mm3 / (wetted_mm2 + _footprint_mm2(run, solid))


def fill_volumes(profile: Profile, outline: Outline, solid: Solid, from_mm: float, to_mm: float) -> FilledVolumes:
    """Return the volumes below and above a level over a stretch of the crack.

    The cavity is taken from the mesh. Each part of it is filled to the level at the nearest position on the main crack.
    Above the face, the cavity continues straight up. Profiles do not include sealant on the face outside the mouth.
    """
    cavity = cavity_by_level(outline, solid)
    share, s_mm = cavity.between(from_mm, to_mm)
    level_mm = profile.level_at_mm(s_mm)
    face_mm = np.zeros_like(level_mm)
    room_mm3 = float(share @ cavity.below_mm3(face_mm))
    sealant_mm3 = float(share @ cavity.below_mm3(level_mm))
    heap_mm3 = float(share @ (cavity.area_at_mm2(face_mm) * np.maximum(level_mm, 0.0)))
    return FilledVolumes(
        underfill_mm3=room_mm3 - sealant_mm3,
        overfill_mm3=heap_mm3,
        sealant_mm3=sealant_mm3 + heap_mm3,
        fill_ratio=sealant_mm3 / room_mm3,
    )


def balance_profile(volume_mm3: float, outline: Outline, solid: Solid) -> Profile:
    """Return the flat level of a volume in the whole crack, like water between dams at both ends.

    The level depends only on the volume and the crack. A simulation also models the flow, so its error should be
    smaller.
    """
    from scipy.optimize import root_scalar

    floor_mm, first_mm, last_mm = -solid.depth_at_mm(outline.s_mm), outline.s_mm[0], outline.s_mm[-1]

    def held(level_mm: float) -> FilledVolumes:
        flat = Profile(outline.s_mm, np.maximum(floor_mm, level_mm))
        return fill_volumes(flat, outline, solid, first_mm, last_mm)

    # Above the face each millimetre adds the same volume, so the level with all of the volume there is an upper bound.
    highest_mm = 1.0 + volume_mm3 / held(1.0).overfill_mm3
    level_mm = root_scalar(
        lambda level_mm: held(level_mm).sealant_mm3 - volume_mm3, bracket=(-solid.depth_mm, highest_mm)
    ).root
    return Profile(outline.s_mm, np.maximum(floor_mm, level_mm), source="volume balance")


CELLS_ACROSS, LARGEST_MM = 8, 0.125  # Number of cells across the crack's mean width, and their largest size
MAX_IN_MOUTH, MAX_CELLS = 40_000, 1_000_000  # Largest numbers of cells between the walls, and in total
MIN_SHARE = 1e-9  # Fraction of a cell below which an area is a rounding error
LEVELS = 49  # Number of levels from the deepest floor to the face, 1/3 mm apart if it is 16 mm deep
BESIDE_MM = 1e-3  # Distance of a cut from the face and from horizontal facets, at which the area jumps
LOWEST_LEVELS = np.array([1 / 16, 1 / 8, 1 / 4, 1 / 2])  # More levels in the lowest layer, for uneven floors
LEVEL_MM, MIN_OF_MOUTH, MAX_FLATS = 0.02, 1 / 200, 12
"""Three limits for horizontal facets: largest height in mm of a facet that counts as horizontal, smallest area at one
height that gets its own levels (as a fraction of the mouth's area), and largest number of such heights. Floors, shelves
and roofs are horizontal. Without their own levels, the area would slope where it should jump."""
NOISE, MAX_NOISE = 2.5, 1 / 8
"""Depth of the hollows in a scanned face, in standard deviations of its vertices' heights, and largest depth as a
fraction of the cavity's depth. Only 0.6 % of the vertices are deeper, too few to form connected hollows."""
NORMAL_MEDIAN = 0.6745  # Median distance from the mean of a normal distribution, in standard deviations
SMOOTHED_MM = 5.0  # Length along the crack over which the walls' slope under the face is averaged


@dataclass(frozen=True)
class CavityByLevel:
    """Horizontal areas of the cavity by level, in bins along the crack. Between two levels, an area changes linearly.

    Each point of the cavity belongs to the bin of the main crack that is nearest to it through the cavity. A side crack
    belongs to the bin of its root, and the space beyond an end of the main crack to the bin at this end. The bins
    therefore add up to the cavity without its stones.
    """

    ends_mm: Floats  # (k + 1,): arc length at the ends of the bins
    levels_mm: Floats  # (n,), increasing, from the deepest floor to the face
    area_mm2: Floats  # (k, n)
    floor_mm: Floats  # (k,): level of the floor

    @property
    def middle_mm(self) -> Floats:
        return midpoints(self.ends_mm)

    def between(self, from_mm: float, to_mm: float) -> tuple[Floats, Floats]:
        """Return the fraction of each bin between two arc lengths, and the middle of the included part, (k,) each."""
        inside_mm = np.clip(self.ends_mm, from_mm, to_mm)
        return np.diff(inside_mm) / np.diff(self.ends_mm), midpoints(inside_mm)

    def area_at_mm2(self, level_mm: Floats) -> Floats:
        """Return the area of each bin at its level, (k,). Above the face it is the area of the mouth."""
        before, share = self._places(level_mm)
        lower_mm2, upper_mm2 = self._beside(self.area_mm2, before)
        return lower_mm2 + share * (upper_mm2 - lower_mm2)

    def below_mm3(self, level_mm: Floats) -> Floats:
        """Return the volume of each bin from its floor up to its level or the face, whichever is lower, (k,).

        The area jumps from zero at a bin's floor. In the layer that contains the floor, the volume therefore grows
        linearly from the floor, not from the bottom of the layer. Otherwise a level at the floor would have a volume
        above zero.
        """
        before, share = self._places(level_mm)
        step_mm = np.diff(self.levels_mm)
        lower_mm2, upper_mm2 = self._beside(self.area_mm2, before)
        reached_mm3, layer_top_mm3 = self._beside(self._sums_mm3, before)
        volume_mm3 = reached_mm3 + share * step_mm[before] * (lower_mm2 + share * (upper_mm2 - lower_mm2) / 2)
        above_floor_mm = np.maximum(self.levels_mm[before + 1] - self.floor_mm, BESIDE_MM**2)
        risen = np.clip((level_mm - self.floor_mm) / above_floor_mm, 0.0, 1.0)
        with_floor = (self.floor_mm > self.levels_mm[before]) & (share < 1)
        return np.where(with_floor, risen * layer_top_mm3, volume_mm3)

    @cached_property
    def _sums_mm3(self) -> Floats:
        """Volume of each bin below each level, (k, n)."""
        layers_mm3 = np.diff(self.levels_mm) * (self.area_mm2[:, 1:] + self.area_mm2[:, :-1]) / 2
        return np.cumulative_sum(layers_mm3, axis=1, include_initial=True)

    def _places(self, level_mm: Floats) -> tuple[Integers, Floats]:
        """Return the next lower level's index, and the fraction of the layer below ``level_mm``, (k,) each, by bin."""
        before = np.searchsorted(self.levels_mm, level_mm, side="right") - 1
        before = np.clip(before, 0, len(self.levels_mm) - 2)
        step_mm = np.diff(self.levels_mm)[before]
        return before, np.clip((level_mm - self.levels_mm[before]) / step_mm, 0.0, 1.0)

    @staticmethod
    def _beside(values: Floats, before: Integers) -> tuple[Floats, Floats]:
        rows = np.arange(len(values))
        return values[rows, before], values[rows, before + 1]


_BY_SOLID: WeakKeyDictionary[Solid, tuple[Outline, CavityByLevel]] = WeakKeyDictionary()


def cavity_by_level(outline: Outline, solid: Solid) -> CavityByLevel:
    """Return the horizontal areas of the solid's cavity along its crack. The result for the last outline is cached."""
    columns = _BY_SOLID.get(solid)
    if columns is None or columns[0] is not outline:
        columns = outline, _cut(outline, solid)
        _BY_SOLID[solid] = columns
    return columns[1]


@dataclass(frozen=True)
class _Raster:
    origin_mm: Floats
    cell_mm: float
    shape: tuple[int, int]  # rows, columns

    def areas(self, rings: Iterable[Floats]) -> Floats:
        """Return the area of a region in each cell, row by row, as fractions of a cell, (cells,)."""
        return cell_areas(((np.asarray(ring) - self.origin_mm) / self.cell_mm for ring in rings), self.shape).ravel()

    def middles_mm(self, cells: Integers) -> Floats:
        row, column = np.divmod(cells, self.shape[1])
        return self.origin_mm + self.cell_mm * (np.column_stack([column, row]) + 0.5)


def _cut(outline: Outline, solid: Solid) -> CavityByLevel:
    noise_mm = _noise_mm(solid)
    levels_mm = _levels_mm(outline, solid, noise_mm)
    cuts = _cuts(solid, levels_mm, noise_mm)
    raster = _raster(outline, cuts)
    cells, shares = [], []
    for cut in cuts:
        covered = raster.areas(cut.to_polygons())
        cells.append(np.flatnonzero(covered > MIN_SHARE))
        shares.append(covered[cells[-1]])
    inside = np.zeros(raster.shape, bool)
    inside.ravel()[np.concatenate(cells)] = True
    s_mm = _arc_lengths_mm(outline, raster, inside)
    count = max(int(np.ceil(outline.length_mm / raster.cell_mm)), 2)
    ends_mm = np.linspace(0.0, outline.length_mm, count + 1)
    # A cell is as long as a bin and is divided between the two bins that it overlaps; bin ``count`` is for no crack.
    bin_position = s_mm / ends_mm[1] - 0.5
    first = np.floor(bin_position)
    later = bin_position - first
    lower, upper = (np.where(s_mm < 0, count, bins.clip(0, count - 1)).astype(np.int32) for bins in (first, first + 1))
    area_mm2 = np.empty((count, len(cuts)))
    for level, (cell, share) in enumerate(zip(cells, shares, strict=True)):
        to_upper = share * later[cell]
        sums = np.bincount(lower[cell], share - to_upper, count + 1) + np.bincount(upper[cell], to_upper, count + 1)
        area_mm2[:, level] = sums[:count] * raster.cell_mm**2
    area_mm2 = _up_to_the_ends(levels_mm, area_mm2, noise_mm, ends_mm[1])
    return CavityByLevel(ends_mm, levels_mm, area_mm2, -solid.depth_at_mm(midpoints(ends_mm)))


def _raster(outline: Outline, cuts: list[CrossSection]) -> _Raster:
    """Return a raster that covers the cuts and the walls."""
    walls_mm = np.vstack([outline.left_wall_mm, outline.right_wall_mm])
    corners_mm = np.vstack([walls_mm, *(np.reshape(cut.bounds(), (2, 2)) for cut in cuts if not cut.is_empty())])
    low_mm, high_mm = corners_mm.min(axis=0), corners_mm.max(axis=0)
    cell_mm = min(outline.mean_width_mm / CELLS_ACROSS, LARGEST_MM)
    mouth_mm2 = outline.mean_width_mm * outline.length_mm
    cell_mm = max(cell_mm, float(np.sqrt(max(np.prod(high_mm - low_mm) / MAX_CELLS, mouth_mm2 / MAX_IN_MOUTH))))
    columns, rows = (np.ceil((high_mm - low_mm) / cell_mm).astype(int) + 3).tolist()
    return _Raster(low_mm - cell_mm, cell_mm, (rows, columns))


def _arc_lengths_mm(outline: Outline, raster: _Raster, inside: np.ndarray) -> Floats:
    """Return for each cell the arc length of the nearest point on the main crack, or -1 outside the crack, (cells,).

    A cell that is partly between the walls counts as main crack, because a gap next to a stone may contain no whole
    cell.
    """
    walls_mm = np.vstack([outline.left_wall_mm, outline.right_wall_mm[::-1]])
    main = np.flatnonzero((np.abs(raster.areas([walls_mm])) > MIN_SHARE) & inside.ravel())
    main_mm = arc_length_at(raster.middles_mm(main), outline.centreline_mm).clip(0.0, outline.length_mm)
    nearest = np.zeros(inside.shape, np.int32)
    nearest.ravel()[main] = np.arange(1, len(main) + 1)
    nearest = watershed(np.zeros(inside.shape, np.uint8), nearest, connectivity=2, mask=inside)
    return np.append(-1.0, main_mm)[nearest.ravel()]


def _noise_mm(solid: Solid) -> float:
    """Return the depth of the hollows in the face of an imported sample, or 0 if the face is plane.

    It is estimated from the median height of the face's vertices. A rounded or chamfered mouth does not change the
    median, so it does not count as noise.
    """
    if solid.figures.mesh is None:
        return 0.0
    corners_mm = solid.vertices_mm[solid.faces[solid.face_label == FaceLabel.TOP]]
    height_mm = np.abs(corners_mm[:, :, 2]).ravel()
    order = np.argsort(height_mm)
    area_mm2 = np.cumsum(np.repeat(_plan_areas_mm2(corners_mm), 3)[order])
    median_mm = float(height_mm[order][np.searchsorted(area_mm2, area_mm2[-1] / 2)])
    noise_mm = min(NOISE * median_mm / NORMAL_MEDIAN, MAX_NOISE * solid.depth_mm)
    return noise_mm if noise_mm > 2 * BESIDE_MM else 0.0


def _plan_areas_mm2(corners_mm: Floats) -> Floats:
    """Return the area of each facet, (n, 3, 3), in plan view, (n,)."""
    (x1, y1), (x2, y2) = ((corners_mm[:, corner, :2] - corners_mm[:, 0, :2]).T for corner in (1, 2))
    return np.abs(x1 * y2 - x2 * y1) / 2


def _up_to_the_ends(levels_mm: Floats, area_mm2: Floats, noise_mm: float, bin_mm: float) -> Floats:
    """Return the areas, with the first and last ones extrapolated to the deepest floor and the face, (k, n).

    If the face is rough, its hollows open into the crack. The area at the face is then extrapolated from the layers
    below the hollows, with the slope of the walls. It is the smaller slope of two layers, because a ledge is not a
    slope.
    """
    share = BESIDE_MM / (levels_mm[1] - levels_mm[0] - BESIDE_MM)
    area_mm2[:, 0] += share * (area_mm2[:, 0] - area_mm2[:, 1])
    if noise_mm:
        lowest, middle, highest = (area_mm2[:, np.searchsorted(levels_mm, -part * noise_mm)] for part in (2, 1.5, 1))
        width = max(int(SMOOTHED_MM / bin_mm), 1)
        lower, upper = uniform_filter1d([middle - lowest, highest - middle], width, axis=1)
        slope = np.where(lower * upper > 0, np.sign(lower) * np.minimum(np.abs(lower), np.abs(upper)), 0.0)
        area_mm2[:, -1] = highest + 2 * slope
    else:
        share = BESIDE_MM / (levels_mm[-1] - levels_mm[-2] - BESIDE_MM)
        area_mm2[:, -1] += share * (area_mm2[:, -1] - area_mm2[:, -2])
    return area_mm2.clip(min=0.0)


def _levels_mm(outline: Outline, solid: Solid, noise_mm: float) -> Floats:
    """Return increasing levels from the deepest floor to the face, with a level on both sides of horizontal facets.

    No level is within the hollows of a rough face.
    """
    even_mm = np.linspace(-solid.depth_mm, 0.0, LEVELS)
    finer_mm = even_mm[0] + (even_mm[1] - even_mm[0]) * LOWEST_LEVELS
    noisy_mm = -noise_mm * np.array([2.0, 1.5, 1.0])
    inner_mm = np.concatenate([even_mm[1:-1], finer_mm, _beside_flats_mm(outline, solid), noisy_mm])
    inner_mm = inner_mm[(inner_mm > even_mm[0] + 2 * BESIDE_MM) & (inner_mm <= -max(noise_mm, 2 * BESIDE_MM))]
    return np.concatenate([even_mm[:1], np.unique(inner_mm), even_mm[-1:]])


def _beside_flats_mm(outline: Outline, solid: Solid) -> Floats:
    """Return the levels just below and above horizontal facets, (k,), for the heights with the largest facet areas."""
    corners_mm = solid.vertices_mm[solid.faces]
    low_mm, high_mm = corners_mm[:, :, 2].min(axis=1), corners_mm[:, :, 2].max(axis=1)
    flat = (high_mm - low_mm < LEVEL_MM) & (low_mm > -solid.depth_mm - BESIDE_MM) & (high_mm < -BESIDE_MM)
    low_mm, high_mm = low_mm[flat], high_mm[flat]
    _, height = np.unique(np.round((low_mm + high_mm) / 2 / LEVEL_MM), return_inverse=True)
    total_mm2 = np.bincount(height, _plan_areas_mm2(corners_mm[flat]))
    large = np.argsort(-total_mm2, kind="stable")[:MAX_FLATS]
    large = large[total_mm2[large] > MIN_OF_MOUTH * outline.mean_width_mm * outline.length_mm]
    ends_mm = [
        (low_mm[height == level].min() - BESIDE_MM, high_mm[height == level].max() + BESIDE_MM) for level in large
    ]
    return np.array(ends_mm).ravel()


def cuts_of_cavity(solid: Solid, levels: int) -> tuple[Floats, list[list[Floats]]]:
    """Return increasing levels from the deepest floor to the face, and the rings of the cavity at each level.

    The last rings are those of the mouth.
    """
    levels_mm = np.linspace(-solid.depth_mm, 0.0, levels)
    return levels_mm, [cut.to_polygons() for cut in _cuts(solid, levels_mm, _noise_mm(solid))]


def _cuts(solid: Solid, levels_mm: Floats, noise_mm: float) -> list[CrossSection]:
    """Return the cuts of the cavity (block minus mesh), from just above the deepest floor to just below the face."""
    x_min, y_min, x_max, y_max = solid.block_mm
    block = CrossSection.square((x_max - x_min, y_max - y_min)).translate((x_min, y_min))
    # Mesh64 needs writable arrays that are no views: copy.
    body = Manifold(Mesh64(np.array(solid.vertices_mm, float), np.array(solid.faces, np.uint64)))
    inside_mm = levels_mm.clip(levels_mm[0] + BESIDE_MM, levels_mm[-1] - max(noise_mm, BESIDE_MM))
    return [block - body.slice(level_mm) for level_mm in inside_mm.tolist()]


def cell_areas(rings: Iterable[Floats], shape: tuple[int, int]) -> Floats:
    """Return the area of a region in each cell, (rows, columns), as a fraction of the cell.

    Cell (row, column) is the unit square whose lower corner is (column, row). Rings run counter-clockwise around the
    region and clockwise around its islands, all within the raster. Edges are cut at the borders of cells. Each piece
    adds the area between it and the right border of its cell, and adds its height to all cells on its right. This is
    Green's theorem, row by row.
    """
    edges = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    if not edges:
        return np.zeros(shape)
    start, step = (edge := np.concatenate(edges))[:, 0], edge[:, 1] - edge[:, 0]
    numbers, fractions = [np.arange(len(start))], [np.zeros(len(start))]
    for axis in (0, 1):
        low = np.ceil(edge[:, :, axis].min(axis=1)).astype(int)
        count = np.floor(edge[:, :, axis].max(axis=1)).astype(int) - low + 1
        count[step[:, axis] == 0] = 0
        number, border = counted_up(count, low)
        numbers.append(number)
        fractions.append(((border - start[number, axis]) / step[number, axis]).clip(0.0, 1.0))
    number, fraction = np.concatenate(numbers), np.concatenate(fractions)
    order = np.lexsort((fraction, number))
    number, fraction = number[order], fraction[order]
    end = np.where(np.append(number[1:] == number[:-1], False), np.append(fraction[1:], 1.0), 1.0)
    middle = start[number] + ((fraction + end) / 2)[:, None] * step[number]
    column, row = np.floor(middle).astype(int).T
    height = -(end - fraction) * step[number, 1]
    to_the_right = np.zeros(shape[0] * (shape[1] + 1))
    index, before = row * (shape[1] + 1) + column, middle[:, 0] - column
    to_the_right += np.bincount(index, height * (1 - before), len(to_the_right))
    to_the_right += np.bincount(index + 1, height * before, len(to_the_right))
    return np.cumsum(to_the_right.reshape(shape[0], -1), axis=1)[:, :-1]
