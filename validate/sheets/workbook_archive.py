"""An XLSX as the archive that it is: XML in a zip, opened within bounds, since nothing of it can be trusted.

By ECMA-376 part 1 (SpreadsheetML). Names are taken without their namespace, which the strict form has another of.
"""

import io
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from xml.parsers import expat

from validate.sheets.faults import clipped

MOST_ENTRIES = 2_000
LARGEST_PART = 16_000_000
"""Bytes of XML: 10,000 rows of 32 numbers take 13 million. What unpacks to more is not opened."""
LARGEST_PARTS = 32_000_000
"""All that are opened together."""
PIECE = 1 << 16


class UnusableError(Exception):
    """Why this is no workbook that can be read."""


class Handler:
    """What a part's XML says, element by element."""

    def start(self, name: str, values: dict[str, str]) -> None: ...

    def end(self, name: str) -> None: ...

    def text(self, piece: str) -> None: ...


class Archive:
    """Its parts, which are XML; none is opened that is not asked for."""

    def __init__(self, content: bytes) -> None:
        with _damage_named():
            self._archive = zipfile.ZipFile(io.BytesIO(content))
        entries = self._archive.infolist()
        if len(entries) > MOST_ENTRIES:
            raise UnusableError(f"{len(entries):,} parts; at most {MOST_ENTRIES:,} are looked at")
        self._unpacked = 0
        self._parts = {entry.filename: entry for entry in entries}
        if len(self._parts) < len(entries):
            raise UnusableError("a part stands twice")

    def __contains__(self, part: str) -> bool:
        return part in self._parts

    def parse(self, part: str, handler: Handler) -> None:
        """Piece by piece, and never more than a part is allowed to hold."""
        entry = self._parts.get(part)
        if entry is None:
            raise UnusableError(f"{clipped(part)} is not in it")
        if entry.flag_bits & 1:
            raise UnusableError("it has a password")
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise UnusableError(f"{clipped(part)} is packed in a way that XLSX does not have")
        if entry.file_size > LARGEST_PART:
            raise UnusableError(f"{clipped(part)} unpacks to more than {LARGEST_PART / 1e6:g} MB")
        self._unpacked += entry.file_size
        if self._unpacked > LARGEST_PARTS:
            raise UnusableError(f"its sheets unpack to more than {LARGEST_PARTS / 1e6:g} MB together")
        parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = _refuse_doctype
        parser.StartElementHandler = lambda name, values: handler.start(name.rpartition(":")[2], values)
        parser.EndElementHandler = lambda name: handler.end(name.rpartition(":")[2])
        parser.CharacterDataHandler = handler.text
        try:
            for piece in self._pieces(entry):
                parser.Parse(piece)
            parser.Parse(b"", True)
        except expat.ExpatError as fault:
            raise UnusableError(f"damaged: {clipped(part)}, {fault}") from fault

    def _pieces(self, entry: zipfile.ZipInfo) -> Iterator[bytes]:
        """No more than the directory says; a wrong checksum is damage."""
        with _damage_named(), self._archive.open(entry) as packed:
            while piece := packed.read(PIECE):
                yield piece


@contextmanager
def _damage_named() -> Iterator[None]:
    """All that the archive's reader stumbles over where bytes are not as they were written."""
    try:
        yield
    except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError, ValueError) as fault:
        raise UnusableError(f"damaged: {clipped(str(fault))}") from fault


def _refuse_doctype(*_: object) -> None:
    raise UnusableError("it declares entities, as no spreadsheet program does")
