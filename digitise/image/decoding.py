"""Read photos and painted masks. The header is checked before anything is decompressed."""

import math
import struct
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
import simplejpeg
from numpy.typing import NDArray
from PIL import Image, ImageOps, TiffImagePlugin
from PIL.ExifTags import IFD, Base

from digitise.geometry.polyline import depth_inside
from digitise.image.raster import DISPLAY_GAMMA, Map, Size
from digitise.settings import LARGEST_FILE_BYTES
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts, doubt
from sealtwin.core.records import Booleans, Floats

PHOTO_SUFFIXES = {".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp", ".heic", ".heif", ".avif"}
"""File endings of photos in a folder. Photos that cannot be read are reported."""
FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "AVIF")
READABLE = "JPEG, PNG, WEBP, TIFF, BMP, HEIC or AVIF"
MAX_PIXELS = 50_000_000  # Largest photo: twice as many as a good camera has. It takes 350 MB of memory
TOO_LARGE = f"more than the {MAX_PIXELS // 1_000_000} million pixels allowed. Save it smaller."
MIN_SIDE_PX = 64
# Brands of pictures in ISO 23008-12; other brands are videos
HEIC_BRANDS = (b"heic", b"heix", b"heim", b"heis", b"mif1")
# Tone curves that ITU-T H.273 numbers: BT.709 and its equals, sRGB, gamma 2.2, and "unspecified". Others are HDR's
CAMERA_CURVES, LONGEST_HEAD = (1, 2, 4, 6, 13, 14, 15), 1 << 16
RAW_ENDINGS = (".arw", ".cr2", ".cr3", ".dng", ".mrw", ".nef", ".nrw", ".orf", ".pef", ".raf", ".rw2", ".sr2")
RAW = "a camera's raw file must be developed: save it as JPEG at full size."
UNREADABLE = f"save it as {READABLE}; videos are not accepted, and {RAW}"
BLACK, BRIGHT_PART = 15, 99.5  # A photo is too dark if the 99.5th percentile of its pixels is below 15 of 255
# Diagonal of 35 mm film, to which EXIF refers focal lengths (CIPA DCG-001)
FULL_FRAME_DIAGONAL_MM = float(np.hypot(36, 24))
RESOLUTIONS = ("dpi", "resolution", "aspect", "jfif_density")  # Pillow's names for dots per length, across and down
# Largest relative difference between the sides of a square pixel, and between two equal shapes: programs round
SQUARE = 0.01


@dataclass(frozen=True, kw_only=True)
class Decoded:
    """Content of a photo file."""

    image: NDArray[np.uint8]  # (height, width, 3), RGB, as the camera stored it
    focal_px: float | None = None  # Focal length in px. None if the camera did not record it or the photo is cropped
    warnings: Facts = ()


@dataclass(frozen=True, kw_only=True)
class Pixels(Decoded):
    """A photo whose scale is not known yet."""

    file: Path
    brightness: Map  # Linear light, 0 to 1, (height, width)
    drawn: Booleans | None = None  # The user's painted mask of the crack, (height, width)

    @property
    def size_px(self) -> Size:
        """Width and height in px."""
        return self.brightness.shape[1], self.brightness.shape[0]

    def depth_px(self, points_px: Floats) -> Floats:
        """Return the distance of points, (..., 2), from the middles of the outermost pixels. Negative outside."""
        width, height = self.size_px
        return depth_inside(points_px, (0, 0, width - 1, height - 1))


