"""Bias and scatter over a lab's earlier trials, and the expected readings of a new trial.

As for fire models, the model's error is a bias and a scatter of each quantity over all trials with held-out readings
(McGrattan & Toman 2011, *Fire Safety Journal* 46; FDS's validation guide). Fills, which are never negative, are
compared by their ratio, levels and heaps by their difference.
"""

from collections.abc import Mapping, Sequence
from typing import get_args

import numpy as np
from scipy.special import stdtrit

from sealtwin.core.records import Floats
from validate.metrics.curve_distances import PiecewiseLinear
from validate.metrics.verdict import kept_volume
from validate.metrics.volumes import fill_volumes
from validate.report_input import Evidence
from validate.result import Bias, EarlierTrial, EarlierTrials, Expectation, Quantity
from validate.units import PageTable, counted, percent, signed

FEWEST = 2  # Trials: one has no scatter
FEW, ENOUGH = 4, 6  # Trials; the interval's half-width over the scatter is 16 at two, 5.0 at three, 2.8 at six
ROUNDING = 1e-9  # Scatter of equal errors, mm, mm² or a logarithm
RANGE: dict[Quantity, tuple[float, float]] = {
    "mean_level_mm": (-np.inf, np.inf),
    "fill_ratio": (0.0, 1.0),
    "heap_mm2": (0.0, np.inf),
}
"""Smallest and largest possible value of a quantity."""
NAMES: dict[Quantity, str] = {
    "mean_level_mm": "mean level",
    "fill_ratio": "share of the room below the face that is filled",
    "heap_mm2": "heap above the face, per mm of crack",
}


def biases(trials: Sequence[EarlierTrial]) -> tuple[Bias, ...]:
    """Return bias and scatter of each quantity. The result is empty with fewer than two trials.

    A ratio to an empty crack is omitted. So is a quantity with the same error in all trials, such as the heap if no
    trial has one, since it shows no scatter.
    """
    if len(trials) < FEWEST:
        return ()
    results: list[Bias] = []
    for quantity in get_args(Quantity):
        relative = quantity == "fill_ratio"
        errors = _errors(trials, quantity)
        if not np.isfinite(errors).all():
            continue
        mean, scatter = float(errors.mean()), float(errors.std(ddof=1))
        if scatter < ROUNDING:
            continue
        bias = float(np.exp(mean)) if relative else mean
        results.append(Bias(quantity=quantity, relative=relative, bias=bias, scatter=scatter, trials=len(trials)))
    return tuple(results)


def expect(trials: Sequence[EarlierTrial], computed: Mapping[Quantity, float]) -> EarlierTrials | None:
    """Return the expected readings of the next trial, or None if there is no bias and scatter of the mean level.

    With n trials of scatter s the interval's half-width is t s sqrt(1 + 1/n), with t of n - 1 degrees of freedom.
    """
    expectations = [_expectation(bias, computed[bias.quantity]) for bias in biases(trials)]
    level = any(one.quantity == "mean_level_mm" for one in expectations)
    return EarlierTrials(trials=tuple(trials), expectations=tuple(expectations)) if level else None


def foresee(trials: Sequence[EarlierTrial], evidence: Evidence) -> EarlierTrials | None:
    """Return the expected readings for a run, or None for the fast model and for a run with an unsound volume."""
    if len(trials) < FEWEST or not evidence.run.has_particles or not kept_volume(evidence.volume_ratio):
        return None
    return expect(trials, computed_quantities(evidence))


def expected_sentences(earlier: EarlierTrials) -> tuple[str, ...]:
    """Return the sentences on the expected readings, for a reader without knowledge of the method."""
    by_quantity = {one.quantity: one for one in earlier.expectations}
    count = counted(len(earlier.trials), "earlier trial")
    level = by_quantity["mean_level_mm"]
    side = "below" if level.bias > 0 else "above"
    off = f"{abs(level.bias):.1f} mm {side} the computed level on average"
    lay = off if round(abs(level.bias), 1) else "as high as the computed level on average"
    sentence = (
        f"In {count} of this lab (measured and held out), the sealant was {lay}, with a standard deviation from trial "
        f"to trial of {level.scatter:.1f} mm. The mean level expected here is {_value(level, level.expected)} (95 %: "
        f"{_value(level, level.expected_95[0])} to {_value(level, level.expected_95[1])})"
    )
    if (fill := by_quantity.get("fill_ratio")) is not None:
        ends = " to ".join(percent(end, 0) for end in fill.expected_95)
        sentence += f", with {percent(fill.expected, 0)} of the room below the face filled ({ends})"
    assumed = (
        f"The ranges follow from the Student t distribution for {len(earlier.trials)} trials, if the trials are "
        "exchangeable and their errors normal."
    )
    few = (f"With {ENOUGH} trials the ranges would be much narrower.",)
    return (f"{sentence}.", assumed, *(few if len(earlier.trials) < FEW else ()))


