"""Read masks: a crack painted by a person or a program, as an area of two values."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import ImageOps

from digitise.image.decoding import opened
from sealtwin.core.errors import InputError

PAINTED = 128  # Least brightness, or opacity, of 255 of a painted pixel
MOST_PAINTED = 0.5  # Largest painted share of a mask; above it, black and white are exchanged
PLAIN, OF_PAINT = (16, 240), 0.2  # Values between are neither black nor white; largest share of paint with one of them
REMEDY = (
    "Does it contain object or class numbers from a labelling program? Paint the crack white on black, or opaque on "
    "transparent."
)


def take_mask(painted: NDArray[np.generic], size_px: tuple[int, int], name: str) -> NDArray[np.bool_]:
    """Check a mask in memory, (height, width); ``size_px`` is the photo's. Pixels that are not 0 are painted."""
    painted = np.asarray(painted)
    if painted.shape != size_px[::-1]:
        raise InputError(
            f"{name}: an array of shape {painted.shape}; the photo is {size_px[0]} x {size_px[1]} px, so give an "
            f"array of shape {size_px[::-1]}."
        )
    return _soundly_painted(painted.astype(bool), name, "pixels that are not 0 are painted")


def read_mask(path: Path, size_px: tuple[int, int]) -> NDArray[np.bool_]:
    """Read a painted mask, (height, width): the opaque pixels if opacity varies, else the bright ones.

    Raises InputError if the size is not ``size_px``, the photo's width and height, if there are more than two values,
    or if the mask paints no crack.
    """
    with opened(path, "photo.mask") as picture:
        ImageOps.exif_transpose(picture, in_place=True)
        if picture.size != size_px:
            raise InputError(
                f"{path}: the mask is {picture.width} x {picture.height} px, the photo {size_px[0]} x {size_px[1]}; "
                "paint it over the photo itself, upright and at full size."
            )
        opacity = picture.convert("RGBA").getchannel("A") if picture.has_transparency_data else None
        # Editors add an opaque alpha channel to any picture.
        by_opacity = opacity is not None and opacity.getextrema() != (255, 255)
        shown = np.asarray(opacity if by_opacity else picture.convert("L"), dtype=np.uint8)
    kind = "opacity" if by_opacity else "brightness"
    if shown.max() < PAINTED:
        raise InputError(
            f"{path}: the mask paints nothing: its largest {kind} is {shown.max()} of 255, but paint needs at least "
            f"{PAINTED}. {REMEDY}"
        )
    painted = shown >= PAINTED
    _soundly_painted(painted, path, f"pixels with a {kind} of {PAINTED} to 255 are painted")
    count = np.bincount(shown.ravel(), minlength=256)
    between = PLAIN[0] + int(np.argmax(count[PLAIN[0] : PLAIN[1]]))
    if count[between] > OF_PAINT * np.count_nonzero(painted):
        raise InputError(
            f"{path}: {count[between]} px of the mask have the {kind} {between} of 255, which is neither painted nor "
            f"unpainted. {REMEDY}"
        )
    return painted


def _soundly_painted(painted: NDArray[np.bool_], name: Path | str, rule: str) -> NDArray[np.bool_]:
    share = float(np.mean(painted))
    if not 0 < share <= MOST_PAINTED:
        raise InputError(
            f"{name}: the mask paints {share:.0%} of the photo; a crack is more than nothing and at most "
            f"{MOST_PAINTED:.0%} ({rule}). Are black and white exchanged? {REMEDY}"
        )
    return painted
