"""A small designed set of runs: every input at its lower or upper value in each, every run used for every effect."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sealtwin.records import Floats, Integers


def two_level_design(inputs: int) -> Integers:
    """-1 or 1 for each run and input, (runs, inputs): columns of a Hadamard matrix, balanced and orthogonal.

    2, 4, 8 or 16 runs for up to 1, 3, 7 or 15 inputs (Plackett & Burman 1946). An effect is a difference of two
    halves of all runs, so that the scatter of single runs counts least; what two inputs do only together is not told
    apart from what a third one does.
    """
    return _matrix(inputs)[:, 1 : inputs + 1]


def effects_of(results: Floats, inputs: int) -> tuple[Floats, float | None]:
    """What each input does, going from its middle to its upper value, and how far runs scatter in such an effect.

    Args:
        results: Of the runs in the order of ``two_level_design``, (runs, k).
        inputs: How many vary.

    Returns:
        Effects, (inputs, k); and their standard deviation by chance, root mean square over k, from the columns that no
        input has. None where every column has one.
    """
    contrasts = _matrix(inputs).T @ results / len(results)
    spare = contrasts[inputs + 1 :]
    return contrasts[1 : inputs + 1], float(np.sqrt(np.mean(spare**2))) if len(spare) else None


@dataclass(frozen=True)
class Effect:
    """What one declared standard uncertainty of an input does to the simulated level."""

    name: str
    """Of the setting in [uncertainty]."""
    standard: float
    """As declared, in the unit that the name ends with."""
    level_mm: Floats
    """Change of the level for an input larger by that, at the places where levels are compared."""


def together(effects: Sequence[Effect]) -> Floats:
    """Standard uncertainty of the level by all inputs, independent of each other, (k,)."""
    return np.sqrt(np.sum([effect.level_mm**2 for effect in effects], axis=0))


def _matrix(inputs: int) -> Integers:
    from scipy.linalg import hadamard

    runs = 2
    while runs <= inputs:
        runs *= 2
    return np.asarray(hadamard(runs), dtype=np.int64)
