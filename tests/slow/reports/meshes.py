"""Meshes."""

import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from tests.slow.reports.table import LONG_SLOT_MM3, MESH, MM3, SLOT, TO, refused, report, right, warned
from tests.support.meshes import box, mesh_of, slotted


def obj_of_polygons(folder: Path) -> None:
    """A block of 100 x 40 x 20 mm in polygons as modellers write it; a slot of 60 x 4 x 10 mm, open at one end.

    Its top and one side are concave: a fan from the first corner covers the slot.
    """
    top = [(0, 0), (100, 0), (100, 18), (40, 18), (40, 22), (100, 22), (100, 40), (0, 40)]
    corners = [(*point, 0) for point in top] + [(*top[i], -20) for i in (0, 1, 6, 7)]
    corners += [(*top[i], -10) for i in (2, 3, 4, 5)]
    a, b, c, d, e, f, g, h, a0, b0, g0, h0, cs, ds, es, fs = range(1, 17)
    faces = [
        (a, b, c, d, e, f, g, h),
        (b, a, a0, b0),
        (a, h, h0, a0),
        (h, g, g0, h0),
        (c, b, b0, g0, g, f, fs, cs),
        (d, c, cs, ds),
        (e, d, ds, es),
        (f, e, es, fs),
        (ds, cs, fs, es),
        (a0, h0, g0, b0),
    ]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {' '.join(map(str, face))}" for face in faces]
    (folder / "block.obj").write_text("\n".join(lines) + "\n")


def slotted_mesh(standing: bool = False) -> Any:
    """The slotted block in mm; ``standing``: in m, with y upward as a GLB has it."""
    vertices, faces = mesh_of(slotted())
    if standing:
        vertices = vertices[:, [0, 2, 1]] * (0.001, 0.001, -0.001)
    return trimesh.Trimesh(vertices, faces, process=False)


def write_three_mf(folder: Path, unit: str, build: str, further: str = "") -> None:
    """Write block.3mf: the slotted block as object 1, with a tenth of its mm as numbers, and ``further`` objects."""
    mesh = slotted_mesh()
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices / 10)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces)
    head = '<?xml version="1.0" encoding="UTF-8"?>'
    model = (
        f'{head}<model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1" type="model"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>'
        f"</object>{further}</resources><build>{build}</build></model>"
    )
    of_package = "http://schemas.openxmlformats.org/package/2006"
    kinds = (
        f'{head}<Types xmlns="{of_package}/content-types"><Default Extension="rels" ContentType="application/vnd.'
        'openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.'
        '3dmanufacturing-3dmodel+xml"/></Types>'
    )
    links = (
        f'{head}<Relationships xmlns="{of_package}/relationships"><Relationship Target="/3D/3dmodel.model" Id="r0" '
        'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
    )
    with zipfile.ZipFile(folder / "block.3mf", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", kinds)
        archive.writestr("_rels/.rels", links)
        archive.writestr("3D/3dmodel.model", model)


def _write_obj(path: Path, *parts: str) -> None:
    """Write the slotted block's faces in as many parts, each behind its lines."""
    vertices, faces = mesh_of(slotted())
    lines = [f"v {x} {y} {z}" for x, y, z in vertices]
    for head, share in zip(parts, np.array_split(faces + 1, len(parts)), strict=True):
        lines += [head, *(f"f {a} {b} {c}" for a, b, c in share)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


# Concave polygons of an OBJ are cut into a fan that covers their notches.
report(
    "mikedh/trimesh/pull/2560",
    MESH("obj"),
    SLOT,
    refused("block.obj", "polygon|concave|more than three corners|triangles"),
)(obj_of_polygons)


@report("assimp/assimp/issues/4976", MESH("glb"), SLOT, refused("block.glb", "inside out|mirror|negative"))
def glb_mirrored(folder: Path) -> None:
    """A node scaled by -1 turns the mesh inside out."""
    scene = trimesh.Scene()
    scene.add_geometry(slotted_mesh(), transform=np.diag([-1.0, 1.0, 1.0, 1.0]))
    scene.export(folder / "block.glb")


@report(
    "prusa3d/PrusaSlicer/issues/15842",
    MESH("3mf"),
    refused("block.3mf", "centimeter|unit is cm"),
    warned("centimeter|unit is cm"),
    SLOT,
)
def three_mf_in_cm(folder: Path) -> None:
    """A 3MF that states centimetres is taken as millimetres."""
    write_three_mf(folder, "centimeter", '<item objectid="1"/>')


@report(
    "mrdoob/three.js/issues/14937",
    MESH("ply"),
    refused("block.ply", "cut short|ends early|ends before|truncated|fewer|shorter|header|length"),
    right(MM3, LONG_SLOT_MM3, 24, "repair|filled|closed|missing"),
)
def ply_cut_short(folder: Path) -> None:
    """A PLY with fewer faces than its header says loads as nothing."""
    mesh = slotted_mesh()
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(mesh.faces)}\nproperty list uchar int vertex_indices\n"
        "end_header\n"
    )
    points = mesh.vertices.astype("<f4").tobytes()
    faces = b"".join(struct.pack("<Biii", 3, *face) for face in mesh.faces[:-3])
    (folder / "block.ply").write_bytes(header.encode() + points + faces)


