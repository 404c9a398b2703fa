"""The crack in a block: cavity, mouth, picture for reports, outline, and a given path."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold
from numpy.typing import NDArray
from skimage.measure import points_in_poly

from digitise.geometry.polyline import at_arc_length, resampled, signed_area
from digitise.geometry.region import box_region, prism
from digitise.mesh_import.block import Block, parted
from digitise.mesh_import.cavity_sections import seen_from_above, strip_width_mm
from digitise.mesh_import.mouth_line import MouthLine
from digitise.photo import Photo
from digitise.settings import MeshUnit
from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.errors import InputError, ShapeError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.plain_files import read_columns
from sealtwin.core.records import Floats, Outline

# Limits of the choice of an opening, sizes of the picture, and limits of a given path.
#
# Each line states what its value rests on. Areas and shares accept or refuse a mesh or a path. Sizes of the picture
# change its look, and how precisely a given path enters the mouth.
RIVAL = 0.5  # Share of the largest opening's area from which a second one makes the choice ambiguous
PIT_MM2 = 1.0  # Area of another opening that gives a warning; smaller ones are pores
SLICE_MM = 1e-3  # Depth below its flat top at which a piece of the cavity is sliced
UNDER_MM = 1.0  # Depth below the underside that is searched for a crack through it
LEAST_ACROSS_PX = 10  # Least pixels over the crack's width: fewer would part a thin mouth
ROUND_MM = 15.0  # Width shown around the crack, with space for the overlay's legend
FACE_GREY = 205.0  # Grey of the face
MOUTH_GREY = 40.0  # Grey of the crack's mouth
MOST_POINTS, FARTHEST_MM = 20_000, 1e6  # Limits of a path file
MOST_BESIDE = 0.05  # Largest share of a given line, between entry and exit, that may be beside the crack
WHOLE = 0.9  # Least share of the mouth that a line along the whole crack covers: oblique ends take some
SPACING_MM = 0.25  # Spacing of a given line's points: that of the centreline at 0.1 mm/px


AS_READ = "It is read as x and y in mm, in the mesh's own axes turned upright."


@dataclass(frozen=True)
class Cavity:
    """The space that sealant can fill."""

    body: Manifold  # Cavity from the face down, and up to the block's sides if the crack is open
    mouth: CrossSection  # Section of the cavity ``below_mm`` under the face
    below_mm: float
    warnings: tuple[Fact, ...]

    @property
    def volume_mm3(self) -> float:
        return float(self.body.volume())

    @property
    def depth_mm(self) -> float:
        return -float(self.body.bounding_box()[2])


def find_cavity(block: Block, below_mm: float, on_path_mm: Floats | None) -> Cavity:
    """Return the cavity below the opening with most points of the path, or below the largest opening without a path.

    Openings are searched for ``below_mm`` under the face.
    """
    face = box_region(block.face_mm)
    openings = (face - block.body.slice(-below_mm)).decompose()
    mouth, warnings = _chosen(openings, on_path_mm)
    bottom_mm = block.body.bounding_box()[2]
    _, rooms = parted(prism(face, bottom_mm - UNDER_MM, -below_mm), block.body)
    reached = [room for room in rooms.decompose() if (room.slice(-below_mm - SLICE_MM) ^ mouth).area() > 0]
    below = max(reached, key=Manifold.volume, default=None)
    if below is None:
        raise ShapeError("There is no cavity below the crack's mouth.", "Check the mesh around the mouth.", "mouth")
    if below.bounding_box()[2] < bottom_mm:
        raise ShapeError(
            "The crack passes through the underside of the mesh, so sealant would run out.",
            "Close the crack below, or check mesh.up, the axis that points out of the cracked face.",
            "through",
        )
    # Walls that open upward reach beyond the mouth, up to 63 degrees from upright; flatter ones are a face.
    rim = mouth.offset(2 * below_mm, JoinType.Round) ^ face
    above = prism(rim, -below_mm, 0.0) - block.body
    return Cavity(below + above, mouth, below_mm, warnings)


def _chosen(openings: list[CrossSection], on_path_mm: Floats | None) -> tuple[CrossSection, tuple[Fact, ...]]:
    openings = sorted(openings, key=CrossSection.area, reverse=True)
    if not openings or openings[0].area() < PIT_MM2:
        raise ShapeError(
            "No crack opens in the face.", "Check mesh.up, the axis that points out of the cracked face.", "mouth"
        )
    chosen, areas_mm2 = 0, [opening.area() for opening in openings]
    if on_path_mm is not None:
        chosen = int(np.argmax([_inside(opening, on_path_mm).sum() for opening in openings]))
    elif len(openings) > 1 and areas_mm2[1] > RIVAL * areas_mm2[0]:
        (x0, y0), (x1, y1) = (np.reshape(opening.bounds(), (2, 2)).mean(axis=0) for opening in openings[:2])
        raise ShapeError(
            f"Two openings may be the crack: {areas_mm2[0]:.0f} mm² around ({x0:.0f}, {y0:.0f}) and "
            f"{areas_mm2[1]:.0f} mm² around ({x1:.0f}, {y1:.0f}), in mm from the face's lower left corner.",
            "Choose one with mesh.path.",
            "rivals",
        )
    pits = [area for i, area in enumerate(areas_mm2) if i != chosen and area >= PIT_MM2]
    largest_mm2 = max(pits, default=0.0)
    text = (
        f"{len(pits)} other openings of up to {largest_mm2:.1f} mm² in the face are not part of the crack: sealant may "
        "run into them."
    )
    return openings[chosen], (doubt("mesh.other-openings", text, largest_mm2, "mm²"),) if pits else ()


def _inside(region: CrossSection, points_mm: Floats) -> NDArray[np.bool_]:
    """Return True for each point inside a region: inside an odd number of its rings, (n,)."""
    return np.logical_xor.reduce([points_in_poly(points_mm, ring) for ring in region.to_polygons()])


def photograph(block: Block, cavity: Cavity, file: Path, units: MeshUnit) -> Photo:
    """Draw the crack's mouth dark on a bright face. A pixel is the darker the more of it the mouth covers."""
    low, high = np.reshape(cavity.mouth.bounds(), (2, 2)) + np.array([[-ROUND_MM], [ROUND_MM]])
    width_mm = strip_width_mm(cavity.mouth)
    view, mm_per_px, in_mouth = seen_from_above(cavity.mouth, width_mm, low, high)
    if width_mm < LEAST_ACROSS_PX * mm_per_px:
        raise ShapeError(
            f"The crack is {width_mm:.3f} mm wide and extends over {high[0] - low[0]:.0f} x {high[1] - low[1]:.0f} "
            "mm: it is too narrow to be followed.",
            "Crop the mesh to a shorter piece.",
            "narrow",
        )
    grey = FACE_GREY + in_mouth * (MOUTH_GREY - FACE_GREY)
    return Photo(
        file=file,
        image=np.repeat(grey.round().astype(np.uint8)[:, :, None], 3, axis=2),
        brightness=1.0 - in_mouth,
        view=view,
        face_mm=block.face_mm,
        mm_per_px=mm_per_px,
        scale_source=f"mesh in {units}: {file.name}",
        drawn=in_mouth > 0.5,
        warnings=cavity.warnings,
    )


