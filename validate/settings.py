"""What a result is held against: the tables [readings] and [gate] of a trial file."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from sealtwin.records import DataKind
from sealtwin.settings import Settings

Role = Literal["calibrated-on", "held-out"]
"""Whether the fluid was tuned on these very readings. A match with those it was tuned on is a residual, no test."""


class Readings(Settings):
    """A sheet of caliper readings."""

    file: Path
    """Beside the trial file, or absolute. Columns s_mm and level_1_mm, level_2_mm, ... (upward from the face) or
    depth_1_mm, ... (downward from it): the sign stands in the name and is never guessed.
    """
    data: DataKind
    """Where the readings come from; only "measured" ones can validate."""
    role: Role


class Gate(Settings):
    """Limits declared before the run, each of which the result must keep."""

    mean_error_mm: float = Field(gt=0)
    """Area between the simulated and the measured level over the covered length; 1.26 in the paper's best run."""
