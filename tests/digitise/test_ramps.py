"""A ramp against what constant acceleration does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from digitise.trajectory import times_along


@given(
    speed=st.floats(0.01, 1000),
    ramp=st.floats(0.01, 200),
    even=st.floats(0.0, 500),
    count=st.integers(2, 300),
)
def test_a_path_with_two_ramps_takes_as_long_as_one_longer_by_both_of_them(speed, ramp, even, count):
    """Each ramp is passed at half the speed on average."""
    length = 2 * ramp + even
    t_s = times_along(np.linspace(0.0, length, count), speed, ramp)
    # Square roots of distances: rounding of 1e-16 mm becomes 1e-8 of a ramp.
    assert t_s[-1] == pytest.approx((length + 2 * ramp) / speed, rel=1e-7)
    assert t_s[0] == 0
    assert np.diff(t_s).min() > 0


def test_acceleration_is_constant_and_speed_is_reached_at_the_end_of_the_ramp():
    """4 mm/s over 8 mm: 1 mm/s², 4 s. Second differences of t² / 2 are exact at even times."""
    way = np.array([0.0, 0.5, 2.0, 4.5, 8.0, 12.0, 16.0, 19.5, 22.0, 23.5, 24.0])
    # Half a second at a time: 0.5 t² up to t = 4 s, 4 mm/s in between, and the same way down.
    assert times_along(way, 4.0, 8.0) == pytest.approx([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10], abs=1e-12)


def test_the_way_back_is_the_way_there_in_a_mirror():
    way = np.sort(np.random.default_rng(0).uniform(0, 60, 50))
    way = np.concatenate([[0.0], way, [60.0]])
    there, back = times_along(way, 3.0, 11.0), times_along(60.0 - way[::-1], 3.0, 11.0)
    assert there == pytest.approx(there[-1] - back[::-1], abs=1e-9)


def test_no_ramp_is_at_speed_at_once():
    assert times_along(np.array([0.0, 1.0, 3.0]), 2.0, 0.0).tolist() == [0.0, 0.5, 1.5]
