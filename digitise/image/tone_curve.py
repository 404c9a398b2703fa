"""Read the tone curve that a photo's file states, and apply it if it differs from a camera's."""

from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
from PIL import Image, TiffImagePlugin
from PIL.ExifTags import IFD, Base

from sealtwin.core.errors import present
from sealtwin.core.records import Floats

DISPLAY_GAMMA = 2.2  # Exponent from stored brightness to light, about a camera's: half contrast is half the light
NEAR = 0.2  # Largest difference of a camera's exponent (sRGB: 2.1 to 2.25); a width changes by under 1 %
MIDDLE = np.arange(64, 192)  # Stored values from which a curve's exponent is taken; below is a straight piece
LARGEST_GAMMA = 6.0  # Largest plausible exponent; its inverse is the smallest
MODE_OF = {b"RGB ": "RGB", b"GRAY": "L"}  # Mode of the pixels for each colour space of a profile that is used
GREY_MODES = ("1", "L", "LA")

Curve = Callable[[Floats], Floats]


def as_displayed(photo: Image.Image) -> tuple[Image.Image, tuple[str, ...]]:
    """Return the photo in RGB for ``DISPLAY_GAMMA``, and a warning if its file states another tone curve.

    Values do not change if the file states no curve, or one close to a camera's.
    """
    if profile := photo.info.get("icc_profile"):
        return _by_profile(photo, profile)
    rgb = _in_rgb(photo)
    if (stated := _stated(photo)) is None:
        return rgb, ()
    curve, source = stated
    light = np.clip(curve(np.arange(256) / 255), 0, 1)
    gamma = _exponent(light)
    if abs(gamma - DISPLAY_GAMMA) <= NEAR:
        return rgb, ()
    table = np.rint(255 * light ** (1 / DISPLAY_GAMMA)).astype(np.uint8)
    return rgb.point(table.tolist() * 3), (_warning(gamma, source),)


def _in_rgb(photo: Image.Image) -> Image.Image:
    return photo if photo.mode == "RGB" else photo.convert("RGB")


def _warning(gamma: float, source: str) -> str:
    return (
        f"the photo's file states a tone curve of gamma {gamma:.2g} ({source}), which was used instead of a camera's "
        f"usual {DISPLAY_GAMMA:g}. If it is wrong, widths are off by several percent: save the photo as sRGB"
    )


def _exponent(light: Floats) -> float:
    """Return the exponent of a curve in the middle of its range; ``light`` is given for each of 256 stored values."""
    return float(np.median(np.log(np.maximum(light[MIDDLE], 1e-6)) / np.log(MIDDLE / 255)))


def _stated(photo: Image.Image) -> tuple[Curve, str] | None:
    """Return the tone curve that the file states outside its ICC profile, from stored value to light, and its source.

    Values and light are from 0 to 1. None if the file states no curve there.
    """
    if photo.format == "PNG":
        gamma = photo.info.get("gamma")
        return None if "srgb" in photo.info or not gamma else _power(1 / gamma, "PNG gAMA")
    if isinstance(photo, TiffImagePlugin.TiffImageFile) and (table := photo.tag_v2.get(Base.TransferFunction)):
        values = np.array(table[:256], dtype=float) / 65535
        if len(values) == 256:
            return lambda stored: np.interp(stored, np.arange(256) / 255, values), "TIFF TransferFunction"
    gamma = photo.getexif().get_ifd(IFD.Exif).get(Base.Gamma)
    return None if gamma is None else _power(gamma, "EXIF Gamma")


def _power(gamma: Any, source: str) -> tuple[Curve, str] | None:
    try:
        exponent = float(gamma)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    if not 1 / LARGEST_GAMMA <= exponent <= LARGEST_GAMMA:
        return None
    return lambda stored: stored**exponent, source


def _by_profile(photo: Image.Image, content: bytes) -> tuple[Image.Image, tuple[str, ...]]:
    """Return the photo converted by its ICC profile if that has another tone curve than a camera's."""
    # Imported here: few photos need it.
    from PIL import ImageCms

    grey = Image.fromarray(np.arange(256, dtype=np.uint8)[None])
    try:
        profile, srgb = ImageCms.getOpenProfile(BytesIO(content)), ImageCms.createProfile("sRGB")
        mode = MODE_OF.get(content[16:20])  # The colour space in a profile's header
        if mode is None or photo.mode == "CMYK" or (mode == "L" and photo.mode not in GREY_MODES):
            # The profile is for inks, or for other pixels than these.
            return _in_rgb(photo), ()

        def by_profile(picture: Image.Image) -> Image.Image:
            intent = ImageCms.Intent.RELATIVE_COLORIMETRIC
            shown = ImageCms.profileToProfile(picture.convert(mode), profile, srgb, intent, "RGB")
            return present(shown, "the picture in sRGB")

        ramp = np.asarray(by_profile(grey), dtype=float)[0].mean(axis=1) / 255
        gamma = _exponent(ramp**DISPLAY_GAMMA)
        if abs(gamma - DISPLAY_GAMMA) <= NEAR:
            return _in_rgb(photo), ()
        return by_profile(photo), (_warning(gamma, "ICC profile"),)
    except (ImageCms.PyCMSError, OSError, ValueError, TypeError):
        return _in_rgb(photo), (
            "the photo's ICC profile cannot be read: a camera's usual tone curve (gamma) is assumed. If the photo "
            "has another, widths are off by several percent: save the photo as sRGB",
        )
