from pathlib import Path

import numpy as np
import pytest

from digitise.geometry.polyline import coverage, rectangle
from digitise.image.raster import blurred
from digitise.scale.marker_scale import check_level
from digitise.scale.view import View
from fixtures.generate.rendering import BOARD, GAP, MORTAR
from sealtwin.core.errors import InputError

FILE = Path("photo.jpg")
FACE_MM = (0.0, 0.0, 70.0, 40.0)
DISTANCE_MM = 300.0
PX = np.array([[0.1, 0, -10], [0, -0.1, 50], [0, 0, 1.0]])
"""A tenth of a millimetre per pixel; the face lies 100 px from each border."""
SIZE_PX = (900, 600)


def looked_at_mm(grown: float) -> View:
    """The mapping of markers that lie below the face by ``grown`` of their distance: it looks larger by as much."""
    middle_mm = np.array([35.0, 20.0])
    shift = np.array([[1 + grown, 0, -grown * middle_mm[0]], [0, 1 + grown, -grown * middle_mm[1]], [0, 0, 1]])
    return View(shift @ PX)


def picture(gap_px: float = 0.0, board: float = BOARD, crack: bool = True) -> np.ndarray:
    corners_px = View(PX).to_px(rectangle(FACE_MM))
    middle_px = corners_px.mean(axis=0)
    outer_px = corners_px + gap_px * np.sign(corners_px - middle_px)
    face, gap = coverage(corners_px, SIZE_PX), coverage(outer_px, SIZE_PX)
    grain = blurred(np.random.default_rng(1).standard_normal(SIZE_PX[::-1], dtype=np.float32), 1.2)
    light = board * (1 - gap) + GAP * (gap - face) + MORTAR * face * (1 + 0.09 * grain / grain.std())
    if crack:
        light[:, 400:440] = np.where(face[:, 400:440] > 0.5, 0.02, light[:, 400:440])
    return blurred(light.astype(np.float32), 0.9)


@pytest.mark.parametrize("gap_px", [0.0, 2.5, 5.0, 20.0])
def test_markers_level_with_the_face_raise_no_alarm(gap_px):
    """Whether the sample's edge meets the board, or a dark gap of any width lies between."""
    excess, warnings = check_level(picture(gap_px), looked_at_mm(0.0), FACE_MM, None, DISTANCE_MM, FILE)
    assert excess == 0
    assert warnings == ()


@pytest.mark.parametrize(
    ("below_mm", "side", "gap_px"), [(5.0, "below", 0.0), (-5.0, "above", 5.0), (5.0, "below", 20.0)]
)
def test_markers_beside_the_plane_of_the_face_are_told_with_their_offset(below_mm, side, gap_px):
    """5 mm at 300 mm is 1.7 % of every length. The edges tell it to half a millimetre: 0.17 % of the face's 81 mm."""
    grown = below_mm / DISTANCE_MM
    excess, warnings = check_level(picture(gap_px), looked_at_mm(grown), FACE_MM, None, DISTANCE_MM, FILE)
    assert excess == pytest.approx(grown, abs=0.0017)
    (warning,) = warnings
    assert "1.7%" in warning.text
    assert f"mm {side} the face, 300 mm from the camera" in warning.text
    assert f"{70 * (1 + grown):.1f} x {40 * (1 + grown):.1f} mm, but face_mm is 70 x 40" in warning.text


def test_an_offset_that_is_no_bent_frame_is_refused():
    """Markers on the table, beside a sample 40 mm high: 13 % of every length."""
    corners_px = View(PX).to_px(rectangle(FACE_MM))
    with pytest.raises(InputError, match=r"79\.3 x 45\.3 mm.* face_mm is 70 x 40.* markers 40\.0 mm below"):
        check_level(picture(), looked_at_mm(40 / DISTANCE_MM), FACE_MM, corners_px, DISTANCE_MM, FILE)


@pytest.mark.parametrize(
    ("light", "face_mm", "why"),
    [
        (picture(board=MORTAR), FACE_MM, "no edges of the face"),
        (picture(), None, "since face_mm is not given"),
    ],
    ids=["hidden", "unmeasured"],
)
@pytest.mark.parametrize(("distance_mm", "cost"), [(262.0, "0.38% of every length at 262"), (None, "0.40% of every")])
def test_where_it_cannot_be_seen_the_rule_is_told_with_its_number(light, face_mm, why, distance_mm, cost):
    excess, warnings = check_level(light, looked_at_mm(0.0), face_mm, None, distance_mm, FILE)
    assert excess is None
    (warning,) = warnings
    assert why in warning.text
    assert cost in warning.text
