"""The robot's frame against known turns and shifts, and what must never pass for one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from digitise.robots.cell import RobotFrame, fit_frame
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

CORNERS = np.array([[0.0, 0.0], [160.0, 0.0], [0.0, 40.0]])
FOUR = np.vstack([CORNERS, [[160.0, 40.0]]])
SHIFT = np.array([312.0, -81.0, 55.0])


def seen(sample_mm: Floats, turn_deg: float = 130.0, tip_deg: float = 2.0) -> Floats:
    """The points as a robot finds them: turned about z, tipped, shifted."""
    return (
        Rotation.from_euler("zx", [turn_deg, tip_deg], degrees=True).apply(
            np.column_stack([sample_mm, np.zeros(len(sample_mm))])
        )
        + SHIFT
    )


def fitted(sample_mm: Floats, robot_mm: Floats, limit_mm: float = 0.5) -> RobotFrame:
    return fit_frame(sample_mm, robot_mm, limit_mm=limit_mm, where="cell.toml")


@settings(max_examples=30)
@given(turn=st.floats(-180, 180), tip=st.floats(-60, 60), seed=st.integers(0, 99))
def test_any_turn_and_shift_is_found_exactly(turn, tip, seed):
    frame = fitted(CORNERS, seen(CORNERS, turn, tip))
    # Rounding of coordinates of some hundred millimetres.
    assert frame.residual_mm.max() < 1e-9
    assert frame.scale == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.det(frame.rotation) == pytest.approx(1.0)
    point = np.random.default_rng(seed).uniform(-50, 200, (5, 2))
    flat = np.column_stack([point, np.zeros(5)])
    assert np.abs(frame.to_robot_mm(flat) - seen(point, turn, tip)).max() < 1e-9
    # Above the face is along its normal: 3 mm of height stay 3 mm.
    lifted = frame.to_robot_mm(flat + np.array([0, 0, 3.0]))
    assert lifted - frame.to_robot_mm(flat) == pytest.approx(np.tile(3.0 * frame.normal, (5, 1)))


def test_errors_of_touch_grow_outside_the_taught_points():
    """Square to the face, against a thousand simulated teachings; the leverage formula is exact for a plane."""
    rng = np.random.default_rng(1)
    places = np.array([[80.0, 20.0], [80.0, 100.0]])
    flat = np.column_stack([places, np.zeros(2)])
    heights_mm = []
    for _ in range(1000):
        touched = seen(FOUR, 0.0, 0.0) + rng.normal(0, 0.1, (4, 3))
        heights_mm.append(fitted(FOUR, touched, limit_mm=9.0).to_robot_mm(flat)[:, 2])
    spread = np.std(heights_mm, axis=0) / 0.1
    frame = fitted(FOUR, seen(FOUR))
    for place, growth in zip(places, spread, strict=True):
        # 1000 draws know a standard deviation to 2 %; three of them.
        assert frame.error_growth(place[None]) == pytest.approx(growth, rel=0.07)
    assert frame.error_growth(places) == pytest.approx(spread.max(), rel=0.07)


@pytest.mark.parametrize(
    ("sample_mm", "robot_mm", "says"),
    [
        (CORNERS, seen(CORNERS) / 25.4, r"0\.03937 times as far apart"),
        (CORNERS, seen(CORNERS * 1.013), r"1\.013 times as far apart"),
        (CORNERS, seen(CORNERS * [1, -1], tip_deg=0.0), "mirrored"),
        # The arm hangs.
        (CORNERS, seen(CORNERS, tip_deg=0.0) * [1, -1, -1], "whose z points up"),
        (CORNERS, seen(CORNERS[[0, 2, 1]]), r"do not fit .* are 0\.6\d* times"),
        (FOUR, seen(FOUR) + np.outer([0, 0, 0, 6], [1, 0, 0]), r"point 4, .*\[160, 40\], .*4\.04 mm off; 0.5"),
        (np.array([[0, 0], [80, 1], [160, 0]]), seen(np.array([[0, 0], [80, 1], [160, 0]])), r"0\.47 mm of a line"),
        (np.tile([[5.0, 5.0]], (3, 1)), seen(np.tile([[5.0, 5.0]], (3, 1))), r"within 0 mm of a line"),
    ],
)
def test_points_that_no_rigid_sample_has_are_refused_by_what_is_wrong(sample_mm, robot_mm, says):
    with pytest.raises(InputError, match=r"cell\.toml: .*" + says):
        fitted(np.asarray(sample_mm, dtype=float), robot_mm)
