"""Turn a photo's file into pixels, safely: the header is judged before anything is expanded."""

import re
import struct
import warnings
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile, ImageOps

from sealtwin.errors import InputError

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP")
MAX_PIXELS = 50_000_000
"""Twice a good camera's photo; what is kept of that many is 350 MB."""
TOO_LARGE = f"more than the {MAX_PIXELS // 1_000_000} million pixels that are read; save it smaller."
MIN_SIDE_PX = 64
MULTIPAGE = ("TIFF", "PNG", "WEBP")
"""Formats in which a second picture is another page or frame; beside a phone's JPEG it is a preview of the same."""


@dataclass(frozen=True)
class Decoded:
    """What a photo's file holds."""

    image: NDArray[np.uint8]
    """(height, width, 3), RGB."""
    warnings: tuple[str, ...] = ()


def read_photo(path: Path) -> Decoded:
    """Pixels, turned upright as the camera's EXIF says. Nothing else of the EXIF is kept.

    Raises InputError for whatever is no whole, single 8-bit photo of at most ``MAX_PIXELS``.
    """
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; photo.file must be a {_formats()} file.")
    if not path.is_file():
        raise InputError(f"{path}: photo not found; photo.file is looked for beside the trial file.")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: the photo is empty (0 bytes); copy it from the camera again.")
    try:
        with warnings.catch_warnings():
            # Odd metadata is no reason to refuse a photo; its size is judged below.
            warnings.simplefilter("ignore")
            with Image.open(path, formats=FORMATS) as photo:
                _check_header(path, photo)
                upright = ImageOps.exif_transpose(photo)
                return Decoded(np.array(upright.convert("RGB")), _transparency(upright))
    except Image.DecompressionBombError as fault:
        raise InputError(f"{path}: {_size_named(fault)}{TOO_LARGE}") from None
    except Image.UnidentifiedImageError:
        raise InputError(f"{path}: no photo that can be read; save it as {_formats()}.") from None
    except (OSError, SyntaxError, ValueError, EOFError, struct.error, zlib.error) as fault:
        raise InputError(
            f"{path}: the photo is damaged or cut short ({fault}); copy it from the camera again."
        ) from None


def _check_header(path: Path, photo: Image.Image) -> None:
    width, height = photo.size
    if width * height > MAX_PIXELS:
        raise InputError(f"{path}: {width} x {height} pixels, {TOO_LARGE}")
    if min(width, height) < MIN_SIDE_PX:
        raise InputError(f"{path}: {width} x {height} pixels are too few; each side needs {MIN_SIDE_PX}.")
    if photo.mode.startswith(("I", "F")) or ";16" in _stored_as(photo):
        raise InputError(f"{path}: more than 8 bits a channel ({_stored_as(photo) or photo.mode}); save it with 8.")
    pages = getattr(photo, "n_frames", 1)
    if photo.format in MULTIPAGE and pages > 1:
        raise InputError(f"{path}: {pages} pages or frames in one file; save the one that shows the crack by itself.")


def _stored_as(photo: Image.Image) -> str:
    """Pillow's name for the pixels as they lie in the file; its mode already tells of what it makes of them."""
    tiles = photo.tile if isinstance(photo, ImageFile.ImageFile) else []
    arguments = tiles[0].args if tiles else ()
    return next((part for part in np.atleast_1d(np.array(arguments, dtype=object)) if isinstance(part, str)), "")


def _transparency(photo: Image.Image) -> tuple[str, ...]:
    """Transparent pixels have a colour that no viewer shows: it is read, and that is said."""
    if not photo.has_transparency_data:
        return ()
    alpha = np.asarray(photo.convert("RGBA").getchannel("A"))
    clear = float(np.mean(alpha < 255))
    if clear == 0:
        return ()
    return (f"{max(clear, 0.0001):.2%} of the photo is transparent; the colours hidden there were read as they stand",)


def _size_named(fault: Exception) -> str:
    """Pillow refuses before the size can be asked for, but names the number of pixels."""
    found = re.search(r"\((\d+) pixels\)", str(fault))
    return f"{int(found[1]) / 1e6:.0f} million pixels, " if found else ""


def _formats() -> str:
    return ", ".join(FORMATS[:-1]) + f" or {FORMATS[-1]}"
