"""What a physics benchmark finds: a figure beside its reference, where that comes from, and how far off it may be."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from benchmarks.table import Row


@dataclass(frozen=True)
class Finding(Row):
    """One line of the table; its goal is the reference.

    A tolerance comes from a source or from a reason, never from what was measured.
    """

    source: str = ""


def reported(name: str, value: float, unit: str, reference: str, source: str) -> Finding:
    """A figure that judges nothing."""
    return Finding(name, value, unit, goal=reference, source=source)


def within(
    name: str,
    value: float,
    unit: str,
    reference: float,
    off: float,
    source: str,
    *,
    share: bool = True,
    because: str = "",
) -> Finding:
    """A figure that may be off its reference by a share of it, or by an amount."""
    far = abs(reference) * off if share else off
    return Finding(name, value, unit, reference - far, reference + far, f"{reference:.4g}", source, because=because)


Case = Callable[[], Iterator[Finding]]
