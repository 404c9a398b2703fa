"""Public reports on photos and masks."""

from pathlib import Path

import cv2
import numpy as np
import tifffile
from PIL import Image, ImageCms

from tests.slow.reports.files import CRACK_PX, WIDTH_PX, grey, photo
from tests.slow.reports.table import (
    CLICKED,
    LENGTH,
    SCALED,
    WIDE,
    WIDTH,
    Maker,
    refused,
    report,
    right,
    warned,
)

CRACK_MM = 44.12
"""Length of the crack at 0.1 mm per pixel, with its round ends."""
JPG, TIF = (f"digitise photo.{ending} {CLICKED}" for ending in ("jpg", "tif"))
JPG_MASK, PNG_MASK, TIF_MASK = (f"digitise photo.png --mask mask.{ending} {SCALED}" for ending in ("jpg", "png", "tif"))
LENGTH_RIGHT = right(LENGTH, CRACK_MM, 1.5)


def painted() -> np.ndarray:
    """Return the mask of the crack, 255 on 0."""
    mask = np.zeros((300, 500), dtype=np.uint8)
    cv2.polylines(mask, [np.array(CRACK_PX, dtype=np.int32)], False, 255, WIDTH_PX)
    return mask


def _srgb() -> bytes:
    return ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


def rgb() -> Image.Image:
    return Image.fromarray(grey()).convert("RGB")


def tagged(orientation: int) -> Image.Exif:
    tags = Image.Exif()
    tags[274] = orientation
    return tags


def masked(save: Maker) -> Maker:
    """Return a function that writes the photo, and its mask by ``save``."""
    return lambda folder: (photo(folder), save(folder))


@report(
    "divamgupta/image-segmentation-keras/issues/11",
    PNG_MASK,
    right(WIDTH, 2.1, 0.3),
    refused("mask.png", "grey|values|between"),
)
def mask_enlarged(folder: Path) -> None:
    """Masks that are resized bilinearly have values between the labels."""
    photo(folder)
    small = (cv2.resize(painted(), (125, 75), interpolation=cv2.INTER_AREA) > 127).astype(np.uint8) * 255
    cv2.imwrite(str(folder / "mask.png"), cv2.resize(small, (500, 300), interpolation=cv2.INTER_LINEAR))


# A grey TIFF whose 0 is white is read inverted. The file is a mask with this tag, 262.
report("darktable-org/darktable/pull/18815", TIF_MASK, WIDE, refused("mask.tif", "white|inverted"))(
    masked(lambda folder: tifffile.imwrite(folder / "mask.tif", 255 - painted(), photometric="miniswhite"))
)


@report(
    "karlch/vimiv-qt/issues/51",
    f"digitise photo.jpg --mask mask.png {SCALED}",
    refused("mask"),
    warned("photo.mask", "rotated"),
)
def stale_orientation(folder: Path) -> None:
    """A picture is turned twice, since an editor turned it and left the tag."""
    rgb().save(folder / "photo.jpg", quality=95, exif=tagged(3).tobytes())
    Image.fromarray(painted()).save(folder / "mask.png")


# A mask that was saved as JPEG has all values.
report("arahusky/Tensorflow-Segmentation/issues/11", JPG_MASK, WIDE, refused("mask.jpg", "jpeg|between|brightness"))(
    masked(lambda folder: Image.fromarray(painted()).save(folder / "mask.jpg", quality=60))
)


# A TIFF whose 0 is white is read inverted if it has a colour profile.
report("haraldk/TwelveMonkeys/issues/455", TIF, LENGTH_RIGHT, refused("photo.tif", "icc|profile|white"))(
    lambda folder: tifffile.imwrite(folder / "photo.tif", 255 - grey(), photometric="miniswhite", iccprofile=_srgb())
)


# A grey JPEG has the colour profile of the picture that it was made from.
report("wavexx/fgallery/issues/26", JPG, LENGTH_RIGHT, refused("photo.jpg", "icc|profile"))(
    lambda folder: Image.fromarray(grey()).save(folder / "photo.jpg", quality=95, icc_profile=_srgb())
)
