"""Stage numbers of this version, and those that a result depends on."""

from typing import Literal

import digitise
import simulate
import validate

StageName = Literal["digitise", "simulate", "validate"]

NUMBERS: dict[str, int] = {
    "digitise": digitise.STAGE_NUMBER,
    "simulate": simulate.STAGE_NUMBER,
    "validate": validate.STAGE_NUMBER,
}
"""Number of each stage, in the order of the pipeline."""


def numbers_up_to(stage: StageName) -> dict[str, int]:
    """Return the number of a stage and those of the stages before it."""
    order = list(NUMBERS)
    return {name: NUMBERS[name] for name in order[: order.index(stage) + 1]}


def own_numbers() -> dict[str, int]:
    """Return all stage numbers of this version. It is a function so that it can be called on another machine."""
    return dict(NUMBERS)