@report(
    "Genesis-Embodied-AI/genesis-world/pull/2237",
    f"import-mesh block.glb --units m {TO}",
    SLOT,
    refused("block.glb", "mesh.up|y-up|axis"),
)
def glb_y_up(folder: Path) -> None:
    """A GLB is y upward by its specification, and lies on its side where z is up."""
    slotted_mesh(standing=True).export(folder / "block.glb")


@report("openscad/openscad/issues/945", MESH("stl"), SLOT, refused("block.stl", "area|degenerate|flat"))
def stl_with_flat_triangles(folder: Path) -> None:
    """Triangles without area, on an edge that is cut in two, make a sound solid unreadable."""
    mesh = slotted_mesh()
    a, b, c = mesh.faces[0]
    middle = len(mesh.vertices)
    vertices = np.vstack([mesh.vertices, (mesh.vertices[a] + mesh.vertices[b]) / 2])
    faces = np.vstack([mesh.faces[1:], [(a, middle, c), (middle, b, c), (a, b, middle)]])
    trimesh.Trimesh(vertices, faces, process=False).export(folder / "block.stl")


@report("lemgandi/3mf2stl/issues/3", MESH("3mf"), SLOT, refused("block.3mf", "transform|build"))
def three_mf_scaled_by_its_build(folder: Path) -> None:
    """The transform that a 3MF's build has for its object is not applied."""
    write_three_mf(folder, "millimeter", '<item objectid="1" transform="10 0 0 0 10 0 0 0 10 0 0 0"/>')


@report("tinyobjloader/tinyobjloader/pull/235", MESH("obj"), SLOT)
def obj_of_two_objects(folder: Path) -> None:
    """Of two objects one is skipped where a material is named before the object."""
    _write_obj(folder / "block.obj", "usemtl stone\no Block.001", "usemtl wall\no Block")


@report(
    "andymai/gridfinity-layout-tool/pull/1493",
    MESH("stl"),
    SLOT,
    refused("block.stl", "wind|orient|inside out|turned|direction"),
)
def stl_of_mixed_winding(folder: Path) -> None:
    """A sixth of the triangles is wound the other way, and the volume is wrong."""
    mesh = slotted_mesh()
    faces = mesh.faces.copy()
    faces[::6] = faces[::6, ::-1]
    trimesh.Trimesh(mesh.vertices, faces, process=False).export(folder / "block.stl")


@report(
    "openscad/openscad/issues/1107",
    MESH("stl"),
    SLOT,
    refused("block.stl", "overlap|intersect|bodies|shells|parts|pieces"),
)
def stl_of_overlapping_bodies(folder: Path) -> None:
    """Bodies that overlap are exported as they are, with faces inside each other."""
    slot = box((20.0, 18.0, -10.0), (80.0, 22.0, 1.0))
    parts = [box((low, 0.0, -20.0), (high, 40.0, 0.0)) - slot for low, high in ((0.0, 60.0), (40.0, 100.0))]
    bodies = [trimesh.Trimesh(*mesh_of(part), process=False) for part in parts]
    trimesh.util.concatenate(bodies).export(folder / "block.stl")


@report("bambulab/BambuStudio/issues/11745", MESH("3mf"), SLOT, refused("block.3mf", "component|transform"))
def three_mf_of_a_component(folder: Path) -> None:
    """Transforms of a 3MF's components and items are not those of its unit."""
    transform = 'transform="10 0 0 0 10 0 0 0 10 0 0 0"'
    component = f'<component objectid="1" {transform}/>'
    further = f'<object id="2" type="model"><components>{component}</components></object>'
    write_three_mf(folder, "millimeter", '<item objectid="2"/>', further)


@report("cnr-isti-vclab/meshlab/issues/1281", MESH("stl"), SLOT, refused("block.stl", "triangles|faces|header|length"))
def stl_without_its_count(folder: Path) -> None:
    """A binary STL whose writer left the number of triangles at 0."""
    path = folder / "block.stl"
    slotted_mesh().export(path)
    content = path.read_bytes()
    path.write_bytes(content[:80] + struct.pack("<I", 0) + content[84:])


@report("cnr-isti-vclab/corto/issues/32", MESH("ply"), SLOT, refused("block.ply", "polygon|corners|triangles|concave"))
def ply_of_polygons(folder: Path) -> None:
    """A PLY of quads is not read as one."""
    obj_of_polygons(folder)
    lines = [line.split() for line in (folder / "block.obj").read_text(encoding="utf-8").splitlines()]
    (folder / "block.obj").unlink()
    corners = [line[1:] for line in lines if line[0] == "v"]
    faces = [[str(int(corner) - 1) for corner in line[1:]] for line in lines if line[0] == "f"]
    head = ["ply", "format ascii 1.0", f"element vertex {len(corners)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "s", "t")]
    head += [f"element face {len(faces)}", "property list uchar uint vertex_indices", "end_header"]
    rows = [" ".join([*corner, "0 0 1 0.5 0.5"]) for corner in corners]
    rows += [" ".join([str(len(face)), *face]) for face in faces]
    (folder / "block.ply").write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
