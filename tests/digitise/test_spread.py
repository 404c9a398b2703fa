"""Blobs and beads on emulated photos of the printed sheet, whose outline is known."""

from dataclasses import replace

import numpy as np
import pytest

from digitise.geometry.polyline import resampled
from digitise.settings import PhotoInput
from digitise.spread import BeadOutline, SpreadBlob, measure_bead, measure_spread
from sealtwin.core.errors import InputError
from tests.support.spread_photos import BEAD_BOARD, BEAD_FACE_MM, BOARD, FACE_MM, BeadPhoto, Blob

BLOB = Blob(48.0, mm_per_px=0.3)
BEAD = BeadPhoto(8.0, mm_per_px=0.15)


def spread_of(folder, blob: Blob) -> SpreadBlob:
    file = blob.write(folder / "blob.png")
    return measure_spread(PhotoInput(file=file, data="synthetic", markers=BOARD, face_mm=FACE_MM), folder)


def bead_of(folder, bead: BeadPhoto) -> BeadOutline:
    file = bead.write(folder / "bead.png")
    return measure_bead(PhotoInput(file=file, data="synthetic", markers=BEAD_BOARD, face_mm=BEAD_FACE_MM), folder)


@pytest.mark.parametrize("dark", [True, False])
def test_the_radius_of_a_blob_is_measured_to_a_tenth_of_a_pixel(tmp_path, dark):
    """The photo has perspective, a gradient of light, grain, a glint and a rim that is not round."""
    blob = replace(BLOB, dark=dark, tilt_deg=7.0, gradient=0.4, noise=0.03, lens_k1=-0.05, unround=(0.02, 0.01, 0.0))
    figures = spread_of(tmp_path, blob)
    assert figures.radius_mm == pytest.approx(48.0, abs=0.03)
    assert figures.unround == pytest.approx(0.0158, abs=0.001)
    assert figures.radius_error_mm > 0.5 * 0.3
    # Two lobes of 2 % make the longest way across about 4 % longer than the shortest.
    assert figures.diameters_mm[1] / figures.diameters_mm[0] == pytest.approx(1.04, abs=0.015)


def test_the_measured_sizes_of_a_bead_equal_the_drawn_sizes(tmp_path):
    bead = replace(BEAD, dark=False, turn=0.5, tilt_deg=6.0, lens_k1=-0.04, noise=0.03, straight_mm=25.0)
    outline = bead_of(tmp_path, bead)
    assert (outline.length_mm, outline.width_mm) == pytest.approx((25 + 16, 16), abs=0.06)
    assert outline.area_mm2 == pytest.approx(16 * 25 + np.pi * 64, rel=2e-3)
    assert outline.edge_error_mm == pytest.approx(0.5 * 0.15, rel=0.1)
    # A capsule's paste lies at distance d from its edge on two straight lines and one circle.
    shares = [(outline.inward_mm > depth).mean() * outline.area_mm2 for depth in (2.0, 6.0)]
    assert shares == pytest.approx([2 * (8 - d) * 25 + np.pi * (8 - d) ** 2 for d in (2, 6)], rel=0.03)
    # The ends of the bead lie on its middle line.
    tip_mm = (25 / 2 + 8) * np.array([np.cos(0.5), np.sin(0.5)])
    ends_mm = outline.tips_mm[np.argsort(outline.tips_mm[:, 0])]
    assert ends_mm == pytest.approx(np.array([45.0, 30.0]) + np.array([-tip_mm, tip_mm]), abs=0.2)


def bent() -> tuple[tuple[float, float], ...]:
    ring = resampled(replace(BEAD, middle_mm=(0.0, 0.0)).ring_mm, 0.5)
    return tuple((x, y + 0.02 * x * x) for x, y in ring.tolist())


@pytest.mark.parametrize(
    ("paste", "changes", "says"),
    [
        (BLOB, {"radius_mm": 11.0}, "at least 40"),
        (BLOB, {"unround": (0.2, 0.0, 0.0)}, "14%"),
        (BLOB, {"middle_mm": (20.0, 75.0)}, "edge is visible on only"),
        (BLOB, {"radius_mm": 0.5}, "no blob stands out|Take the photo from closer"),
        (BEAD, {"radius_mm": 5.0}, r"3\d px, .* at least 40"),
        (BEAD, {"straight_mm": 4.0}, r"20\.\d mm long and 1\d\.\d mm wide"),
        (BEAD, {"edge_mm": bent()}, "1[0-9]% of its length"),
        (BEAD, {"middle_mm": (20.0, 30.0)}, "edge is visible on only"),
    ],
)
def test_small_misshapen_or_cropped_blobs_and_beads_are_refused(tmp_path, paste, changes, says):
    with pytest.raises(InputError, match=says):
        (spread_of if paste is BLOB else bead_of)(tmp_path, replace(paste, **changes))
