"""STL, binary and text."""

import re
from itertools import islice

import numpy as np

from digitise.modelled.triangles import Triangles, UnreadableError, refuse_too_many
from sealtwin.records import Floats

HEADER_BYTES, FACET_BYTES = 84, 50
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
CORNER = re.compile(rb"^[ \t]*vertex[ \t]+(\S{1,40})[ \t]+(\S{1,40})[ \t]+(\S{1,40})", re.IGNORECASE | re.MULTILINE)
CORNER_BEGINS = re.compile(rb"^[ \t]*vertex\b", re.IGNORECASE | re.MULTILINE)
AT_ONCE = 100_000
"""Corners turned into numbers at a time: as Python objects they take fifty times their room."""


def read_stl(content: bytes) -> Triangles:
    """A soup: every triangle has corners of its own. Stored normals are not used."""
    count = int.from_bytes(content[80:84], "little")
    bytes_needed = HEADER_BYTES + FACET_BYTES * count
    # Binary files, too, may begin with the word that marks a text.
    if len(content) == bytes_needed:
        refuse_too_many(count)
        facets = np.frombuffer(content, FACET, offset=HEADER_BYTES)
        return _soup(facets["corners"].reshape(-1, 3).astype(float))
    if b"facet" in content[:4096].lower():
        return _soup(_corners_of_text(content))
    raise UnreadableError(
        f"it is no text, and as a binary its header names {count} triangles, {bytes_needed} bytes, where the file has "
        f"{len(content)}"
    )


def _corners_of_text(content: bytes) -> Floats:
    found = CORNER.finditer(content)
    parts = [np.empty((0, 3))]
    count = 0
    while batch := [match.groups() for match in islice(found, AT_ONCE)]:
        parts.append(np.array(batch).astype(float))
        count += len(batch)
        refuse_too_many(count // 3)
    if count != sum(1 for _ in CORNER_BEGINS.finditer(content)):
        raise UnreadableError("a vertex is not three numbers")
    return np.concatenate(parts)


def _soup(corners: Floats) -> Triangles:
    if len(corners) % 3:
        raise UnreadableError(f"{len(corners)} corners, which is no whole number of triangles")
    return Triangles(corners, np.arange(len(corners)).reshape(-1, 3))
