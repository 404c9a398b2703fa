"""Area of a sample's cavity at every level, stretch by stretch along the crack, cut from its mesh.

Each place of the cavity belongs to the stretch of the main crack that is nearest to it through the cavity: a side crack
to that of its root, the room around a tip to the last one. So stretches add up to the cavity, less its stones.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from manifold3d import CrossSection, Manifold, Mesh64
from skimage.segmentation import watershed

from sealtwin.core.coverage import coverage
from sealtwin.core.records import Floats, Integers, Outline, Solid, arc_length_at

STRETCH_MM, MOST_STRETCHES = 1.0, 800  # Length of a stretch of the crack, and most of them
LEVELS = 49  # Levels from the deepest floor to the face: a third of a millimetre apart at 16 mm
BESIDE_MM = 1e-3  # Distance of a cut from the face and from a level floor, where the area jumps
FINER = np.array([1 / 16, 1 / 8, 1 / 4, 1 / 2])  # Levels within the lowest layer: a modelled floor is not quite level
ACROSS, ALONG, MOST_CELLS = 8, 4, 1_000_000  # Cells across the crack's mean width and along a stretch; most in all
RIM = 1 / 24
"""Share of the depth down to which a cut of a modelled sample counts only over deeper places of the cavity. A scanned
face has hollows that meet the crack."""


@dataclass(frozen=True)
class CavityByLevel:
    """Level areas of the cavity in stretches of the crack; between levels an area is linear."""

    ends_mm: Floats  # (k + 1,): arc length at the ends of the stretches
    levels_mm: Floats  # (n,), increasing, from the deepest floor to the face
    area_mm2: Floats  # (k, n)

    @property
    def middle_mm(self) -> Floats:
        return (self.ends_mm[1:] + self.ends_mm[:-1]) / 2

    def between(self, from_mm: float, to_mm: float) -> tuple[Floats, Floats]:
        """Return the share of each stretch between two arc lengths, and the middle of that part, (k,) each."""
        inside_mm = np.clip(self.ends_mm, from_mm, to_mm)
        return np.diff(inside_mm) / np.diff(self.ends_mm), (inside_mm[1:] + inside_mm[:-1]) / 2

    def area_at_mm2(self, level_mm: Floats) -> Floats:
        """Return the area of each stretch at its level, (k,); that of the mouth over the face."""
        before, share, _ = self._places(level_mm)
        lower_mm2, upper_mm2 = self._beside(self.area_mm2, before)
        return lower_mm2 + share * (upper_mm2 - lower_mm2)

    def below_mm3(self, level_mm: Floats) -> Floats:
        """Return the volume of each stretch below its level, (k,); of a level over the face, that below the face."""
        before, share, step_mm = self._places(level_mm)
        lower_mm2, upper_mm2 = self._beside(self.area_mm2, before)
        layers_mm3 = np.diff(self.levels_mm) * (self.area_mm2[:, 1:] + self.area_mm2[:, :-1]) / 2
        sums_mm3 = np.concatenate([np.zeros((len(layers_mm3), 1)), np.cumsum(layers_mm3, axis=1)], axis=1)
        reached_mm3, _ = self._beside(sums_mm3, before)
        return reached_mm3 + share * step_mm * (lower_mm2 + share * (upper_mm2 - lower_mm2) / 2)

    def _places(self, level_mm: Floats) -> tuple[Integers, Floats, Floats]:
        """Return the index of the level below each level, the share of the layer up to it, and the layer's height."""
        before = np.searchsorted(self.levels_mm, level_mm, side="right") - 1
        before = np.clip(before, 0, len(self.levels_mm) - 2)
        step_mm = np.diff(self.levels_mm)[before]
        return before, np.clip((level_mm - self.levels_mm[before]) / step_mm, 0.0, 1.0), step_mm

    @staticmethod
    def _beside(values: Floats, before: Integers) -> tuple[Floats, Floats]:
        rows = np.arange(len(values))
        return values[rows, before], values[rows, np.minimum(before + 1, values.shape[1] - 1)]


_BY_SOLID: WeakKeyDictionary[Solid, tuple[Outline, CavityByLevel]] = WeakKeyDictionary()


def cavity_by_level(outline: Outline, solid: Solid) -> CavityByLevel:
    """Return the level areas of the solid's cavity along its crack; those of the last outline are kept."""
    of = _BY_SOLID.get(solid)
    if of is None or of[0] is not outline:
        of = outline, _cut(outline, solid)
        _BY_SOLID[solid] = of
    return of[1]


