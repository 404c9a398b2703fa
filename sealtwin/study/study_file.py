"""Read study files. A study file lists the settings with which one trial is run many times."""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator, Field

from sealtwin.core.errors import InputError, present
from sealtwin.core.settings import MAX_FAULTS, Settings, read_settings
from sealtwin.trial.trial_file import (
    SETTINGS,
    TABLES,
    Name,
    Trial,
    folder_name,
    no_such_setting,
)

MAX_RUNS = 20_000  # Largest number of runs of a study. More runs are probably a mistake in a grid

Value = TypeVar("Value")


def _by_dotted_name(table: Any) -> Any:
    """Return settings by dotted name.

    TOML reads fluid.U without quotes as the key U in the table fluid. It becomes the name "fluid.U".
    """
    if not isinstance(table, dict):
        return table
    named: dict[str, Any] = {}
    for name, value in table.items():
        is_table = name in TABLES and isinstance(value, dict)
        for dotted, content in {f"{name}.{key}": value[key] for key in value}.items() if is_table else [(name, value)]:
            if dotted in named:
                raise ValueError(f"{dotted} is given twice")
            # After a validator, pydantic treats the value as a Python object, and refuses a list in place of a tuple.
            named[dotted] = tuple(content) if isinstance(content, list) else content
    return named


Named = Annotated[dict[str, Value], BeforeValidator(_by_dotted_name)]


class Rows(Settings):
    """A list of runs, with one row for each."""

    columns: Annotated[tuple[str, ...], Field(min_length=1)]
    """Dotted names of the settings that vary."""
    rows: Annotated[tuple[tuple[Any, ...], ...], Field(min_length=1, max_length=MAX_RUNS)]
    """One row for each run, with a value for each column."""

    def _check(self) -> None:
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.columns):
                raise ValueError(f"row {number} has {len(row)} values, but columns has {len(self.columns)} settings")


class Study(Settings):
    """A study file: a trial, and the settings that vary."""

    name: Name
    """Name of the study, and of its folder under reports/."""
    trial: Path
    """Trial file, relative to the study file's folder or absolute."""
    fixed: Named[Any] = Field(default={})
    """Settings that replace settings of the trial in all runs, by dotted name, for example a coarser radius."""
    grid: Annotated[Named[tuple[Any, ...]], Field(min_length=1)] | None = None
    """Values of each setting. All combinations are run, and the setting that is given first varies slowest."""
    list: Rows | None = None

    def _check(self) -> None:
        if (self.grid is None) == (self.list is None):
            raise ValueError("give either [grid] or [list] for the settings that vary")
        varied, runs, _ = self._design()
        if unknown := [name for name in (*self.fixed, *varied) if name not in SETTINGS]:
            raise ValueError("; ".join(no_such_setting(name) for name in unknown))
        if twice := sorted({name for name in varied if name in self.fixed or varied.count(name) > 1}):
            raise ValueError(f"{', '.join(twice)}: given twice; give each setting once")
        if empty := [name for name, values in (self.grid or {}).items() if not values]:
            raise ValueError(f"grid.{empty[0]}: the list of values is empty; give at least one value")
        if runs > MAX_RUNS:
            raise ValueError(f"there are {runs} runs, but at most {MAX_RUNS} are allowed")

    def _design(self) -> tuple[tuple[str, ...], int, Iterable[tuple[Any, ...]]]:
        """Return the names of the varied settings, the number of runs, and the values for each run."""
        if self.grid is not None:
            values = self.grid.values()
            return tuple(self.grid), math.prod(map(len, values)), itertools.product(*values)
        rows = present(self.list, "list")
        return rows.columns, len(rows.rows), rows.rows

    @property
    def names(self) -> set[str]:
        """Dotted names of all settings in the study file."""
        return {*self.fixed, *self._design()[0]}

    @property
    def folder_name(self) -> str:
        return folder_name(self.name)

    def combinations(self) -> Iterator[dict[str, Any]]:
        """Yield the varied settings of each run, by dotted name."""
        names, _, rows = self._design()
        return (dict(zip(names, row, strict=True)) for row in rows)


@dataclass(frozen=True)
class PlannedRun:
    """One run of a study."""

    number: int  # Position in the study, from 1
    settings: dict[str, Any]  # Varied settings, by dotted name
    trial: Trial
    accurate: bool = False  # True for an accurate run in a study of drafts


def load_study(path: Path) -> Study:
    """Read a study file. Raises InputError if it is missing, is not TOML, or has a key or value that is not allowed."""
    starter = "'sealtwin sweep --example study.toml' writes an example"
    return read_settings(Study, path, name="study file", starter=starter)


def plan_runs(study: Study, path: Path, base: Trial) -> list[PlannedRun]:
    """Return a checked trial for each run of a study. ``base`` is the study's trial.

    Raises InputError if settings cannot be used, or if two runs are the same. The message begins with ``path``, and
    lists each fault once, with the numbers of its runs.
    """
    planned: list[PlannedRun] = []
    faults: dict[str, list[int]] = {}
    for number, settings in enumerate(study.combinations(), start=1):
        try:
            trial = base.changed({**study.fixed, **settings}, path)
        except InputError as fault:
            for sentence in fault.sentences:
                faults.setdefault(sentence, []).append(number)
        else:
            planned.append(PlannedRun(number, settings, trial))
    raise_faults(faults)
    first: dict[str, int] = {}
    for run in planned:
        same = first.setdefault(run.trial.model_dump_json(), run.number)
        if same != run.number:
            raise InputError(f"{path}: runs {same} and {run.number} have the same settings; all runs must differ.")
    return planned


def raise_faults(faults: Mapping[str, list[int]]) -> None:
    """Raise InputError if there are faults. The message lists each fault once, with the numbers of its runs."""
    if not faults:
        return
    shown = [f"{_runs(numbers)}: {sentence}" for sentence, numbers in list(faults.items())[:MAX_FAULTS]]
    more = len(faults) - len(shown)
    raise InputError("\n".join([*shown, f"There are {more} more faults."] if more else shown))


def _runs(numbers: list[int]) -> str:
    shown = ", ".join(str(number) for number in numbers[:3])
    more = f" and {len(numbers) - 3} more" if len(numbers) > 3 else ""
    return f"run{'s' if len(numbers) > 1 else ''} {shown}{more}"
