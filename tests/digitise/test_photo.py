from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from digitise.photo import load_photo, smaller
from digitise.scale.view import Lens, View
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from tests.support.photos import mortar, photo_of_light, with_crack, write_png


def test_a_black_photo_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"photo\.png: the photo is black"):
        photo_of_light(tmp_path, np.full((200, 300), 0.001))


def test_brightness_is_proportional_to_light(tmp_path):
    """Half the light is 186 of 255 in the file, and half the brightness here."""
    steps = np.repeat([[1.0, 0.5, 0.1]], 100, axis=0).repeat(100, axis=1)
    photo = photo_of_light(tmp_path, steps)
    assert photo.brightness[50, [50, 150, 250]] == pytest.approx([1.0, 0.5, 0.1], abs=0.005)


PAINT = np.zeros((300, 500), dtype=np.uint8)
PAINT[150:160, 100:300] = 255
WHITE = Image.fromarray(PAINT)
OPAQUE = Image.merge("LA", [Image.new("L", WHITE.size, 255), WHITE])
SIDEWAYS = WHITE.transpose(Image.Transpose.ROTATE_90)


@pytest.mark.parametrize(
    ("mask", "refusal"),
    [
        (WHITE, None),
        (OPAQUE, None),
        (SIDEWAYS, None),
        (WHITE.crop((0, 0, 400, 300)), "mask is 400 x 300 px, but the photo is 500 x 300"),
        (Image.new("L", WHITE.size), "paints nothing"),
        (WHITE.point(lambda grey: 255 - grey), "99% of the photo"),
    ],
    ids=["white on black", "opaque white", "turned by its EXIF", "of another size", "empty", "inverted"],
)
def test_a_painted_mask_marks_the_crack_unless_its_size_or_area_is_wrong(tmp_path, mask, refusal):
    write_png(tmp_path / "photo.png", mortar())
    exif = Image.Exif()
    exif[0x0112] = 6 if mask is SIDEWAYS else 1
    mask.save(tmp_path / "mask.png", exif=exif)
    settings = PhotoInput(file=Path("photo.png"), data="synthetic", mm_per_px=0.1, mask=Path("mask.png"))
    with pytest.raises(InputError, match=refusal) if refusal else nullcontext():
        drawn = load_photo(settings, tmp_path).drawn
        assert drawn is not None
        assert np.array_equal(drawn, PAINT > 0)


def test_a_smaller_copy_of_a_photo_has_the_same_mapping_to_millimetres(tmp_path):
    """The mapping includes tilt and lens. Tolerance: a ten-thousandth of a pixel."""
    picture = with_crack(mortar((1001, 603)), [(60, 430), (360, 330), (600, 350), (940, 210)], width_px=40)
    tilted = np.array([[0.1, 0.001, 3.0], [0.002, -0.11, 60.0], [1e-5, 2e-5, 1.0]])
    photo = replace(
        photo_of_light(tmp_path, picture),
        view=View(tilted, Lens(np.array([500.0, 301.0]), -1.2e-7)),
        markers_px=(np.array([[10.5, 20.0]]),),
    )
    copy = smaller(photo, 4)
    points_px = np.array([[0.0, 0.0], [123.4, 456.7], [1000.0, 602.0]])
    in_copy_px = (points_px + 0.5) / 4 - 0.5
    assert np.allclose(copy.to_mm(in_copy_px), photo.to_mm(points_px), atol=1e-5)
    assert np.allclose(copy.to_px(photo.to_mm(points_px)), in_copy_px, atol=1e-4)
    assert np.allclose(copy.markers_px[0], (photo.markers_px[0] + 0.5) / 4 - 0.5)
    assert (copy.mm_per_px, copy.brightness.shape) == (4 * photo.mm_per_px, (603 // 4, 1001 // 4))
    block = photo.brightness[100:104, 896:900]
    assert copy.brightness[25, 224] == pytest.approx(block.mean(), rel=1e-5)
