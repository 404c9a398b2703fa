"""Conclusions after V&V 20, and their limits."""

import numpy as np
import pytest

from validate.uncertainty.validation import left_out, mean_level_budget, mean_level_sentence, station_sentence


def test_parts_add_in_squares_and_only_those_that_are_known():
    assert mean_level_budget(1.0, 0.3, 0.4, 1.2).validation_mm == pytest.approx(1.3)
    assert mean_level_budget(1.0, 0.3, None, None).validation_mm == pytest.approx(0.3)


def test_an_error_within_the_doubt_does_not_say_that_the_model_is_right():
    sentence = mean_level_sentence(mean_level_budget(-0.2, 0.3, 0.4, 0.0))
    assert sentence.startswith("The data cannot resolve an error of the model in the mean level (E = -0.20 mm, 2 u_val")
    assert "between -1.20 and +0.80 mm" in sentence
    assert sentence.endswith("This does not say that the model is right.")


@pytest.mark.parametrize(("error_mm", "way"), [(1.5, "too high"), (-1.5, "too low")])
def test_an_error_beyond_it_has_a_sign_and_bounds(error_mm, way):
    mean = mean_level_budget(error_mm, 0.3, 0.4, 0.0)
    assert mean.resolved
    sentence = mean_level_sentence(mean)
    assert f"lies between {error_mm - 1:+.2f} and {error_mm + 1:+.2f} mm" in sentence
    assert f"mean level is {way}" in sentence


def test_what_is_not_determined_is_said():
    assert "about the numerics and the inputs is not in it" in mean_level_sentence(mean_level_budget(1.0, 0.1))
    assert "about the inputs is not in it" in mean_level_sentence(mean_level_budget(1.0, 0.1, 0.1))
    assert "not in it" not in mean_level_sentence(mean_level_budget(1.0, 0.1, 0.1, 0.1))


def test_stations_are_counted_by_the_side_on_which_they_are_off():
    sentence = station_sentence(np.array([1.0, -1.0, -0.1, 0.3]), np.array([0.2, 0.2, 0.2, 0.1]))
    assert "At 3 of 4 stations" in sentence
    assert "too high at 2 and too low at 1. At the other 1 the data cannot tell." in sentence
    assert station_sentence(np.zeros(3), np.ones(3)) == "At none of 3 stations is |E| above 2 u_val."


def test_only_with_all_doubts_known_is_the_model_to_blame():
    """With one sentence for both, numerics and inputs that were not computed were blamed on the model."""
    assert "The simulated mean level is too high" in mean_level_sentence(mean_level_budget(1.0, 0.1, 0.1))
    assert "The model's mean level is too high" in mean_level_sentence(mean_level_budget(1.0, 0.1, 0.1, 0.1))
    errors_mm, validation_mm = np.array([1.0, -1.0]), np.array([0.2, 0.2])
    assert "there the model is off, too high at 1" in station_sentence(errors_mm, validation_mm)
    partial = station_sentence(errors_mm, validation_mm, left_out(mean_level_budget(0.0, 0.1)))
    assert "model" not in partial
    assert (
        "too high at 1 and too low at 1, by more than the readings' uncertainty alone; that of the numerics and"
        in partial
    )


def test_an_input_that_waits_for_its_run_is_not_in_it():
    """The effect of stations needs no run; declared beside a speed, it must not count as that of all inputs."""
    waiting = mean_level_budget(1.0, 0.1, 0.1, 0.1, inputs_waiting=True)
    assert "about the other inputs is not in it" in mean_level_sentence(waiting)