def read_photo(path: Path, key: str = "photo.file") -> Decoded:
    """Read a single 8-bit photo and turn it upright. Errors name the setting ``key``."""
    with opened(path, key) as photo:
        if photo.format in ("JPEG", "MPO"):
            # Pillow hides libjpeg's warnings. At an eighth of its size, the photo is decoded for them alone.
            simplejpeg.decode_jpeg(path.read_bytes(), "GRAY", min_height=1, min_width=1, min_factor=8)
        _require_square(path, photo)
        focal_px = _focal_px(photo)
        # libheif has already rotated a HEIC photo, and its EXIF then states no rotation.
        ImageOps.exif_transpose(photo, in_place=True)
        alpha = photo.convert("RGBA").getchannel("A") if photo.has_transparency_data else 255
        clear = float(np.mean(np.asarray(alpha) < 255))
        text = f"{clear:.2%} of the photo is transparent. The colours under the transparent part were used"
        doubts = (doubt("photo.transparent", text, clear),) if clear else ()
        pixels = np.asarray(_as_srgb(path, photo))
        return Decoded(image=pixels, focal_px=focal_px, warnings=doubts)


def take_photo(image: NDArray[np.generic], name: str) -> Decoded:
    """Check a photo in memory: uint8, (height, width) or (height, width, 3) RGB. Errors begin with ``name``."""
    image = np.asarray(image)
    if image.dtype != np.uint8 or image.ndim < 2 or image.shape[2:] not in ((), (3,)):
        raise InputError(
            f"{name}: the array has shape {image.shape} and type {image.dtype}. Give (height, width) or (height, "
            "width, 3) RGB of type uint8."
        )
    _check_size(name, image.shape[1], image.shape[0])
    rgb = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
    return Decoded(image=np.ascontiguousarray(rgb, np.uint8))


@contextmanager
def opened(path: Path, key: str) -> Iterator[Image.Image]:
    """Open a picture after checks of its header. Errors inside the block become InputErrors.

    ``key`` is the setting that names the file.
    """
    if not path.is_file():
        raise InputError(
            f"{path}: file not found, or not a regular file. {key} is relative to the folder of its trial file."
        )
    size = path.stat().st_size
    if not 0 < size <= LARGEST_FILE_BYTES:
        # Some decoders read the whole file into memory first.
        raise InputError(
            f"{path}: the file has {size / 1e6:.0f} MB. A picture must not be empty, and may have at most "
            f"{LARGEST_FILE_BYTES / 1e6:.0f} MB. Copy it again, or save it as PNG."
        )
    with path.open("rb") as file:
        start = file.read(LONGEST_HEAD)
    is_heic = start[4:8] == b"ftyp" and start[8:12] in HEIC_BRANDS
    colours = start.find(b"colrnclx")  # Box of a HEIC or AVIF picture (ISO 14496-12, 12.1.5)
    if colours >= 0 and int.from_bytes(start[colours + 10 : colours + 12]) not in CAMERA_CURVES:
        raise InputError(f"{path}: the file states an HDR tone curve. Save it as sRGB.")
    if is_heic:
        # Imported here: it takes memory and a tenth of a second.
        from pi_heif import register_heif_opener

        register_heif_opener(thumbnails=False, depth_images=False, aux_images=False)
    damaged = f"{path}: the picture is damaged or cut short. Copy or export it again."
    try:
        # Warnings are about metadata, and about sizes that are checked here. Pillow gets a file without a name: it maps
        # a file with a name into memory, and would read a rotated TIFF with the row length of the upright picture.
        with (
            warnings.catch_warnings(action="ignore"),
            path.open("rb") as file,
            Image.open(file, formats=("HEIF",) if is_heic else FORMATS) as photo,
        ):
            _check_header(path, photo)
            yield photo
    except Image.DecompressionBombError:
        raise InputError(f"{path}: {TOO_LARGE}") from None
    except Image.UnidentifiedImageError:
        if is_heic:
            raise InputError(damaged) from None
        raise InputError(f"{path}: not a readable photo or mask; {UNREADABLE}") from None
    except (OSError, SyntaxError, ValueError, EOFError, RuntimeError, MemoryError, struct.error, zlib.error):
        raise InputError(damaged) from None


