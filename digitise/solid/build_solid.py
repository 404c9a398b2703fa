"""Build the sample as a watertight solid, a block minus the crack's cavity, from the outline and a measured depth."""

from dataclasses import replace

import numpy as np
from manifold3d import CrossSection, FillRule, OpType

from digitise.geometry.mesh_topology import MeshFigures, examine_mesh, mesh_volume_mm3
from digitise.geometry.region import box_region
from digitise.settings import CrackShape
from digitise.solid.dams import (
    REDUCE_ANGLE,
    Dam,
    dam_box,
    dams,
    label_faces,
    tilted_out,
)
from digitise.solid.float_mesh import tidy
from digitise.solid.footprint import Footprint, lay_out
from digitise.solid.sections import Slicer, crack_sections
from digitise.solid.wedges import carve, wall_shifts_mm
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats, Integers, Outline, Solid
from sealtwin.core.settings import doubts_of
from sealtwin.core.solid_figures import ClosingDepth, EndOfCrack, SolidFigures, Span, WeighedCavity

JITTER_MM = 2e-4  # Increase of the random shift of vertices after each failed build. It separates coinciding vertices
MIN_CLOSED = 0.02  # If funnel walls meet along more than this fraction of the crack, there is a warning
MAX_APART = 0.08  # Largest relative difference of the cavity's volume from its sections. Drawn cracks have up to 0.05
BENDS = (
    "The cavity has {:.2f} times the volume of its sections along the crack. The crack bends so sharply for its "
    "width and tilt that parts of it meet, or overlap the material beyond an end. Look at crack.stl, and "
    'reduce wall_angle_deg or choose tilt = "vertical".'
)
# A table of depths may be this much shorter than the crack without a warning, since ends are equally uncertain
TABLE_SHORT_MM = 2.0
ATTEMPTS = 6
MIN_FLOOR = 0.5  # If the floor of leaning walls has less than this fraction of the mouth's area, it leaves the sample
SMALLEST_CAVITY_MM3 = 1.0  # Smallest cavity worth a simulation: four particles of the paper's size


