"""The sample as a watertight solid: a block less the crack's cavity, from the outline and a measured depth."""

from dataclasses import replace
from typing import Any

import numpy as np
from manifold3d import CrossSection, FillRule

from digitise.body.dams import Dam, dams, tilted_out
from digitise.body.footprint import Footprint, lay_out
from digitise.body.labels import label_faces
from digitise.body.readings import Slicer, cavity_volume_mm3, compare_readings
from digitise.body.sections import crack_sections
from digitise.body.tidy import tidy
from digitise.body.tilting import wall_shifts_mm
from digitise.body.wedges import carve
from digitise.geometry.region import rectangle
from digitise.mesh import MeshFigures, examine_mesh
from digitise.settings import CrackShape
from sealtwin.errors import InputError
from sealtwin.records import Floats, Integers, Outline, Solid

JITTER_MM = 2e-4
"""Step of the vertices' random shift after a failed build: breaks a coincidence, and is a thousandth of a pixel."""
ATTEMPTS = 6
CAVITY_TOLERANCE = 1e-3
"""Between the mesh's cavity and the integral of the outline's sections: promised to whoever weighs their sealant."""
FINER = 8
"""Times as many sections in a second look, before a solid is refused: a funnel's change fastest where walls meet."""
LEAST_FLOOR = 0.5
"""Of the mouth's area, under walls that lean: with less of it left, the crack has gone out of the sample's side."""
SMALLEST_CAVITY_MM3 = 1.0
"""Four particles of the paper's size; a cavity with less holds no sealant worth a simulation."""


def build_solid(outline: Outline, shape: CrackShape) -> Solid:
    """Block minus tilted cavity, watertight and free of self-intersections, with dams at open ends.

    z = 0 is the face, the cavity's floor lies at ``-depth_mm`` and the block's underside ``floor_thickness_mm`` below.
    The walls stand at the traced outline at the mouth (lean, funnel, vertical) or at the floor (flare).

    Raises InputError where the outline crosses itself, comes out of the block where no open end is, encloses nothing,
    cannot be made watertight, or the mesh's cavity is not the integral of its sections within ``CAVITY_TOLERANCE``.
    """
    shape, table_warnings = _as_long_as(outline.length_mm, shape)
    spread_mm = max(wall_shifts_mm(shape))
    footprint = lay_out(outline, shape, spread_mm)
    slicer = Slicer(footprint, shape)
    sections = [slicer.between_walls(depth_mm) for depth_mm in (0.0, shape.deepest_mm)]
    if shape.tilt == "lean" and sections[1].area() < LEAST_FLOOR * sections[0].area():
        raise tilted_out(spread_mm)
    plates = dams(footprint, sections, spread_mm)
    readings = compare_readings(outline, footprint, shape)
    _require_volume(readings, shape)
    vertices_mm, faces, figures, jitter_mm = _watertight(footprint, shape, plates)
    bottom_mm = -(shape.deepest_mm + shape.floor_thickness_mm)
    block_mm3 = footprint.block.area() * -bottom_mm
    dam_mm3 = _dam_volume_mm3(plates, shape.dam_height_mm - bottom_mm)
    cavity_mm3 = block_mm3 + dam_mm3 - figures.volume_mm3
    _require_agreement(cavity_mm3, readings, footprint, shape)
    return Solid(
        vertices_mm=vertices_mm,
        faces=faces,
        face_label=label_faces(vertices_mm, faces, footprint, shape.deepest_mm, bottom_mm),
        block_mm=footprint.block_mm,
        depth_mm=shape.deepest_mm,
        tilt=shape.tilt,
        wall_angles_deg=shape.wall_angles_deg,
        cavity_volume_mm3=cavity_mm3,
        sections=crack_sections(outline, shape),
        report={
            **readings,
            # No mesh that leaks gets here: see _watertight.
            "watertight": True,
            "triangles": len(faces),
            "euler": figures.euler,
            "min_edge_mm": figures.min_edge_mm,
            "self_intersections": figures.self_intersections,
            "jitter_mm": jitter_mm,
            "ends": [{"kind": end.kind, "centre_mm": end.centre_mm, "outward": end.outward} for end in footprint.ends],
            "dams": [_dam_report(plate, bottom_mm, shape.dam_height_mm) for plate in plates],
            "warnings": [*footprint.warnings, *table_warnings, *_tilt_warnings(outline, footprint, shape, readings)],
        },
    )


def _as_long_as(length_mm: float, shape: CrackShape) -> tuple[CrackShape, list[str]]:
    """The shape with its table of depths ended at the crack's own end."""
    s_mm = shape.depth_stations_mm
    if s_mm[-1] <= length_mm:
        return shape, []
    s_mm = np.append(s_mm[s_mm < length_mm], length_mm)
    table = tuple(zip(s_mm.tolist(), shape.depth_at_mm(s_mm).tolist(), strict=True))
    warning = (
        f"depth_mm goes on to s = {shape.depth_stations_mm[-1]:g} mm, but the crack is {length_mm:.1f} mm long: its "
        "floor ends there."
    )
    return shape.model_copy(update={"depth_mm": table}), [warning]


