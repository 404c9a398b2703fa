"""Photos and masks."""

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import tifffile
from PIL import Image, ImageCms

import sealtwin as st
from tests.slow.reports.files import CRACK_PX, WIDTH_PX, grey, photo, small_crack
from tests.slow.reports.table import (
    CLICKED,
    LENGTH,
    SCALED,
    WIDE,
    WIDTH,
    Command,
    Maker,
    refused,
    report,
    right,
    warned,
)
from tests.support.photos import mortar, with_crack

CRACK_MM = 44.12
"""Length of the crack at 0.1 mm per pixel, with its round ends."""
JPG, PNG, TIF = (f"digitise photo.{ending} {CLICKED}" for ending in ("jpg", "png", "tif"))
JPG_MASK, PNG_MASK, TIF_MASK = (f"digitise photo.png --mask mask.{ending} {SCALED}" for ending in ("jpg", "png", "tif"))
LENGTH_RIGHT = right(LENGTH, CRACK_MM, 1.5)


def painted() -> np.ndarray:
    """Return the mask of the crack, 255 on 0."""
    mask = np.zeros((300, 500), dtype=np.uint8)
    cv2.polylines(mask, [np.array(CRACK_PX, dtype=np.int32)], False, 255, WIDTH_PX)
    return mask


def _png_of_two_bits(path: Path, values: np.ndarray) -> None:
    """Write a grey PNG of values 0 to 3, four to a byte, by its specification."""

    def chunk(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    height, width = values.shape
    bits = np.unpackbits(values.astype(np.uint8)[..., None], axis=-1)[..., 6:]
    content = b"".join(b"\0" + row.tobytes() for row in np.packbits(bits.reshape(height, -1), axis=1))
    head = struct.pack(">IIBBBBB", width, height, 2, 0, 0, 0, 0)
    chunks = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(content)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


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


def between(*ends_px: tuple[float, float]) -> Command:
    return lambda: st.trace_crack(st.read_photo("crack.png", mm_per_px=0.1), ends_px=ends_px)


def square_photo(folder: Path) -> None:
    small_crack(folder / "crack.png")


@report(
    "divamgupta/image-segmentation-keras/issues/11",
    PNG_MASK,
    right(WIDTH, 2.1, 0.3),
    refused("mask.png", "grey|values|between"),
)
def mask_enlarged(folder: Path) -> None:
    """Masks resized bilinearly hold values between the labels."""
    photo(folder)
    small = (cv2.resize(painted(), (125, 75), interpolation=cv2.INTER_AREA) > 127).astype(np.uint8) * 255
    cv2.imwrite(str(folder / "mask.png"), cv2.resize(small, (500, 300), interpolation=cv2.INTER_LINEAR))


@report("jimp-dev/jimp/issues/816", TIF, refused("photo.tif", "page"), warned("page"))
def two_pages(folder: Path) -> None:
    """Of a TIFF with several pages the first is taken, without a word."""
    first, second = Image.fromarray(grey(WIDTH_PX // 2)), Image.fromarray(grey())
    first.save(folder / "photo.tif", save_all=True, append_images=[second])


@report("haraldk/TwelveMonkeys/issues/184", TIF, LENGTH_RIGHT, refused("photo.tif", "planar|plane"))
def planar_tiff(folder: Path) -> None:
    """A TIFF whose colours lie in planes is taken for one with interleaved colours."""
    planes = np.stack([grey(), 0.9 * grey(), 0.75 * grey()]).astype(np.uint8)
    tifffile.imwrite(folder / "photo.tif", planes, photometric="rgb", planarconfig="separate")


# A grey TIFF whose 0 is white is read inverted. A mask in a TIFF whose 0 is white, by its tag 262.
report("darktable-org/darktable/pull/18815", TIF_MASK, WIDE, refused("mask.tif", "white|inverted"))(
    masked(lambda folder: tifffile.imwrite(folder / "mask.tif", 255 - painted(), photometric="miniswhite"))
)


# A grey PNG of few bits is all black.
report("michaelrsweet/pappl/issues/267", PNG_MASK, WIDE, refused("mask.png", "bit"))(
    masked(lambda folder: _png_of_two_bits(folder / "mask.png", painted() // 85))
)


@report("RodDalBen/SHINE_color/issues/11", PNG_MASK, WIDE, refused("mask.png", "transparen|alpha|white|whole|all of"))
def mask_by_transparency(folder: Path) -> None:
    """What is transparent in a PNG becomes as coloured as the rest."""
    photo(folder)
    white = np.full((*painted().shape, 3), 255, dtype=np.uint8)
    Image.fromarray(np.dstack([white, painted()])).save(folder / "mask.png")


@report(
    "opencv/opencv/issues/6468",
    f"digitise photo.jpg --ends 150,40 160,460 {SCALED}",
    refused("photo.jpg", "cut short|truncat|ends early|ends before|incomplete|damaged|missing"),
)
def jpeg_cut_short(folder: Path) -> None:
    """A JPEG that ends early is read, what is missing being grey."""
    light = with_crack(mortar((300, 500)), [(150, 40), (140, 250), (160, 460)], WIDTH_PX)
    values = np.rint(255 * np.clip(light, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    path = folder / "photo.jpg"
    Image.fromarray(values).convert("RGB").save(path, quality=92)
    content = path.read_bytes()
    path.write_bytes(content[: int(0.55 * len(content))])


# Probabilities from 0 to 1 in floats become zeros.
report("ilastik/ilastik/issues/1068", TIF_MASK, WIDE, refused("mask.tif", "float|32|8 bits"))(
    masked(lambda folder: Image.fromarray((painted() / 255).astype(np.float32), mode="F").save(folder / "mask.tif"))
)


# Points are given as row and column where column and row are meant.
report(
    "scikit-image/scikit-image/issues/2523",
    between((101, 40), (98, 160)),
    refused("crack.png"),
    refused("dark|no crack|bare|ground|not on"),
)(square_photo)


@report(
    "karlch/vimiv-qt/issues/51",
    f"digitise photo.jpg --mask mask.png {SCALED}",
    refused("mask"),
    warned("photo.mask", "turned"),
)
def stale_orientation(folder: Path) -> None:
    """A picture is turned twice, since an editor turned it and left the tag."""
    rgb().save(folder / "photo.jpg", quality=95, exif=tagged(3).tobytes())
    Image.fromarray(painted()).save(folder / "mask.png")


# A mask that was saved as JPEG holds all values.
report("arahusky/Tensorflow-Segmentation/issues/11", JPG_MASK, WIDE, refused("mask.jpg", "jpeg|between|brightness"))(
    masked(lambda folder: Image.fromarray(painted()).save(folder / "mask.jpg", quality=60))
)


# A mask comes out with width and height exchanged.
report("mantasu/glasses-detector/issues/22", PNG_MASK, refused("mask.png", "300 x 500"))(
    masked(lambda folder: Image.fromarray(painted().reshape(500, 300)).save(folder / "mask.png"))
)


# The ending of a file's name is not that of its format.
report("koral--/android-gif-drawable/issues/286", PNG, LENGTH_RIGHT, refused("photo.png", "webp|png"))(
    lambda folder: rgb().save(folder / "photo.png", "WEBP", lossless=True)
)


# A TIFF whose 0 is white comes out inverted where it has a colour profile.
report("haraldk/TwelveMonkeys/issues/455", TIF, LENGTH_RIGHT, refused("photo.tif", "icc|profile|white"))(
    lambda folder: tifffile.imwrite(folder / "photo.tif", 255 - grey(), photometric="miniswhite", iccprofile=_srgb())
)


# A grey picture with a profile of colours. A grey JPEG that kept the profile of the colours it had.
report("wavexx/fgallery/issues/26", JPG, LENGTH_RIGHT, refused("photo.jpg", "icc|profile"))(
    lambda folder: Image.fromarray(grey()).save(folder / "photo.jpg", quality=95, icc_profile=_srgb())
)


@report("MouseLand/cellpose/issues/740", PNG_MASK, WIDE, refused("mask.png", "pieces|parts|two|2 "))
def mask_with_a_speck(folder: Path) -> None:
    """A mask has one pixel more, far from what it is of. A mask with one more pixel, far from the crack."""
    photo(folder)
    mask = painted()
    mask[280, 20] = 255
    Image.fromarray(mask).save(folder / "mask.png")