def outline_of(line: MouthLine, cavity: Cavity, photo: Photo) -> Outline:
    """Return the outline of the crack along a line through its mouth; its ring is the rim of the mouth."""
    ring, *islands = sorted(map(np.asarray, cavity.mouth.to_polygons()), key=signed_area, reverse=True)
    return Outline(
        **photo.in_both_units(
            centreline=line.centreline_mm, left_wall=line.left_mm, right_wall=line.right_mm, outline=ring
        ),
        ends=line.ends,
        **photo.facts_of_outline,
        path_source="mesh",
        warnings=(*cavity.warnings, *line.warnings),
        islands_mm=tuple(islands),
        branches_mm=line.side_lines_mm,
        branches_kept=bool(line.side_lines_mm),
    )


def read_path(path: Path) -> Floats:
    """Read points in mm, (n, 2), from a CSV with the columns x_mm and y_mm. Raises InputError with file and row."""
    limits_mm = (-FARTHEST_MM, FARTHEST_MM)
    bounds = {"x_mm": limits_mm, "y_mm": limits_mm, "z_mm": limits_mm}
    columns = read_columns(path, bounds, ("x_mm", "y_mm"), (2, MOST_POINTS))
    points_mm = np.column_stack([columns["x_mm"], columns["y_mm"]])
    points_mm = points_mm[np.append(True, (np.diff(points_mm, axis=0) != 0).any(axis=1))]
    if len(points_mm) < 2:
        raise InputError(f"{path}: 1 different point; a path needs two or more.")
    return points_mm


def in_mouth(mouth: CrossSection, line_mm: Floats) -> Floats:
    """Return the line between its first and last place in the crack's mouth, evenly spaced."""
    even_mm = resampled(line_mm, SPACING_MM)
    inside = _inside(mouth, even_mm)
    first, last = np.flatnonzero(inside)[[0, -1]] if inside.any() else (0, 0)
    beside = 1 - float(inside[first : last + 1].mean())
    if first == last or beside > MOST_BESIDE:
        wrong = f"The given path is outside the crack on {beside:.0%} of its length (at most {MOST_BESIDE:.0%})."
        raise ShapeError(wrong, AS_READ, "path")
    return even_mm[first : last + 1]


def along(outline: Outline, photo: Photo, line_mm: Floats) -> Outline:
    """Return the outline with the given line as its centreline."""
    middle_s_mm = np.maximum.accumulate(arc_length_at(line_mm, outline.centreline_mm).clip(0, outline.length_mm))
    walls_mm = np.hstack([outline.left_wall_mm, outline.right_wall_mm])
    left_mm, right_mm = np.hsplit(at_arc_length(walls_mm, outline.s_mm, middle_s_mm), 2)
    given = replace(
        outline,
        **photo.in_both_units(centreline=line_mm, left_wall=left_mm, right_wall=right_mm),
        path_source="line",
    )
    followed = given.mean_width_mm * given.length_mm / (np.asarray(photo.drawn).sum() * photo.mm_per_px**2)
    if followed < WHOLE:
        text = (
            f"the given path, {given.length_mm:.1f} mm long, follows {100 * followed:.0f} % of the crack's mouth: "
            'volume_ml = "cavity" would put the sealant for the whole crack on this part. Set volume_ml to a number, '
            "or give a path along the whole crack"
        )
        given = replace(given, warnings=(*given.warnings, doubt("mesh.path-short", text, followed)))
    return given
