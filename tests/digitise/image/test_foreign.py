import struct
from pathlib import Path

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
        (box(b"hevc"), "burst.heic", "videos are not read"),
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


HEIC = Path(__file__).parents[3] / "fixtures" / "heic"
GREYS = np.array([[250, 180], [120, 60]])


@pytest.mark.parametrize("quarters", range(4))
@pytest.mark.parametrize("name", ["turned", "mirrored"])
def test_heic_is_turned_once_whatever_its_exif_states(tmp_path, name, quarters):
    """By irot, quarters counter-clockwise, then imir, here left to right: the eight orientations (ISO 23008-12, 6.5).

    The EXIF says 5 or 6 throughout. The photo is named as a JPEG: the content says what it is.
    """
    content = bytearray((HEIC / f"{name}.heic").read_bytes())
    content[content.index(b"irot") + 4] = quarters
    if name == "mirrored":
        content[content.index(b"imir") + 4] = 1
    (tmp_path / "photo.jpg").write_bytes(content)
    decoded = read_photo(tmp_path / "photo.jpg")
    height, width = decoded.image.shape[:2]
    seen = decoded.image[height // 4 :: height // 2, width // 4 :: width // 2, 0].astype(int)
    shown = np.rot90(GREYS, quarters)
    assert np.abs(seen - (shown[:, ::-1] if name == "mirrored" else shown)).max() < 6
    assert decoded.focal_px == pytest.approx(26 * 160 / np.hypot(36, 24))
    assert decoded.warnings == ()


@pytest.mark.parametrize(("name", "says"), [("two", "2 pages or frames"), ("ten", "more than 8 bits")])
def test_heic_of_several_pictures_or_of_10_bits_is_refused(name, says):
    with pytest.raises(InputError, match=rf"{name}\.heic: .*{says}"):
        read_photo(HEIC / f"{name}.heic")


@pytest.mark.parametrize("content", [b"II*\0", b"MM\0*" + b"\xff" * 4, b"II*\0\x08\0\0\0\xff\xff", b"x"])
def test_a_stump_of_a_tiff_is_no_photo_and_no_fault_of_ours(tmp_path, content):
    path = tmp_path / "photo.tif"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"photo\.tif: "):
        read_photo(path)
