"""Clear, wide cracks of the benchmark of tracing, and their true outlines."""

import numpy as np
import pytest

from benchmarks.tracing_wide import obvious_crack, trace_wide

SEED = 7  # Of a photo of fewer than 1.5 Mpx


@pytest.fixture(scope="module")
def pair():
    """A crack, and its ground without it."""
    return obvious_crack(SEED), obvious_crack(SEED, drawn=False)


def test_the_drawn_crack_covers_its_true_area(pair):
    """The area is counted at half the contrast, to 2 %. A crack that continues beyond the clicks covers more."""
    crack, ground = pair
    share = (crack.picture / np.maximum(ground.picture, 1.0)) ** 2.2
    inside = np.median(share[share < 0.45])
    drawn_px2 = np.sum(share < (1 + inside) / 2)
    assert drawn_px2 > 0.98 * crack.area_px2
    assert inside ** (1 / 2.2) < 0.6
    assert 10 < crack.width_px < 160


def test_a_crack_that_continues_past_the_clicked_end_is_cut_at_the_click(tmp_path):
    """The continuation was once taken for a side crack, and the width was 4 % off."""
    figures = trace_wide(18, True, tmp_path)
    assert abs(figures.width_error_percent) < 1
    assert abs(figures.area_error_percent) < 1
