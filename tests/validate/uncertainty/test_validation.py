"""Conclusions after V&V 20, and their limits."""

import numpy as np
import pytest

from sealtwin.core.comparison import StationErrors
from validate.uncertainty.validation import left_out, mean_level_budget, mean_level_sentence, station_sentence


def test_an_error_within_the_doubt_does_not_say_that_the_model_is_right():
    sentence = mean_level_sentence(mean_level_budget(-0.2, 0.5, 0.3, 0.4, 0.0))
    assert sentence.startswith("The data cannot resolve an error of the model in the mean level (E = -0.20 mm, 2 u_val")
    assert "between -1.20 and +0.80 mm" in sentence
    assert sentence.endswith("This does not say that the model is right.")


@pytest.mark.parametrize(("error_mm", "way"), [(1.5, "too high"), (-1.5, "too low")])
def test_an_error_beyond_it_has_a_sign_and_bounds(error_mm, way):
    mean = mean_level_budget(error_mm, 0.5, 0.3, 0.4, 0.0)
    assert mean.resolved
    sentence = mean_level_sentence(mean)
    assert f"lies between {error_mm - 1:+.2f} and {error_mm + 1:+.2f} mm" in sentence
    assert f"mean level is {way}" in sentence


def test_what_is_not_determined_is_said():
    assert "about the numerics and the inputs is not in it" in mean_level_sentence(mean_level_budget(1.0, 0.1, 0.1))
    assert "about the inputs is not in it" in mean_level_sentence(mean_level_budget(1.0, 0.2, 0.1, 0.1))
    assert "not in it" not in mean_level_sentence(mean_level_budget(1.0, 0.2, 0.1, 0.1, 0.1))


def stations(error_mm, standard_mm, times: float = 1.5) -> StationErrors:
    """Stations whose common band is ``times`` as wide as that of each."""
    error_mm, standard_mm = np.array(error_mm), np.array(standard_mm)
    return StationErrors(
        s_mm=np.arange(float(len(error_mm))),
        error_mm=error_mm,
        data_mm=standard_mm,
        numerics_mm=None,
        inputs_mm=None,
        validation_mm=standard_mm,
        profile_mm=2 * times * standard_mm,
        by_chance=0.05 * len(error_mm),
    )


def test_stations_are_counted_by_the_side_on_which_they_are_off():
    sentence = station_sentence(stations([1.0, -1.0, -0.1, 0.5], [0.2] * 4))
    assert sentence.startswith("At 2 of 4 stations E leaves the 95 % band of the whole profile: ")
    assert "too high at 1 and too low at 1." in sentence
    assert sentence.endswith("|E| is above 2 u_val at 3; by chance alone it would be at 0.2.")


def test_many_stations_are_many_tests():
    """One of twenty above its own 2 u_val is chance, and the model is not called off for it."""
    sentence = station_sentence(stations([0.5, *[0.0] * 19], [0.2] * 20))
    assert sentence.startswith("At none of 20 stations does E leave the 95 % band of the whole profile. ")
    assert "above 2 u_val at 1; by chance alone it would be at 1.0." in sentence


def test_only_with_all_doubts_known_is_the_model_to_blame():
    """With one sentence for both, numerics and inputs that were not computed were blamed on the model."""
    assert "The simulated mean level is too high" in mean_level_sentence(mean_level_budget(1.0, 0.2, 0.1, 0.1))
    assert "The model's mean level is too high" in mean_level_sentence(mean_level_budget(1.0, 0.2, 0.1, 0.1, 0.1))
    both = stations([1.0, -1.0], [0.2, 0.2])
    assert "there the model is off, too high at 1" in station_sentence(both)
    partial = station_sentence(both, left_out(mean_level_budget(0.0, 0.1, 0.1)))
    assert "model" not in partial
    assert (
        "too high at 1 and too low at 1, by more than the readings' uncertainty alone; that of the numerics and"
        in partial
    )


def test_an_input_that_waits_for_its_run_is_not_in_it():
    """The effect of stations needs no run; declared beside a speed, it must not count as that of all inputs."""
    waiting = mean_level_budget(1.0, 0.2, 0.1, 0.1, 0.1, inputs_waiting=True)
    assert "about the other inputs is not in it" in mean_level_sentence(waiting)