def build_solid(outline: Outline, shape: CrackShape) -> Solid:
    """Build the sample: a block minus the cavity with tilted walls, with dams at open ends.

    The solid is watertight and does not cross itself. z = 0 is the face. The walls follow the traced outline at the
    mouth or, for a flare, at the floor. Raises InputError if the outline crosses itself, leaves the block without an
    open end, or encloses nothing, or if walls that widen downward meet below the face.
    """
    if shape.fill is not None or shape.scan is not None:
        raise ValueError("the shape has a weighed fill or a scan whose walls are not computed yet")
    if outline.width_source == "none":
        raise InputError("This outline is only a path, without walls. Give the crack's width to build a solid.")
    shape, table_warnings = shape_as_long_as(outline.length_mm, shape)
    spread_mm = max(wall_shifts_mm(shape))
    footprint = lay_out(outline, shape, spread_mm)
    slicer = Slicer(footprint, shape)
    sections = [slicer.between_walls(depth_mm) for depth_mm in (0.0, shape.deepest_mm)]
    if shape.tilting.lean and sections[1].area() < MIN_FLOOR * sections[0].area():
        raise tilted_out(spread_mm)
    plates = dams(footprint, sections, spread_mm)
    if shape.tilting.opens > 0 and slicer.meets_below(*sections):
        raise InputError(
            f'With tilt = "undercut" and walls at {_angles(shape)} and {shape.deepest_mm:g} mm deep, parts of the '
            f'crack meet below the face. {REDUCE_ANGLE}, or choose tilt = "lean", which keeps the width.'
        )
    along = crack_sections(outline, shape)
    volume_mm3 = float(np.trapezoid(along.area_mm2, along.s_mm))
    if volume_mm3 < SMALLEST_CAVITY_MM3:
        raise InputError(
            f"At {_angles(shape)} and {shape.deepest_mm:g} mm deep, tilt {shape.tilt} leaves a cavity of "
            f"{volume_mm3:.2g} mm³, less than {SMALLEST_CAVITY_MM3:g} mm³, so there is nothing to fill. Check "
            f"depth_mm and the scale. {REDUCE_ANGLE} of a funnel, or choose another tilt."
        )
    vertices_mm, faces, figures, jitter_mm = _watertight(footprint, shape, plates)
    bottom_mm = -(shape.deepest_mm + shape.floor_thickness_mm)
    dam_area = CrossSection.batch_boolean([box_region(dam.box_mm) for dam in plates], OpType.Add)
    dam_mm3 = dam_area.area() * (shape.dam_height_mm - bottom_mm)
    cavity_mm3 = footprint.block.area() * -bottom_mm + dam_mm3 - mesh_volume_mm3(vertices_mm, faces)
    mouth_mm, floor_mm = _widths_mm(outline, shape)
    closing, ratio = _closing_depth(outline, shape), cavity_mm3 / volume_mm3
    apart = not outline.branches_kept and abs(ratio - 1) > MAX_APART
    return Solid(
        vertices_mm=vertices_mm,
        faces=faces,
        face_label=label_faces(vertices_mm, faces, footprint, shape.deepest_mm, bottom_mm),
        block_mm=footprint.block_mm,
        depth_mm=shape.deepest_mm,
        tilt=shape.tilt,
        wall_angles_deg=shape.wall_angles_deg,
        cavity_volume_mm3=cavity_mm3,
        sections=along,
        figures=SolidFigures(
            photo_width_mm=outline.mean_width_mm,
            photo_width_95_mm=outline.width_95_mm,
            cavity_volume_95_mm3=_doubt_of_volume(outline, shape, cavity_mm3),
            mouth_width_mm=mouth_mm,
            floor_width_mm=floor_mm,
            closing_depth_mm=closing,
            # _watertight refuses a mesh that leaks.
            watertight=True,
            **vars(figures),
            jitter_mm=jitter_mm,
            ends=tuple(EndOfCrack(end.kind, tuple(end.centre_mm), tuple(end.outward)) for end in footprint.ends),
            dams=tuple(dam_box(dam.box_mm, bottom_mm, shape.dam_height_mm, dam.end) for dam in plates),
            warnings=(
                *footprint.warnings,
                *table_warnings,
                *_tilt_warnings(outline, shape, closing),
                *([doubt("solid.parts-meet", BENDS.format(ratio), ratio)] if apart else []),
                *doubts_of(shape, width_mm=outline.mean_width_mm),
            ),
        ),
    )


def with_weighed(solid: Solid, weighed: WeighedCavity) -> Solid:
    """Add the figures and findings of a weighed fill to the solid that was built from it."""
    figures = replace(
        solid.figures,
        weighed=weighed,
        cavity_volume_95_mm3=weighed.volume_95_mm3,
        warnings=(*solid.figures.warnings, *weighed.findings),
    )
    return replace(solid, figures=figures)


def _doubt_of_volume(outline: Outline, shape: CrackShape, cavity_mm3: float) -> Span | None:
    """Return the cavity's volume for both ends of the width's 95 % interval.

    Each wall is moved as a whole, without a change of its tilt. Returns None if the width has no interval.
    """
    if outline.width_95_mm is None:
        return None
    area_mm2 = float(np.trapezoid(shape.depth_at_mm(outline.s_mm), outline.s_mm))
    low_mm3, high_mm3 = (
        max(0.0, cavity_mm3 + area_mm2 * (end_mm - outline.mean_width_mm)) for end_mm in outline.width_95_mm
    )
    return low_mm3, high_mm3


def shape_as_long_as(length_mm: float, shape: CrackShape) -> tuple[CrackShape, list[Fact]]:
    """Return the shape, and a warning if its depth table is too long or too short. A long table is cut."""
    s_mm = shape.depth_stations_mm
    differs = f"depth_mm extends to s = {s_mm[-1]:g} mm, but the crack is {length_mm:.1f} mm long. "
    if len(s_mm) > 1 and s_mm[-1] < length_mm - TABLE_SHORT_MM:
        return shape, [
            doubt("solid.short-table", f"{differs}The last depth is used for the rest.", float(s_mm[-1]), "mm")
        ]
    if s_mm[-1] <= length_mm:
        return shape, []
    s_mm = np.append(s_mm[s_mm < length_mm], length_mm)
    table = tuple(zip(s_mm.tolist(), shape.depth_at_mm(s_mm).tolist(), strict=True))
    text = f"{differs}The table is cut at the crack's end."
    return shape.model_copy(update={"depth_mm": table}), [doubt("solid.long-table", text, length_mm, "mm")]


