"""Sentences and a table on a level that was predicted before it was read."""

from collections.abc import Sequence

import numpy as np

from sealtwin.core.facts import Fact, texts
from sealtwin.core.run_figures import FAST
from validate.result import PredictedLevel
from validate.units import LABELS, PageTable, signed

INPUTS: dict[str, tuple[str, str]] = LABELS["inputs"]
"""Words and unit of each input by its name in the table [uncertainty]."""


def predicted_sentence(prediction: PredictedLevel) -> str:
    """Return the prediction in a sentence."""
    level, low, high = (signed(value_mm, 2) for value_mm in (prediction.mean_level_mm, *prediction.mean_level_95_mm))
    return (
        f"Predicted, with no setting fitted to this sample: the mean level is {level} mm from the face (95 %: {low} to "
        f"{high} mm).{other_levels(prediction)} There are no readings yet to check it."
    )


def other_levels(prediction: PredictedLevel) -> str:
    """Return a sentence, after a space, on the mean levels of the fast model and of the volume lying flat."""
    levels = {"the fast model": prediction.fast_level_mm, "the dispensed volume lying flat": prediction.flat_level_mm}
    texts = [
        f"{signed(float(np.trapezoid(level_mm)) / (len(level_mm) - 1), 2)} mm by {name}"
        for name, level_mm in levels.items()
        if level_mm is not None
    ]
    return f" It is {' and '.join(texts)}." if texts else ""


def prediction_sentences(prediction: PredictedLevel) -> tuple[str, ...]:
    """Return sentences on the parts of the band, and on what it does not include."""
    *first, last = dict.fromkeys(f"the {one.name}" if one.kind == "model" else one.kind for one in prediction.parts)
    causes = f"{', '.join(first)} and {last}" if first else last
    sentences = [
        f"The level at a place is predicted to ± {np.median(prediction.band_95_mm):.2f} mm (95 %, median of all "
        f"places; at most ± {prediction.band_95_mm.max():.2f} mm), including the errors of {causes}. "
        "Readings will also differ from it by their own errors and by what the model leaves out.",
    ]
    if prediction.numerics_mm is None:
        sentences.append("The effect of the numerics on the level is unknown, and not in the band.")
    by_fast, unfit = any(one.model == FAST for one in prediction.inputs), prediction.unfit
    if prediction.fast_level_mm is None:
        why = (
            f", since the fast model is unfit for this case: {' '.join(texts(unfit))}" if unfit and not by_fast else "."
        )
        sentences.append(f"The band does not include a difference of particles and fast model{why}")
    missing, left_out = [one.name for one in prediction.missing], prediction.inputs_left_out
    return (*sentences, *input_sentences(left_out, unfit if by_fast else (), "the band", missing))


def input_sentences(
    left_out: Sequence[str], unfit: Sequence[Fact], whole: str, missing: Sequence[str] = ()
) -> list[str]:
    """Return sentences on the inputs and ``missing`` errors not in ``whole``, and on inputs of an unfit fast model."""
    sentences = []
    if left_out or missing:
        names = ", ".join([*(INPUTS[name][0] for name in left_out), *missing])
        sentences.append(f"Not included in {whole}, since [uncertainty] does not declare them: {names}.")
    if unfit:
        sentences.append(
            "The trial is OUTSIDE the domain of the fast model that varied its inputs, so u_input, their part of "
            f"{whole}, is only an estimate. {' '.join(texts(unfit))}"
        )
    return sentences


def prediction_table(prediction: PredictedLevel) -> PageTable:
    """Return a table of the errors in the band."""
    rows = tuple(
        (f"{one.kind}: {one.name}", f"{one.mean_level_mm:.3f} mm of the mean level, {one.place_mm:.3f} mm at a place")
        for one in prediction.parts
    )
    return PageTable("Band of the prediction: u by each error alone", rows)
