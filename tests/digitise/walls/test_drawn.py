from dataclasses import replace

import numpy as np
import pytest
from skimage.draw import polygon2mask

from digitise.crack_path.find_path import find_path
from digitise.geometry.polyline import signed_area
from digitise.outline import trace_outline
from fixtures.generate.recipe import Recipe, SideCrack
from fixtures.generate.specimen import make_specimen
from tests.pictures import (
    SMALL_FACE,
    distance_to,
    evenly_scaled,
    how_traced,
    mortar,
    photo_of,
    rms,
    with_paint,
    write_png,
)

HALF_PIXEL = 0.5


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A specimen with its exact crack painted, on a photo that shows none."""
    side = SideCrack(at=0.35, side="left", angle_deg=60, length_mm=14, width_mm=1.8)
    truth = make_specimen(1, Recipe(**SMALL_FACE, side_cracks=(side,), stones=2))
    photo = photo_of(truth, tmp_path_factory.mktemp("drawn"))
    return truth, replace(photo, brightness=np.full_like(photo.brightness, 0.4))


def painted(photo, rings_mm, holes_mm=()):
    drawn = np.zeros(photo.brightness.shape, dtype=bool)
    for rings, value in ((rings_mm, True), (holes_mm, False)):
        for ring in rings:
            drawn[polygon2mask(drawn.shape, photo.to_px(ring)[:, ::-1])] = value
    return with_paint(photo, drawn)


def test_walls_lie_on_the_rim_of_the_paint(scene):
    """To half a pixel, of which the steps of the mask take 0.3."""
    truth, photo = scene
    photo = painted(photo, [truth.outline_mm])
    outline = trace_outline(photo, find_path(photo, truth.ends_px))
    for traced, exact in ((outline.left_wall_mm, truth.left_wall_mm), (outline.right_wall_mm, truth.right_wall_mm)):
        assert rms(distance_to(traced, exact)) < HALF_PIXEL * photo.mm_per_px
    assert signed_area(outline.outline_mm) == pytest.approx(signed_area(truth.outline_mm), rel=0.005)
    assert outline.ends == ("open", "open")
    assert outline.path_source == "mask"
    # The share of the contrast that a photo's light asks for says nothing about paint.
    again = trace_outline(photo, find_path(photo, truth.ends_px), how_traced(edge_fraction=0.7))
    assert np.array_equal(again.outline_mm, outline.outline_mm)


def strokes(folder, *boxes, without=None):
    """A plain photo on which boxes of rows and columns are painted."""
    photo = evenly_scaled(write_png(folder / "photo.png", mortar()))
    drawn = np.zeros(photo.brightness.shape, dtype=bool)
    for rows, columns in boxes:
        drawn[slice(*rows), slice(*columns)] = True
    if without is not None:
        drawn[slice(*without[0]), slice(*without[1])] = False
    return with_paint(photo, drawn)


def test_a_painted_side_crack_is_kept_however_narrow(tmp_path):
    """A stroke is as wide as it was painted; on a photo, 5 px would be too little to tell."""
    photo = strokes(tmp_path, ((140, 164), (30, 470)), ((60, 140), (250, 255)))
    main, whole = (trace_outline(photo, find_path(photo, None), how_traced(branches=it)) for it in ("drop", "keep"))
    assert main.warnings == ('1 side crack (9 mm) is left out; set branches = "keep" to include it',)
    # 80 x 5 px of paint; a pixel of its length for the corners, which the blur of the picture rounds.
    assert signed_area(whole.outline_mm) - signed_area(main.outline_mm) == pytest.approx(4.0, abs=0.1)
    assert whole.warnings == ()


@pytest.mark.parametrize(("side_px", "count"), [(2, 0), (5, 1)])
def test_only_slips_of_the_brush_are_filled(tmp_path, side_px, count):
    """0.04 mm² is less than what a solid keeps as an island, 0.25 mm² more."""
    hole = ((148, 148 + side_px), (250, 250 + side_px))
    photo = strokes(tmp_path, ((135, 165), (30, 470)), without=hole)
    outline = trace_outline(photo, find_path(photo, None))
    assert len(outline.islands_mm) == count
    assert outline.mean_width_mm == pytest.approx(3.0, abs=0.05)
    assert outline.ends == ("closed", "closed")


def test_another_piece_beside_the_crack_hides_no_wall(tmp_path):
    crack, ends = ((140, 160), (30, 470)), ((40.0, 150.0), (460.0, 150.0))
    both, alone = (strokes(tmp_path, *boxes) for boxes in ((crack, ((163, 175), (100, 400))), (crack,)))
    traced, exact = (trace_outline(picture, find_path(picture, ends)) for picture in (both, alone))
    assert np.array_equal(traced.outline_mm, exact.outline_mm)