def _watertight(
    footprint: Footprint, shape: CrackShape, plates: tuple[Dam, ...]
) -> tuple[Floats, Integers, MeshFigures, float]:
    """Build the solid, clean its mesh and check it.

    If a check fails, the outline's vertices are shifted slightly, and the build is repeated. Returns vertices, (v, 3),
    faces, (f, 3), figures of the mesh, and the size of the last shift in mm. Raises InputError if all builds fail.
    """
    rng, traced = np.random.default_rng(0), footprint.crack
    faults: list[str] = []
    for attempt in range(ATTEMPTS):
        jitter_mm = attempt * JITTER_MM
        if attempt:
            rings = [ring + rng.uniform(-jitter_mm, jitter_mm, ring.shape) for ring in traced.to_polygons()]
            footprint = replace(footprint, crack=CrossSection(rings, FillRule.Positive))
        vertices_mm, faces = tidy(carve(footprint, shape, plates))
        faults, figures = examine_mesh(vertices_mm, faces, expected_euler=2)
        if figures is not None and not faults:
            return vertices_mm, faces, figures, jitter_mm
    raise InputError(
        f"{ATTEMPTS} builds of this outline with tilt {shape.tilt} gave no valid solid: {faults[0]} Retrace the crack "
        "near there, or choose another tilt."
    )


def _widths_mm(outline: Outline, shape: CrackShape) -> tuple[float, float]:
    """Return the mean width at the mouth and at the floor, in mm."""
    opening_mm = sum(wall_shifts_mm(shape)) * shape.tilting.away
    other_mm = _mean_along(outline, np.maximum(0.0, outline.width_mm + opening_mm))
    photo_mm = outline.mean_width_mm
    return (other_mm, photo_mm) if shape.tilting.floor_traced else (photo_mm, other_mm)


def _mean_along(outline: Outline, values: Floats) -> float:
    return float(np.trapezoid(values, outline.s_mm) / outline.length_mm)


def _closing_depth(outline: Outline, shape: CrackShape) -> ClosingDepth:
    """Return the depth at which the walls of a funnel with these angles meet: width / (tan left + tan right)."""
    funnel = shape.model_copy(update={"tilt": "funnel"})
    closing = np.tan(np.radians(funnel.wall_angles_deg)).sum()
    if closing == 0:
        return ClosingDepth(None, None, 0.0)
    depth_mm = outline.width_mm / closing
    closed = (depth_mm < shape.depth_at_mm(outline.s_mm)).astype(float)
    return ClosingDepth(float(depth_mm.min()), _mean_along(outline, depth_mm), _mean_along(outline, closed))


def _tilt_warnings(outline: Outline, shape: CrackShape, closing: ClosingDepth) -> list[Fact]:
    if shape.tilting.away >= 0 or closing.mean is None or closing.share_above_floor < MIN_CLOSED:
        return []
    steepest_deg = np.degrees(np.arctan(outline.mean_width_mm / (2 * shape.deepest_mm)))
    text = (
        f"At {_angles(shape)} the walls meet above the requested depth ({shape.deepest_mm:g} mm at most) along "
        f"{closing.share_above_floor:.0%} of the crack. On average over the whole crack they meet at "
        f'{closing.mean:.1f} mm. Reduce the angle below {steepest_deg:.1f}°, choose tilt = "flare" or "lean", or '
        "accept the V-shaped section."
    )
    return [doubt("solid.walls-meet", text, closing.mean, "mm")]


def _angles(shape: CrackShape) -> str:
    left_deg, right_deg = shape.wall_angles_deg
    return f"{left_deg:.3g}°" if left_deg == right_deg else f"{left_deg:.3g}° left and {right_deg:.3g}° right"
