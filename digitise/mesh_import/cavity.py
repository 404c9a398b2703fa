"""Find the crack in a block: its cavity, its mouth, a picture for reports, and sections along it.

The walls may have any shape. The cavity is cut level by level. Each cell of a cut is assigned to the position along the
crack whose line from wall to wall is nearest. The sections therefore add up to the cavity, even at oblique ends and in
sharp bends. There, planes square to the centreline would miss some of the cavity or meet other parts of the crack.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold
from scipy.sparse import coo_array
from scipy.spatial import KDTree
from skimage.measure import points_in_poly

from digitise.geometry.polyline import Box, coverage, signed_area
from digitise.geometry.region import box_region, prism
from digitise.image.raster import Map
from digitise.mesh_import.block import Block, parted
from digitise.photo import Photo
from digitise.scale.view import View
from digitise.settings import MeshUnit
from sealtwin.core.arc_length import arc_length, at_arc_length
from sealtwin.core.arrays import midpoints
from sealtwin.core.errors import ShapeError
from sealtwin.core.facts import Facts, doubt
from sealtwin.core.records import Booleans, Floats, Outline, Sections

# Limits of the choice of an opening, and sizes of the picture.
#
# Each line says why its value was chosen. Areas and shares accept or refuse a mesh.
RIVAL = 0.5  # The choice is ambiguous if a second opening has more than this share of the largest opening's area
PIT_MM2 = 1.0  # Another opening of at least this area gives a warning; smaller ones are pores
SLICE_MM = 1e-3  # Depth below the flat top of a piece of the cavity at which the piece is sliced
UNDER_MM = 1.0  # Depth below the underside to which the search for a crack through the block extends
MIN_ACROSS_PX = 10  # Minimum number of pixels over the crack's width. With fewer, a thin mouth could fall into pieces
ROUND_MM = 15.0  # Width of the picture's margin around the crack, with space for the overlay's legend
FACE_GREY = 205.0  # Grey of the face
MOUTH_GREY = 40.0  # Grey of the crack's mouth
# Constants of the sections along the crack, and of the picture.
STATION_MM = 1.0  # Spacing of sections, equal to that of the nozzle's waypoints
MAX_STATIONS = 400  # Largest number of sections. More would take minutes on a long crack
FROM_END = 0.01  # Distance of the first and last depth from the crack's ends, as a fraction of the spacing of sections
# Number of layers of the cavity, each cut at its middle. At 16 mm depth, a step in the floor is right to 0.2 mm
LEVELS = 48
CELLS_ACROSS, MAX_CELLS = 24, 2_000_000  # Cells across the crack's width, and largest number of cells
ACROSS_PX = 40  # Pixels over a crack's width
LARGEST_PX = 12_000_000  # Largest number of pixels of the picture, that of a phone's photo
MAX_LINES = 4000  # Largest number of lines from wall to wall
SLOW = 1e-2  # Minimum squared pace of a line's points along the crack. At an inner corner they do not move
PART_WIDTHS = 0.12  # A cell farther than this many widths from every line from wall to wall is not in the main crack


@dataclass(frozen=True)
class Cavity:
    """The space that sealant can fill."""

    body: Manifold  # Space from the face down. If the crack is open at a side of the block, the space ends at that side
    mouth: CrossSection  # Section of the cavity at ``below_mm`` under the face
    below_mm: float
    warnings: Facts

    @property
    def volume_mm3(self) -> float:
        return float(self.body.volume())

    @property
    def depth_mm(self) -> float:
        return -float(self.body.bounding_box()[2])


def find_cavity(block: Block, below_mm: float) -> Cavity:
    """Return the cavity below the largest opening.

    Openings are searched for ``below_mm`` under the face. Raises ShapeError if there is no cavity, if two openings may
    be the crack, or if the crack passes through the underside.
    """
    face = box_region(block.face_mm)
    openings = (face - block.body.slice(-below_mm)).decompose()
    mouth, warnings = _chosen(openings)
    bottom_mm = block.body.bounding_box()[2]
    _, rooms = parted(prism(face, bottom_mm - UNDER_MM, -below_mm), block.body)
    reached = [room for room in rooms.decompose() if (room.slice(-below_mm - SLICE_MM) ^ mouth).area() > 0]
    below = max(reached, key=Manifold.volume, default=None)
    if below is None:
        raise ShapeError("There is no cavity below the crack's mouth.", "Check the mesh around the mouth.")
    if below.bounding_box()[2] < bottom_mm:
        raise ShapeError(
            "The crack passes through the underside of the mesh, so sealant would run out.",
            "Close the crack at the underside, or check mesh.up, the axis that points out of the cracked face.",
        )
    # Above the cut, walls that widen upward reach beyond the mouth. The offset allows up to 63 degrees from upright.
    rim = mouth.offset(2 * below_mm, JoinType.Round) ^ face
    above = prism(rim, -below_mm, 0.0) - block.body
    return Cavity(below + above, mouth, below_mm, warnings)


def _chosen(openings: list[CrossSection]) -> tuple[CrossSection, Facts]:
    openings = sorted(openings, key=CrossSection.area, reverse=True)
    if not openings or openings[0].area() < PIT_MM2:
        raise ShapeError("No crack opens in the face.", "Check mesh.up, the axis that points out of the cracked face.")
    areas_mm2 = [opening.area() for opening in openings]
    if len(openings) > 1 and areas_mm2[1] > RIVAL * areas_mm2[0]:
        (x0, y0), (x1, y1) = (np.reshape(opening.bounds(), (2, 2)).mean(axis=0) for opening in openings[:2])
        raise ShapeError(
            f"Two openings may be the crack: {areas_mm2[0]:.0f} mm² around ({x0:.0f}, {y0:.0f}) and "
            f"{areas_mm2[1]:.0f} mm² around ({x1:.0f}, {y1:.0f}), in mm from the face's lower left corner.",
            "Crop the mesh to one of them.",
        )
    pits = [area for area in areas_mm2[1:] if area >= PIT_MM2]
    largest_mm2 = max(pits, default=0.0)
    text = (
        f"{len(pits)} other openings of up to {largest_mm2:.1f} mm² in the face are not part of the crack, and "
        "sealant may run into them."
    )
    return openings[0], (doubt("mesh.other-openings", text, largest_mm2, "mm²"),) if pits else ()


def photograph(block: Block, cavity: Cavity, file: Path, units: MeshUnit) -> Photo:
    """Draw the mouth of a crack in a mesh as a photo. Raises ShapeError if the crack is too narrow for its length."""
    width_mm, source = strip_width_mm(cavity.mouth), f"mesh in {units}: {file.name}"
    photo = top_view(cavity.mouth, width_mm, block.face_mm, file, source, cavity.warnings)
    if width_mm < MIN_ACROSS_PX * photo.mm_per_px:
        x, y = np.ptp(np.reshape(cavity.mouth.bounds(), (2, 2)), axis=0)
        raise ShapeError(
            f"The crack is {width_mm:.3f} mm wide and extends over {x:.0f} x {y:.0f} mm: it is too narrow to be "
            "followed over this length.",
            "Crop the mesh to a shorter piece.",
        )
    return photo


def top_view(
    mouth: CrossSection,
    width_mm: float,
    face_mm: Box | None,
    file: Path,
    source: str,
    warnings: Facts = (),
) -> Photo:
    """Draw a crack's mouth dark on a bright face. The more of a pixel the mouth covers, the darker the pixel is."""
    low, high = np.reshape(mouth.bounds(), (2, 2)) + np.array([[-ROUND_MM], [ROUND_MM]])
    view, mm_per_px, crack = seen_from_above(mouth, width_mm, low, high)
    grey = FACE_GREY + crack * (MOUTH_GREY - FACE_GREY)
    return Photo(
        file=file,
        image=np.repeat(grey.round().astype(np.uint8)[:, :, None], 3, axis=2),
        brightness=1.0 - crack,
        view=view,
        face_mm=face_mm,
        mm_per_px=mm_per_px,
        scale_source=source,
        warnings=warnings,
    )


