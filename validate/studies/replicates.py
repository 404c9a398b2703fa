"""Several trials side by side: what was never tuned on, and how two distributions of a figure differ."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sealtwin.errors import InputError
from validate.settings import Role

FEWEST = 2
"""Trials on each side: of one alone there is no distribution."""


@dataclass(frozen=True)
class Compared:
    """One trial's comparison, as its comparison.json has it."""

    name: str
    metrics: dict[str, Any]

    @property
    def role(self) -> Role:
        return self.metrics["role"]

    @property
    def held_out(self) -> bool:
        """On readings that nobody tuned on."""
        return self.role == "held-out"


@dataclass(frozen=True)
class HeldOutRow:
    """A trial in the table; lengths in mm."""

    name: str
    role: Role
    data: str
    mean_error_mm: float
    low_mm: float | None
    """Of the 95 % interval by the readings' doubt; None where it was not assessed."""
    high_mm: float | None
    bias_mm: float
    worst_error_mm: float
    beats_flat_level: bool
    beats_volume_balance: bool | None


def held_out_table(trials: Sequence[Compared]) -> list[HeldOutRow]:
    """Held-out trials first, then those that were calibrated on; each in the order given."""
    return [_row(trial) for trial in sorted(trials, key=lambda trial: not trial.held_out)]


def held_out_mean_mm(trials: Sequence[Compared]) -> float | None:
    """Mean error over the held-out trials, each counted once; None where there is none: a residual is no test."""
    errors_mm = [trial.metrics["mean_error_mm"] for trial in trials if trial.held_out]
    return float(np.mean(errors_mm)) if errors_mm else None


def area_validation_metric(simulated: ArrayLike, measured: ArrayLike) -> float:
    """Area between two empirical distributions of one figure, in its unit (Ferson, Oberkampf & Ginzburg 2008).

    ``simulated`` and ``measured`` hold that figure, say the mean level or the volume held, once for each replicate of
    one trial: the same crack, path and paste again. It is no metric for the stations of one trial, whose levels differ
    because the bed slopes, and not by chance; nor for different trials. It is in one dimension the distance of
    Wasserstein.

    Raises InputError where one side has fewer than two, or holds NaN.
    """
    from scipy.stats import wasserstein_distance

    sides = [np.atleast_1d(np.asarray(side, dtype=float)) for side in (simulated, measured)]
    for name, side in zip(("simulated", "measured"), sides, strict=True):
        if side.ndim != 1 or len(side) < FEWEST or not np.isfinite(side).all():
            raise InputError(
                f"The area validation metric compares distributions: {len(side)} {name} replicates with a number, "
                f"where {FEWEST} or more are needed. Give runs of the same trial, done again."
            )
    return float(wasserstein_distance(*sides))


def _row(trial: Compared) -> HeldOutRow:
    metrics = trial.metrics
    low_mm, high_mm = metrics.get("uncertainty", {}).get("mean_error_mm", (None, None))
    return HeldOutRow(
        name=trial.name,
        role=trial.role,
        data=metrics["readings_data"],
        mean_error_mm=metrics["mean_error_mm"],
        low_mm=low_mm,
        high_mm=high_mm,
        bias_mm=metrics["bias_mm"],
        worst_error_mm=metrics["worst_error_mm"],
        beats_flat_level=metrics["beats_flat_level"],
        beats_volume_balance=metrics.get("beats_volume_balance"),
    )