def _cut(outline: Outline, solid: Solid) -> CavityByLevel:
    levels_mm = _levels_mm(solid)
    cuts = _cuts(solid, levels_mm)
    low_mm, high_mm = np.reshape(CrossSection.compose(cuts).bounds(), (2, 2))
    cell_mm = min(outline.mean_width_mm / ACROSS, STRETCH_MM / ALONG)
    cell_mm = max(cell_mm, float(np.sqrt(np.prod(high_mm - low_mm) / MOST_CELLS)))
    origin_mm = low_mm - cell_mm
    columns, rows = (np.ceil((high_mm - low_mm) / cell_mm).astype(int) + 3).tolist()
    cells, shares = [], []
    # From the face down: a sliver between the cells' sub-rows, where walls meet, lies below the cut above it.
    for cut in reversed(cuts):
        covered = _covered(cut, origin_mm, cell_mm, (columns, rows)).ravel()
        inside = np.flatnonzero(covered)
        cells.append(inside if len(inside) else cells[-1])
        share = covered[inside] if len(inside) else shares[-1]
        # The sum over cells is the area of the cut, as the mesh has it.
        shares.append(share * cut.area() / max(share.sum(), np.finfo(float).tiny))
    cells, shares = cells[::-1], shares[::-1]
    deep = levels_mm < -RIM * solid.depth_mm if solid.tilt == "modelled" else levels_mm <= 0
    inside = np.zeros(rows * columns, dtype=bool)
    inside[np.concatenate([at for at, counts in zip(cells, deep, strict=True) if counts])] = True
    length_mm = outline.length_mm
    ends_mm = np.linspace(0.0, length_mm, int(np.clip(np.ceil(length_mm / STRETCH_MM), 2, MOST_STRETCHES)) + 1)
    stretch, ends_mm = _stretches(outline, ends_mm, origin_mm, cell_mm, inside.reshape(rows, columns))
    area_mm2 = [np.bincount(stretch[at], share, len(ends_mm))[1:] for at, share in zip(cells, shares, strict=True)]
    return CavityByLevel(ends_mm, levels_mm, _up_to_the_ends(levels_mm, np.array(area_mm2, dtype=float).T))


def _up_to_the_ends(levels_mm: Floats, area_mm2: Floats) -> Floats:
    """Return areas whose first and last, cut beside the deepest floor and the face, are continued to these."""
    for end, inner in ((0, 1), (-1, -2)):
        share = BESIDE_MM / (abs(levels_mm[end] - levels_mm[inner]) - BESIDE_MM)
        area_mm2[:, end] += share * (area_mm2[:, end] - area_mm2[:, inner])
    return area_mm2.clip(min=0.0)


def _levels_mm(solid: Solid) -> Floats:
    """Return levels from the deepest floor to the face, and two beside each floor that is level, increasing."""
    depth_mm, count = np.unique(np.round(solid.sections.depth_mm, 6), return_counts=True)
    floors_mm = -depth_mm[(count > 1) & (depth_mm < solid.depth_mm - 2 * BESIDE_MM) & (depth_mm > 2 * BESIDE_MM)]
    even_mm = np.linspace(-solid.depth_mm, 0.0, LEVELS)
    finer_mm = even_mm[0] + (even_mm[1] - even_mm[0]) * FINER
    return np.unique(np.concatenate([even_mm, finer_mm, floors_mm - BESIDE_MM, floors_mm + BESIDE_MM]))


def _cuts(solid: Solid, levels_mm: Floats) -> list[CrossSection]:
    """Return the level cuts of what the mesh leaves of its block, just above the deepest floor and below the face."""
    x_min, y_min, x_max, y_max = solid.block_mm
    block = CrossSection.square((x_max - x_min, y_max - y_min)).translate((x_min, y_min))
    # Copies, since it takes no array that is read-only or a view.
    body = Manifold(Mesh64(np.array(solid.vertices_mm, float), np.array(solid.faces, np.uint64)))
    inside_mm = levels_mm.clip(levels_mm[0] + BESIDE_MM, levels_mm[-1] - BESIDE_MM)
    return [block - body.slice(level_mm) for level_mm in inside_mm.tolist()]


def _covered(cut: CrossSection, origin_mm: Floats, cell_mm: float, shape: tuple[int, int]) -> Floats:
    """Return the area of a cut in each cell of (columns, rows), (rows, columns); its islands run clockwise."""
    covered = np.zeros(shape[::-1])
    for ring in map(np.asarray, cut.to_polygons()):
        turn = np.sign((ring[:, 0] * np.roll(ring[:, 1], -1) - np.roll(ring[:, 0], -1) * ring[:, 1]).sum())
        covered += turn * coverage((ring - origin_mm) / cell_mm, shape)
    return covered.clip(min=0.0)


def _stretches(
    outline: Outline, ends_mm: Floats, origin_mm: Floats, cell_mm: float, inside: np.ndarray
) -> tuple[Integers, Floats]:
    """Return the stretch of each cell, row by row, from 1, and the ends of the stretches, half way between their cells.

    Cells that do not meet the crack have 0.
    """
    rows, columns = inside.shape
    walls_mm = np.vstack([outline.left_wall_mm, outline.right_wall_mm[::-1]])
    between = coverage((walls_mm - origin_mm) / cell_mm, (columns, rows))
    row, column = np.nonzero((between > 0.5) & inside)
    s_mm = arc_length_at(origin_mm + cell_mm * np.column_stack([column, row]), outline.centreline_mm)
    s_mm = s_mm.clip(ends_mm[0], ends_mm[-1])
    stretch = np.clip(np.searchsorted(ends_mm, s_mm, side="right"), 1, len(ends_mm) - 1)
    begun = np.zeros(inside.shape, dtype=np.int32)
    begun[row, column] = stretch
    weight = between[row, column]
    sums = np.array([np.bincount(stretch, values, len(ends_mm))[1:] for values in (weight, weight * s_mm)])
    middle_mm = np.where(sums[0] > 0, sums[1] / np.maximum(sums[0], 1e-9), (ends_mm[1:] + ends_mm[:-1]) / 2)
    ends_mm = np.concatenate([ends_mm[:1], (middle_mm[1:] + middle_mm[:-1]) / 2, ends_mm[-1:]])
    return watershed(np.zeros(inside.shape, np.uint8), begun, connectivity=2, mask=inside).ravel(), ends_mm
