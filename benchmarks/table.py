"""How every benchmark runs, by ``python -m benchmarks.NAME``: options, a table of figures with targets, an exit code.

``main`` of a benchmark returns its rows. Its parameters are the options, and its module's docstring is the help. Runs
that take long are kept by ``kept_runs``; ``results`` runs all benchmarks, and resumes; ``machine`` times programs.
"""

import inspect
import json
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import KW_ONLY, asdict, dataclass
from functools import wraps
from math import inf, isfinite
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import typer
from numpy.typing import ArrayLike

ROWS_TO = "SEALTWIN_ROWS_TO"
"""Name of the environment variable with the file to which a benchmark writes its rows as JSON, where it is set."""


@dataclass(frozen=True)
class Row:
    """One figure. ``low`` to ``high`` is the target; ``goal`` says in words what we would like.

    A row that could not fail is no target: without an upper bound, and a lower one above 0, the figure is reported.
    """

    name: str
    value: float
    unit: str
    low: float = 0.0
    high: float = inf
    goal: str = ""
    _: KW_ONLY
    because: str = ""
    """Why it is missed, where that is known: the evidence against which it cannot be met."""

    @property
    def judged(self) -> bool:
        return self.low > 0 or self.high < inf

    @property
    def met(self) -> bool:
        return self.low <= self.value <= self.high

    @property
    def missed(self) -> bool:
        return self.judged and not self.met

    @property
    def target(self) -> str:
        if not self.judged:
            return "reported"
        if self.low == self.high:
            return f"{self.low:.4g}"
        if self.high == inf:
            return f">= {self.low:.4g}"
        return f"<= {self.high:.4g}" if self.low == 0 else f"{self.low:.4g} to {self.high:.4g}"


def run_benchmark(benchmark: Callable[..., Sequence[Row] | None]) -> None:
    """Run a benchmark by its command line, and leave as ``finish`` does; one that returns None has judged nothing."""

    @wraps(benchmark)
    def command(**options: Any) -> None:
        if (rows := benchmark(**options)) is not None:
            finish(rows)

    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    paragraphs = (inspect.getmodule(benchmark).__doc__ or "").split("\n\n")
    app.command(help="\n\n".join(f"\b\n{paragraph}" for paragraph in paragraphs))(command)
    app()


def one_of(names: Iterable[str]) -> Any:
    """Return an option that takes one of ``names``; of a list of names, it may be given again."""
    allowed = list(names)

    def chosen(name: str) -> str:
        if name not in allowed:
            raise typer.BadParameter(f"{name}: there is {', '.join(allowed)}")
        return name

    return typer.Option(parser=chosen, metavar="NAME", help=f"{'; '.join(allowed)}")


def finish(rows: Sequence[Row]) -> None:
    """Print the table and leave: with 0 if every target is met, else with 1."""
    print(f"{'figure':<52} {'seen':>10} {'unit':<6} {'target':<14} {'goal':<14}")
    for row in rows:
        missed = "  MISSED" if row.missed else ""
        print(f"{row.name:<52} {row.value:>10.5g} {row.unit:<6} {row.target:<14} {row.goal:<14}{missed}")
        if row.missed and row.because:
            print(f"    since {row.because}")
    if target := os.environ.get(ROWS_TO):
        shown = {"judged", "missed", "target"}
        content = [asdict(row) | {name: getattr(row, name) for name in shown} for row in rows]
        # JSON has no infinity, and none of NaN.
        records = [
            {key: value for key, value in row.items() if isinstance(value, str) or isfinite(value)} for row in content
        ]
        Path(target).write_text(json.dumps(records), encoding="utf-8")
    targets, missed = sum(row.judged for row in rows), sum(row.missed for row in rows)
    print(f"{targets - missed} of {targets} targets met")
    sys.exit(1 if missed else 0)


def processes(count: int) -> ProcessPoolExecutor:
    """Return a pool of so many processes, which inherit nothing: Warp does not work in a copy of a process."""
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))


def rms(values: ArrayLike) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
