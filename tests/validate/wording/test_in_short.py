"""The answer in plain sentences: numbers and sides, pinned by value."""

from dataclasses import replace

import numpy as np
import pytest

from sealtwin.core.records import SHOWN_AROUND
from tests.evidence import make_evidence
from validate.report.chapters import _around_crack
from validate.wording.headline import in_short


@pytest.mark.parametrize(("error_mm", "lies"), [(0.5, "0.5 mm above"), (-0.5, "0.5 mm below"), (0.0, "as high as")])
def test_it_says_by_how_much_and_to_which_side(tmp_path, error_mm, lies):
    nearness, whereabouts = in_short(make_evidence(tmp_path, error_mm=error_mm))
    assert f"{abs(error_mm):.1f} mm off the readings on average" in nearness
    assert lies in nearness
    assert "ml dispensed" in whereabouts


def test_without_readings_it_says_where_the_sealant_went(tmp_path):
    (whereabouts,) = in_short(make_evidence(tmp_path, readings_data=None))
    assert "; less than 0.01 ml ran over the edge" in whereabouts, "one particle of the case did"


def test_the_photo_is_cut_around_the_crack(tmp_path):
    """In an overlay of half the photo's size, as large as the crack with its margins, which are wider than high."""
    outline = make_evidence(tmp_path).outline
    size_px = tuple(int(2 * most) for most in outline.outline_px.max(axis=0) + 400)
    overlay = np.zeros((size_px[1] // 2, size_px[0] // 2, 3), np.uint8)
    ring = outline.outline_px / 2
    inside = ring.mean(axis=0).astype(int)
    overlay[inside[1], inside[0]] = 255
    cut = _around_crack(overlay, replace(outline, photo_size_px=size_px))
    assert cut.max() == 255
    largest = np.ptp(ring, axis=0).max()
    low = np.maximum(ring.min(axis=0) - SHOWN_AROUND * largest, 0)
    assert cut.shape[1::-1] == pytest.approx(ring.max(axis=0) + SHOWN_AROUND * largest - low, abs=2)
    assert _around_crack(overlay, replace(outline, photo_size_px=None)) is overlay