def _check_header(path: Path, photo: Image.Image) -> None:
    if isinstance(photo, TiffImagePlugin.TiffImageFile):
        tags = photo.tag_v2
        # The first picture of a raw file is a thumbnail; a plain TIFF reader would take it for the photo.
        thumbnail = Base.SubIFDs in tags and tags.get(Base.NewSubfileType, 0) & 1
        if path.suffix.lower() in RAW_ENDINGS or Base.DNGVersion in tags or thumbnail:
            raise InputError(f"{path}: {RAW}")
    _check_size(path, *photo.size)
    # Pillow opens 16-bit colours as 8 bits. The arguments of its decoder show how they are stored.
    stored_as = str(getattr(photo, "tile", ""))
    if photo.mode.startswith(("I", "F")) or ";16" in stored_as:
        raise InputError(
            f"{path}: the picture has more than 8 bits per channel. Save it with 8 bits, for example as PNG."
        )
    if photo.mode == "CMYK":
        raise InputError(f"{path}: the picture's colours are inks (CMYK). Save it as RGB.")
    pages = getattr(photo, "n_frames", 1)
    # A second picture in a phone's JPEG, by Pillow's name MPO, is a preview.
    if photo.format != "MPO" and pages > 1:
        raise InputError(f"{path}: the file has {pages} pages or frames. Save only the one that shows the crack.")


def _check_size(name: Path | str, width: int, height: int) -> None:
    if width * height > MAX_PIXELS:
        raise InputError(f"{name}: the picture has {width} x {height} pixels, {TOO_LARGE}")
    if min(width, height) < MIN_SIDE_PX:
        raise InputError(
            f"{name}: the picture has {width} x {height} pixels. Each side must have at least {MIN_SIDE_PX}."
        )


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


def _focal_px(photo: Image.Image) -> float | None:
    """Return the focal length in px from the EXIF of a photo. None if it is unknown.

    Call this before the photo is rotated upright.
    """
    exif = photo.getexif().get_ifd(IFD.Exif)
    film_mm = exif.get(Base.FocalLengthIn35mmFilm)
    if not isinstance(film_mm, int) or film_mm <= 0:
        return None
    sides = [exif.get(tag) for tag in (Base.ExifImageWidth, Base.ExifImageHeight)]
    taken = [side for side in sides if isinstance(side, int) and side > 0]
    # A cropped photo has another aspect ratio than the camera's, and its angle of view is unknown.
    if len(taken) == 2 and abs(np.ptp(np.log(taken)) - np.ptp(np.log(photo.size))) > SQUARE:
        return None
    return film_mm * float(np.hypot(*photo.size)) / FULL_FRAME_DIAGONAL_MM


# Largest difference from a camera's exponent (sRGB: 2.1 to 2.25). It changes a width by less than 1 %
EXPONENT_TOLERANCE = 0.2


def _as_srgb(path: Path, photo: Image.Image) -> Image.Image:
    """Return the photo as RGB, converted from its ICC profile to sRGB.

    Raises InputError if the profile does not fit the photo, or, without a profile, if the file states a tone curve
    unlike a camera's: widths would be off by several percent.
    """
    content = photo.info.get("icc_profile")
    if not content:
        _require_usual_tone(path, photo)
        return photo.convert("RGB")
    # Imported here: not every photo needs it.
    from PIL import ImageCms

    try:
        profile = ImageCms.getOpenProfile(BytesIO(content))
        mode = "L" if content[16:20] == b"GRAY" else "RGB"  # Colour space in the profile's header
        shown = ImageCms.createProfile("sRGB")
        converted = ImageCms.profileToProfile(photo.convert(mode), profile, shown, outputMode="RGB")
    except (ImageCms.PyCMSError, OSError, ValueError):
        raise InputError(f"{path}: the file's ICC profile is unreadable or not the photo's. Save it as sRGB.") from None
    assert converted is not None
    return converted


