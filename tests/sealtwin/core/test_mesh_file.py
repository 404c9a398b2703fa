"""Mesh files of other programs are read as written, or refused with the name of the file and its format."""

import json
import os
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from sealtwin.core.errors import InputError
from sealtwin.core.mesh_file import READERS, Triangles, read_mesh

CORNERS = np.array([[0, 0, 0], [20, 0, 0], [20, 10, 0], [0, 10, 0], [0, 0, 5], [20, 0, 5], [20, 10, 5], [0, 10, 5]])
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
HALVES = [(a, b, c) for a, b, c, _ in SIDES] + [(a, c, d) for a, _, c, d in SIDES]


def box() -> trimesh.Trimesh:
    """20 x 10 x 5 with one corner at the origin, as another library writes it."""
    mesh = trimesh.creation.box((20.0, 10.0, 5.0))
    mesh.apply_translation((10.0, 5.0, 2.5))
    return mesh


def written(mesh: trimesh.Trimesh | trimesh.Scene, kind: str, **options: Any) -> bytes:
    content: Any = mesh.export(file_type=kind, **options)
    return content.encode() if isinstance(content, str) else bytes(content)


def big_endian_ply(faces: Sequence[Sequence[int]] = HALVES) -> bytes:
    """Big-endian, with colours that are skipped and an element that is not read."""
    header = (
        "ply\nformat binary_big_endian 1.0\ncomment by hand\nelement camera 1\nproperty float focus\n"
        "element vertex 8\nproperty uchar red\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_index\nproperty uchar flags\nend_header\n"
    )
    vertices = b"".join(struct.pack(">B3d", 7, *corner) for corner in CORNERS)
    rows = b"".join(struct.pack(f">B{len(face)}iB", len(face), *face, 0) for face in faces)
    return header.encode() + struct.pack(">f", 50.0) + vertices + rows


SAMPLES: dict[str, Callable[[], tuple[str, bytes]]] = {
    "binary STL": lambda: (".stl", written(box(), "stl")),
    "text STL": lambda: (".stl", written(box(), "stl_ascii")),
    "binary PLY": lambda: (".ply", written(box(), "ply")),
    "text PLY": lambda: (".ply", written(box(), "ply", encoding="ascii")),
    "big-endian PLY": lambda: (".ply", big_endian_ply()),
    "GLB": lambda: (".glb", written(box(), "glb")),
}


def read(folder: Path, suffix: str, content: bytes, **options: str) -> Triangles:
    path = folder / f"sample{suffix}"
    path.write_bytes(content)
    return read_mesh(path, **options)


def volume_of(mesh: Triangles) -> float:
    """Return the volume; faces that look inward make it negative."""
    return float(np.linalg.det(mesh.vertices[mesh.faces]).sum()) / 6


@pytest.mark.parametrize("sample", SAMPLES)
def test_a_box_in_each_mesh_format_is_read_with_its_corners_and_volume(tmp_path, sample):
    assert {make()[0] for make in SAMPLES.values()} == set(READERS)
    mesh = read(tmp_path, *SAMPLES[sample]())
    assert len(mesh.faces) == 12
    assert volume_of(mesh) == pytest.approx(1000.0)
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [[0, 0, 0], [20, 10, 5]], atol=1e-6)


def test_a_text_ply_is_read_in_double_precision(tmp_path):
    """Its header declares float, whose step at 0.1 is 7e-9."""
    text = (PLY.format("ascii", 3, 1) + LIST).encode() + b"0.1 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    assert read(tmp_path, ".ply", text).vertices[0, 0] == 0.1


def test_the_mesh_of_a_mirrored_glb_node_is_moved_with_its_faces_outward(tmp_path):
    mirror = np.diag([-1.0, 2.0, 1.0, 1.0])
    mirror[:3, 3] = 1.0, 2.0, 3.0
    scene = trimesh.Scene()
    scene.add_geometry(box(), transform=mirror)
    mesh = read(tmp_path, ".glb", written(scene, "glb"))
    assert mesh.vertices.min(axis=0) == pytest.approx([-19, 2, 3])
    assert volume_of(mesh) == pytest.approx(2000.0)


