import struct

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin

from digitise.image.decoding import read_photo
from sealtwin.core.errors import InputError


def box(brand: bytes) -> bytes:
    """The first box of an ISO media file: its length, its kind, its major brand."""
    return struct.pack(">I", 24) + b"ftyp" + brand + bytes(12)


MAKE = 271


def write_tiff(path, **tags):
    info = TiffImagePlugin.ImageFileDirectory_v2()
    for number, value in tags.items():
        info.tagtype[int(number[1:])] = 4
        info[int(number[1:])] = value
    Image.fromarray(np.full((80, 80, 3), 100, dtype=np.uint8)).save(path, format="TIFF", tiffinfo=info)


@pytest.mark.parametrize(
    ("content", "name", "kind"),
    [
        (box(b"heic"), "IMG_1.HEIC", "this is HEIC"),
        (box(b"heix"), "renamed.jpg", "this is HEIC"),
        (box(b"mif1"), "photo.heif", "HEIF"),
        (box(b"avif"), "photo.avif", "AVIF"),
        (box(b"crx "), "photo.cr3", "raw file"),
        (b"FUJIFILMCCD-RAW 0201", "photo.raf", "raw file"),
        (b"IIU\0" + bytes(20), "photo.RW2", "raw file"),
        # TIFFs: by its ending, a DNG, and one whose thumbnail comes first and would be read.
        ({}, "photo.NEF", "raw file"),
        ({"t50706": 1025}, "photo.tif", "raw file"),
        ({"t254": 1, "t330": 400}, "photo.tif", "raw file"),
    ],
    ids=str,
)
def test_a_photo_that_is_not_read_is_named_with_the_remedy(tmp_path, content, name, kind):
    if isinstance(content, dict):
        write_tiff(tmp_path / name, **content)
    else:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=rf"{name}: .*{kind}.* save it as JPEG at full size"):
        read_photo(tmp_path / name)


@pytest.mark.parametrize("name", ["a.tif", "a.png", "a.jpg", "a.webp", "a.bmp", "jpeg.nef", "pyramid.tif"])
def test_a_photo_that_is_read_is_not_taken_for_another(tmp_path, name):
    """A JPEG with a raw file's name is a JPEG; a TIFF whose first picture is the photo may have smaller ones after."""
    exif = Image.Exif()
    exif[MAKE] = "NIKON CORPORATION"
    if name == "pyramid.tif":
        write_tiff(tmp_path / name, t254=0, t330=400)
    else:
        form = "JPEG" if name == "jpeg.nef" else None
        Image.fromarray(np.full((80, 80, 3), 100, dtype=np.uint8)).save(tmp_path / name, form, exif=exif)
    assert read_photo(tmp_path / name).image.shape == (80, 80, 3)


@pytest.mark.parametrize("content", [b"II*\0", b"MM\0*" + b"\xff" * 4, b"II*\0\x08\0\0\0\xff\xff", b"x"])
def test_a_stump_of_a_tiff_is_no_photo_and_no_fault_of_ours(tmp_path, content):
    path = tmp_path / "photo.tif"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"photo\.tif: "):
        read_photo(path)
