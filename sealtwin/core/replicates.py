"""Replicates: runs that differ only in the seed, the band that they give, and a check that they are no copies."""

from collections.abc import Iterable, Sequence

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

Z_95 = 1.96
"""Half-width of a 95 % band in standard deviations. The variance of the band is averaged over the places along the
crack, of which a run has some 50 independent ones, so two runs determine it (decision 0182)."""


def further_run_mm2(levels_mm: Floats, mean_of: int) -> float:
    """Return the variance of a further run's level about the mean of ``mean_of`` runs, averaged over the places.

    ``levels_mm``, (runs, k), are the levels that show the scatter.
    """
    return float(levels_mm.var(axis=0, ddof=1).mean() * (1 + 1 / mean_of))


def require_different(levels_mm: Iterable[Floats], names: Sequence[str], where: str) -> None:
    """Raise InputError if two replicates have the same level, bit by bit.

    ``names`` has the name of each level's run. The message begins with ``where``.
    """
    earlier: list[Floats] = []
    for number, level_mm in enumerate(levels_mm):
        for other, earlier_mm in enumerate(earlier):
            if np.array_equal(level_mm, earlier_mm):
                raise InputError(
                    f"{where}: the runs {names[other]} and {names[number]} have the same level to the last digit. They "
                    "are copies, not replicates, and do not show the scatter of single runs. Give another "
                    "solver.radius_mm, at which the seed changes the run."
                )
        earlier.append(level_mm)
