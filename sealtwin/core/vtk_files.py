"""Write and read the frames of a fluid run as VTK files: a PolyData file (.vtp) per frame, and a collection (.pvd).

ParaView and any other VTK reader can open them. The format is VTK XML (VTK User's Guide, "VTK File Formats") with
appended raw data, little endian, and UInt64 headers.
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

from sealtwin.core.arrays import Floats, Integers, lengths
from sealtwin.core.errors import InputError
from sealtwin.core.files import read_bytes, write_bytes, write_text

TYPES: dict[str, Any] = {"Float32": np.dtype("<f4"), "Int32": np.dtype("<i4"), "UInt8": np.dtype("u1")}
BEGIN_OF_DATA = b'<AppendedData encoding="raw">_'
LENGTH = struct.Struct("<Q")
RESUMED = ", and checkpoint.npz if the run is not finished; then simulate again."
"""End of the remedy for a damaged frame. A resumed run reads its earlier frames, so it would stop at the same fault."""


class ParticleState(IntEnum):
    """State of a particle at one moment."""

    MOVING = 0
    ASLEEP = 1  # Particle at rest below the yield stress, until a faster particle touches it
    FROZEN = 2  # Particle that is permanently fixed because of its age
    SPILLED = 3  # Particle that left the sample over its edge
    ESCAPED = 4  # Particle that went through a wall, which is a fault


@dataclass(frozen=True)
class Frame:
    """Particles at one moment of a fluid run, in the order in which they left the nozzle."""

    t_s: float
    position_mm: Floats  # (n, 3)
    velocity_mm_s: Floats  # (n, 3)
    age_s: Floats  # Time since the release, (n,)
    density: Floats  # Density divided by the rest density, (n,)
    state: Integers  # ParticleState values, (n,)

    @property
    def speed_mm_s(self) -> Floats:
        return lengths(self.velocity_mm_s)


def write_frame(path: Path, frame: Frame) -> None:
    """Write a .vtp file with one vertex and its data for each particle, in millimetres and seconds."""
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
    """Read a frame that ``write_frame`` wrote. Raises InputError if the file is damaged or of another kind."""
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
            f"{path}: is damaged or not a frame of a run ({fault}). Delete the folder {path.parent}{RESUMED}"
        ) from fault


def write_collection(path: Path, frames: Sequence[tuple[float, str]]) -> None:
    """Write a .pvd file that lists the time in seconds and the file of each frame. All files are in one folder."""
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n<Collection>\n'
    lines = [f'<DataSet timestep="{t_s!r}" group="" part="0" file="{name}"/>\n' for t_s, name in frames]
    write_text(path, f"{head}{''.join(lines)}</Collection>\n</VTKFile>\n")


def read_collection(path: Path) -> list[tuple[float, Path]]:
    """Read the time in seconds and the file of each frame from a .pvd file, in the order of the file.

    Raises InputError if the file is damaged or of another kind.
    """
    content = read_bytes(path)
    try:
        sets = list(ElementTree.fromstring(content).iter("DataSet"))
        if not sets:
            raise ValueError("it lists no frames")
        return [
            (float(dataset.attrib["timestep"]), path.parent / _plain_name(dataset.attrib["file"])) for dataset in sets
        ]
    except (ValueError, KeyError, ElementTree.ParseError) as fault:
        raise InputError(f"{path}: is damaged or not a collection of frames ({fault}). Delete it{RESUMED}") from fault


def _values(array: ElementTree.Element, data: bytes) -> NDArray[Any]:
    """Return an array from the appended data, with one row for each particle, (n,) or (n, 3)."""
    begin, dtype = int(array.attrib["offset"]), TYPES[array.attrib["type"]]
    (size,) = LENGTH.unpack_from(data, begin)
    values = np.frombuffer(data, dtype, size // dtype.itemsize, begin + LENGTH.size)
    values = values.astype(np.int64 if dtype.kind == "u" else float)
    return values if array.attrib["NumberOfComponents"] == "1" else values.reshape(-1, 3)


def _plain_name(name: str) -> str:
    """Return ``name`` if it is the name of a .vtp file.

    Raises ValueError for a path, because frames are in the folder of the collection.
    """
    if not re.fullmatch(r"[\w.-]+\.vtp", name):
        raise ValueError(f"the file name {name!r:.60} is not allowed")
    return name