def _watertight(
    footprint: Footprint, shape: CrackShape, plates: tuple[Dam, ...]
) -> tuple[Floats, Integers, MeshFigures, float]:
    """Build, tidy and check; where a check fails, shift the outline's vertices a little and build again."""
    rng = np.random.default_rng(0)
    faults: list[str] = []
    for attempt in range(ATTEMPTS):
        jitter_mm = attempt * JITTER_MM
        shaken = replace(footprint, crack=_shaken(footprint.crack, jitter_mm, rng)) if attempt else footprint
        vertices_mm, faces = tidy(carve(shaken, shape, plates))
        faults, figures = examine_mesh(vertices_mm, faces, expected_euler=2)
        if figures is not None and not faults:
            return vertices_mm, faces, figures, jitter_mm
    raise InputError(
        f"No sound solid after {ATTEMPTS} builds of this outline with tilt {shape.tilt}: {faults[0]} "
        "Retrace the crack near there, or choose another tilt."
    )


def _shaken(crack: CrossSection, by_mm: float, rng: np.random.Generator) -> CrossSection:
    rings = [ring + rng.uniform(-by_mm, by_mm, ring.shape) for ring in crack.to_polygons()]
    return CrossSection(rings, FillRule.Positive)


def _require_volume(readings: dict[str, Any], shape: CrackShape) -> None:
    volume_mm3 = readings["volume_mm3"][shape.tilt]
    if volume_mm3 >= SMALLEST_CAVITY_MM3:
        return
    # Only a funnel takes room away; otherwise the crack itself is too shallow or too small.
    closes = shape.tilt == "funnel" and readings["volume_mm3"]["vertical"] >= SMALLEST_CAVITY_MM3
    remedy = (
        'Reduce wall_angle_deg or choose tilt = "flare" or "lean".'
        if closes
        else "Check depth_mm and the photo's scale."
    )
    raise InputError(
        f"At {_angles(shape)} and {shape.deepest_mm:g} mm deep, tilt {shape.tilt} leaves a cavity of "
        f"{volume_mm3:.2g} mm³, less than {SMALLEST_CAVITY_MM3:g}: nothing to fill. {remedy}"
    )


def _require_agreement(cavity_mm3: float, readings: dict[str, Any], footprint: Footprint, shape: CrackShape) -> None:
    integral_mm3 = readings["volume_mm3"][shape.tilt]
    if abs(cavity_mm3 / integral_mm3 - 1) > CAVITY_TOLERANCE:
        integral_mm3 = cavity_volume_mm3(footprint, shape, FINER)
    if abs(cavity_mm3 / integral_mm3 - 1) > CAVITY_TOLERANCE:
        raise InputError(
            f"The mesh's cavity holds {cavity_mm3:.6g} mm³, the sections of its outline {integral_mm3:.6g} mm³: they "
            f"may differ by {CAVITY_TOLERANCE:.1%}. Reduce floor_thickness_mm and margin_mm, or choose another tilt."
        )


def _tilt_warnings(outline: Outline, footprint: Footprint, shape: CrackShape, readings: dict[str, Any]) -> list[str]:
    closing = readings["closing_depth_mm"]
    if shape.tilt != "funnel" or closing["share_above_floor"] == 0:
        return []
    depth_mm = f"{shape.deepest_mm:g} mm" if footprint.floor is None else f"of up to {shape.deepest_mm:g} mm"
    steepest_deg = np.degrees(np.arctan(outline.mean_width_mm / (2 * shape.deepest_mm)))
    return [
        f"At {_angles(shape)} the walls meet at {closing['mean']:.1f} mm on average, above the requested depth "
        f"{depth_mm} along {closing['share_above_floor']:.0%} of the crack; volume "
        f"{readings['volume_mm3']['funnel'] / 1000:.2f} ml. Reduce the angle below {steepest_deg:.1f}°, choose "
        'tilt = "flare" or "lean", or accept the V.'
    ]


def _angles(shape: CrackShape) -> str:
    left_deg, right_deg = shape.wall_angles_deg
    return f"{left_deg:g}°" if left_deg == right_deg else f"{left_deg:g}° left and {right_deg:g}° right"


def _dam_volume_mm3(plates: tuple[Dam, ...], height_mm: float) -> float:
    area = CrossSection()
    for plate in plates:
        area += rectangle(plate.box_mm)
    return area.area() * height_mm


def _dam_report(plate: Dam, bottom_mm: float, top_mm: float) -> dict[str, Any]:
    x_min, y_min, x_max, y_max = plate.box_mm
    return {"end": plate.end, "box_mm": [x_min, y_min, bottom_mm, x_max, y_max, top_mm]}
