"""Frames of a fluid run, and their files for ParaView and any VTK reader: PolyData (.vtp), and a collection (.pvd).

Format: VTK's XML file formats (VTK User's Guide, "VTK File Formats"), appended raw data, little endian, UInt64 headers.
"""

import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.errors import InputError
from sealtwin.core.files import read_bytes, write_bytes, write_text
from sealtwin.core.records import Floats, Integers

TYPES: dict[str, Any] = {"Float32": np.dtype("<f4"), "Int32": np.dtype("<i4"), "UInt8": np.dtype("u1")}
BEGIN_OF_DATA = b'<AppendedData encoding="raw">_'
LENGTH = struct.Struct("<Q")
RESUMED = ", and checkpoint.npz if the run is not finished; then simulate again."
"""End of a remedy. A resumed run reads the frames that it has written, so it would stop at the same fault again."""


class ParticleState(IntEnum):
    """State of a particle at one moment."""

    MOVING = 0
    ASLEEP = 1  # Particle at rest below the yield stress, until a faster one meets it
    FROZEN = 2  # Particle that froze by its age, permanently
    SPILLED = 3  # Particle that left over the sample's edge
    ESCAPED = 4  # Particle that went through a wall: a fault


@dataclass(frozen=True)
class Frame:
    """Particles that have left the nozzle at one moment of a fluid run, in the order in which they left it."""

    t_s: float
    position_mm: Floats  # (n, 3)
    velocity_mm_s: Floats  # (n, 3)
    age_s: Floats  # (n,): since release
    density: Floats  # (n,): over rest density
    state: Integers  # (n,), ParticleState values

    @property
    def speed_mm_s(self) -> Floats:
        return np.linalg.norm(self.velocity_mm_s, axis=1)


def write_frame(path: Path, frame: Frame) -> None:
    """Write one .vtp with a vertex for each particle and the particle's state, in millimetres and seconds."""
    count = len(frame.position_mm)
    names = ("speed_mm_s", "velocity_mm_s", "age_s", "density")
    of_points = {name: getattr(frame, name).astype("<f4") for name in names} | {"state": frame.state.astype("u1")}
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
    write_bytes(path, head.encode() + BEGIN_OF_DATA + data + b"</AppendedData>\n</VTKFile>\n")


def read_frame(path: Path) -> Frame:
    """Read a frame that ``write_frame`` wrote. Raises InputError if it is another kind of file, or damaged."""
    head, _, data = read_bytes(path).partition(BEGIN_OF_DATA)
    try:
        arrays = {
            array.attrib["Name"]: array for array in ElementTree.fromstring(head + b"</VTKFile>").iter("DataArray")
        }
        names = ("position_mm", "velocity_mm_s", "age_s", "density", "state")
        read = {name: _values(arrays[name], data) for name in names}
        if len({len(values) for values in read.values()}) != 1:
            raise ValueError("its arrays differ in length")
        return Frame(t_s=float(arrays["TimeValue"].text or ""), **read)
    except (ValueError, KeyError, struct.error, ElementTree.ParseError) as fault:
        raise InputError(
            f"{path}: not a frame of a run, or damaged ({fault}). Delete the folder {path.parent}{RESUMED}"
        ) from fault


def write_collection(path: Path, frames: Sequence[tuple[float, str]]) -> None:
    """Write a .pvd that lists frames by time in seconds and by file in the same folder."""
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n<Collection>\n'
    lines = [f'<DataSet timestep="{t_s!r}" group="" part="0" file="{name}"/>\n' for t_s, name in frames]
    write_text(path, f"{head}{''.join(lines)}</Collection>\n</VTKFile>\n")


def read_collection(path: Path) -> list[tuple[float, Path]]:
    """Read times in seconds and files of a .pvd that ``write_collection`` wrote, in its order. Raises InputError."""
    content = read_bytes(path)
    try:
        sets = list(ElementTree.fromstring(content).iter("DataSet"))
        if not sets:
            raise ValueError("it lists no frame")
        return [(float(each.attrib["timestep"]), path.parent / _plain_name(each.attrib["file"])) for each in sets]
    except (ValueError, KeyError, ElementTree.ParseError) as fault:
        raise InputError(f"{path}: not a collection of frames, or damaged ({fault}). Delete it{RESUMED}") from fault


def _values(array: ElementTree.Element, data: bytes) -> NDArray[Any]:
    """Return an array of the appended data, with one row for each particle."""
    begin, dtype = int(array.attrib["offset"]), TYPES[array.attrib["type"]]
    (size,) = LENGTH.unpack_from(data, begin)
    values = np.frombuffer(data, dtype, size // dtype.itemsize, begin + LENGTH.size)
    values = values.astype(np.int64 if dtype.kind == "u" else float)
    return values if array.attrib["NumberOfComponents"] == "1" else values.reshape(-1, 3)


def _plain_name(name: str) -> str:
    """Return the name of a frame's file. Raises ValueError for a path, since frames are in the collection's folder."""
    if not re.fullmatch(r"[\w.-]+\.vtp", name):
        raise ValueError(f"it names {name!r:.60}")
    return name
