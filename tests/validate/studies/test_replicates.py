"""Several trials: held-out ones first and alone in the mean, and a metric of distributions against closed forms."""

import numpy as np
import pytest

from sealtwin.errors import InputError
from validate.studies.replicates import Compared, area_validation_metric, held_out_mean_mm, held_out_table


def trial(name: str, role: str, mean_error_mm: float, **metrics) -> Compared:
    known = {"role": role, "readings_data": "measured", "mean_error_mm": mean_error_mm, "bias_mm": 0.1}
    return Compared(name, known | {"worst_error_mm": 3.0, "beats_flat_level": True} | metrics)


def test_held_out_trials_come_first_and_alone_make_the_mean():
    trials = [trial("a", "calibrated-on", 0.2), trial("b", "held-out", 1.0), trial("c", "held-out", 2.0)]
    assert [row.name for row in held_out_table(trials)] == ["b", "c", "a"]
    assert held_out_mean_mm(trials) == pytest.approx(1.5)
    assert held_out_mean_mm(trials[:1]) is None


def test_an_interval_is_shown_where_there_is_one():
    known = trial("a", "held-out", 1.0, uncertainty={"mean_error_mm": [0.9, 1.1]}, beats_volume_balance=False)
    (row,) = held_out_table([known])
    assert (row.low_mm, row.high_mm, row.beats_volume_balance) == (0.9, 1.1, False)
    (bare,) = held_out_table([trial("b", "held-out", 1.0)])
    assert (bare.low_mm, bare.beats_volume_balance) == (None, None)


def test_the_area_between_two_distributions():
    """A shift is itself; half of the replicates 2 mm higher are 1 mm; order and number of replicates do not matter."""
    assert area_validation_metric([0.0, 1.0], [3.0, 4.0]) == pytest.approx(3.0, abs=1e-12)
    assert area_validation_metric([0.0, 2.0], [0.0, 0.0]) == pytest.approx(1.0, abs=1e-12)
    assert area_validation_metric([2.0, 0.0], [0.0, 0.0, 2.0, 2.0]) == pytest.approx(0.0, abs=1e-12)


def test_it_is_the_integral_of_the_difference_of_both_curves():
    simulated, measured = np.array([0.3, 1.1, 2.0]), np.array([0.5, 0.9, 1.4, 3.0])
    x = np.linspace(0, 4, 400_001)
    steps = [np.searchsorted(np.sort(side), x, side="right") / len(side) for side in (simulated, measured)]
    area = np.trapezoid(np.abs(steps[0] - steps[1]), x)
    assert area_validation_metric(simulated, measured) == pytest.approx(area, abs=1e-4)


@pytest.mark.parametrize(("simulated", "measured"), [([1.0], [1.0, 2.0]), ([1.0, 2.0], []), ([1.0, np.nan], [1, 2])])
def test_one_replicate_is_no_distribution(simulated, measured):
    with pytest.raises(InputError, match="2 or more are needed"):
        area_validation_metric(simulated, measured)
