"""The obvious cracks that tracing is judged by: their truth is what is drawn, and they are what the text promises."""

import numpy as np
import pytest

from benchmarks.tracing_wide import WideFigures, obvious_crack, trace_wide, wide_rows

SEED = 7  # Of a photo of fewer than 1.5 Mpx


@pytest.fixture(scope="module")
def pair():
    """A crack, and its ground without it."""
    return obvious_crack(SEED), obvious_crack(SEED, drawn=False)


def test_the_truth_is_what_is_drawn(pair):
    """Counted at half the contrast, 2 % apart; of a crack that goes on, more is drawn than lies between the clicks."""
    crack, ground = pair
    share = (crack.picture / np.maximum(ground.picture, 1.0)) ** 2.2
    inside = np.median(share[share < 0.45])
    drawn_px2 = np.sum(share < (1 + inside) / 2)
    assert drawn_px2 > 0.98 * crack.area_px2
    assert inside ** (1 / 2.2) < 0.6
    assert 10 < crack.width_px < 160


def figures(count, width=0.5, area=-0.5, refusal="", true_px=20.0):
    return [WideFigures("a photo", true_px, width, area, refusal)] * count


def test_of_two_hundred_two_may_be_refused_and_none_wrong():
    none, nan = figures(40, refusal="no crack", true_px=0.0), float("nan")

    def met(cracks, without=none):
        return [row.met for row in wide_rows([*cracks, *without])]

    assert all(met([*figures(198), *figures(2, nan, nan, "no")]))
    assert met([*figures(197), *figures(3, nan, nan, "no")]) == [False, True, True, True]
    assert met([*figures(199), *figures(1, width=-3.1)]) == [True, False, True, True]
    assert met([*figures(199), *figures(1, area=3.1)]) == [True, True, False, True]
    assert met(figures(200), [*none[1:], *figures(1, true_px=0.0)]) == [True, True, True, False]


def test_a_crack_that_goes_on_past_a_click_off_its_middle_is_cut_there(tmp_path):
    """What goes on was taken for a side crack and painted over, and a tip drawn in the crack: its width was 4 % off."""
    figures = trace_wide(18, True, tmp_path)
    assert abs(figures.width_error_percent) < 1
    assert abs(figures.area_error_percent) < 1
