"""Sentences on a level that was predicted and not read yet."""

from collections.abc import Sequence

import numpy as np

from validate.result import PredictedLevel
from validate.units import LABELS, PageTable, signed

INPUTS: dict[str, tuple[str, str]] = LABELS["inputs"]
"""Words and unit of each input by its name in the table [uncertainty]."""


def predicted_sentence(prediction: PredictedLevel) -> str:
    """Return the prediction in a sentence."""
    level, low, high = (signed(value_mm, 2) for value_mm in (prediction.mean_level_mm, *prediction.mean_level_95_mm))
    return (
        f"Predicted, nothing fitted to this sample: the mean level is {level} mm from the face, 95 % from {low} to "
        f"{high} mm. No readings hold it yet."
    )


def prediction_sentences(found: PredictedLevel) -> tuple[str, ...]:
    """Return what the band is made of, and what it leaves out."""
    made = [name for name, part in (("numerics", found.numerics_mm), ("inputs", found.inputs_mm)) if part is not None]
    sentences = [
        f"The level at a place is predicted to ± {np.median(found.band_95_mm):.2f} mm (95 %, the middle of all places; "
        f"± {found.band_95_mm.max():.2f} mm at worst), by {' and '.join(made)}. Readings will differ from it by their "
        "own errors too, and by what the model leaves out.",
    ]
    if found.numerics_mm is None:
        sentences.append("What the numerics do to the level is not known, and not in the band.")
    return (*sentences, *input_sentences(found.inputs_left_out, found.unfit, "the band"))


def input_sentences(left_out: Sequence[str], unfit: Sequence[str], whole: str) -> list[str]:
    """Return sentences on the inputs that are not in ``whole``, and on those that an unfit fast model moved."""
    sentences = []
    if left_out:
        names = ", ".join(INPUTS[name][0] for name in left_out)
        sentences.append(f"Not declared in [uncertainty], and so not in {whole}: {names}.")
    if unfit:
        sentences.append(
            "The trial is OUTSIDE the domain of the fast model that moved its inputs, so that u_input, their part of "
            f"{whole}, is an estimate. {' '.join(unfit)}"
        )
    return sentences


def prediction_table(found: PredictedLevel) -> PageTable:
    """Return the errors that the band is made of."""
    rows = tuple(
        (one.name, f"{one.mean_level_mm:.3f} mm of the mean level, {one.place_mm:.3f} mm at a place")
        for one in found.parts
    )
    return PageTable("Band of the prediction: u by each error alone", rows)
