"""Mesh files of other programs are read as written, or refused with the name of the file and its format."""

import importlib.util
import io
import json
import os
import struct
import zipfile
from collections.abc import Callable, Iterable, Sequence
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


def three_mf(unit: str = "millimeter", scale: float = 1.0, xml: str | None = None) -> bytes:
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in CORNERS)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in HALVES)
    xml = xml or (
        f'<?xml version="1.0"?><model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f'<resources><object id="1"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>'
        '</object><object id="2"><components><component objectid="1"/></components></object></resources>'
        f'<build><item objectid="2" transform="{scale} 0 0 0 {scale} 0 0 0 {scale} 0 0 0"/></build></model>'
    )
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", xml)
    return packed.getvalue()


def counted_obj(faces: Sequence[Sequence[int]] = HALVES) -> bytes:
    lines = ["mtllib ../../secret.mtl", *(f"  v {x} {y} {z}" for x, y, z in CORNERS), "usemtl steel"]
    # Two ways of counting: from the first vertex, and backward from the last.
    lines += ["f " + " ".join(f"{i + 1}/1/1" for i in face) for face in faces[:3]]
    lines += ["f " + " ".join(str(i - 8) for i in face) for face in faces[3:]]
    return "\n".join([*lines, "v 0 0 0"]).encode()


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
    "OBJ": lambda: (".obj", written(box(), "obj")),
    "OBJ counted in two ways": lambda: (".obj", counted_obj()),
    "GLB": lambda: (".glb", written(box(), "glb")),
    "3MF": lambda: (".3mf", three_mf()),
}


needs_lxml = pytest.mark.skipif(importlib.util.find_spec("lxml") is None, reason="needs lxml, of sealtwin[3mf]")


def needing(names: Iterable[str]) -> list[Any]:
    """Names of cases; those of 3MF need an extra, which a plain installation lacks."""
    return [pytest.param(name, marks=[needs_lxml] if "3MF" in name else []) for name in names]


def read(folder: Path, suffix: str, content: bytes, **options: str) -> Triangles:
    path = folder / f"sample{suffix}"
    path.write_bytes(content)
    return read_mesh(path, **options)


def volume_of(mesh: Triangles) -> float:
    """Return the volume; faces that look inward make it negative."""
    return float(np.linalg.det(mesh.vertices[mesh.faces]).sum()) / 6


@pytest.mark.parametrize("sample", needing(SAMPLES))
def test_a_box_in_each_mesh_format_is_read_with_its_corners_and_volume(tmp_path, sample):
    assert {make()[0] for make in SAMPLES.values()} == set(READERS)
    mesh = read(tmp_path, *SAMPLES[sample]())
    assert len(mesh.faces) == 12
    assert volume_of(mesh) == pytest.approx(1000.0)
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [[0, 0, 0], [20, 10, 5]], atol=1e-6)


@needs_lxml
@pytest.mark.parametrize(("unit", "unit_mm"), [("millimeter", 1.0), ("inch", 25.4)])
def test_the_unit_and_the_transform_of_a_3mf_part_are_read(tmp_path, unit, unit_mm):
    mesh = read(tmp_path, ".3mf", three_mf(unit, scale=2.0))
    assert mesh.unit_mm == unit_mm
    assert mesh.vertices.max(axis=0) == pytest.approx([40, 20, 10])


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
    "a face that names a vertex beyond all numbers": (".obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999"),
    "a GLB whose buffer is another file": (".glb",
        glb(one_mesh(buffers=[{"byteLength": 36, "uri": "/etc/passwd"}]), bytes(36))),
    "a GLB shorter than it claims": (".glb",
        glb(one_mesh(accessors=[{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": HUGE}]), bytes(36))),
    "a GLB with circular nodes": (".glb", glb(one_mesh(nodes=[{"children": [0, 0]}]), bytes(36))),
    "a 3MF with expanding entities": (".3mf",
        three_mf(xml='<!DOCTYPE m [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]><model>&b;</model>')),
    "an OBJ of polygons": (".obj", counted_obj(SIDES)),
    "a PLY of polygons": (".ply", big_endian_ply(SIDES)),
    "a 3MF with circular components": (".3mf",
        three_mf(xml='<model><object id="1"><component objectid="1"/><component objectid="1"/></object>'
            '<build><item objectid="1"/></build></model>')),
}
# fmt: on


@pytest.mark.parametrize("name", needing(REFUSED))
def test_the_error_for_content_that_is_not_a_mesh_names_file_and_format(tmp_path, name):
    suffix, content = REFUSED[name]
    with pytest.raises(InputError) as refusal:
        read(tmp_path, suffix, content, remedy="Digitise again.")
    assert str(refusal.value).startswith(f"{tmp_path / 'sample'}{suffix}: not a readable {suffix[1:].upper()}: ")
    assert str(refusal.value).endswith("Digitise again.")


@pytest.mark.parametrize(
    ("suffix", "remedy"), [(".gltf", "GLB"), (".step", "triangles"), (".las", "mesh"), (".png", "STL")]
)
def test_an_unsupported_mesh_format_is_refused_with_a_remedy(tmp_path, suffix, remedy):
    with pytest.raises(InputError, match=rf"sample{suffix}: .*{remedy}"):
        read(tmp_path, suffix, b"")


def test_a_3mf_without_lxml_is_refused_with_a_remedy(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"sample\.3mf: .*sealtwin\[3mf\].*STL"):
        read(tmp_path, ".3mf", three_mf())


@needs_lxml
def test_an_oversized_3mf_is_refused_before_unpacking(tmp_path, monkeypatch):
    monkeypatch.setattr("sealtwin.core.mesh_file.LARGEST_MODEL", 1_000_000)
    bomb = three_mf(xml=" " * 2_000_000)
    assert len(bomb) < 4000
    with pytest.raises(InputError, match=r"2000000 bytes after unpacking, but at most 1000000"):
        read(tmp_path, ".3mf", bomb)
    # If the archive states a wrong size, only that much is unpacked, and the checksum fails.
    with pytest.raises(InputError, match="CRC"):
        read(tmp_path, ".3mf", bomb.replace(struct.pack("<I", 2_000_000), struct.pack("<I", 900)))


@pytest.mark.parametrize(("size", "fault"), [(200_000_001, ": the file has 200 MB"), (None, "")])
def test_an_oversized_or_missing_mesh_file_is_refused(tmp_path, size, fault):
    if size:
        (tmp_path / "scan.stl").touch()
        os.truncate(tmp_path / "scan.stl", size)
    with pytest.raises(InputError, match=rf"scan\.stl{fault}"):
        read_mesh(tmp_path / "scan.stl")


@pytest.mark.parametrize("sample", needing(SAMPLES))
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
