"""Calibrate settings of trials on their readings. The result is a posterior distribution of the settings."""

from datetime import date as day
from pathlib import Path

from pydantic import Field

from sealtwin.core.settings import Settings

LEAST_BUDGET = 40
MOST_FREE = 6  # Forty runs cannot resolve more free settings


class CalibrationOptions(Settings):
    """Settings that a calibration determines, and the number of its runs.

    They are options of 'sealtwin calibrate' and keywords of ``calibrate``.
    """

    free: dict[str, tuple[float, float]]
    """The unknown settings, up to 6, each with its range. A measured setting has its value and uncertainty in the trial
    as prior; for any other, all values in the range are equally likely."""
    hold_out: tuple[Path, ...] = ()
    """Trials to predict and compare, whose readings have the role "held-out"."""
    budget: int = Field(default=LEAST_BUDGET, ge=LEAST_BUDGET, le=400)
    """Runs of each trial; fewer would make the intervals too narrow."""
    date: day | None = None
    """Day of the calibration; default: today."""
