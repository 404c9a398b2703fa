"""What a report says of readings, of how near they are and of where a level leaves them, pinned by value."""

from dataclasses import replace

import numpy as np
import pytest

from sealtwin.core.doubts import QuantityMean
from sealtwin.core.errors import present
from tests.support.evidence import make_evidence
from validate.compare import compare, worst_at_a_station
from validate.intervals import StationError, StationErrors
from validate.report.first_page import first_page
from validate.report.report_facts import stretches_off

S_MM = np.arange(0.0, 45.0, 5.0)


def stations(*errors_mm):
    """Stations 5 mm apart, in a band of 1 mm."""
    bands = {"data_mm": 0 * S_MM, "validation_mm": 0 * S_MM, "profile_mm": 1 + 0 * S_MM}
    return StationErrors(
        s_mm=S_MM, error_mm=np.array(errors_mm), numerics_mm=None, inputs_mm=None, by_chance=0.4, **bands
    )


LARGEST_FIRST = (
    "too low from 15 to 20 mm (up to 3.0 mm, at 15 mm), too high at 40 mm (2.0 mm), "
    "too high from 5 to 10 mm (up to 1.4 mm, at 10 mm)."
)


@pytest.mark.parametrize(
    ("errors_mm", "named", "absent"),
    [
        ((0, 1.2, 1.4, -3, -1.1, 0.9, 0, 0, 2.0), LARGEST_FIRST, "more"),
        ((2, 0, -2.1, 0, 2.2, 0, -2.3, 0, 2.4), "2 more stretches", "at 0 mm"),
        ((0.99,) * 9, "", "too"),
    ],
)
def test_stretches_off_are_named(errors_mm, named, absent):
    text = stretches_off(stations(*errors_mm))
    assert named in text
    assert absent not in text
    assert bool(text) == bool(named)


def test_a_worst_error_between_stations_or_beyond_the_readings_is_said_to_be_one():
    errors = stations(0, 0, -2.0, *[0] * 6)
    assert worst_at_a_station(errors, S_MM[1]) is None
    assert worst_at_a_station(errors, S_MM[-1] + 0.4) == StationError(2.0, S_MM[2])


def test_the_mean_of_another_quantity_is_in_the_comparison_and_on_page_one(tmp_path):
    evidence = make_evidence(tmp_path)
    means = {"temperature": QuantityMean(value=21.75, unit="°C", stations=4)}
    means |= {"noise": QuantityMean(value=46, unit="", stations=1)}
    readings = replace(present(evidence.readings, "readings"), means=means)
    crack = evidence.outline, evidence.solid
    comparison = compare(evidence.profile, readings, *crack, role="undeclared", photo_data="measured")
    assert comparison.model_dump()["means"]["temperature"] == {"value": 21.75, "unit": "°C", "stations": 4}
    assert "means" not in present(evidence.comparison, "comparison").model_dump()
    text = "temperature 21.75 °C, mean of 4 stations; noise 46 (no unit), mean of 1 station."
    assert ("Conditions:", text) in first_page(replace(evidence, comparison=comparison)).notes