def earlier_table(earlier: EarlierTrials) -> PageTable:
    """Return the table of bias, scatter and expectation of each quantity, and of each trial."""
    rows = [
        (
            NAMES[one.quantity],
            f"{_off(one)}; here {_value(one, one.computed)} computed, {_value(one, one.expected)} expected (95 %: "
            f"{_value(one, one.expected_95[0])} to {_value(one, one.expected_95[1])})",
        )
        for one in earlier.expectations
    ]
    rows += [(f"sample {one.name}", _trial(one)) for one in earlier.trials]
    return PageTable("Earlier trials of this lab, measured and held out", tuple(rows))


def bias_lines(of_quantities: Sequence[Bias]) -> list[str]:
    """Return a line for each quantity, for a terminal."""
    return [f"  {NAMES[one.quantity]}: {_off(one)}" for one in of_quantities]


def computed_quantities(evidence: Evidence) -> dict[Quantity, float]:
    """Return a run's computed quantities over the length that its readings cover.

    Without readings, all of it counts.
    """
    profile = evidence.profile
    from_mm, to_mm = float(profile.s_mm[0]), float(profile.s_mm[-1])
    if evidence.comparison is not None:
        from_mm, to_mm = evidence.comparison.covered_from_mm, evidence.comparison.covered_to_mm
    s_mm = np.unique([from_mm, *profile.s_mm[(profile.s_mm > from_mm) & (profile.s_mm < to_mm)], to_mm])
    level_mm = np.interp(s_mm, profile.s_mm, profile.level_mm)
    volumes = fill_volumes(profile, evidence.outline, evidence.solid, from_mm, to_mm)
    return {
        "mean_level_mm": PiecewiseLinear(s_mm, level_mm).mean(),
        "fill_ratio": volumes["fill_ratio"],
        "heap_mm2": volumes["overfill_mm3"] / (to_mm - from_mm),
    }


def _errors(trials: Sequence[EarlierTrial], quantity: Quantity) -> Floats:
    """Return the error of each trial, (n,).

    For fills it is the logarithm of the ratio; all are NaN if a crack is empty.
    """
    if quantity == "mean_level_mm":
        return np.array([one.level_error_mm for one in trials])
    if quantity == "heap_mm2":
        return np.array([one.computed_heap_mm2 - one.read_heap_mm2 for one in trials])
    ratios = np.array([[one.computed_fill_ratio, one.read_fill_ratio] for one in trials])
    if (ratios <= 0).any():
        return np.full(len(trials), np.nan)
    return np.log(ratios[:, 0] / ratios[:, 1])


def _expectation(bias: Bias, computed: float) -> Expectation:
    half = float(stdtrit(bias.trials - 1, 0.975)) * bias.scatter * np.sqrt(1 + 1 / bias.trials)
    if bias.relative:
        expected = computed / bias.bias
        ends = np.array([expected * np.exp(-half), expected, expected * np.exp(half)])
    else:
        ends = computed - bias.bias + np.array([-half, 0.0, half])
    low, expected, high = (float(end) for end in np.clip(ends, *RANGE[bias.quantity]))
    return Expectation(**dict(bias), computed=computed, expected=expected, expected_95=(low, high))


def _off(one: Bias) -> str:
    if one.relative:
        return f"ratio of computed to read {one.bias:.3f}, scatter {percent(one.scatter)}"
    unit = _unit(one)
    return f"computed minus read {signed(one.bias, 2)} {unit}, scatter {one.scatter:.2f} {unit}"


def _value(one: Expectation, value: float) -> str:
    if one.relative:
        return percent(value)
    text = signed(value, 2) if one.quantity == "mean_level_mm" else f"{value:.2f}"
    return f"{text} {_unit(one)}"


def _unit(one: Bias) -> str:
    return "mm²" if one.quantity == "heap_mm2" else "mm"


def _trial(one: EarlierTrial) -> str:
    return (
        f"level {signed(one.level_error_mm, 2)} mm, filled {percent(one.computed_fill_ratio)} computed and "
        f"{percent(one.read_fill_ratio)} read, heap {one.computed_heap_mm2:.2f} mm² computed and "
        f"{one.read_heap_mm2:.2f} mm² read"
    )
