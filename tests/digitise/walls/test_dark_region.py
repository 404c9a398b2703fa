"""Walls as the rims of a dark region: on ground as coarse as the crack, and beside a shadow."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.tracing_roads import clicks
from digitise.crack_path.find_path import find_path
from digitise.crack_path.hints import CrackPath
from digitise.outline import trace_outline
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from digitise.walls.centreline_and_walls import WallsMissingError, trace
from digitise.walls.dark_region import trace_dark_region
from fixtures.generate.road import Road, road
from sealtwin.core.errors import InputError
from tests.support.photos import mortar, photo_of_light, with_crack

WIDE_IN_STONES = 7  # A seed of a road on whose crack of 31 px profiles lack walls


@pytest.fixture(scope="module")
def stony() -> Road:
    return road(WIDE_IN_STONES)


@pytest.fixture(scope="module")
def photo(stony, tmp_path_factory) -> Photo:
    folder = tmp_path_factory.mktemp("road")
    stony.write(folder)
    settings = PhotoInput(file=Path("photo.jpg"), data="synthetic", mm_per_px=stony.recipe.mm_per_px)
    return load_photo(settings, folder)


def unhidden(photo: Photo) -> np.ndarray:
    return np.zeros(photo.brightness.shape, np.uint8)


def test_a_crack_among_stones_of_like_width_is_traced_as_a_dark_region(stony, photo):
    path = find_path(photo, clicks(WIDE_IN_STONES, stony))
    with pytest.raises(WallsMissingError):
        trace(photo, path, 0.5, unhidden(photo))
    outline = trace_outline(photo, path)
    true_mm = stony.recipe.mm_per_px * stony.mean_width_px
    assert outline.width_source == "region"
    assert outline.mean_width_mm == pytest.approx(true_mm, rel=0.05)
    low_mm, high_mm = outline.width_95_mm or (0.0, 0.0)
    assert low_mm < true_mm < high_mm < 1.3 * low_mm
    assert (low_mm + high_mm) / 2 == pytest.approx(outline.mean_width_mm)
    assert any("too coarse to follow the walls" in warning.text for warning in outline.warnings)


def dark_line(folder: Path, width_px: int = 24, shadow: float = 1.0) -> tuple[Photo, CrackPath]:
    """A photo of a straight crack, with a shadow on the ground above it, and its path."""
    picture = mortar()
    picture[:150] *= shadow
    photo = photo_of_light(folder, with_crack(picture, [(-30, 150), (530, 150)], width_px))
    return photo, CrackPath(np.array([(20.0, 150.0), (480.0, 150.0)]), float(width_px), "ends")


@pytest.mark.parametrize(("width_px", "shadow"), [(12, 1.0), (24, 0.18), (90, 0.35)])
def test_the_width_of_a_dark_region_equals_that_of_traced_walls(tmp_path, width_px, shadow):
    """The widest crack is measured in a smaller copy; two cracks are at the edge of a shadow."""
    photo, path = dark_line(tmp_path, width_px, shadow)
    walls, region = (follow(photo, path, 0.5, unhidden(photo)) for follow in (trace, trace_dark_region))
    assert region.width_px == pytest.approx(walls.width_px, rel=0.03, abs=0.4)
    assert np.median(region.left_mm[:, 1]) > np.median(region.right_mm[:, 1])


def test_a_larger_contrast_fraction_moves_the_walls_of_a_region_outwards(tmp_path):
    photo, path = dark_line(tmp_path)
    soft = replace(photo, brightness=cv2.GaussianBlur(photo.brightness, (0, 0), 3.0))
    inner, outer = (trace_dark_region(soft, path, share, unhidden(soft)).width_px for share in (0.3, 0.7))
    assert outer > inner + 3


def test_a_region_narrower_than_8_px_is_refused(tmp_path):
    photo, path = dark_line(tmp_path, 4)
    with pytest.raises(InputError, match="px are needed"):
        trace_dark_region(photo, path, 0.5, unhidden(photo))
