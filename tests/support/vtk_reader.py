"""A reader of VTK's XML files of its own, after the format's description and not after our writer.

Source: VTK User's Guide, "VTK XML Format". Whatever it does not know it refuses.
"""

import re
import struct
import xml.sax
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

NUMBERS = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4", "Int64": "i8",
    "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
HEADERS = {"UInt32": ("I", 4), "UInt64": ("Q", 8)}


@dataclass
class PolyData:
    points: NDArray[Any]
    point_data: dict[str, NDArray[Any]]
    field_data: dict[str, NDArray[Any]]
    vertices: list[list[int]]
    """Points of each vertex cell."""
    active: dict[str, str] = field(default_factory=dict)


class _Tree(xml.sax.ContentHandler):
    """Elements in their order, each with the way down to it and its text."""

    def __init__(self) -> None:
        super().__init__()
        self.way: list[str] = []
        self.elements: list[tuple[str, dict[str, str], list[str]]] = []
        self._open: list[list[str]] = []

    def startElement(self, name: str, attrs: Any) -> None:  # noqa: N802
        self.way.append(name)
        text: list[str] = []
        self._open.append(text)
        self.elements.append(("/".join(self.way), dict(attrs.items()), text))

    def characters(self, content: str) -> None:
        self._open[-1].append(content)

    def endElement(self, name: str) -> None:  # noqa: N802
        self.way.pop()
        self._open.pop()


def read_polydata(path: Path) -> PolyData:
    content = path.read_bytes()
    # Appended raw data follow an underscore and are no XML; the tags behind them are.
    opening = re.search(rb'<AppendedData\s+encoding="raw"\s*>\s*_', content)
    assert opening is not None, "no raw appended data"
    closing = content.rindex(b"</AppendedData>")
    data = content[opening.end() : closing]
    tree = _Tree()
    xml.sax.parseString(content[: opening.end()] + content[closing:], tree)
    ((_, root, _),) = [one for one in tree.elements if one[0] == "VTKFile"]
    assert root["type"] == "PolyData"
    assert "compressor" not in root
    order = {"LittleEndian": "<", "BigEndian": ">"}[root["byte_order"]]
    letter, width = HEADERS[root["header_type"]]

    def values(attributes: dict[str, str], text: list[str]) -> NDArray[Any]:
        dtype = np.dtype(order + NUMBERS[attributes["type"]])
        if attributes["format"] == "ascii":
            flat = np.array("".join(text).split(), dtype=dtype)
        else:
            assert attributes["format"] == "appended"
            begin = int(attributes["offset"])
            (size,) = struct.unpack_from(order + letter, data, begin)
            assert begin + width + size <= len(data), "beyond the end of the file"
            flat = np.frombuffer(data[begin + width : begin + width + size], dtype)
        columns = int(attributes.get("NumberOfComponents", 1))
        return flat.reshape(-1, columns) if columns > 1 else flat

    def under(way: str) -> dict[str, NDArray[Any]]:
        return {a["Name"]: values(a, text) for place, a, text in tree.elements if place == f"{way}/DataArray"}

    piece_way = "VTKFile/PolyData/Piece"
    ((_, piece, _),) = [one for one in tree.elements if one[0] == piece_way]
    ((_, active, _),) = [one for one in tree.elements if one[0] == f"{piece_way}/PointData"]
    (points,) = under(f"{piece_way}/Points").values()
    assert points.shape == (int(piece["NumberOfPoints"]), 3)
    point_data = under(f"{piece_way}/PointData")
    assert all(len(values) == len(points) for values in point_data.values())
    cells = under(f"{piece_way}/Verts")
    ends = cells["offsets"].tolist()
    assert len(ends) == int(piece["NumberOfVerts"])
    assert all(int(piece[f"NumberOf{kind}"]) == 0 for kind in ("Lines", "Strips", "Polys"))
    vertices = [cells["connectivity"][a:b].tolist() for a, b in zip([0, *ends], ends, strict=False)]
    return PolyData(points, point_data, under("VTKFile/PolyData/FieldData"), vertices, active)


def read_pvd(path: Path) -> list[tuple[float, Path]]:
    tree = _Tree()
    xml.sax.parseString(path.read_bytes(), tree)
    assert tree.elements[0][1]["type"] == "Collection"
    entries = [a for place, a, _ in tree.elements if place == "VTKFile/Collection/DataSet"]
    return [(float(entry["timestep"]), path.parent / entry["file"]) for entry in entries]