def cavity_sections(cavity: Manifold, outline: Outline) -> Sections:
    """Return the sections of the cavity along the outline, without side cracks and parts beyond the outline's ends."""
    length_mm = outline.length_mm
    s_mm = np.linspace(0.0, length_mm, int(np.clip(np.ceil(length_mm / STATION_MM), 8, MAX_STATIONS)) + 1)
    (*low_mm, bottom_mm), (*high_mm, _) = np.reshape(cavity.bounding_box(), (2, 3)).tolist()
    size_mm = np.subtract(high_mm, low_mm)
    cell_mm = max(outline.mean_width_mm / CELLS_ACROSS, float(np.sqrt(np.prod(size_mm) / MAX_CELLS)))
    origin_mm = np.array(low_mm) - cell_mm
    width, height = (int(np.ceil(side / cell_mm)) + 3 for side in size_mm)
    levels_mm = np.linspace(bottom_mm, 0.0, LEVELS + 1)
    layers = [
        covered(cavity.slice(middle), lambda ring_mm: (ring_mm - origin_mm) / cell_mm, (width, height))
        for middle in midpoints(levels_mm)
    ]
    rows, columns = np.nonzero(np.max(layers, axis=0))
    cells_mm = origin_mm + cell_mm * np.column_stack([columns, rows])
    at_mm, main = _places(cells_mm, outline, cell_mm)
    cells = np.array([layer[rows, columns] for layer in layers]) * cell_mm**2
    # Each cell is divided between the two sections beside it, so that areas are linear between sections.
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
    """Return the fraction of each cell that a region covers, (rows, columns).

    ``to_cells`` maps points in mm to (column, row), and ``shape`` is (columns, rows).
    """
    share = np.zeros(shape[::-1])
    for ring in map(np.asarray, region.to_polygons()):
        # Islands run clockwise.
        share += np.sign(signed_area(ring)) * coverage(to_cells(ring), shape)
    return np.clip(share, 0.0, 1.0)


