import re
import struct
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image, ImageCms, TiffImagePlugin

from digitise.image.decoding import read_photo, take_mask, take_photo
from sealtwin.core.errors import InputError
from tests.support.paths import ROOT


def write_bomb(path, side=20_000):
    """A PNG of ``side`` x ``side`` black bits: a few hundred kB that become 1.2 GB as RGB."""
    packer = zlib.compressobj(1)
    rows = bytes((side // 8 + 1) * 1000)
    pixels = b"".join(packer.compress(rows) for _ in range(side // 1000)) + packer.flush()
    header = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)
    chunks = [name + content for name, content in ((b"IHDR", header), (b"IDAT", pixels), (b"IEND", b""))]
    packed = [struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) for chunk in chunks]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(packed))


@pytest.fixture
def picture():
    return np.random.default_rng(1).integers(0, 255, (80, 100, 3), dtype=np.uint8)


def refusal(path) -> str:
    with pytest.raises(InputError) as caught:
        read_photo(path)
    text = str(caught.value)
    assert str(path) in text
    assert "\n" not in text
    return text


def several(path, picture):
    pages = [Image.fromarray(np.roll(picture, 20 * i, axis=1)) for i in range(3)]
    pages[0].save(path, save_all=True, append_images=pages[1:])


def deep(path, picture):
    assert cv2.imwrite(str(path), picture.astype(np.uint16) * 257)


@pytest.mark.parametrize(
    ("name", "write", "says"),
    [
        ("a.jpg", lambda path, _: path.mkdir(), "not a regular file"),
        ("a.jpg", lambda path, _: path.touch(), "0 MB"),
        ("a.jpg", lambda path, _: path.write_text("this is not a photo\n" * 50), "JPEG, PNG"),
        ("a.png", lambda path, picture: Image.fromarray(picture[:20]).save(path), "100 x 20"),
        ("a.png", lambda path, _: Image.fromarray(np.full((80, 80), 40_000, dtype=np.uint16)).save(path), "8 bits"),
        # Pillow opens such a file as plain RGB and drops the lower eight bits of each channel.
        ("a.png", deep, "8 bits"),
        ("a.tif", deep, "8 bits"),
        ("a.tif", several, "3 pages or frames"),
        ("a.webp", several, "3 pages or frames"),
        # Pillow warns at 100 million pixels, and refuses at twice its limit.
        ("a.png", lambda path, _: write_bomb(path, 8_000), "8000 x 8000 pixels, more than the 50 million"),
        ("a.tif", lambda path, _: path.write_bytes(b"II*\0\x08\0\0\0\xff\xff"), "a.tif"),
    ],
    ids=["folder", "empty", "text", "few pixels", "grey", "deep PNG", "deep TIFF", "pages", "frames", "large", "stump"],
)
def test_a_file_that_is_not_a_usable_photo_is_refused_with_the_reason(tmp_path, picture, name, write, says):
    write(tmp_path / name, picture)
    assert says in refusal(tmp_path / name)


@pytest.mark.parametrize("ending", ["jpg", "png", "webp", "bmp", "tif"])
def test_a_truncated_photo_is_refused(tmp_path, picture, ending):
    path = tmp_path / f"photo.{ending}"
    Image.fromarray(picture).save(path)
    assert read_photo(path).image.shape == (80, 100, 3)
    path.write_bytes(path.read_bytes()[: int(0.98 * path.stat().st_size)])
    assert "cut short" in refusal(path) or "not a readable" in refusal(path)


def test_a_jpeg_that_lost_a_block_of_its_data_is_refused(tmp_path, picture):
    """Pillow reads it without a word: the rest of the photo is shifted, and its end is grey."""
    path = tmp_path / "photo.jpg"
    Image.fromarray(picture).save(path)
    content = path.read_bytes()
    middle = len(content) * 3 // 4
    path.write_bytes(content[:middle] + content[middle + len(content) // 10 :])
    with Image.open(path) as photo:
        assert np.asarray(photo).shape == picture.shape
    assert "damaged or cut short" in refusal(path)


def test_a_photo_with_transparent_pixels_is_read_with_a_warning(tmp_path, picture):
    alpha = np.full(picture.shape[:2], 255, dtype=np.uint8)
    for rows, values in ((0, []), (20, [0.25])):
        alpha[:rows] = 0
        Image.fromarray(np.dstack([picture, alpha])).save(tmp_path / "photo.png")
        decoded = read_photo(tmp_path / "photo.png")
        assert [(remark.key, remark.value) for remark in decoded.warnings] == [("photo.transparent", v) for v in values]
        assert np.array_equal(decoded.image, picture)


@pytest.mark.parametrize(
    ("mode", "orientation", "quarters"), [("L", 6, -1), ("P", 8, 1), ("RGBA", 3, 2), ("RGB", 6, -1)]
)
def test_a_rotated_uncompressed_tiff_is_read_upright(tmp_path, picture, mode, orientation, quarters):
    """Pillow maps such a file into memory, if it has a name, with rows as long as the upright picture's."""
    stored, path = Image.fromarray(picture).convert(mode), tmp_path / "photo.tif"
    stored.save(path, tiffinfo={274: orientation})
    shown = np.asarray(stored.convert("RGB"))
    assert np.array_equal(read_photo(path).image, np.rot90(shown, quarters))


FOCAL_PX = 26 * 500 / np.hypot(36, 24)
FILM_MM, WIDTH_PX, HEIGHT_PX = 0xA405, 0xA002, 0xA003


@pytest.mark.parametrize(
    ("tags", "focal_px"),
    [
        ({FILM_MM: 26}, FOCAL_PX),
        ({FILM_MM: 26, WIDTH_PX: 4000, HEIGHT_PX: 3000}, FOCAL_PX),
        ({FILM_MM: 26, WIDTH_PX: 3000, HEIGHT_PX: 4000}, FOCAL_PX),
        # No focal length, zero, and that of a cropped photo.
        ({}, None),
        ({FILM_MM: 0}, None),
        ({FILM_MM: 26, WIDTH_PX: 4000, HEIGHT_PX: 2250}, None),
    ],
)
def test_the_focal_length_in_pixels_is_computed_if_the_exif_data_are_valid(tmp_path, tags, focal_px):
    """The photo has 500 px diagonal, the film 43.27 mm, the lens 26 mm; smaller copies have the same shape."""
    exif = Image.Exif()
    exif.get_ifd(0x8769).update(tags)
    Image.fromarray(np.full((300, 400, 3), 90, dtype=np.uint8)).save(tmp_path / "photo.jpg", exif=exif)
    assert read_photo(tmp_path / "photo.jpg").focal_px == (focal_px and pytest.approx(focal_px))


def test_an_image_array_is_returned_unchanged_unless_it_is_invalid(picture):
    assert (take_photo(picture, "image").image == picture).all()
    assert (take_photo(picture[..., 0], "image").image == picture[..., :1]).all()
    for wrong in (picture / 255, np.dstack([picture, picture[..., :1]]), picture[:20], picture[0]):
        with pytest.raises(InputError, match=r"^P01: "):
            take_photo(wrong, "P01")


@pytest.mark.parametrize("painted", [np.zeros((80, 100), bool), np.ones((80, 100), bool), np.ones((100, 80), bool)])
def test_a_mask_array_that_is_empty_full_or_of_another_size_is_refused(painted):
    with pytest.raises(InputError, match=r"^mask: "):
        take_mask(painted, (100, 80), "mask")


def iso_box(brand: bytes) -> bytes:
    """The first box of an ISO media file: its length, its kind, its major brand."""
    return struct.pack(">I", 24) + b"ftyp" + brand + bytes(12)


def write_tiff(path, **tags):
    info = TiffImagePlugin.ImageFileDirectory_v2()
    for number, value in tags.items():
        info.tagtype[int(number[1:])] = 4
        info[int(number[1:])] = value
    Image.fromarray(np.full((80, 80, 3), 100, dtype=np.uint8)).save(path, format="TIFF", tiffinfo=info)


@pytest.mark.parametrize(
    ("content", "name", "kind"),
    [
        (iso_box(b"hevc"), "burst.heic", "videos are not accepted"),
        (iso_box(b"crx "), "photo.cr3", "raw file"),
        (b"FUJIFILMCCD-RAW 0201", "photo.raf", "raw file"),
        (b"IIU\0" + bytes(20), "photo.RW2", "raw file"),
        # TIFFs: a raw file by its ending, a DNG, and a raw file whose thumbnail comes first.
        ({}, "photo.NEF", "raw file"),
        ({"t50706": 1025}, "photo.tif", "raw file"),
        ({"t254": 1, "t330": 400}, "photo.tif", "raw file"),
    ],
    ids=str,
)
def test_the_error_for_a_photo_in_an_unsupported_format_gives_the_remedy(tmp_path, content, name, kind):
    if isinstance(content, dict):
        write_tiff(tmp_path / name, **content)
    else:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=rf"{name}: .*{kind}.* save it as JPEG at full size"):
        read_photo(tmp_path / name)


HEIC = ROOT / "fixtures" / "heic"
GREYS = np.array([[250, 180], [120, 60]])


@pytest.mark.parametrize("quarters", range(4))
@pytest.mark.parametrize("name", ["turned", "mirrored"])
def test_the_exif_does_not_change_the_orientation_of_a_heic_photo(tmp_path, name, quarters):
    """The box irot turns counter-clockwise by quarters, then imir mirrors left to right (ISO 23008-12, 6.5).

    The EXIF orientation is always 5 or 6. The file has the name of a JPEG, which has no effect.
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


def test_a_heic_file_with_several_pictures_is_refused():
    with pytest.raises(InputError, match=r"two\.heic: .*2 pages or frames"):
        read_photo(HEIC / "two.heic")


def grey_levels(shown) -> list[int]:
    height, width = shown.shape[:2]
    return shown[height // 4 :: height // 2, width // 4 :: width // 2, 0].ravel().tolist()


def test_a_heic_photo_of_10_bits_is_read_with_8():
    assert grey_levels(read_photo(HEIC / "ten.heic").image) == pytest.approx(GREYS.ravel().tolist(), abs=6)


def test_an_avif_photo_is_read_unless_its_tone_curve_is_that_of_hdr(tmp_path, picture):
    path = tmp_path / "photo.avif"
    Image.fromarray(picture).save(path, quality=100, subsampling="4:4:4")
    assert np.abs(read_photo(path).image.astype(int) - picture).max() < 12
    content = bytearray(path.read_bytes())
    transfer = content.index(b"colrnclx") + 10
    content[transfer : transfer + 2] = (16).to_bytes(2, "big")  # PQ, ITU-T H.273
    path.write_bytes(content)
    assert "HDR" in refusal(path)


@pytest.mark.parametrize("mode", ["RGB", "L", "RGBA"])
def test_the_colours_of_an_icc_profile_become_srgb(tmp_path, mode):
    """By a profile of gamma 1, a stored value of 128 is a light of 0.502, which sRGB stores as 188."""
    profile = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    for curve in re.finditer(b"para", bytes(profile[128:])):
        # A parametric curve of kind 0 and exponent 1
        start = 128 + curve.start() + 8
        profile[start : start + 8] = bytes([0, 0, 0, 0, 0, 1, 0, 0])
    photo = Image.new("RGB", (100, 80), (128, 128, 128)).convert(mode)
    photo.save(tmp_path / "photo.png", icc_profile=bytes(profile))
    shown = read_photo(tmp_path / "photo.png").image
    assert (shown.min(), shown.max()) == (188, 188)
