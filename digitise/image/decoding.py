"""Read photos. The header is checked before anything is decompressed."""

import struct
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from numbers import Real
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile, ImageOps, TiffImagePlugin
from PIL.ExifTags import IFD, Base

from digitise.image.raster import Map
from digitise.image.tone_curve import as_displayed
from digitise.settings import LARGEST_FILE_BYTES
from sealtwin.core.errors import InputError

PHOTO_SUFFIXES = {".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp", ".heic", ".heif"}
"""File endings of photos in a folder. Photos that cannot be read are reported."""
FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP")
READABLE = "JPEG, PNG, WEBP, TIFF or BMP"
MAX_PIXELS = 50_000_000  # Largest photo, twice that of a good camera; it takes 350 MB of memory
TOO_LARGE = f"more than the {MAX_PIXELS // 1_000_000} million pixels allowed; save it smaller."
MIN_SIDE_PX = 64
MASK = "photo.mask"  # Setting of the mask. Messages about it suggest PNG, since JPEG blurs its two values
HEIF_BRANDS = (b"hei", b"hev", b"mif", b"msf", b"avi")  # How the brands of HEIC, HEIF and AVIF files begin
HEIF = (
    "this is HEIC, HEIF or AVIF, which cannot be read; save it as JPEG at full size (a phone's camera has a setting "
    'for it: "most compatible").'
)
RAW_ENDINGS = frozenset(
    {".arw", ".cr2", ".cr3", ".dng", ".mrw", ".nef", ".nrw", ".orf", ".pef", ".raf", ".rw2", ".sr2"}
)
RAW = "this is a camera's raw file, which cannot be read; develop it, and save it as JPEG at full size."
BLACK, BRIGHT_PART = 15, 99.5  # Least usable brightness, of 255, at a percentile of a photo's pixels
FLOATS = 3  # TIFF's sample format of floats
FULL_FRAME_DIAGONAL_MM = float(np.hypot(36, 24))  # Of 35 mm film, to which EXIF refers focal lengths (CIPA DCG-001)
RESOLUTIONS = ("dpi", "resolution", "aspect", "jfif_density")  # Pillow's names for dots per length, across and down
SQUARE = 0.01  # Largest relative difference of a square pixel's sides: programs round to whole dots
MULTIPAGE = ("TIFF", "PNG", "WEBP")  # Formats with pages or frames; a second picture in a phone's JPEG is a preview


@dataclass(frozen=True, kw_only=True)
class Decoded:
    """Content of a photo's file."""

    image: NDArray[np.uint8]  # (height, width, 3), RGB, as the camera stored it
    focal_px: float | None = None  # Focal length in pixels, if the camera recorded it and the photo is not cropped
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Pixels(Decoded):
    """A photo before its scale is known."""

    file: Path
    brightness: Map  # Linear light, 0 to 1
    drawn: NDArray[np.bool_] | None = None  # Mask of the crack that the user painted, (height, width)

    @property
    def size_px(self) -> tuple[int, int]:
        """Width, height."""
        return self.brightness.shape[1], self.brightness.shape[0]


def read_photo(path: Path, key: str = "photo.file") -> Decoded:
    """Read a single 8-bit photo and turn it upright by its EXIF; ``key`` is the setting that an InputError names."""
    with opened(path, key) as photo:
        _require_square(path, photo)
        focal_px = _focal_px(photo)
        ImageOps.exif_transpose(photo, in_place=True)
        shown, remarks = as_displayed(photo)
        pixels = np.asarray(shown)
        doubts = (*_transparency(photo), *remarks, *_inks(path, photo, pixels))
        return Decoded(image=pixels, focal_px=focal_px, warnings=doubts)


def take_photo(image: NDArray[np.generic], name: str) -> Decoded:
    """Check pixels in memory, uint8, (height, width) or (height, width, 3) RGB; an InputError names them ``name``."""
    image = np.asarray(image)
    if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise InputError(
            f"{name}: an array of shape {image.shape} and type {image.dtype}; give (height, width) or "
            "(height, width, 3) RGB of type uint8."
        )
    _check_size(name, image.shape[1], image.shape[0])
    rgb = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
    return Decoded(image=np.ascontiguousarray(rgb, dtype=np.uint8))


