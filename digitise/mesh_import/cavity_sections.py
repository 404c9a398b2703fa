"""Compute the depth of a modelled cavity along its crack, and the area of its sections below every level.

The walls may have any shape. The cavity is cut level by level. Each cell of a cut belongs to the place along the crack
whose line from wall to wall is nearest. So the sections add up to the cavity, also at oblique ends and in sharp bends.
Planes square to the centreline would miss some of it there, or meet other parts of the crack.
"""

from collections.abc import Callable

import numpy as np
from manifold3d import CrossSection, Manifold
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.spatial import KDTree
from skimage.measure import points_in_poly

from digitise.geometry.polyline import at_arc_length, coverage, signed_area
from digitise.image.raster import Map
from digitise.scale.view import View
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Outline, Sections

STATION_MM = 1.0  # Spacing of sections: that of the nozzle's waypoints
MOST_STATIONS = 400  # Most sections: more would take minutes on a long crack
FROM_END = 0.01  # Distance of the first and last cut of the floor from the crack's ends, in spacings of sections
LEVELS = 48  # Layers of the cavity, each cut at its middle: at 16 mm depth a step in the floor is placed within 0.2 mm
ACROSS, MOST_CELLS = 24, 2_000_000  # Cells across the crack's width, and most in all
ACROSS_PX = 40  # Pixels over a crack's width: a given path enters the mouth within a fortieth of it
LARGEST_PX = 12_000_000  # Largest picture, that of a phone
MOST_LINES = 4000  # Most lines from wall to wall
SLOW = 1e-2  # Least squared pace of a line's points along the crack: at an inner corner they do not move
APART = 0.12  # Widths from every line from wall to wall beyond which the mouth is another part of the crack


def cavity_sections(cavity: Manifold, outline: Outline) -> Sections:
    """Return the sections of the cavity along the outline, without side cracks and parts beyond its ends."""
    length_mm = outline.length_mm
    s_mm = np.linspace(0.0, length_mm, int(np.clip(np.ceil(length_mm / STATION_MM), 8, MOST_STATIONS)) + 1)
    *low_mm, bottom_mm = np.asarray(cavity.bounding_box())[[0, 1, 2]].tolist()
    size_mm = np.asarray(cavity.bounding_box())[[3, 4]] - low_mm
    cell_mm = max(outline.mean_width_mm / ACROSS, float(np.sqrt(np.prod(size_mm) / MOST_CELLS)))
    origin_mm = np.array(low_mm) - cell_mm
    width, height = (int(np.ceil(side / cell_mm)) + 3 for side in size_mm)
    levels_mm = np.linspace(bottom_mm, 0.0, LEVELS + 1)
    layers = [
        covered(cavity.slice(float(middle)), lambda ring_mm: (ring_mm - origin_mm) / cell_mm, (width, height))
        for middle in (levels_mm[1:] + levels_mm[:-1]) / 2
    ]
    rows, columns = np.nonzero(np.max(layers, axis=0))
    cells_mm = origin_mm + cell_mm * np.column_stack([columns, rows])
    at_mm, main = _places(cells_mm, outline, cell_mm)
    cells = np.array([layer[rows, columns] for layer in layers]) * cell_mm**2
    # Each cell is shared between both sections beside it, so that areas are linear between sections.
    step_mm = s_mm[1]
    before = np.clip((at_mm[main] / step_mm).astype(int), 0, len(s_mm) - 2)
    share = at_mm[main] / step_mm - before
    spacing_mm = np.full(len(s_mm), step_mm)
    spacing_mm[[0, -1]] /= 2
    to_sections = coo_array(
        (np.append(1 - share, share), (np.append(before, before + 1), np.tile(np.flatnonzero(main), 2))),
        shape=(len(s_mm), len(main)),
    )
    below_mm2 = np.zeros((len(s_mm), LEVELS + 1))
    below_mm2[:, 1:] = np.cumsum(to_sections @ cells.T / spacing_mm[:, None], axis=1) * (levels_mm[1] - levels_mm[0])
    return Sections(s_mm, _depths_mm(cavity, outline, s_mm), below_mm2[:, -1], levels_mm, below_mm2)


def covered(region: CrossSection, to_cells: Callable[[Floats], Floats], shape: tuple[int, int]) -> Floats:
    """Return the share of each cell that a region covers, (rows, columns). ``to_cells`` maps to (column, row)."""
    share = np.zeros(shape[::-1])
    for ring in map(np.asarray, region.to_polygons()):
        # Islands run clockwise.
        share += np.sign(signed_area(ring)) * coverage(to_cells(ring), shape)
    return np.clip(share, 0.0, 1.0)


