"""Bounds of the settings that reach the robot's files and the printer."""

import json
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from digitise.settings import CrackShape, Marker, MarkerBoard, NozzlePath, PhotoInput
from sealtwin.core.errors import InputError

PHOTO: dict[str, Any] = {"file": "photo.jpg", "data": "measured"}
CRACK: dict[str, Any] = {"depth_mm": 16.0}
MARKER: dict[str, Any] = {"id": 0, "x_mm": 0.0, "y_mm": 0.0}


@pytest.mark.parametrize(
    ("table", "base", "key", "values"),
    [
        (PhotoInput, PHOTO, "mm_per_px", (1e-12, 1e-3, 10.0, 1e300)),
        (PhotoInput, PHOTO, "face_mm", ([160.0, 0.0], [160.0, -40.0], [160.0, 1e9])),
        (CrackShape, {}, "depth_mm", (0.001, 501.0)),
        *((CrackShape, CRACK, key, (1e-9, 1e9)) for key in ("floor_thickness_mm", "margin_mm")),
        (CrackShape, CRACK, "wall_angle_deg", (-4.84, [-4.0, 5.0])),
        (CrackShape, CRACK, "dam_height_mm", (-1.0, 1e9)),
        (NozzlePath, {}, "volume_ml", (1e-9, 0.0, 1001.0, 1e300)),
        (NozzlePath, {}, "speed_mm_s", (1e-9, 1e300)),
        (NozzlePath, {}, "nozzle_height_mm", (1e-9, 1e9)),
        (NozzlePath, {}, "spacing_mm", (1e-6, 1e9)),
        *((NozzlePath, {}, f"{of}_mm", (-1.0, 1e9)) for of in ("trim", "smoothing", "ramp", "lead_in", "lead_out")),
        (NozzlePath, {}, "fill", (0.0, -1.0, 1e9)),
        (MarkerBoard, {"markers": [MARKER | {"id": n} for n in range(4)]}, "size_mm", (1e-9, 1e9)),
        (Marker, MARKER, "x_mm", (-1e9, 1e300)),
        (Marker, MARKER, "id", (-1, 10**9)),
    ],
)
def test_the_error_for_a_setting_out_of_bounds_names_the_key(table: type[BaseModel], base, key, values):
    """Each of these values once reached trajectory.csv or crack.stl, or ended in a traceback."""
    for value in values:
        with pytest.raises(ValidationError, match=key):
            table.model_validate_json(json.dumps(base | {key: value}))


@pytest.mark.parametrize("key", ["ends_px", "via_px", "roi_px", "ruler_px", "face_corners_px"])
def test_the_error_for_a_pixel_position_beyond_any_photo_names_the_key(key):
    """Beyond 2^27 px OpenCV's integers overflow: a region of everything became a region of nothing."""
    for value in (-1e12, 2e6):
        with pytest.raises(ValidationError, match=key):
            PhotoInput.model_validate_json(json.dumps(PHOTO | {"mm_per_px": 0.1, key: [[0.0, 0.0], [value, 0.0]]}))


def test_extreme_settings_within_the_bounds_are_accepted():
    CrackShape.model_validate(CRACK | {"dam_height_mm": 0.0, "floor_thickness_mm": 0.2, "depth_mm": 500.0})
    NozzlePath.model_validate({"volume_ml": 1000.0, "speed_mm_s": 1000.0, "smoothing_mm": 0.0, "trim_mm": 0.0})
    PhotoInput.model_validate_json(json.dumps(PHOTO | {"mm_per_px": 0.002}))


def test_a_fill_fraction_together_with_a_volume_is_refused():
    """One of the two would be ignored."""
    with pytest.raises(InputError, match=r"fill = 0\.8 is given with volume_ml = 4\.8"):
        NozzlePath(volume_ml=4.8, fill=0.8)


def test_a_board_that_lists_a_marker_twice_is_refused():
    places = [{"id": number, "x_mm": 20.0 * number, "y_mm": 0.0} for number in (0, 1, 2, 3, 1)]
    with pytest.raises(ValidationError, match="marker 1 is listed 2 times"):
        MarkerBoard.model_validate_json(json.dumps({"size_mm": 16.0, "markers": places}))