def _require_usual_tone(path: Path, photo: Image.Image) -> None:
    exif, png = photo.getexif(), photo.info.get("gamma")
    # Exponents from stored value to light, by source
    stated: dict[str, Any] = {
        "PNG gAMA": 1 / png if png and "srgb" not in photo.info else None,
        "EXIF Gamma": exif.get_ifd(IFD.Exif).get(Base.Gamma),
        "TransferFunction": math.nan if Base.TransferFunction in exif else None,
    }
    for source, exponent in stated.items():
        try:
            gamma = float(exponent)
        except (TypeError, ValueError, ZeroDivisionError):
            continue
        if not abs(gamma - DISPLAY_GAMMA) <= EXPONENT_TOLERANCE:
            raise InputError(
                f"{path}: the file states a tone curve of gamma {gamma:.2g} ({source}) instead of a camera's usual "
                f"{DISPLAY_GAMMA:g}. Save it as sRGB."
            )


PAINTED = 128  # Minimum brightness or opacity, of 255, of a painted pixel
MAX_PAINTED = 0.5  # Largest painted fraction of a mask. More means that black and white are exchanged
# Values between these two are neither black nor white. Largest number of pixels that have the most frequent of these
# values, as a fraction of the painted pixels
PLAIN, OF_PAINT = (16, 240), 0.2
REMEDY = (
    "Does it contain object or class numbers from a labelling program? Paint the crack white on black, or opaque on "
    "transparent."
)


def take_mask(painted: NDArray[np.generic], size_px: Size, name: str) -> Booleans:
    """Check a mask in memory, (height, width). Pixels that are not 0 are painted.

    ``size_px`` is the photo's width and height. Raises InputError, with ``name`` first, if the shape is wrong, or if
    nothing or too much is painted.
    """
    painted = np.asarray(painted)
    if painted.shape != size_px[::-1]:
        raise InputError(
            f"{name}: the array has shape {painted.shape}. The photo is {size_px[0]} x {size_px[1]} px, so give an "
            f"array of shape {size_px[::-1]}."
        )
    return _soundly_painted(painted.astype(bool), name, "pixels that are not 0 are painted")


def read_mask(path: Path, size_px: Size) -> Booleans:
    """Read a painted mask, (height, width). Opaque pixels are painted, or bright ones if the opacity is constant.

    Raises InputError if the size differs from ``size_px``, the photo's width and height, if many pixels are neither
    black nor white, or if nothing or too much is painted.
    """
    with opened(path, "photo.mask") as picture:
        ImageOps.exif_transpose(picture, in_place=True)
        if picture.size != size_px:
            raise InputError(
                f"{path}: the mask is {picture.width} x {picture.height} px, but the photo is {size_px[0]} x "
                f"{size_px[1]} px. Paint the mask over the photo itself, upright and at full size."
            )
        opacity = picture.convert("RGBA").getchannel("A") if picture.has_transparency_data else None
        # Editors add an opaque alpha channel to any picture.
        by_opacity = opacity is not None and opacity.getextrema() != (255, 255)
        shown = np.asarray(opacity if by_opacity else picture.convert("L"), np.uint8)
    kind = "opacity" if by_opacity else "brightness"
    if shown.max() < PAINTED:
        raise InputError(
            f"{path}: the mask paints nothing: its largest {kind} is {shown.max()} of 255, and painted pixels need at "
            f"least {PAINTED}. {REMEDY}"
        )
    painted = _soundly_painted(shown >= PAINTED, path, f"pixels with a {kind} of {PAINTED} to 255 are painted")
    count = np.bincount(shown.ravel(), minlength=256)
    between = PLAIN[0] + int(np.argmax(count[PLAIN[0] : PLAIN[1]]))
    if count[between] > OF_PAINT * np.count_nonzero(painted):
        raise InputError(
            f"{path}: {count[between]} px of the mask have the {kind} {between} of 255, which is neither painted nor "
            f"unpainted. {REMEDY}"
        )
    return painted


def _soundly_painted(painted: Booleans, name: Path | str, rule: str) -> Booleans:
    share = float(np.mean(painted))
    if not 0 < share <= MAX_PAINTED:
        raise InputError(
            f"{name}: the mask paints {share:.0%} of the photo. It must paint something, and at most "
            f"{MAX_PAINTED:.0%} ({rule}). Are black and white exchanged? {REMEDY}"
        )
    return painted
