"""Photo formats that are known by their first bytes, and not read: phones' HEIF, and cameras' raw files."""

import struct
from pathlib import Path

HEIF_BRANDS = {
    b"heic": "HEIC",
    b"heix": "HEIC",
    b"heim": "HEIC",
    b"heis": "HEIC",
    b"hevc": "HEIC",
    b"hevx": "HEIC",
    b"mif1": "HEIF",
    b"msf1": "HEIF",
    b"avif": "AVIF",
    b"avis": "AVIF",
}
"""Major brands of ISO/IEC 23008-12 (HEIF, HEVC inside) and of AVIF."""
RAW_STARTS = {
    b"FUJIFILMCCD-RAW": "Fujifilm (RAF)",
    b"IIU\0": "Panasonic (RW2)",
    b"IIRO": "Olympus (ORF)",
    b"IIRS": "Olympus (ORF)",
    b"MMOR": "Olympus (ORF)",
    b"\0MRM": "Minolta (MRW)",
}
RAW_ENDINGS = {".cr2": "Canon", ".nef": "Nikon", ".nrw": "Nikon", ".arw": "Sony", ".sr2": "Sony", ".pef": "Pentax"}
"""Of raw files that are TIFFs at heart; nobody names a plain TIFF so."""
TIFF_STARTS = {b"II*\0": "<", b"MM\0*": ">"}
SUBFILE_TYPE, SUB_PICTURES, DNG_VERSION = 254, 330, 50706
"""TIFF tags: what the first picture is, where further ones lie, and that it is Adobe's raw format."""


def foreign_format(path: Path) -> str | None:
    """What the file is and what to do with it, for a sentence; None where it may be a photo that can be read."""
    with path.open("rb") as file:
        start = file.read(16)
        if start[4:8] == b"ftyp":
            if start[8:12] == b"crx ":
                return _raw("Canon (CR3)")
            if start[8:12] in HEIF_BRANDS:
                return (
                    f"this is {HEIF_BRANDS[start[8:12]]}, which is not read; save it as JPEG at full size (a phone's "
                    'camera has a setting for it: "most compatible").'
                )
        for begins, maker in RAW_STARTS.items():
            if start.startswith(begins):
                return _raw(maker)
        if start[:4] not in TIFF_STARTS or len(start) < 8:
            return None
        if start[8:10] == b"CR":
            return _raw("Canon (CR2)")
        if path.suffix.lower() in RAW_ENDINGS:
            return _raw(f"{RAW_ENDINGS[path.suffix.lower()]} ({path.suffix[1:].upper()})")
        order = TIFF_STARTS[start[:4]]
        file.seek(struct.unpack(order + "I", start[4:8])[0])
        tags = _first_directory(file.read(2 + 12 * 0xFFFF), order)
    if DNG_VERSION in tags:
        return _raw("Adobe (DNG)")
    # Raw files put a thumbnail first, and a reader of plain TIFF takes it for the photo.
    if SUB_PICTURES in tags and tags.get(SUBFILE_TYPE, 0) & 1:
        return _raw("TIFF with a thumbnail first")
    return None


def _raw(maker: str) -> str:
    return f"this is a camera's raw file, {maker}, which is not read; develop it, and save it as JPEG at full size."


def _first_directory(content: bytes, order: str) -> dict[int, int]:
    """Tags of a TIFF's first picture, each with its value where that is one number; empty where it is cut short."""
    if len(content) < 2:
        return {}
    count = min(struct.unpack_from(order + "H", content)[0], (len(content) - 2) // 12)
    tags = {}
    for entry in range(count):
        tag, kind, _ = struct.unpack_from(order + "HHI", content, 2 + 12 * entry)
        tags[tag] = struct.unpack_from(order + ("H" if kind == 3 else "I"), content, 10 + 12 * entry)[0]
    return tags
