"""Runs that count as replicates: a copy of a run shows no scatter, and would make every interval too narrow."""

from collections.abc import Iterable, Sequence

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats


def require_different(levels_mm: Iterable[Floats], names: Sequence[str], where: str) -> None:
    """Refuse replicates of which two have the same level, bit by bit.

    ``names`` say which run each level is of, and ``where`` begins the message. Raises InputError.
    """
    earlier: list[Floats] = []
    for number, level_mm in enumerate(levels_mm):
        for other, earlier_mm in enumerate(earlier):
            if np.array_equal(level_mm, earlier_mm):
                raise InputError(
                    f"{where}: the runs {names[other]} and {names[number]} have the same level to the last digit, so "
                    "that they are copies and no replicates, and how far single runs scatter is not known. Give "
                    "another solver.radius_mm, of which the seed changes the run."
                )
        earlier.append(level_mm)
