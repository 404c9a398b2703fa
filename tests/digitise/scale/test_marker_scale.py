import re

import numpy as np
import pytest

from digitise.geometry.polyline import rectangle
from digitise.photo import Photo, load_photo
from digitise.scale.marker_scale import BOARD_MM, PRINT
from digitise.settings import MarkerBoard
from fixtures.generate.recipe import Recipe
from fixtures.generate.specimen import Specimen, make_specimen
from sealtwin.core.errors import InputError
from tests.support.marker_boards import face_grid_mm
from tests.support.photos import SMALL_FACE, photo_of

BENT = Recipe(**SMALL_FACE, lens_k1=-0.2, camera_mm=262.0, tilt_deg=4.0)
GRID_MM = face_grid_mm() * (70 / 160, 1.0)


@pytest.fixture(scope="module")
def bent() -> Specimen:
    """A wide lens close by: without its radial term, lengths are off by up to 1 %."""
    return make_specimen(1, BENT)


@pytest.fixture(scope="module")
def bent_photo(bent, tmp_path_factory) -> Photo:
    return photo_of(bent, tmp_path_factory.mktemp("bent"))


def errors(photo: Photo, specimen: Specimen) -> tuple[float, float]:
    """Of lengths between places all over the face: of their mean, and of the worst that is longer than 10 mm."""
    seen_mm = photo.to_mm(specimen.to_px(GRID_MM))
    first, second = np.triu_indices(len(GRID_MM), 1)
    true_mm = np.linalg.norm(GRID_MM[first] - GRID_MM[second], axis=1)
    off = np.linalg.norm(seen_mm[first] - seen_mm[second], axis=1) / true_mm - 1
    return abs(float(np.mean(off))), float(np.abs(off[true_mm > 10]).max())


def test_a_bent_photo_is_measured_like_a_straight_one(bent, bent_photo, tmp_path):
    """The issue asks for 0.3 %. The design note reached 0.07 % in the mean and 0.14 % in the worst length."""
    bent.write(tmp_path)
    four = tuple(marker for marker in bent.board.markers if marker.id in (0, 2, 5, 7))
    board = MarkerBoard(size_mm=bent.board.size_mm, markers=four)
    by_four = load_photo(bent.photo_input().model_copy(update={"markers": board}), tmp_path)
    for photo in (bent_photo, by_four):
        mean, worst = errors(photo, bent)
        assert mean < 0.0002
        assert worst < 0.0005
        assert photo.scale_source.endswith(", lens fitted")
        assert photo.scale_residual_mm is not None
        assert photo.scale_residual_mm < 0.01


def test_a_lens_that_is_not_wanted_is_not_fitted(bent, tmp_path):
    """Straight markers cannot be laid over bent ones: they miss by twice what is allowed, and the lens is offered."""
    bent.write(tmp_path)
    with pytest.raises(InputError, match=r"photo\.jpg: markers misfit by 0\.\d+ mm.* lens"):
        load_photo(bent.photo_input().model_copy(update={"lens": "none"}), tmp_path)


def test_tilt_and_uncertainty_of_a_photo_are_told(bent, tmp_path):
    """The camera leans by 4 degrees about x and 2 about y. The frame's callipered size is most of what is unsure."""
    bent.write(tmp_path)
    photo = load_photo(bent.photo_input().model_copy(update={"camera_distance_mm": 262.0}), tmp_path)
    assert photo.camera_tilt_deg == pytest.approx(4.47, abs=0.2)
    span_mm = np.hypot(70 + 28 + 16, 40 + 28 + 16)
    assert photo.scale_uncertainty is not None
    assert BOARD_MM / span_mm <= photo.scale_uncertainty < 2 * BOARD_MM / span_mm


def test_markers_below_the_face_or_printed_smaller_make_the_scale_unsure(bent, bent_photo, tmp_path):
    """As they would look 5 mm lower at 262 mm: 1.9 % larger. The edges of the face give them away.

    By a table longer than a frame that a printer made smaller it is the same; the ruler on the frame mends it.
    """
    bent.write(tmp_path)

    def by_table(grown, **changes):
        board = bent.board.model_dump() | changes
        board["size_mm"] *= grown
        for marker in board["markers"]:
            marker["x_mm"] = 35 + grown * (marker["x_mm"] - 35)
            marker["y_mm"] = 20 + grown * (marker["y_mm"] - 20)
        settings = {"markers": MarkerBoard(**board), "camera_distance_mm": 262.0}
        return load_photo(bent.photo_input().model_copy(update=settings), tmp_path)

    grown = 1 + 5 / 262
    photo = by_table(grown)
    assert photo.scale_uncertainty == pytest.approx(grown - 1, rel=0.2)
    assert any("mm below the face, 262 mm from the camera" in warning.text for warning in photo.warnings)
    assert any("the scale's standard uncertainty is 2.0%" in warning.text for warning in photo.warnings)
    assert re.search(r"a print at 9[78]\.\d% \(.*photo\.markers\.printed_ruler_mm", photo.warnings[0].text)
    mended = by_table(grown, printed_ruler_mm=100 / grown)
    assert mended.mm_per_px == pytest.approx(bent_photo.mm_per_px, rel=1e-4)
    assert mended.warnings == ()
    assert mended.scale_uncertainty == pytest.approx(BOARD_MM * grown / 100, rel=0.2)


def test_a_print_that_nothing_checks_is_in_the_uncertainty_and_named(bent, tmp_path):
    """A frame printed at 97 % gives lengths 3 % off without a face or a ruler to hold it against."""
    bent.write(tmp_path)
    by_ruler = MarkerBoard(**bent.board.model_dump() | {"printed_ruler_mm": 100.0})
    for board, least, most in ((bent.board, PRINT, 1.01 * PRINT), (by_ruler, BOARD_MM / 100, 1.5 * BOARD_MM / 100)):
        photo = load_photo(bent.photo_input().model_copy(update={"markers": board, "face_mm": None}), tmp_path)
        assert photo.scale_uncertainty is not None
        assert least <= photo.scale_uncertainty < most
        assert any("photo.markers.printed_ruler_mm" in warning.text for warning in photo.warnings) == (
            board is bent.board
        )


def test_corners_beside_markers_are_checked_like_corners_alone(bent, tmp_path):
    bent.write(tmp_path)
    turned = tuple((float(x), float(y)) for x, y in bent.to_px(rectangle((0, 0, 70, 40)))[::-1])
    settings = bent.photo_input().model_copy(update={"face_corners_px": turned})
    with pytest.raises(InputError, match=r"photo\.jpg: face_corners_px = \(\("):
        load_photo(settings, tmp_path)
