"""Turn a photo's file into pixels, safely: the header is judged before anything is expanded."""

import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from sealtwin.errors import InputError

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP")
MAX_PIXELS = 50_000_000
"""Twice a good camera's photo; what is kept of that many is 350 MB."""
TOO_LARGE = f"more than the {MAX_PIXELS // 1_000_000} million pixels that are read; save it smaller."
MIN_SIDE_PX = 64


def read_photo(path: Path) -> NDArray[np.uint8]:
    """Pixels, (height, width, 3) RGB, turned upright as the camera's EXIF says. Nothing else of the EXIF is kept.

    Raises InputError for whatever is no whole 8-bit photo of at most ``MAX_PIXELS``.
    """
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; photo.file must be a {_formats()} file.")
    if not path.is_file():
        raise InputError(f"{path}: photo not found; photo.file is looked for beside the trial file.")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: the photo is empty (0 bytes); copy it from the camera again.")
    try:
        with warnings.catch_warnings():
            # Odd metadata is no reason to refuse a photo, its size is.
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path, formats=FORMATS) as photo:
                _check_header(path, photo)
                upright = ImageOps.exif_transpose(photo)
                return np.array(upright.convert("RGB"))
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise InputError(f"{path}: {TOO_LARGE}") from None
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
    if photo.mode.startswith(("I", "F")):
        raise InputError(f"{path}: more than 8 bits a channel ({photo.mode}); save it with 8.")


def _formats() -> str:
    return ", ".join(FORMATS[:-1]) + f" or {FORMATS[-1]}"
