"""Turn a photo's file into pixels, safely: the header is judged before anything is expanded."""

import re
import struct
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile, ImageOps

from digitise.pictures.foreign import foreign_format
from digitise.settings import LARGEST_FILE_BYTES
from sealtwin.errors import InputError

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP")
MAX_PIXELS = 50_000_000
"""Twice a good camera's photo; what is kept of that many is 350 MB."""
TOO_LARGE = f"more than the {MAX_PIXELS // 1_000_000} million pixels that are read; save it smaller."
MIN_SIDE_PX = 64
MOST_PAINTED = 0.5
"""Of a mask: no crack takes half a photo, but its mortar does, in a mask with black and white exchanged."""
FULL_FRAME_DIAGONAL_MM = float(np.hypot(36, 24))
"""A focal length "in 35 mm film" gives the same diagonal angle of view on that film (CIPA DCG-001)."""
EXIF_IFD, FOCAL_IN_35_MM, EXIF_WIDTH, EXIF_HEIGHT = 0x8769, 0xA405, 0xA002, 0xA003
MULTIPAGE = ("TIFF", "PNG", "WEBP")
"""Formats in which a second picture is another page or frame; beside a phone's JPEG it is a preview of the same."""


@dataclass(frozen=True)
class Decoded:
    """What a photo's file holds."""

    image: NDArray[np.uint8]
    """(height, width, 3), RGB."""
    focal_px: float | None = None
    """Focal length in pixels, where the camera wrote it and nobody has cropped the photo since."""
    warnings: tuple[str, ...] = ()


def read_photo(path: Path, key: str = "photo.file") -> Decoded:
    """Pixels, turned upright as the camera's EXIF says; of the EXIF only the focal length is kept.

    ``key`` is the setting that names the file. Raises InputError for whatever is no whole, single 8-bit photo of at
    most ``MAX_PIXELS``.
    """
    with _opened(path, key) as photo:
        focal_px = _focal_px(photo)
        ImageOps.exif_transpose(photo, in_place=True)
        pixels = np.asarray(photo if photo.mode == "RGB" else photo.convert("RGB"))
        return Decoded(pixels, focal_px, _transparency(photo))


def read_mask(path: Path, size_px: tuple[int, int]) -> NDArray[np.bool_]:
    """Where a picture is painted, (height, width): opaque where it has transparency, else brighter than half.

    Turned upright by its own EXIF, as the photo by its. Raises InputError where it is no picture of ``size_px``, the
    photo's width and height, or paints nothing, or most of it.
    """
    with _opened(path, "photo.mask") as picture:
        ImageOps.exif_transpose(picture, in_place=True)
        if picture.size != size_px:
            raise InputError(
                f"{path}: the mask is {picture.width} x {picture.height} px, the photo {size_px[0]} x {size_px[1]}; "
                "paint it over the photo itself, upright and at full size."
            )
        shown = picture.convert("RGBA").getchannel("A") if picture.has_transparency_data else picture.convert("L")
        painted = np.asarray(shown) >= 128
    if not painted.any():
        raise InputError(f"{path}: nothing is painted in the mask; the crack must be white on black, or opaque.")
    if np.mean(painted) > MOST_PAINTED:
        raise InputError(
            f"{path}: the mask paints {np.mean(painted):.0%} of the photo; the crack must be white on black, or opaque."
        )
    return painted


@contextmanager
def _opened(path: Path, key: str) -> Iterator[Image.Image]:
    """A picture whose header is in order, to be expanded within; what goes wrong there is said in a sentence."""
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; {key} must be a {_formats()} file.")
    if not path.is_file():
        raise InputError(f"{path}: not found; what {key} names is looked for beside its trial file.")
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path}: the photo is empty (0 bytes); copy it from the camera again.")
    if size > LARGEST_FILE_BYTES:
        # Some decoders take the whole file into memory before they look at it.
        raise InputError(f"{path}: {size / 1e6:.0f} MB; at most {LARGEST_FILE_BYTES / 1e6:.0f} MB; save it as JPEG.")
    if foreign := foreign_format(path):
        raise InputError(f"{path}: {foreign}")
    try:
        with warnings.catch_warnings():
            # Odd metadata is no reason to refuse a photo; its size is judged below.
            warnings.simplefilter("ignore")
            with Image.open(path, formats=FORMATS) as photo:
                _check_header(path, photo)
                yield photo
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
        raise InputError(f"{path}: more than 8 bits a channel; save it with 8, as JPEG for one.")
    pages = getattr(photo, "n_frames", 1)
    if photo.format in MULTIPAGE and pages > 1:
        raise InputError(f"{path}: {pages} pages or frames in one file; save the one that shows the crack by itself.")


def _stored_as(photo: Image.Image) -> str:
    """Pillow's name for the pixels as they lie in the file; its mode already tells of what it makes of them."""
    tiles = photo.tile if isinstance(photo, ImageFile.ImageFile) else []
    arguments = tiles[0].args if tiles else ()
    return next((part for part in np.atleast_1d(np.array(arguments, dtype=object)) if isinstance(part, str)), "")


def _focal_px(photo: Image.Image) -> float | None:
    """By the EXIF, before the photo is turned upright."""
    exif = photo.getexif().get_ifd(EXIF_IFD)
    film_mm, width, height = (exif.get(tag) for tag in (FOCAL_IN_35_MM, EXIF_WIDTH, EXIF_HEIGHT))
    if not isinstance(film_mm, int) or film_mm <= 0:
        return None
    if isinstance(width, int) and isinstance(height, int) and height > 0:
        shape, taken = sorted(photo.size), sorted((width, height))
        # A smaller copy has the camera's shape; a cropped one has not, and its angle of view is unknown.
        if abs(shape[1] * taken[0] - shape[0] * taken[1]) > 0.01 * shape[0] * taken[1]:
            return None
    return film_mm * float(np.hypot(*photo.size)) / FULL_FRAME_DIAGONAL_MM


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
