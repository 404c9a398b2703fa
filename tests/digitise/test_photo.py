from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from digitise.photo import load_photo
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from tests.support.paths import ROOT
from tests.support.photos import evenly_scaled, mortar, write_png


def test_a_photo_is_looked_for_beside_the_trial(tmp_path):
    write_png(tmp_path / "photo.png", mortar())
    settings = PhotoInput(file=Path("photo.png"), data="synthetic", mm_per_px=0.1)
    assert load_photo(settings, tmp_path).size_px == (500, 300)
    with pytest.raises(InputError, match="not found"):
        load_photo(settings, tmp_path / "elsewhere")


@pytest.mark.parametrize("level", [0.0, 0.001])
def test_a_black_photo_is_refused_as_black(tmp_path, level):
    path = write_png(tmp_path / "photo.png", np.full((200, 300), level))
    with pytest.raises(InputError, match=r"photo\.png: the photo is black"):
        evenly_scaled(path)


def test_brightness_is_proportional_to_light(tmp_path):
    """Half the light is 186 of 255 in the file, and half the brightness here."""
    steps = np.repeat([[1.0, 0.5, 0.1]], 100, axis=0).repeat(100, axis=1)
    photo = evenly_scaled(write_png(tmp_path / "photo.png", steps))
    assert photo.brightness[50, [50, 150, 250]] == pytest.approx([1.0, 0.5, 0.1], abs=0.005)


def painted(tmp_path, size_px=(500, 300), **changes):
    """The mask of a photo of 500 x 300 px, with a crack of 200 x 10 px painted into a picture of ``size_px``."""
    write_png(tmp_path / "photo.png", mortar())
    mask = np.zeros(size_px[::-1], dtype=np.uint8)
    mask[150:160, 100:300] = 255
    picture = Image.fromarray(mask)
    if changes.get("see_through"):
        picture = Image.merge("LA", [Image.new("L", picture.size, changes["colour"]), picture])
    if changes.get("upside_down"):
        picture = picture.point(lambda grey: 255 - grey)
    if changes.get("empty"):
        picture = Image.new("L", size_px)
    exif = Image.Exif()
    if changes.get("sideways"):
        picture, exif[0x0112] = picture.transpose(Image.Transpose.ROTATE_90), 6
    picture.save(tmp_path / "mask.png", exif=exif)
    settings = PhotoInput(file=Path("photo.png"), data="synthetic", mm_per_px=0.1, mask=Path("mask.png"))
    drawn = load_photo(settings, tmp_path).drawn
    assert drawn is not None
    rows, columns = np.nonzero(drawn)
    return rows.min(), rows.max() + 1, columns.min(), columns.max() + 1, len(rows)


@pytest.mark.parametrize(
    "changes",
    [{}, {"see_through": True, "colour": 0}, {"see_through": True, "colour": 255}, {"sideways": True}],
    ids=["white on black", "opaque black", "opaque white", "turned by its EXIF"],
)
def test_a_painted_mask_says_where_the_crack_is(tmp_path, changes):
    assert painted(tmp_path, **changes) == (150, 160, 100, 300, 2000)


@pytest.mark.parametrize(
    ("changes", "refused"),
    [
        ({"size_px": (400, 300)}, r"mask is 400 x 300 px, the photo 500 x 300"),
        ({"empty": True}, "mask paints nothing"),
        ({"upside_down": True}, "paints 99% of the photo"),
    ],
)
def test_a_mask_that_cannot_be_the_crack_is_refused(tmp_path, changes, refused):
    with pytest.raises(InputError, match=refused):
        painted(tmp_path, **changes)


@pytest.mark.parametrize(("mm_per_px", "warned"), [(0.1, False), (0.104, True)])
def test_markers_beside_a_typed_scale_are_named_if_they_contradict_it(mm_per_px, warned):
    photo = PhotoInput(file=ROOT / "fixtures" / "paper-trial" / "photo.jpg", data="synthetic", mm_per_px=mm_per_px)
    assert any("markers of 4x4_50" in warning.text for warning in load_photo(photo, ROOT).warnings) is warned


def test_a_length_is_in_px_alone_until_there_is_a_scale(tmp_path):
    """A millimetre of a photo without a scale would be taken for one of the sample's."""
    photo = evenly_scaled(write_png(tmp_path / "photo.png", mortar()))
    assert photo.length(94.0) == "9.4 mm (94 px)"
    assert replace(photo, unit="px").length(94.0) == "94 px"
