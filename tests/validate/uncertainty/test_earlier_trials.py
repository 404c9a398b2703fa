"""What a lab's earlier trials make of a new computed level."""

from dataclasses import replace

import numpy as np
import pytest

from tests.evidence import FAST_FILL
from validate.result import EarlierTrial, EarlierTrials, Quantity
from validate.uncertainty.earlier_trials import biases, computed_quantities, expect, expected_sentences, foresee

HERE: dict[Quantity, float] = {"mean_level_mm": -2.0, "fill_ratio": 0.8, "heap_mm2": 0.5}


def trial(level=0.0, filled=(0.8, 0.8), heap=(0.0, 0.0)) -> EarlierTrial:
    ratios = {"computed_fill_ratio": filled[0], "read_fill_ratio": filled[1]}
    return EarlierTrial(name="P", level_error_mm=level, computed_heap_mm2=heap[0], read_heap_mm2=heap[1], **ratios)


def expecting(trials) -> EarlierTrials:
    expected = expect(trials, HERE)
    assert expected is not None
    return expected


def expected(trials, quantity: Quantity):
    return next(one for one in expecting(trials).expectations if one.quantity == quantity)


def test_one_trial_has_no_scatter_and_says_nothing():
    assert expect([trial()], HERE) is None
    assert biases([]) == ()


def test_a_level_is_moved_by_the_mean_error_within_students_t():
    """By hand: errors 0.1, 0.2, 0.6 have the mean 0.3 and the standard deviation 0.2646; t of two degrees is 4.303."""
    level = expected([trial(level=error) for error in (0.1, 0.2, 0.6)], "mean_level_mm")
    assert (level.bias, level.scatter) == pytest.approx((0.3, 0.264575), abs=1e-6)
    assert level.expected == pytest.approx(-2.3)
    half_mm = 4.302653 * 0.264575 * np.sqrt(4 / 3)
    assert level.expected_95 == pytest.approx((-2.3 - half_mm, -2.3 + half_mm), abs=1e-5)


def test_a_fill_is_divided_by_the_mean_factor_and_stays_a_share_and_no_heap_is_below_zero():
    """Computed over read is 1.1 and 1 / 1.1, then twice 0.5: twice as much was read as computed."""
    even = expected([trial(filled=(0.55, 0.5)), trial(level=0.2, filled=(0.5, 0.55))], "fill_ratio")
    assert even.relative
    assert (even.bias, even.expected) == pytest.approx((1.0, 0.8))
    assert even.scatter == pytest.approx(np.sqrt(2) * np.log(1.1))
    twice = expected([trial(filled=(0.2, 0.4)), trial(level=0.2, filled=(0.3, 0.606))], "fill_ratio")
    assert (twice.bias, twice.expected, twice.expected_95[1]) == pytest.approx((0.4975, 1.0, 1.0), abs=1e-4)
    heap = expected([trial(heap=(3.0, 1.0)), trial(level=0.2, heap=(2.0, 1.5))], "heap_mm2")
    assert (heap.bias, heap.expected, heap.expected_95[0]) == (1.25, 0.0, 0.0), "no heap is below 0"


def test_an_empty_crack_has_no_ratio_and_the_rest_is_told():
    earlier = expecting([trial(filled=(0.1, 0.0), heap=(0.1, 0.0)), trial(level=0.2)])
    assert [one.quantity for one in earlier.expectations] == ["mean_level_mm", "heap_mm2"]


def test_equal_errors_show_no_scatter_and_make_no_interval():
    """Two trials without a heap. Broken on purpose, its interval is 0.5 to 0.5 mm² and that of a level has no width."""
    earlier = expecting([trial(level=0.1), trial(level=0.3)])
    assert [one.quantity for one in earlier.expectations] == ["mean_level_mm"]
    assert expect([trial(level=0.1, heap=(0.1, 0.0)), trial(level=0.1)], HERE) is None


@pytest.mark.broad
def test_the_interval_holds_the_next_reading_in_95_of_100_labs():
    """Three trials and a fourth that is predicted, 4,000 labs of one bias and scatter: a fixed seed, sd 0.34 %."""
    drawn = np.random.default_rng(5)
    hits = 0
    for _ in range(4000):
        *errors, here = drawn.normal(0.4, 0.3, 4)
        low, high = expected([trial(level=error) for error in errors], "mean_level_mm").expected_95
        hits += low <= HERE["mean_level_mm"] - here <= high
    assert 0.94 <= hits / 4000 <= 0.96


def test_the_computed_numbers_are_those_over_the_length_that_was_read(evidence):
    metrics = evidence.comparison
    here = computed_quantities(evidence)
    assert here["mean_level_mm"] == pytest.approx(-8.0 + 0.2 * 20.0 + 0.5)
    assert here["fill_ratio"] == pytest.approx(metrics.simulated_fill_ratio)
    assert here["heap_mm2"] == pytest.approx(metrics.simulated_overfill_mm3 / metrics.covered_length_mm)
    alone = computed_quantities(replace(evidence, readings=None, comparison=None))
    assert alone["mean_level_mm"] == pytest.approx(here["mean_level_mm"], abs=1e-6)


def test_a_run_that_lost_volume_or_is_the_fast_model_s_is_not_foreseen(evidence):
    trials = [trial(level=0.1), trial(level=0.3)]
    assert foresee(trials, evidence) == expect(trials, computed_quantities(evidence)) is not None
    assert foresee(trials[:1], evidence) is None
    assert foresee(trials, replace(evidence, volume_ratio=0.94)) is None
    assert foresee(trials, replace(evidence, run=replace(evidence.run, fast_fill=FAST_FILL))) is None


def test_words_have_the_sign_of_the_bias():
    high, low = (expected_sentences(expecting([trial(level=sign * 0.2), trial(level=sign * 0.4)])) for sign in (1, -1))
    assert "0.3 mm below the computed level" in high[0]
    assert "-2.30 mm" in high[0]
    assert "0.3 mm above the computed level" in low[0]
    assert len(high) == 3, "few trials are called few"
    assert "for 2 trials" in high[1]
    assert len(expected_sentences(expecting([trial(level=0.1 * one) for one in range(4)]))) == 2