@contextmanager
def opened(path: Path, key: str) -> Iterator[Image.Image]:
    """Open a picture after checks of its header. Errors inside the block become InputErrors.

    ``key`` is the setting that names the file. Messages about a mask suggest other formats than those about a photo.
    """
    what, saved, again = ("mask", "PNG", "export it") if key == MASK else ("photo", "JPEG", "copy it from the camera")
    if path.is_dir():
        raise InputError(f"{path}: is a folder; give {key} as a {READABLE} file.")
    if not path.is_file():
        raise InputError(f"{path}: not found; {key} is relative to the folder of its trial file.")
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path}: the {what} is empty (0 bytes); {again} again.")
    if size > LARGEST_FILE_BYTES:
        # Some decoders read the whole file into memory first.
        raise InputError(
            f"{path}: {size / 1e6:.0f} MB, more than {LARGEST_FILE_BYTES / 1e6:.0f} MB; save it as {saved}."
        )
    try:
        # Warnings are about metadata, and about sizes that are checked here. Pillow gets a file without a name: it maps
        # a named one into memory, and reads a turned TIFF there by rows as long as those of the upright picture.
        with (
            warnings.catch_warnings(action="ignore"),
            path.open("rb") as file,
            Image.open(file, formats=FORMATS) as photo,
        ):
            _check_header(path, photo, saved)
            yield photo
    except Image.DecompressionBombError:
        raise InputError(f"{path}: {TOO_LARGE}") from None
    except Image.UnidentifiedImageError:
        raise InputError(f"{path}: {_unknown(path, what, saved)}") from None
    except (OSError, SyntaxError, ValueError, EOFError, struct.error, zlib.error) as fault:
        raise InputError(f"{path}: the {what} is damaged or cut short ({fault}); {again} again.") from None


def _unknown(path: Path, what: str, saved: str) -> str:
    """Return a sentence on a file that Pillow cannot identify, with the format to save ``what`` in."""
    if path.suffix.lower() in RAW_ENDINGS:
        return RAW
    with path.open("rb") as file:
        start = file.read(12)
    if start[4:8] == b"ftyp" and start[8:11] in HEIF_BRANDS:
        return HEIF
    if path.suffix.lower() in (".tif", ".tiff") and (bits := _tiff_values(path)):
        return f"a TIFF of {bits}, which cannot be read; save it with 8 bits per channel, for example as {saved}."
    return f"not a readable {what}; save it as {READABLE}."


def _tiff_values(path: Path) -> str | None:
    """Return the kind of numbers that a TIFF stores for each channel; None for any other file."""
    try:
        with warnings.catch_warnings(action="ignore"), path.open("rb") as file:
            tags = TiffImagePlugin.ImageFileDirectory_v2(file.read(8))
            file.seek(tags.next)
            tags.load(file)
        (bits, *_), (kind, *_) = (
            np.atleast_1d(tags.get(tag, 1)).tolist() for tag in (Base.BitsPerSample, Base.SampleFormat)
        )
    except (OSError, SyntaxError, ValueError, TypeError, IndexError, struct.error):
        return None
    return f"{bits}-bit {'floats' if kind == FLOATS else 'whole numbers'} per channel"


def _inks(path: Path, photo: Image.Image, pixels: NDArray[np.uint8]) -> tuple[str, ...]:
    """Return a warning if a CMYK file does not state its polarity. Raises InputError if the photo would be black."""
    if photo.mode != "CMYK" or photo.format != "JPEG" or "adobe" in photo.info:
        return ()
    unsure = "a CMYK JPEG without Adobe's marker, which does not state whether its values are ink or light"
    if np.percentile(pixels[::2, ::2], BRIGHT_PART) < BLACK:
        raise InputError(f"{path}: {unsure}. Read as most programs do, the photo is black. Save it as RGB JPEG.")
    return (f"the photo is {unsure}. If dark and light look exchanged in the overlay, save it as RGB JPEG",)


