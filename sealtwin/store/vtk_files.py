"""Frames as ParaView and any VTK reader take them: PolyData (.vtp), and a collection in time (.pvd).

Format: VTK's XML file formats (VTK User's Guide, "VTK File Formats"), appended raw data, little endian, UInt64 headers.
"""

import re
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from sealtwin.errors import InputError, naming
from sealtwin.records import Frame
from sealtwin.store.files import replacing, write_text

TYPES: dict[str, Any] = {"Float32": np.dtype("<f4"), "Int32": np.dtype("<i4"), "UInt8": np.dtype("u1")}
BEGIN_OF_DATA = b'<AppendedData encoding="raw">_'
LENGTH = struct.Struct("<Q")
HEAD_BYTES = 1000
"""Hold the time."""
LARGEST_BYTES = 200_000_000
"""Of one frame: four million particles."""


def write_frame(path: Path, frame: Frame) -> None:
    """One .vtp, appears whole: a vertex for each particle, with what is known of it. Millimetres and seconds."""
    count = len(frame.position_mm)
    of_points = {
        "speed_mm_s": frame.speed_mm_s.astype("<f4"),
        "velocity_mm_s": frame.velocity_mm_s.astype("<f4"),
        "age_s": frame.age_s.astype("<f4"),
        "density": frame.density.astype("<f4"),
        "state": frame.state.astype("u1"),
    }
    places = {"position_mm": frame.position_mm.astype("<f4")}
    cells = {"connectivity": np.arange(count, dtype="<i4"), "offsets": np.arange(1, count + 1, dtype="<i4")}
    data = bytearray()

    def block(arrays: dict[str, NDArray[Any]]) -> str:
        lines = []
        for name, values in arrays.items():
            kind = next(kind for kind, dtype in TYPES.items() if dtype == values.dtype)
            columns = values.shape[1] if values.ndim == 2 else 1
            lines.append(
                f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{columns}" format="appended" '
                f'offset="{len(data)}"/>'
            )
            content = np.ascontiguousarray(values).tobytes()
            data.extend(LENGTH.pack(len(content)) + content)
        return "\n".join(lines)

    head = f"""<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData>
<FieldData>
<DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{frame.t_s!r}</DataArray>
</FieldData>
<Piece NumberOfPoints="{count}" NumberOfVerts="{count}" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="0">
<PointData Scalars="speed_mm_s" Vectors="velocity_mm_s">
{block(of_points)}
</PointData>
<Points>
{block(places)}
</Points>
<Verts>
{block(cells)}
</Verts>
</Piece>
</PolyData>
"""
    with replacing(path) as temporary:
        temporary.write_bytes(head.encode() + BEGIN_OF_DATA + data + b"</AppendedData>\n</VTKFile>\n")


def read_frame(path: Path) -> Frame:
    """What ``write_frame`` wrote. Raises InputError, naming the file, where it is none of ours, or damaged."""
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB, as no frame of ours is.")
        head, found, data = path.read_bytes().partition(BEGIN_OF_DATA)
        if not found:
            raise ValueError("no appended data")
        root = ElementTree.fromstring(head + b"</VTKFile>")
        arrays = {array.attrib["Name"]: array for array in root.iter("DataArray")}
        read = {name: _values(arrays[name], data) for name in ("age_s", "density", "state")}
        read |= {name: _values(arrays[name], data).reshape(-1, 3) for name in ("position_mm", "velocity_mm_s")}
        if len({len(values) for values in read.values()}) != 1:
            raise ValueError("its arrays differ in length")
        return Frame(
            t_s=float(arrays["TimeValue"].text or ""),
            position_mm=read["position_mm"].astype(float),
            velocity_mm_s=read["velocity_mm_s"].astype(float),
            age_s=read["age_s"].astype(float),
            density=read["density"].astype(float),
            state=read["state"].astype(np.int64),
        )
    except FileNotFoundError:
        raise InputError(f"{path}: not found. Run the simulation again.") from None
    except (ValueError, KeyError, struct.error, ElementTree.ParseError) as fault:
        raise InputError(f"{path}: no frame of ours, or damaged ({fault}). Run the simulation again.") from fault


def time_of_frame(path: Path) -> float:
    """Seconds, read from the head of the file alone. Raises InputError as ``read_frame``."""
    with naming(path), path.open("rb") as file:
        found = re.search(rb'Name="TimeValue"[^>]*>([^<]*)<', file.read(HEAD_BYTES))
    try:
        return float(found.group(1)) if found else float("no time")
    except ValueError as fault:
        raise InputError(f"{path}: no frame of ours, or damaged ({fault}). Run the simulation again.") from fault


def write_collection(path: Path, frames: Sequence[tuple[float, str]]) -> None:
    """A .pvd of frames, each its time in seconds and its file beside the .pvd; whole at any moment."""
    lines = [f'<DataSet timestep="{t_s!r}" group="" part="0" file="{name}"/>' for t_s, name in frames]
    write_text(
        path,
        "\n".join(
            [
                '<?xml version="1.0"?>',
                '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">',
                "<Collection>",
                *lines,
                "</Collection>",
                "</VTKFile>",
                "",
            ]
        ),
    )


def read_collection(path: Path) -> list[tuple[float, Path]]:
    """Times in seconds and files of a .pvd that ``write_collection`` wrote, in its order. Raises InputError."""
    try:
        found = ElementTree.fromstring(path.read_bytes()).iter("DataSet")
        return [(float(each.attrib["timestep"]), path.parent / _own(each.attrib["file"])) for each in found]
    except FileNotFoundError:
        raise InputError(f"{path}: not found. Give [output] frames_every_s and simulate again.") from None
    except (ValueError, KeyError, ElementTree.ParseError) as fault:
        raise InputError(f"{path}: no collection of ours, or damaged ({fault}). Simulate again.") from fault


def _values(array: ElementTree.Element, data: bytes) -> NDArray[Any]:
    """Of an array in the appended data, flat."""
    begin, dtype = int(array.attrib["offset"]), TYPES[array.attrib["type"]]
    (size,) = LENGTH.unpack_from(data, begin)
    return np.frombuffer(data, dtype, size // dtype.itemsize, begin + LENGTH.size)


def _own(name: str) -> str:
    """A plain name: a collection from somebody else must not lead out of its folder."""
    if not re.fullmatch(r"[\w.-]+\.vtp", name):
        raise ValueError(f"it names {name!r:.60}")
    return name
