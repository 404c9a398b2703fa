from pathlib import Path

import numpy as np
import pytest

from digitise.photo import load_photo, scale_by_ruler
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.facts import texts
from tests.support.photos import mortar, write_png

FILE = Path("photo.jpg")


def test_two_points_and_their_distance_give_the_scale(tmp_path):
    """The points are 300 px apart in x and 200 px in y, which is 360.56 px or, here, 36.056 mm."""
    write_png(tmp_path / "photo.jpg", mortar())
    settings = PhotoInput(
        file=FILE, data="synthetic", ruler_px=((100.0, 250.0), (400.0, 50.0)), ruler_mm=float(np.hypot(30, 20))
    )
    photo = load_photo(settings, tmp_path)
    assert photo.mm_per_px == pytest.approx(0.1)
    assert photo.to_mm(np.array([[0.0, 299], [10, 289]])) == pytest.approx(np.array([[0.0, 0], [1, 1]]), abs=1e-12)
    assert (photo.scale_source, photo.camera_tilt_deg) == ("ruler of 36.0555 mm over 361 px", None)
    assert any("5 degrees" in text and "3.5 %" in text for text in texts(photo.warnings))


@pytest.mark.parametrize(
    ("start_px", "end_px", "says"), [(0.0, 30.0, r"30\.0 px .* 50 px"), (-20.0, 500.0, "520.* px")]
)
def test_a_ruler_that_is_short_or_outside_the_photo_is_refused(start_px, end_px, says):
    with pytest.raises(InputError, match="the two points of ruler_px are " + says):
        scale_by_ruler(((start_px, 10.0), (end_px, 10.0)), 50.0, (2000, 1000), FILE)
