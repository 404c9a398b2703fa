"""Beads on emulated photos of the printed sheet, whose outline is known."""

from dataclasses import replace

import numpy as np
import pytest

from digitise.geometry.polyline import resampled
from digitise.settings import PhotoInput
from digitise.spread import BeadOutline, measure_bead
from sealtwin.core.errors import InputError
from tests.support.spread_photos import BEAD_BOARD, BEAD_FACE_MM, BeadPhoto

BEAD = BeadPhoto(8.0, mm_per_px=0.15)


def seen(folder, bead: BeadPhoto) -> BeadOutline:
    photo = bead.write(folder / "bead.png")
    return measure_bead(PhotoInput(file=photo, data="synthetic", markers=BEAD_BOARD, face_mm=BEAD_FACE_MM), folder)


def test_a_beads_sizes_are_those_that_were_drawn(tmp_path):
    bead = replace(BEAD, dark=False, turn=0.5, tilt_deg=6.0, lens_k1=-0.04, noise=0.03, straight_mm=25.0)
    outline = seen(tmp_path, bead)
    assert outline.length_mm == pytest.approx(bead.straight_mm + 16, abs=0.06)
    assert outline.width_mm == pytest.approx(16.0, abs=0.06)
    assert outline.area_mm2 == pytest.approx(16 * bead.straight_mm + np.pi * 64, rel=2e-3)
    assert outline.edge_error_mm == pytest.approx(0.5 * 0.15, rel=0.1)
    # A capsule's paste lies at distance d from its edge on two straight lines and one circle.
    shares = [(outline.inward_mm > depth).mean() * outline.area_mm2 for depth in (2.0, 6.0)]
    assert shares == pytest.approx([2 * (8 - d) * bead.straight_mm + np.pi * (8 - d) ** 2 for d in (2, 6)], rel=0.03)
    # Its ends lie on its middle line.
    forth = np.array([np.cos(bead.turn), np.sin(bead.turn)])
    ends = sorted((np.array([45.0, 30.0]) + sign * forth * (bead.straight_mm / 2 + 8)).tolist() for sign in (-1, 1))
    assert np.array(sorted(outline.tips_mm.tolist())) == pytest.approx(np.array(ends), abs=0.2)


def bent() -> tuple[tuple[float, float], ...]:
    ring = resampled(replace(BEAD, middle_mm=(0.0, 0.0)).ring_mm, 0.5)
    return tuple((x, y + 0.02 * x * x) for x, y in ring.tolist())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"radius_mm": 5.0}, r"the paste is 3\d px in half its width; at least 40"),
        ({"straight_mm": 4.0}, r"the bead is 20\.\d mm long and 1\d\.\d mm wide"),
        ({"edge_mm": bent()}, "it bends by 1[0-9]% of its length"),
        ({"middle_mm": (20.0, 30.0)}, "edge is visible on only"),
    ],
)
def test_what_is_no_straight_bead_is_refused(tmp_path, changes, says):
    with pytest.raises(InputError, match=says):
        seen(tmp_path, replace(BEAD, **changes))