def strip_width_mm(region: CrossSection) -> float:
    """Return the width of a long strip with the same area and rim: twice the area, divided by the length of the rim."""
    rings = (np.asarray(ring, float) for ring in region.to_polygons())
    return 2 * region.area() / sum(arc_length(ring[[*range(len(ring)), 0]])[-1] for ring in rings)


def seen_from_above(mouth: CrossSection, width_mm: float, low: Floats, high: Floats) -> tuple[View, float, Map]:
    """Return a view of the box between two corners, its mm/px, and the fraction of each pixel that a mouth covers."""
    mm_per_px = max(width_mm / ACROSS_PX, float(np.sqrt(np.prod(high - low) / LARGEST_PX)))
    view = View(np.array([[mm_per_px, 0.0, low[0]], [0.0, -mm_per_px, high[1]], [0.0, 0.0, 1.0]]))
    width_px, height_px = (int(count) for count in np.ceil((high - low) / mm_per_px) + 1)
    return view, mm_per_px, covered(mouth, view.to_px, (width_px, height_px)).astype(np.float32)


def _places(cells_mm: Floats, outline: Outline, step_mm: float) -> tuple[Floats, Booleans]:
    """Return the arc length at each cell, (n,), and a mask that is True for cells of the main crack, (n,).

    A cell outside the mouth, below an undercut wall, gets the values of the nearest cell in the mouth.
    """
    fine_mm = np.linspace(0.0, outline.length_mm, min(MAX_LINES, int(outline.length_mm / step_mm) + 2))
    left_mm, right_mm = _walls_at(outline, fine_mm)
    share = np.linspace(0.0, 1.0, CELLS_ACROSS + 1)
    lines_mm = left_mm[:, None] + share[:, None] * (right_mm - left_mm)[:, None]
    pace, lines_mm = (vectors.reshape(-1, 2) for vectors in (np.gradient(lines_mm, fine_mm, axis=0), lines_mm))
    in_mouth = points_in_poly(cells_mm, outline.outline_mm)
    if not in_mouth.any():
        in_mouth[:] = True
    places_mm = cells_mm[in_mouth]
    away_mm, near = KDTree(lines_mm).query(places_mm)
    # The pace of the nearest line gives the distance from that line to the cell along the crack.
    onward_mm = ((places_mm - lines_mm[near]) * pace[near]).sum(axis=1) / (pace[near] ** 2).sum(axis=1).clip(min=SLOW)
    at_mm = fine_mm[np.asarray(near) // len(share)] + onward_mm.clip(-fine_mm[1], fine_mm[1])
    # A cell that is cut in half at an end belongs to both sides.
    main = (away_mm <= PART_WIDTHS * outline.mean_width_mm) & (
        np.abs(at_mm - fine_mm[-1] / 2) < (fine_mm[-1] + step_mm) / 2
    )
    nearest = KDTree(places_mm).query(cells_mm)[1]
    return at_mm[nearest].clip(0.0, fine_mm[-1]), main[nearest]


def _walls_at(outline: Outline, s_mm: Floats) -> Sequence[Floats]:
    """Return the left and the right wall at arc lengths, (n, 2) each."""
    walls_mm = np.hstack([outline.left_wall_mm, outline.right_wall_mm])
    return np.hsplit(at_arc_length(walls_mm, outline.s_mm, s_mm), 2)


def _depths_mm(cavity: Manifold, outline: Outline, s_mm: Floats) -> Floats:
    """Return the depth of the cavity at each station, (n,), in the vertical plane from wall to wall."""
    end_mm = FROM_END * s_mm[1]
    walls_mm = _walls_at(outline, np.clip(s_mm, end_mm, s_mm[-1] - end_mm))
    return np.array([_depth_mm(cavity, *ends_mm) for ends_mm in zip(*walls_mm, strict=True)])


def _depth_mm(cavity: Manifold, left_mm: Floats, right_mm: Floats) -> float:
    """Return the depth of the cavity below a line from wall to wall.

    Other parts of the crack in the same plane are ignored.
    """
    x, y = left_mm - right_mm
    moved = cavity.translate((*-right_mm, 0.0)).rotate((0.0, 0.0, -np.degrees(np.arctan2(y, x))))
    # A tip that the plane only touches leaves a piece without bounds.
    pieces = [
        piece.bounds() for piece in moved.rotate((-90.0, 0.0, 0.0)).slice(0.0).decompose() if not piece.is_empty()
    ]
    return max((-low for start, low, end, _ in pieces if start <= np.hypot(x, y) and end >= 0), default=0.0)
