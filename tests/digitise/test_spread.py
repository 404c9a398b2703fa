"""Blobs on emulated photos of the printed sheet, whose outline is known."""

from dataclasses import replace

import pytest

from digitise.settings import PhotoInput
from digitise.spread import SpreadBlob, measure_spread
from sealtwin.core.errors import InputError
from tests.support.spread_photos import BOARD, FACE_MM, Blob

BLOB = Blob(48.0, mm_per_px=0.3)


def spread_of(folder, blob: Blob) -> SpreadBlob:
    file = blob.write(folder / "blob.png")
    return measure_spread(PhotoInput(file=file, data="synthetic", markers=BOARD, face_mm=FACE_MM), folder)


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


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"radius_mm": 11.0}, "at least 40"),
        ({"unround": (0.2, 0.0, 0.0)}, "14%"),
        ({"middle_mm": (20.0, 75.0)}, "edge is visible on only"),
        ({"radius_mm": 0.5}, "no blob stands out|Take the photo from closer"),
    ],
)
def test_small_misshapen_or_cropped_blobs_are_refused(tmp_path, changes, says):
    with pytest.raises(InputError, match=says):
        spread_of(tmp_path, replace(BLOB, **changes))
