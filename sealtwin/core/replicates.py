"""Check of replicates: copies of a run do not scatter, and would make every interval too narrow."""

from collections.abc import Iterable, Sequence

import numpy as np

from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats


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
