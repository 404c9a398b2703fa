"""The only reader of files. It opens plain files of a limited size.

A device would be read without end, and a pipe would wait forever.
"""

import io
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sealtwin.core.errors import InputError, as_text, naming

LARGEST_BYTES = 200_000_000
"""Largest table, JSON file or frame that is read: two million particles. A larger file would fill the memory."""
LARGEST_HASHED_BYTES = 10_000_000_000
"""Largest file that is read in pieces; no input of a stage is as large. A sparse file may be almost endless."""


def require_plain(path: Path, largest_bytes: int = LARGEST_BYTES) -> None:
    """Raise InputError if a path, or the target of a link, is a folder, a device or a pipe, or is too large.

    Raises FileNotFoundError or another OSError, with the name of the file, if the path does not exist or cannot be
    reached.
    """
    with naming(path):
        status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise InputError(f"{as_text(path)}: is a folder; expected a file. Move it away, and run the stage again.")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(
            f"{as_text(path)}: is a device or a pipe, or a link to one; expected a file. Put a copy of the file in "
            "its place, or delete it and run its stage again."
        )
    if status.st_size > largest_bytes:
        raise InputError(
            f"{as_text(path)}: {status.st_size / 1e6:.1f} MB, larger than {largest_bytes / 1e6:g} MB. Delete it and "
            "run its stage again."
        )


@contextmanager
def opened(path: Path, largest_bytes: int = LARGEST_BYTES) -> Iterator[io.BufferedReader]:
    """Open a file for reading. Raises whatever ``require_plain`` raises."""
    require_plain(path, largest_bytes)
    with path.open("rb") as content:
        yield content


def read_bytes(path: Path, largest_bytes: int = LARGEST_BYTES) -> bytes:
    """Read a file. Raises whatever ``require_plain`` raises."""
    with naming(path), opened(path, largest_bytes) as content:
        return content.read()


def read_text(path: Path, largest_bytes: int = LARGEST_BYTES) -> str:
    """Read a UTF-8 text, with or without a byte-order mark. All line ends become line feeds.

    Raises UnicodeDecodeError, and whatever ``require_plain`` raises.
    """
    return io.TextIOWrapper(io.BytesIO(read_bytes(path, largest_bytes)), encoding="utf-8-sig").read()
