"""Public reports on meshes."""

import struct
from pathlib import Path
from typing import Any

import trimesh

from tests.slow.reports.table import LONG_SLOT_MM3, MESH, MM3, SLOT, TO, refused, report, right
from tests.support.meshes import mesh_of, slotted


def slotted_mesh(standing: bool = False) -> Any:
    """The slotted block in mm; ``standing``: in m, with y upward as a GLB has it."""
    vertices, faces = mesh_of(slotted())
    if standing:
        vertices = vertices[:, [0, 2, 1]] * (0.001, 0.001, -0.001)
    return trimesh.Trimesh(vertices, faces, process=False)


@report(
    "mrdoob/three.js/issues/14937",
    MESH("ply"),
    refused("block.ply", "cut short|ends early|ends before|truncated|fewer|shorter|header|length"),
    right(MM3, LONG_SLOT_MM3, 24, "repair|filled|closed|missing"),
)
def ply_cut_short(folder: Path) -> None:
    """A PLY with fewer faces than its header states is read as an empty mesh."""
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
    f"digitise block.glb --units m {TO}",
    SLOT,
    refused("block.glb", "mesh.up|y-up|axis"),
)
def glb_y_up(folder: Path) -> None:
    """A GLB is y upward by its specification, so that a program with z upward turns it on its side."""
    slotted_mesh(standing=True).export(folder / "block.glb")
