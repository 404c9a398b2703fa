"""The tone curve of a camera, and a check that a photo's file states no other."""

import math
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from PIL.ExifTags import IFD, Base

from sealtwin.core.errors import InputError

DISPLAY_GAMMA = 2.2  # Exponent from stored brightness to light, about a camera's: half contrast is half the light
NEAR = 0.2  # Largest difference of a camera's exponent (sRGB: 2.1 to 2.25); a width changes by under 1 %
MIDDLE = 128  # Stored value from which a curve's exponent is taken
MODE_OF = {b"RGB ": "RGB", b"GRAY": "L"}  # Mode of the pixels for each colour space of a profile that is checked


def require_usual_tone(path: Path, photo: Image.Image) -> None:
    """Raise InputError if the file states another tone curve than a camera's: widths would be off by several percent.

    Nothing is converted, so that photos with the curve of sRGB in other colours, as phones save them, stay as they are.
    """
    for source, stated in _stated(photo).items():
        try:
            gamma = float(stated)
        except (TypeError, ValueError, ZeroDivisionError):
            continue
        if not abs(gamma - DISPLAY_GAMMA) <= NEAR:
            curve = f"an unreadable {source}" if math.isnan(gamma) else f"gamma {gamma:.2g} ({source})"
            raise InputError(
                f"{path}: the file states a tone curve of {curve}, not a camera's usual {DISPLAY_GAMMA:g}. Save it as "
                "sRGB."
            )


def _stated(photo: Image.Image) -> dict[str, Any]:
    """Return the exponents from stored value to light that the file states, by their source. NaN if it is not read."""
    exif, png = photo.getexif(), photo.info.get("gamma")
    return {
        "PNG gAMA": 1 / png if png and "srgb" not in photo.info else None,
        "EXIF Gamma": exif.get_ifd(IFD.Exif).get(Base.Gamma),
        "TransferFunction": math.nan if Base.TransferFunction in exif else None,
        "ICC profile": _of_profile(photo.info.get("icc_profile")),
    }


def _of_profile(content: bytes | None) -> float | None:
    """Return the exponent of an ICC profile. NaN if it cannot be read, None if it is not for red, green, blue or grey.

    A grey is converted to sRGB, whose exponent is ``DISPLAY_GAMMA``.
    """
    if not content:
        return None
    # Imported here: not every photo needs it.
    from PIL import ImageCms

    try:
        profile = ImageCms.getOpenProfile(BytesIO(content))
        mode = MODE_OF.get(content[16:20])  # The colour space in a profile's header
        if mode is None:
            return None
        grey = Image.new("L", (1, 1), MIDDLE).convert(mode)
        shown = ImageCms.profileToProfile(grey, profile, ImageCms.createProfile("sRGB"), outputMode="RGB")
        return DISPLAY_GAMMA * math.log(max(np.asarray(shown).mean(), 1) / 255) / math.log(MIDDLE / 255)
    except (ImageCms.PyCMSError, OSError, ValueError):
        return math.nan