def glb(description: object, binary: bytes = b"") -> bytes:
    text = json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def one_mesh(**changes: object) -> dict[str, object]:
    """A GLB scene of one triangle, with parts of it replaced."""
    return {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
    } | changes


HUGE = 4_000_000_000
PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n"
LIST = "property list uchar int vertex_indices\nend_header\n"
# fmt: off
REFUSED = {
    "an empty file": (".stl", b""),
    "a binary STL that claims 4 billion triangles": (".stl", bytes(80) + struct.pack("<I", HUGE) + bytes(50)),
    "a text STL whose second solid has no end": (".stl",
        b"solid a\n" + 3 * b"vertex 1 2 3\n" + b"endsolid\nsolid b\n" + 3 * b"vertex 1 2 3\n"),
    "a coordinate that is nan": (".stl", written(box(), "stl_ascii").replace(b"20.0", b"nan")),
    "a PLY that claims 4 billion vertices": (".ply", (PLY.format("ascii", HUGE, 1) + LIST).encode()),
    "a face that names a vertex beyond all numbers": (".ply",
        (PLY.format("ascii", 3, 1) + LIST).encode() + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 99999999999\n"),
    "a GLB whose buffer is another file": (".glb",
        glb(one_mesh(buffers=[{"byteLength": 36, "uri": "/etc/passwd"}]), bytes(36))),
    "a GLB shorter than it claims": (".glb",
        glb(one_mesh(accessors=[{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": HUGE}]), bytes(36))),
    "a GLB with circular nodes": (".glb", glb(one_mesh(nodes=[{"children": [0, 0]}]), bytes(36))),
    "a PLY of polygons": (".ply", big_endian_ply(SIDES)),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_content_that_is_no_mesh_is_refused_with_file_and_format(tmp_path, name):
    suffix, content = REFUSED[name]
    with pytest.raises(InputError) as refusal:
        read(tmp_path, suffix, content, remedy="Digitise again.")
    assert str(refusal.value).startswith(f"{tmp_path / 'sample'}{suffix}: not a readable {suffix[1:].upper()}: ")
    assert str(refusal.value).endswith("Digitise again.")


@pytest.mark.parametrize(
    ("suffix", "remedy"),
    [(".gltf", "GLB"), (".obj", "STL"), (".3mf", "PLY"), (".step", "triangles"), (".png", "STL")],
)
def test_an_unsupported_mesh_format_is_refused_with_a_remedy(tmp_path, suffix, remedy):
    with pytest.raises(InputError, match=rf"sample{suffix}: .*{remedy}"):
        read(tmp_path, suffix, b"")


@pytest.mark.parametrize(("size", "fault"), [(200_000_001, ": the file has 200 MB"), (None, "")])
def test_an_oversized_or_missing_mesh_file_is_refused(tmp_path, size, fault):
    if size:
        (tmp_path / "scan.stl").touch()
        os.truncate(tmp_path / "scan.stl", size)
    with pytest.raises(InputError, match=rf"scan\.stl{fault}"):
        read_mesh(tmp_path / "scan.stl")


@pytest.mark.parametrize("sample", SAMPLES)
def test_a_damaged_mesh_file_is_read_or_refused_without_another_exception(tmp_path, sample):
    """Bytes are changed, removed and inserted in 150 copies of the file."""
    suffix, content = SAMPLES[sample]()
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(150):
        damaged = bytearray(content)
        for _ in range(rng.integers(1, 6)):
            i = int(rng.integers(len(damaged)))
            match rng.integers(4):
                case 0:
                    damaged[i] = rng.integers(256)
                case 1:
                    del damaged[i : i + int(rng.integers(1, 40))]
                case 2:
                    damaged[i:i] = rng.bytes(int(rng.integers(1, 9)))
                case 3:
                    damaged[i] ^= 1 << int(rng.integers(8))
        try:
            read(tmp_path, suffix, bytes(damaged))
        except InputError:
            refused += 1
    assert refused > 10
