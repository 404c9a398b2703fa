import struct

import numpy as np
import pytest
from PIL import Image

from digitise.pictures.decoding import read_photo
from digitise.pictures.foreign import foreign_format
from sealtwin.errors import InputError


def box(brand: bytes) -> bytes:
    """The first box of an ISO media file: its length, its kind, its major brand."""
    return struct.pack(">I", 24) + b"ftyp" + brand + bytes(12)


def tiff(*entries: tuple[int, int, int], order: str = "<", at: int = 8, start: bytes = b"") -> bytes:
    """A TIFF whose first picture has tags of one number each: tag, type (3: two bytes, 4: four) and value."""
    mark = b"II*\0" if order == "<" else b"MM\0*"
    directory = struct.pack(order + "H", len(entries))
    for tag, kind, value in entries:
        directory += struct.pack(order + "HHI", tag, kind, 1)
        directory += struct.pack(order + "HH", value, 0) if kind == 3 else struct.pack(order + "I", value)
    return (mark + struct.pack(order + "I", at) + start).ljust(at, b"\0") + directory + bytes(4)


MAKE, SUBFILE, SUB_PICTURES, DNG = 271, 254, 330, 50706
THUMBNAIL_FIRST = ((SUBFILE, 4, 1), (MAKE, 4, 200), (SUB_PICTURES, 4, 400))


@pytest.mark.parametrize(
    ("content", "name", "said"),
    [
        (box(b"heic"), "IMG_1.HEIC", "this is HEIC"),
        (box(b"heix"), "renamed.jpg", "this is HEIC"),
        (box(b"mif1"), "photo.heif", "this is HEIF"),
        (box(b"avif"), "photo.avif", "this is AVIF"),
        (box(b"crx "), "photo.cr3", r"Canon \(CR3\)"),
        (b"FUJIFILMCCD-RAW 0201", "photo.raf", r"Fujifilm \(RAF\)"),
        (b"IIU\0" + bytes(20), "photo.rw2", r"Panasonic \(RW2\)"),
        (b"IIRO" + bytes(20), "photo.orf", r"Olympus \(ORF\)"),
        (tiff(start=b"CR\2\0", at=16), "photo.jpg", r"Canon \(CR2\)"),
        (tiff((DNG, 4, 1025)), "photo.tif", r"Adobe \(DNG\)"),
        (tiff((DNG, 4, 1025), order=">", at=4000), "photo.dng", r"Adobe \(DNG\)"),
        (tiff(*THUMBNAIL_FIRST), "photo.tif", "thumbnail first"),
        (tiff((MAKE, 4, 200)), "photo.NEF", r"Nikon \(NEF\)"),
        (tiff((MAKE, 4, 200)), "photo.arw", r"Sony \(ARW\)"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_photo_that_is_not_read_is_named_by_its_content(tmp_path, content, name, said):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"{name}: .*{said}.* save it as JPEG at full size"):
        read_photo(path)


@pytest.mark.parametrize("ending", ["tif", "png", "jpg", "webp", "bmp"])
def test_a_photo_that_is_read_is_not_taken_for_another(tmp_path, ending):
    path = tmp_path / f"photo.{ending}"
    exif = Image.Exif()
    exif[MAKE] = "NIKON CORPORATION"
    Image.fromarray(np.full((80, 80, 3), 100, dtype=np.uint8)).save(path, exif=exif)
    assert foreign_format(path) is None
    read_photo(path)


def test_a_tiff_whose_first_picture_is_the_photo_may_have_smaller_ones_after_it(tmp_path):
    path = tmp_path / "pyramid.tif"
    path.write_bytes(tiff((SUBFILE, 4, 0), (SUB_PICTURES, 4, 400)))
    assert foreign_format(path) is None


def test_a_jpeg_with_a_raw_files_name_is_a_jpeg(tmp_path):
    path = tmp_path / "photo.nef"
    Image.fromarray(np.full((80, 80, 3), 100, dtype=np.uint8)).save(path, format="JPEG")
    assert read_photo(path).image.shape == (80, 80, 3)


@pytest.mark.parametrize("content", [b"II*\0", b"MM\0*" + b"\xff" * 4, b"II*\0\x08\0\0\0\xff\xff", b"x", tiff()[:9]])
def test_a_stump_of_a_tiff_is_no_photo_and_no_fault_of_ours(tmp_path, content):
    path = tmp_path / "photo.tif"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"no photo that can be read|cut short"):
        read_photo(path)
