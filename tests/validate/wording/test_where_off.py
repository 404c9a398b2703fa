"""Where a level leaves its readings: stretches, sides and places, pinned by value."""

import numpy as np
import pytest

from validate.comparison import StationError, StationErrors
from validate.wording.comparison import between_stations, stretches_off, worst_at_a_station

S_MM = np.arange(0.0, 45.0, 5.0)


def stations(*errors_mm):
    """Stations 5 mm apart, in a band of 1 mm."""
    bands = {"data_mm": 0 * S_MM, "validation_mm": 0 * S_MM, "profile_mm": 1 + 0 * S_MM}
    return StationErrors(
        s_mm=S_MM, error_mm=np.array(errors_mm), numerics_mm=None, inputs_mm=None, by_chance=0.4, **bands
    )


def told_of(*errors_mm):
    return " ".join(stretches_off(stations(*errors_mm)))


def test_stretches_are_named_with_side_place_and_largest_error_first():
    told = told_of(0, 1.2, 1.4, -3, -1.1, 0.9, 0, 0, 2.0)
    parts = ["too low from 15 to 20 mm (by up to 3.0 mm, at 15 mm)", "too high at 40 mm (by 2.0 mm)"]
    parts.append("too high from 5 to 10 mm (by up to 1.4 mm, at 10 mm)")
    assert ", ".join(parts) + "." in told


def test_three_stretches_are_named_and_the_others_counted():
    told = told_of(2, 0, -2.1, 0, 2.2, 0, -2.3, 0, 2.4)
    assert "at 0 mm" not in told
    assert "2 other stretches" in told


def test_nothing_is_said_of_stations_in_the_band():
    assert not told_of(*np.full(len(S_MM), 0.99))


@pytest.mark.parametrize(("worst_at_mm", "sentences"), [(10.0, 0), (12.5, 1)])
def test_a_worst_error_between_stations_is_said_to_be_one(worst_at_mm, sentences):
    assert len(between_stations(S_MM, worst_at_mm)) == sentences


@pytest.mark.parametrize(("worst_at_mm", "expected"), [(S_MM[1], None), (S_MM[-1] + 0.4, StationError(2.0, S_MM[2]))])
def test_a_worst_error_beyond_the_readings_has_one_at_a_station_beside_it(worst_at_mm, expected):
    error_mm = np.zeros(len(S_MM))
    error_mm[2] = -2.0
    assert worst_at_a_station(stations(*error_mm), worst_at_mm) == expected
