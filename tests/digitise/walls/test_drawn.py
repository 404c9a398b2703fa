import numpy as np
import pytest
from skimage.draw import polygon2mask

from digitise.crack_path.find_path import find_path
from digitise.geometry.polyline import signed_area
from digitise.outline import trace_outline
from sealtwin.core.facts import texts
from tests.support.photos import evenly_scaled, how_traced, mortar, with_paint, write_png


def painted(photo, rings_mm, holes_mm=()):
    drawn = np.zeros(photo.brightness.shape, dtype=bool)
    for rings, value in ((rings_mm, True), (holes_mm, False)):
        for ring in rings:
            drawn[polygon2mask(drawn.shape, photo.to_px(ring)[:, ::-1])] = value
    return with_paint(photo, drawn)


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
    assert texts(main.warnings) == ('1 side crack (9 mm) is left out; set branches = "keep" to include side cracks',)
    # 80 x 5 px of paint; a pixel of its length for the corners, which the blur of the picture rounds.
    assert signed_area(whole.outline_mm) - signed_area(main.outline_mm) == pytest.approx(4.0, abs=0.1)
    assert whole.warnings == ()


@pytest.mark.parametrize(("side_px", "count"), [(2, 0), (5, 1)])
def test_only_slips_of_the_brush_are_filled(tmp_path, side_px, count):
    """0.04 mm² is less than what a solid keeps as an island, 0.25 mm² more. Walls lie on the rim of the paint."""
    hole = ((148, 148 + side_px), (250, 250 + side_px))
    photo = strokes(tmp_path, ((135, 165), (30, 470)), without=hole)
    outline = trace_outline(photo, find_path(photo, None))
    assert len(outline.islands_mm) == count
    assert outline.mean_width_mm == pytest.approx(3.0, abs=0.05)
    inner = slice(20, -20)
    assert outline.left_wall_px[inner, 1] == pytest.approx(134.5, abs=0.5)
    assert outline.right_wall_px[inner, 1] == pytest.approx(164.5, abs=0.5)
    assert outline.path_source == "mask"
    assert outline.ends == ("closed", "closed")


def test_another_piece_beside_the_crack_hides_no_wall(tmp_path):
    """Nor does the share of the contrast, for a photo's light, say anything about paint."""
    crack, ends = ((140, 160), (30, 470)), ((40.0, 150.0), (460.0, 150.0))
    both, alone = (strokes(tmp_path, *boxes) for boxes in ((crack, ((163, 175), (100, 400))), (crack,)))
    traced = trace_outline(both, find_path(both, ends), how_traced(edge_fraction=0.7))
    exact = trace_outline(alone, find_path(alone, ends))
    assert np.array_equal(traced.outline_mm, exact.outline_mm)
