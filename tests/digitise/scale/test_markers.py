from dataclasses import replace

import cv2
import numpy as np
import pytest

from digitise.scale import marker_scale
from digitise.scale.marker_scale import find_markers
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import Specimen, make_specimen
from tests.support.photos import SMALL_FACE, photo_of


@pytest.fixture(scope="module")
def specimen() -> Specimen:
    """1220 x 920 px: searched for on a copy of 1000 px first."""
    return make_specimen(1, Recipe(**SMALL_FACE))


@pytest.fixture(scope="module")
def photo(specimen, tmp_path_factory):
    return photo_of(specimen, tmp_path_factory.mktemp("photo"))


def test_corners_lie_where_they_were_drawn(specimen, photo):
    """To a tenth of a pixel, upper left first, then clockwise; OpenCV's own are 0.2 px inside, its plain ones 0.5."""
    corners_px = find_markers(photo, "4x4_50", set(range(8)))
    for marker in specimen.board.markers:
        true_px = specimen.to_px(marker_scale.corners_mm(specimen.board, marker))
        assert np.abs(corners_px[marker.id] - true_px).max() < 0.1


def test_markers_on_white_cards_are_found_on_a_dark_bench(tmp_path):
    """By OpenCV's own parameters, a card passes for its marker: six of these eight are lost."""
    dark = make_specimen(1, Recipe(**SMALL_FACE, board=0.05, gap_mm=0.0, mm_per_px=0.2))
    photo = photo_of(dark, tmp_path)
    assert set(find_markers(photo, "4x4_50", set(range(8)))) == set(range(8))


def test_a_small_copy_of_a_marker_is_none_of_the_board(specimen, photo):
    """As grain may look like one now and then: half the size, and the same number."""
    image = photo.image.copy()
    x, y = np.rint(specimen.to_px(np.array([[-14.0, -14.0]]))[0]).astype(int)
    copy = image[y - 100 : y + 100, x - 100 : x + 100]
    image[y - 300 : y - 220, x + 150 : x + 230] = cv2.resize(copy, (80, 80), interpolation=cv2.INTER_AREA)
    corners_px = find_markers(replace(photo, image=image), "4x4_50", set(range(8)))
    assert corners_px[0].mean(axis=0) == pytest.approx([x, y], abs=2)
