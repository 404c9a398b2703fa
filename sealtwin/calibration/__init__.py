"""Calibrate settings of trials on the trials' readings. The result is a posterior distribution of the settings."""

from datetime import date as day
from pathlib import Path

from pydantic import Field

from sealtwin.core.settings import Settings

MIN_BUDGET = 40
MAX_FREE = 6  # Largest number of free settings, since 40 runs cannot resolve more


class CalibrationOptions(Settings):
    """Options of a calibration: options of 'sealtwin calibrate' and keywords of ``calibrate``."""

    free: dict[str, tuple[float, float]]
    """Unknown settings (up to 6), each with its range. All values in the range are equally likely, or all logarithms of
    values if the range is wider than a factor of 5."""
    hold_out: tuple[Path, ...] = ()
    """Trials that are predicted and compared. Their readings have the role "held-out"."""
    budget: int = Field(default=MIN_BUDGET, ge=MIN_BUDGET, le=400)
    """Number of runs of each trial. With fewer than 40, the intervals would be too narrow."""
    date: day | None = None
    """Day of the calibration. Default: today."""
