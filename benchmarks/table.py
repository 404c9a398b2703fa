"""How every benchmark ends: a table of figure, target and goal, a count, and an exit code."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One figure. ``low`` to ``high`` is the target; ``goal`` says in words what we would like."""

    name: str
    value: float
    unit: str
    low: float
    high: float
    goal: str = ""

    @property
    def met(self) -> bool:
        return self.low <= self.value <= self.high

    @property
    def target(self) -> str:
        if self.low == self.high:
            return f"{self.low:g}"
        return f"<= {self.high:g}" if self.low <= 0 else f"{self.low:g} to {self.high:g}"


def finish(rows: Sequence[Row], last_line: str = "") -> None:
    """Print the table and leave: with 0 where every target is met, else with 1. ``last_line`` is for programs."""
    print(f"{'figure':<52} {'seen':>10} {'unit':<6} {'target':<14} {'goal':<14}")
    for row in rows:
        missed = "" if row.met else "  MISSED"
        print(f"{row.name:<52} {row.value:>10.5g} {row.unit:<6} {row.target:<14} {row.goal:<14}{missed}")
    leave(sum(row.met for row in rows), len(rows), last_line)


def leave(met: int, targets: int, last_line: str = "") -> None:
    """Say how many targets are met, and exit: with 0 where all are, else with 1."""
    print(f"{met} of {targets} targets met")
    if last_line:
        print(last_line)
    sys.exit(0 if met == targets else 1)