def _check_header(path: Path, photo: Image.Image, saved: str) -> None:
    if isinstance(photo, TiffImagePlugin.TiffImageFile):
        tags = photo.tag_v2
        # The first picture of a raw file is a thumbnail; a plain TIFF reader would take it for the photo.
        thumbnail = Base.SubIFDs in tags and tags.get(Base.NewSubfileType, 0) & 1
        if path.suffix.lower() in RAW_ENDINGS or Base.DNGVersion in tags or thumbnail:
            raise InputError(f"{path}: {RAW}")
    _check_size(path, *photo.size)
    if photo.mode.startswith(("I", "F")) or ";16" in _stored_as(photo):
        raise InputError(f"{path}: more than 8 bits per channel; save it with 8, for example as {saved}.")
    pages = getattr(photo, "n_frames", 1)
    if photo.format in MULTIPAGE and pages > 1:
        raise InputError(f"{path}: {pages} pages or frames in one file; save only the one with the crack.")


def _check_size(name: Path | str, width: int, height: int) -> None:
    if width * height > MAX_PIXELS:
        raise InputError(f"{name}: {width} x {height} pixels, {TOO_LARGE}")
    if min(width, height) < MIN_SIDE_PX:
        raise InputError(f"{name}: {width} x {height} pixels; each side must have at least {MIN_SIDE_PX}.")


def _require_square(path: Path, photo: Image.Image) -> None:
    """Raise InputError if the file states pixels that are not square, as some scans do."""
    exif = photo.getexif()
    for pair in (*map(photo.info.get, RESOLUTIONS), (exif.get(Base.XResolution), exif.get(Base.YResolution))):
        across, down = (float(side) if isinstance(side, Real) else 0.0 for side in pair or (0, 0))
        if across > 0 and down > 0 and abs(across / down - 1) > SQUARE:
            raise InputError(
                f"{path}: the file states pixels that are not square ({across:g} dots across, {down:g} down), but a "
                "scale needs square pixels. Resample the photo to square pixels, or, if the statement is wrong, "
                "delete it from the file."
            )


def _stored_as(photo: Image.Image) -> str:
    """Return Pillow's name for the pixel format in the file. The mode of the opened image does not show it."""
    tiles = photo.tile if isinstance(photo, ImageFile.ImageFile) else []
    arguments = tiles[0].args if tiles else ()
    return next((part for part in np.atleast_1d(np.array(arguments, dtype=object)) if isinstance(part, str)), "")


def _focal_px(photo: Image.Image) -> float | None:
    """Return the focal length in pixels from the EXIF of a photo before it is turned upright; None if unknown."""
    exif = photo.getexif().get_ifd(IFD.Exif)
    film_mm, width, height = map(exif.get, (Base.FocalLengthIn35mmFilm, Base.ExifImageWidth, Base.ExifImageHeight))
    if not isinstance(film_mm, int) or film_mm <= 0:
        return None
    if isinstance(width, int) and isinstance(height, int) and height > 0:
        shape, taken = sorted(photo.size), sorted((width, height))
        # A cropped photo has another shape than the camera's, and its angle of view is unknown.
        if abs(shape[1] * taken[0] - shape[0] * taken[1]) > 0.01 * shape[0] * taken[1]:
            return None
    return film_mm * float(np.hypot(*photo.size)) / FULL_FRAME_DIAGONAL_MM


def _transparency(photo: Image.Image) -> tuple[str, ...]:
    """Return a warning if pixels are transparent; their hidden colours are used."""
    alpha = photo.convert("RGBA").getchannel("A") if photo.has_transparency_data else 255
    clear = float(np.mean(np.asarray(alpha) < 255))
    return (f"{max(clear, 0.0001):.2%} of the photo is transparent; its hidden colours were used",) if clear else ()