def strip_width_mm(region: CrossSection) -> float:
    """Return the width of a long strip: twice its area over its rim."""
    rings = (np.asarray(ring, dtype=float) for ring in region.to_polygons())
    return 2 * region.area() / sum(arc_length(ring[[*range(len(ring)), 0]])[-1] for ring in rings)


def seen_from_above(mouth: CrossSection, width_mm: float, low: Floats, high: Floats) -> tuple[View, float, Map]:
    """Return the view of a picture between two corners, its mm/px, and the share of each pixel that a mouth covers."""
    mm_per_px = max(width_mm / ACROSS_PX, float(np.sqrt(np.prod(high - low) / LARGEST_PX)))
    view = View(np.array([[mm_per_px, 0.0, low[0]], [0.0, -mm_per_px, high[1]], [0.0, 0.0, 1.0]]))
    width_px, height_px = (int(count) for count in np.ceil((high - low) / mm_per_px) + 1)
    return view, mm_per_px, covered(mouth, view.to_px, (width_px, height_px)).astype(np.float32)


def _places(cells_mm: Floats, outline: Outline, step_mm: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the arc length of each cell, (n,), and True for cells of the main crack.

    A cell beside the mouth, below an undercut wall, belongs to the nearest cell in the mouth.
    """
    fine_mm = np.linspace(0.0, outline.length_mm, min(MOST_LINES, int(outline.length_mm / step_mm) + 2))
    walls_mm = np.hstack([outline.left_wall_mm, outline.right_wall_mm])
    left_mm, right_mm = np.hsplit(at_arc_length(walls_mm, outline.s_mm, fine_mm), 2)
    share = np.linspace(0.0, 1.0, ACROSS + 1)
    lines_mm = left_mm[:, None] + share[:, None] * (right_mm - left_mm)[:, None]
    pace, lines_mm = (each.reshape(-1, 2) for each in (np.gradient(lines_mm, fine_mm, axis=0), lines_mm))
    in_mouth = points_in_poly(cells_mm, outline.outline_mm)
    if not in_mouth.any():
        in_mouth[:] = True
    places_mm = cells_mm[in_mouth]
    away_mm, near = KDTree(lines_mm).query(places_mm)
    # Interpolated from the nearest line by the pace of the lines there.
    onward_mm = ((places_mm - lines_mm[near]) * pace[near]).sum(axis=1) / (pace[near] ** 2).sum(axis=1).clip(min=SLOW)
    at_mm = fine_mm[np.asarray(near) // len(share)] + onward_mm.clip(-fine_mm[1], fine_mm[1])
    # A cell that is cut in half at an end belongs to both sides.
    main = (away_mm <= APART * outline.mean_width_mm) & (np.abs(at_mm - fine_mm[-1] / 2) < (fine_mm[-1] + step_mm) / 2)
    nearest = KDTree(places_mm).query(cells_mm)[1]
    return at_mm[nearest].clip(0.0, fine_mm[-1]), main[nearest]


def _depths_mm(cavity: Manifold, outline: Outline, s_mm: Floats) -> Floats:
    """Return the depth of the cavity at each station, (n,), in the vertical plane from wall to wall."""
    end_mm = FROM_END * s_mm[1]
    walls_mm = np.hstack([outline.left_wall_mm, outline.right_wall_mm])
    stations = at_arc_length(walls_mm, outline.s_mm, np.clip(s_mm, end_mm, s_mm[-1] - end_mm))
    return np.array([_depth_mm(cavity, *np.split(station, 2)) for station in stations])


def _depth_mm(cavity: Manifold, left_mm: Floats, right_mm: Floats) -> float:
    """Return the depth of the cavity below a line from wall to wall, without other parts of the crack in its plane."""
    x, y = left_mm - right_mm
    moved = cavity.translate((*-right_mm, 0.0)).rotate((0.0, 0.0, -float(np.degrees(np.arctan2(y, x)))))
    # A tip that the plane only touches leaves a piece without bounds.
    pieces = [
        piece.bounds() for piece in moved.rotate((-90.0, 0.0, 0.0)).slice(0.0).decompose() if not piece.is_empty()
    ]
    return max((-low for start, low, end, _ in pieces if start <= np.hypot(x, y) and end >= 0), default=0.0)
