"""What the trace page may say of a photo, and how it goes together with what its trial says already."""

from pathlib import Path

import pytest
from pydantic import ValidationError

from digitise.settings import CrackShape, Marker, MarkerBoard, PhotoInput
from digitise.trace_page.session import Hints, Shape, path_settings, rest_of, scale_settings
from sealtwin.core.errors import InputError

ENDS = ((1.0, 2.0), (300.0, 4.5))
BOARD = MarkerBoard(size_mm=16.0, markers=tuple(Marker(id=n, x_mm=float(n), y_mm=0.0) for n in range(4)))


def _trial(**changed):
    return PhotoInput(**{"file": Path("photo.jpg"), "data": "synthetic", **changed})


def test_hints_start_as_the_trial_has_them():
    """Defaults are not said: a save would write them into a file that never had them."""
    trial = _trial(ends_px=ENDS, mm_per_px=0.1, edge_fraction=0.7)
    assert Hints.of(trial).said() == {"ends_px": [[1.0, 2.0], [300.0, 4.5]], "mm_per_px": 0.1}


def test_a_trial_taken_apart_and_put_together_is_the_same():
    trial = _trial(markers=BOARD, face_mm=(160.0, 40.0), ends_px=ENDS, via_px=((5.0, 6.0),), edge_fraction=0.7)
    together = scale_settings(rest_of(trial), Hints.of(trial))
    assert together is not None
    assert together.model_dump(exclude={"ends_px", "via_px"}) == trial.model_dump(exclude={"ends_px", "via_px"})


def test_without_a_scale_there_is_none():
    """It is never guessed: the page then measures in pixels."""
    assert scale_settings(rest_of(_trial(mm_per_px=0.1)), Hints(ends_px=ENDS)) is None
    assert scale_settings(rest_of(_trial(mm_per_px=0.1)), Hints(scale_is="assumed")) is None
    assert scale_settings(rest_of(_trial(markers=BOARD)), Hints()) is not None


@pytest.mark.parametrize(
    ("hints", "named"),
    [
        (Hints(ruler_mm=30.0, mm_per_px=0.1), "ruler"),
        (Hints(ruler_px=ENDS), "ruler_mm"),
        (Hints(mm_per_px=-1.0), "mm_per_px"),
        (Hints(face_mm=(160.0, 0.5)), "face_mm"),
        (Hints(face_corners_px=((0, 9), (9, 9), (9, 0), (0, 0))), "face_mm"),
    ],
)
def test_half_a_scale_or_two_are_refused(hints, named):
    with pytest.raises(InputError, match=named):
        scale_settings(rest_of(_trial(mm_per_px=0.1)), hints)


def test_a_wrong_scale_does_not_keep_the_path_from_being_traced():
    rest = rest_of(_trial(markers=BOARD, edge_fraction=0.7))
    settings = path_settings(rest, Hints(ends_px=ENDS, mm_per_px=-1.0))
    assert (settings.ends_px, settings.edge_fraction, settings.markers) == (ENDS, 0.7, None)


def test_via_points_without_ends_are_refused():
    with pytest.raises(InputError, match="ends"):
        path_settings(rest_of(_trial(mm_per_px=0.1)), Hints(via_px=((5.0, 6.0),)))


@pytest.mark.parametrize(
    "body",
    [
        '{"file": "/etc/passwd"}',
        '{"ends_px": [[1, 2]]}',
        '{"ends_px": [["1", "2"], ["3", "4"]]}',
        '{"ends_px": [[1, NaN], [3, 4]]}',
        '{"ends_px": [[1, 1e999], [3, 4]]}',
        '{"mm_per_px": "0.1"}',
        '{"via_px": %s}' % ([[1, 2]] * 51),
        '{"roi_px": %s}' % ([[1, 2]] * 201),
        '{"scale_is": "guessed"}',
        "[" * 5000,
        "null",
    ],
)
def test_anything_else_is_no_hint(body):
    """The page can name no file, and send no number that is none."""
    with pytest.raises(ValidationError):
        Hints.model_validate_json(body)


def test_a_shape_is_what_a_trial_says_in_single_values():
    """A default must not be saved as if somebody had said it, nor a table be flattened."""
    assert Shape.of(CrackShape(depth_mm=16)).said() == {"depth_mm": 16.0}
    crack = CrackShape(depth_mm=((0, 16), (40, 12)), tilt="flare", wall_angle_deg=(5, 7))
    assert Shape.of(crack).said() == {"tilt": "flare"}
