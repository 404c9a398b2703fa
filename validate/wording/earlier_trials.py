"""Sentences and a table on what a lab's earlier trials say of a computed level."""

from collections.abc import Sequence

from validate.result import Bias, EarlierTrial, EarlierTrials, Expectation, Quantity
from validate.units import PageTable, counted, percent, signed

FEW, ENOUGH = 4, 6  # Trials; the interval's half-width over the scatter is 16 at two, 5.0 at three, 2.8 at six
NAMES: dict[Quantity, str] = {
    "mean_level_mm": "mean level",
    "fill_ratio": "share of the room below the face that is filled",
    "heap_mm2": "heap above the face, on each mm of crack",
}


def expected_sentences(found: EarlierTrials) -> tuple[str, ...]:
    """Return what readings are expected to find, for a reader who knows no method."""
    told = {one.quantity: one for one in found.expectations}
    count = counted(len(found.trials), "earlier trial")
    level = told["mean_level_mm"]
    side = "below" if level.bias > 0 else "above"
    off = f"{abs(level.bias):.1f} mm {side} the computed level on average"
    lay = off if round(abs(level.bias), 1) else "as high as the computed level on average"
    sentence = (
        f"In {count} of this lab, measured and held out, the sealant lay {lay}, and this differed from trial to trial "
        f"by {level.scatter:.1f} mm: here a mean level of {_value(level, level.expected)} is to be expected, 95 % from "
        f"{_value(level, level.expected_95[0])} to {_value(level, level.expected_95[1])}"
    )
    if (fill := told.get("fill_ratio")) is not None:
        ends = " to ".join(percent(end, 0) for end in fill.expected_95)
        sentence += f", and {percent(fill.expected, 0)} of the room below the face filled ({ends})"
    assumed = (
        f"The ranges, by Student t of {len(found.trials)} trials, assume that these and this one are exchangeable and "
        "their errors normal."
    )
    few = (f"So few trials make these ranges wide; {ENOUGH} would make them much narrower.",)
    return (f"{sentence}.", assumed, *(few if len(found.trials) < FEW else ()))


def earlier_table(found: EarlierTrials) -> PageTable:
    """Return bias, scatter and what is expected of each quantity, and each trial."""
    rows = [
        (
            NAMES[one.quantity],
            f"{_off(one)}; here {_value(one, one.computed)} computed, {_value(one, one.expected)} expected, 95 % from "
            f"{_value(one, one.expected_95[0])} to {_value(one, one.expected_95[1])}",
        )
        for one in found.expectations
    ]
    rows += [(f"sample {one.name}", _trial(one)) for one in found.trials]
    return PageTable("Earlier trials of this lab, measured and held out", tuple(rows))


def bias_lines(found: Sequence[Bias]) -> list[str]:
    """Return a line for each quantity, for a terminal."""
    return [f"  {NAMES[one.quantity]}: {_off(one)}" for one in found]


def _off(one: Bias) -> str:
    if one.relative:
        return f"computed over read {one.bias:.3f}, scatter {percent(one.scatter)}"
    unit = _unit(one)
    return f"computed less read {signed(one.bias, 2)} {unit}, scatter {one.scatter:.2f} {unit}"


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
