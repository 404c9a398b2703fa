"""Walls at a glance lie where the real ones do, to what an eye sees, and cost a fraction of their time."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.crack_path.hints import CrackPath
from digitise.outline import GLANCE_WIDTH_PX, glance, trace_outline
from digitise.photo import smaller
from digitise.scale.view import Lens, View
from tests.pictures import distance_to, evenly_scaled, how_traced, mortar, with_crack, write_png

ENDS = ((60.0, 430.0), (940.0, 210.0))
WIDTH_PX = 40


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    line = [(60, 430), (360, 330), (600, 350), (940, 210)]
    picture = with_crack(mortar((1001, 603)), line, width_px=WIDTH_PX)
    return evenly_scaled(write_png(tmp_path_factory.mktemp("photo") / "crack.png", picture))


@pytest.fixture(scope="module")
def path(photo):
    return replace(find_path(photo, ENDS), width_px=WIDTH_PX)


def test_a_glance_sees_the_walls_that_are_there(photo, path):
    """Half as many pixels, half as sure of each edge: half a pixel of the photo on average; length and width 1 %."""
    rough, fine = glance(photo, path), trace_outline(photo, path)
    assert rough is not None
    assert rough.length_mm == pytest.approx(fine.length_mm, rel=0.01)
    assert rough.mean_width_mm == pytest.approx(fine.mean_width_mm, rel=0.01)
    for name in ("left_wall_mm", "right_wall_mm"):
        off_mm = distance_to(getattr(rough, name), getattr(fine, name))
        assert off_mm.mean() < 0.5 * photo.mm_per_px
    stroked = glance(photo, path, how_traced(crack_strokes_px=[[(360.0, 330.0)]]))
    assert stroked is not None
    assert any("strokes drawn by hand" in warning for warning in stroked.warnings)
    # What it costs is per station, and they lie 2.5 of its own pixels apart.
    assert len(rough.centreline_mm) < 0.6 * len(fine.centreline_mm)


@pytest.mark.parametrize(
    ("width_px", "seen"), [(2 * GLANCE_WIDTH_PX, True), (1.9 * GLANCE_WIDTH_PX, False), (9.0, False), (0.0, False)]
)
def test_a_narrow_crack_is_left_to_the_photo(photo, path, width_px, seen):
    assert (glance(photo, replace(path, width_px=width_px)) is not None) == seen


def test_a_glance_that_finds_no_walls_says_nothing_nor_one_at_a_painted_crack(photo, path):
    """Whether they are there is for the photo to say."""
    bare = CrackPath(np.column_stack([np.linspace(100, 900, 200), np.full(200, 80.0)]), WIDTH_PX, "ends")
    assert glance(photo, bare) is None
    assert glance(replace(photo, file=Path("x"), drawn=np.ones(photo.brightness.shape, dtype=bool)), path) is None


def test_the_copy_shows_every_place_where_the_photo_does(photo):
    """Through tilt and lens, to a ten-thousandth of a pixel: the same mapping, in other pixels."""
    tilted = np.array([[0.1, 0.001, 3.0], [0.002, -0.11, 60.0], [1e-5, 2e-5, 1.0]])
    seen = replace(
        photo, view=View(tilted, Lens(np.array([500.0, 301.0]), -1.2e-7)), markers_px=(np.array([[10.5, 20.0]]),)
    )
    factor = 4
    copy = smaller(seen, factor)
    places_px = np.array([[0.0, 0.0], [123.4, 456.7], [1000.0, 602.0]])
    in_copy_px = (places_px + 0.5) / factor - 0.5
    assert np.allclose(copy.to_mm(in_copy_px), seen.to_mm(places_px), atol=1e-5)
    assert np.allclose(copy.to_px(seen.to_mm(places_px)), in_copy_px, atol=1e-4)
    assert np.allclose(copy.markers_px[0], (seen.markers_px[0] + 0.5) / factor - 0.5)
    assert copy.mm_per_px == factor * seen.mm_per_px
    assert copy.brightness.shape == (603 // factor, 1001 // factor)


def test_a_pixel_of_the_copy_is_the_mean_of_its_block(photo):
    copy = smaller(photo, 4)
    block = photo.brightness[100:104, 896:900]
    assert copy.brightness[25, 224] == pytest.approx(block.mean(), rel=1e-5)
