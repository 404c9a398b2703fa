"""A reader of VTK's XML files of its own, after the format's description and not after our writer.

Source: VTK User's Guide, "VTK XML Format". Whatever it does not know it refuses.
"""

import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray


@dataclass
class PolyData:
    points: NDArray[Any]
    point_data: dict[str, NDArray[Any]]
    field_data: dict[str, NDArray[Any]]
    vertices: list[list[int]]
    """Points of each vertex cell."""
    active: dict[str, str]


def read_polydata(path: Path) -> PolyData:
    content = path.read_bytes()
    # Appended raw data follow an underscore and are no XML; the tags behind them are.
    opening = re.search(rb'<AppendedData\s+encoding="raw"\s*>\s*_', content)
    assert opening is not None, "no raw appended data"
    closing = content.rindex(b"</AppendedData>")
    data = content[opening.end() : closing]
    root = ElementTree.fromstring(content[: opening.end()] + content[closing:])
    assert (root.attrib["type"], root.get("compressor")) == ("PolyData", None)
    order = {"LittleEndian": "<", "BigEndian": ">"}[root.attrib["byte_order"]]
    header = order + {"UInt32": "I", "UInt64": "Q"}[root.attrib["header_type"]]

    def values(array: ElementTree.Element) -> NDArray[Any]:
        dtype = np.dtype(f"{order}{np.dtype(array.attrib['type'].lower()).str[1:]}")
        if array.attrib["format"] == "ascii":
            flat = np.array((array.text or "").split(), dtype=dtype)
        else:
            assert array.attrib["format"] == "appended"
            (size,) = struct.unpack_from(header, data, int(array.attrib["offset"]))
            begin = int(array.attrib["offset"]) + struct.calcsize(header)
            assert begin + size <= len(data), "beyond the end of the file"
            flat = np.frombuffer(data[begin : begin + size], dtype)
        columns = int(array.get("NumberOfComponents", 1))
        return flat.reshape(-1, columns) if columns > 1 else flat

    def under(way: str) -> dict[str, NDArray[Any]]:
        return {array.attrib["Name"]: values(array) for array in root.iterfind(f"PolyData/{way}/DataArray")}

    (piece,), (active,) = (root.findall(f"PolyData/Piece{way}") for way in ("", "/PointData"))
    (points,), point_data, cells = under("Piece/Points").values(), under("Piece/PointData"), under("Piece/Verts")
    assert points.shape == (int(piece.attrib["NumberOfPoints"]), 3)
    assert all(len(values) == len(points) for values in point_data.values())
    ends = cells["offsets"].tolist()
    assert len(ends) == int(piece.attrib["NumberOfVerts"])
    assert all(int(piece.attrib[f"NumberOf{kind}"]) == 0 for kind in ("Lines", "Strips", "Polys"))
    vertices = [cells["connectivity"][a:b].tolist() for a, b in zip([0, *ends], ends, strict=False)]
    return PolyData(points, point_data, under("FieldData"), vertices, active.attrib)


def read_pvd(path: Path) -> list[tuple[float, Path]]:
    root = ElementTree.parse(path).getroot()
    assert root.attrib["type"] == "Collection"
    entries = [entry.attrib for entry in root.iterfind("Collection/DataSet")]
    return [(float(entry["timestep"]), path.parent / entry["file"]) for entry in entries]
