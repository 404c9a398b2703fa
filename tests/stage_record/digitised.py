"""Small outputs of digitise: walls and widths traced in a drawn photo, the solid in each tilt, the nozzle path."""

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import trimesh

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.settings import CrackShape, NozzlePath, Tilt
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.records import Outline
from tests.pictures import evenly_scaled, mortar, with_crack, write_png
from tests.shapes import outline_between, wandering_crack
from tests.stage_record.sampled import Nudge, Outputs, sampled

ENDS_PX = (20.0, 82.0), (200.0, 80.0)


def traced(nudge: Nudge) -> Outputs:
    return {name: sampled(values) for name, values in _walls(nudge).items()}


def solids(nudge: Nudge) -> Outputs:
    return {name: sampled(values) for name, values in {**_solids(nudge), **_path(nudge)}.items()}


def _walls(nudge: Nudge) -> dict[str, Any]:
    drawn = with_crack(mortar((220, 160)), [(20, 82), (80, 70), (140, 96), (200, 80)], 18)
    with tempfile.TemporaryDirectory() as place:
        photo = evenly_scaled(write_png(Path(place) / "crack.png", drawn))
    photo = replace(photo, brightness=nudge(photo.brightness).astype(photo.brightness.dtype))
    found = find_path(photo, ENDS_PX)
    outline = trace_outline(photo, found)
    return {
        "left wall": outline.left_wall_mm,
        "right wall": outline.right_wall_mm,
        "width": outline.width_mm,
        "centreline": outline.centreline_mm,
    }


def _solids(nudge: Nudge) -> dict[str, Any]:
    outline, found = _nudged(wandering_crack(), nudge), dict[str, Any]()
    for tilt in get_args(Tilt):
        solid = build_solid(outline, CrackShape.model_validate({"depth_mm": 12.0, "tilt": tilt}))
        # Not the vertices themselves: rounding gives them another order, and cuts a plane into other triangles.
        mesh = trimesh.Trimesh(solid.vertices_mm, solid.faces, process=False)
        found[f"{tilt}: bounds and centroid"] = [*mesh.bounds.ravel(), *mesh.center_mass]
        found[f"{tilt}: inertia"] = mesh.moment_inertia
        found[f"{tilt}: area and volume"] = [mesh.area, mesh.volume]
        found[f"{tilt}: cavity and sections"] = [solid.cavity_volume_mm3, *solid.sections.area_mm2[::40]]
    return found


def _path(nudge: Nudge) -> dict[str, Any]:
    path = NozzlePath(volume_ml=0.3, speed_mm_s=5.0, trim_mm=1.0)
    planned = plan_trajectory(_nudged(wandering_crack(), nudge), path, 300.0)
    return {"path: place": planned.position_mm, "path: time": planned.t_s, "path: flow": planned.flow_mm3_s}


def _nudged(outline: Outline, nudge: Nudge) -> Outline:
    """Return the crack a rounding larger or smaller: points that coincide stay together."""
    roundings = nudge(np.ones(100)) - 1
    # One draw alone may be three times as large, and so would be the tolerance of the record.
    size = 1 + float(np.sign(roundings[0]) * np.sqrt(np.mean(roundings**2)))
    lines = size * outline.centreline_mm, size * outline.left_wall_mm, size * outline.right_wall_mm
    return outline_between(*lines, outline.ends, outline.face_mm)
