"""Random outlines of every kind, made into solids with every tilt: whether each is sound.

    python -m benchmarks.solids [--outlines N] [--first SEED]

Plain, pinched, self-touching, tapered, branched and with islands; 50 to 300 mm long, traced in 200 to 2000 points.
Every second one is as deep and as steep as the paper's, the others from 6 to 25 mm deep and from 3 to 15 degrees steep.
Sound is what holds in memory and again in a file of float32: closed, facing outward, crossing itself nowhere, one piece
without a hole through it, its cavity with one for each island. An undercut without room is built with a smaller angle;
one whose parts all but touch at the face, for which there is none, is not counted.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import trimesh
from manifold3d import Manifold, Mesh64
from typer import Option

from benchmarks.outlines import KINDS, Kind, odd_outline
from benchmarks.table import Row, run_benchmark
from digitise.geometry.mesh_topology import examine_mesh, mesh_volume_mm3
from digitise.geometry.polyline import signed_area
from digitise.settings import CrackShape, Tilt
from digitise.solid.build_solid import build_solid
from digitise.solid.footprint import lay_out
from digitise.solid.sections import Slicer
from digitise.solid.wedges import wall_shifts_mm
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Outline, Solid

TILTS: tuple[Tilt, ...] = ("flare", "funnel", "undercut", "lean")
MEETS, SMALLEST_DEG, LESS = "parts of the crack meet", 0.1, 0.8
"""Words of a refused undercut, the least angle that is tried then, and the share of an angle that is tried next."""
BELOW_MM = 1e-6
"""Where the mouth's pieces and islands are counted."""


@dataclass(frozen=True)
class Built:
    kind: Kind
    seed: int
    tilt: Tilt
    faults: tuple[str, ...]
    shortest_mm: float = 0.0
    has_room: bool = True
    """False for an undercut that meets itself at SMALLEST_DEG."""


def main(
    outlines: Annotated[int, Option(help="how many, of all kinds together")] = 100,
    first: Annotated[int, Option(help="first seed: others than those that the tool was made with")] = 0,
) -> list[Row]:
    built = []
    for number in range(outlines):
        kind, seed = KINDS[number % len(KINDS)], first + number // len(KINDS)
        for tilt in TILTS:
            built.append(build(odd_outline(kind, seed), kind, seed, tilt))
            for fault in built[-1].faults:
                print(f"{kind} {seed}, {tilt}: {fault}")
    return rows(built)


def build(outline: Outline, kind: Kind, seed: int, tilt: Tilt) -> Built:
    """One solid, and all that is wrong with it."""
    shape = shape_of(seed, tilt)
    try:
        shape, solid = built_with_room(outline, shape)
    except InputError as fault:
        if MEETS in str(fault):
            return Built(kind, seed, tilt, (), has_room=False)
        return Built(kind, seed, tilt, (str(fault),))
    footprint = lay_out(outline, shape, max(wall_shifts_mm(shape)))
    faults = (*faults_of_the_file(solid), *faults_of_the_cavity(solid, Slicer(footprint, shape)))
    return Built(kind, seed, tilt, faults, present(solid.figures.min_edge_mm, "its shortest edge"))


def built_with_room(outline: Outline, shape: CrackShape) -> tuple[CrackShape, Solid]:
    try:
        return shape, build_solid(outline, shape)
    except InputError as fault:
        less_deg = LESS * shape.wall_angles_deg[0]
        if MEETS not in str(fault) or less_deg < SMALLEST_DEG:
            raise
    return built_with_room(outline, shape.model_copy(update={"wall_angle_deg": less_deg}))


def shape_of(seed: int, tilt: Tilt) -> CrackShape:
    if seed % 2 == 0:
        return CrackShape(depth_mm=16.0, tilt=tilt, wall_angle_deg=11.0)
    rng = np.random.default_rng(seed)
    return CrackShape(depth_mm=rng.uniform(6.0, 25.0), tilt=tilt, wall_angle_deg=rng.uniform(3.0, 15.0))


def faults_of_the_file(solid: Solid) -> list[str]:
    """Of a binary STL, which knows its vertices only by their float32 coordinates."""
    file = io.BytesIO()
    trimesh.Trimesh(solid.vertices_mm, solid.faces, process=False).export(file, file_type="stl")
    file.seek(0)
    stl = trimesh.load_mesh(file, file_type="stl")
    faults = examine_mesh(solid.vertices_mm, solid.faces, expected_euler=2)[0]
    faults += examine_mesh(np.array(stl.vertices, dtype=float), np.array(stl.faces, dtype=np.int64), expected_euler=2)[
        0
    ]
    if not (stl.is_watertight and stl.is_winding_consistent):
        faults.append("the STL is not watertight or its faces look both ways")
    off = abs(float(stl.volume) / mesh_volume_mm3(solid.vertices_mm, solid.faces) - 1)
    return faults if off < 1e-6 else [*faults, f"the STL's volume is off by {1e6 * off:.2g} ppm"]


def faults_of_the_cavity(solid: Solid, slicer: Slicer) -> list[str]:
    """The block less the solid: as large as it says, and for each piece of the mouth a ball, with a hole per island."""
    x_min, y_min, x_max, y_max = solid.block_mm
    bottom_mm = float(solid.vertices_mm[:, 2].min())
    block = Manifold.cube((x_max - x_min, y_max - y_min, -bottom_mm)).translate((x_min, y_min, bottom_mm))
    cavity = block - Manifold(Mesh64(solid.vertices_mm.copy(), solid.faces.astype(np.uint64)))
    pieces = [piece for piece in cavity.decompose() if piece.volume() > 1e-3]
    euler = sum(2 - 2 * piece.genus() for piece in pieces)
    mouth = slicer.between_walls(BELOW_MM).to_polygons()
    expected = 2 * sum(1 if signed_area(ring) > 0 else -1 for ring in mouth)
    faults = [] if euler == expected else [f"the cavity's Euler number is {euler}, not {expected}"]
    missing_mm3 = abs(cavity.volume() - solid.cavity_volume_mm3)
    if missing_mm3 > 1e-6 * block.volume():
        faults.append(f"cavity and solid are {missing_mm3:.2g} mm³ short of the block")
    return faults


def rows(built: Sequence[Built]) -> list[Row]:
    """The table: what is promised holds for the worst of each tilt."""
    table = []
    for tilt in TILTS:
        solids = [each for each in built if each.tilt == tilt and each.has_room]
        sound = sum(not each.faults for each in solids)
        # What was refused has no edges, and is missed by the count already.
        shortest_mm = min((each.shortest_mm for each in solids if each.shortest_mm), default=0.0)
        table += [
            Row(f"{tilt}: sound, of {len(solids)}", sound, "", len(solids), len(solids)),
            Row(f"{tilt}: shortest edge", shortest_mm, "mm", 1e-3, 1.0),
        ]
    return table


if __name__ == "__main__":
    run_benchmark(main)
