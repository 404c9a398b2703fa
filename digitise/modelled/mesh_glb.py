"""GLB, the binary form of glTF 2.0: one file, metres, nothing outside it."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from digitise.modelled.triangles import Triangles, UnreadableError, refuse_too_many
from sealtwin.records import Floats

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
LARGEST_JSON = 20_000_000
"""It names nodes and buffers; the numbers lie in the other chunk."""
MOST_PIECES = 10_000
"""Of nodes, and of what their meshes consist of: a scan is one."""
DEEPEST_NODE = 64
KINDS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
TRIANGLES = 4
"""Of a primitive's modes; points and lines, 0 to 3, have no faces, strips and fans are 5 and 6."""


def read_glb(content: bytes) -> Triangles:
    """All meshes of the scene where its nodes place them. Colours and textures are not looked at."""
    scene, binary = _chunks(content)
    if required := scene.get("extensionsRequired"):
        raise UnreadableError(f"it needs the extension {required[0]}: save it uncompressed")
    corners = [np.empty((0, 3, 3))]
    looked_at = 0
    for mesh, placed in _placed_meshes(scene):
        for primitive in scene["meshes"][mesh]["primitives"]:
            looked_at += 1
            if looked_at > MOST_PIECES:
                raise UnreadableError(f"its meshes have more than {MOST_PIECES} parts: save them as one")
            mode = primitive.get("mode", TRIANGLES)
            if mode > TRIANGLES:
                raise UnreadableError("it holds triangle strips or fans: save it as triangles")
            if mode == TRIANGLES:
                corners.append(_transformed(_triangles(scene, binary, primitive), placed))
                refuse_too_many(sum(map(len, corners)))
    soup = np.concatenate(corners)
    return Triangles(soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3), "m")


def _chunks(content: bytes) -> tuple[dict[str, Any], bytes]:
    magic, version, length = content[:4], *np.frombuffer(content[4:12].ljust(8, b"\0"), "<u4").tolist()
    if magic != b"glTF" or version != 2 or length > len(content):
        raise UnreadableError("it does not begin as glTF 2 does, or ends early")
    found: dict[int, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = np.frombuffer(content, "<u4", 2, at).tolist()
        if at + 8 + size > length:
            raise UnreadableError("a chunk of it is longer than the file")
        found.setdefault(kind, content[at + 8 : at + 8 + size])
        at += 8 + size
    text = found.get(JSON_CHUNK, b"")
    if not 0 < len(text) <= LARGEST_JSON:
        raise UnreadableError(f"its description takes {len(text)} bytes, 1 to {LARGEST_JSON} are allowed")
    return json.loads(text), found.get(BINARY_CHUNK, b"")


def _placed_meshes(scene: dict[str, Any]) -> Iterator[tuple[int, Floats]]:
    """Number of each mesh in the scene and the transform, (4, 4), of the node that holds it."""
    roots = scene["scenes"][scene.get("scene", 0)].get("nodes", [])
    waiting = [(node, np.eye(4), 0) for node in roots]
    visited = 0
    while waiting:
        number, above, depth = waiting.pop()
        visited += 1
        if visited > MOST_PIECES or depth > DEEPEST_NODE or number < 0:
            raise UnreadableError("its nodes hang in a circle, or are too many")
        node = scene["nodes"][number]
        placed = above @ _local(node)
        if "mesh" in node:
            yield node["mesh"], placed
        waiting += [(child, placed, depth + 1) for child in node.get("children", [])]


def _local(node: dict[str, Any]) -> Floats:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T
    local = np.eye(4)
    x, y, z, w = node.get("rotation", [0.0, 0.0, 0.0, 1.0])
    local[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    local[:3, :3] *= np.array(node.get("scale", [1.0, 1.0, 1.0]), dtype=float).reshape(3)
    local[:3, 3] = np.array(node.get("translation", [0.0, 0.0, 0.0]), dtype=float).reshape(3)
    return local


def _transformed(corners: Floats, placed: Floats) -> Floats:
    moved = corners @ placed[:3, :3].T + placed[:3, 3]
    # A mirror turns faces inside out.
    return moved[:, ::-1] if np.linalg.det(placed[:3, :3]) < 0 else moved


def _triangles(scene: dict[str, Any], binary: bytes, primitive: dict[str, Any]) -> Floats:
    vertices = _accessed(scene, binary, primitive["attributes"]["POSITION"], "VEC3", 3)
    if "indices" in primitive:
        index = _accessed(scene, binary, primitive["indices"], "SCALAR", 1).reshape(-1)
    else:
        index = np.arange(len(vertices))
    refuse_too_many(len(index) // 3)
    if len(index) % 3 or (len(index) and index.max() >= len(vertices)):
        raise UnreadableError("its faces name vertices that are not there")
    return vertices[index.reshape(-1, 3)].astype(float)


def _accessed(scene: dict[str, Any], binary: bytes, number: int, kind: str, width: int) -> np.ndarray:
    """The rows of an accessor, (count, width): a view of the file, so that no count can ask for memory."""
    accessor = scene["accessors"][number]
    if accessor["type"] != kind or "sparse" in accessor or (kind == "VEC3" and accessor["componentType"] != 5126):
        raise UnreadableError("its numbers are packed in a way that is not read: save it uncompressed")
    view = scene["bufferViews"][accessor["bufferView"]]
    buffer = scene["buffers"][view["buffer"]]
    if view["buffer"] != 0 or "uri" in buffer:
        raise UnreadableError("it keeps its numbers in another file, which is not opened: save all in one GLB")
    row = np.dtype((KINDS[accessor["componentType"]], (width,)))
    stride = view.get("byteStride", row.itemsize)
    begin, count = view.get("byteOffset", 0) + accessor.get("byteOffset", 0), accessor["count"]
    if min(begin, count) < 0 or stride < row.itemsize or begin + (count - 1) * stride + row.itemsize > len(binary):
        raise UnreadableError("its description names more numbers than it holds")
    return np.ndarray((count, width), row.base, binary, begin, (stride, row.base.itemsize))
