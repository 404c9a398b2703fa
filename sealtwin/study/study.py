"""A study: one trial run many times, each time with other settings."""

import itertools
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import BeforeValidator, Field, model_validator

from digitise.settings import CrackShape, NozzlePath
from sealtwin.errors import InputError
from sealtwin.settings import Settings
from sealtwin.store.settings_file import MOST_FAULTS, checked, read_settings
from sealtwin.trials.trial import PRINTABLE, Trial, folder_name
from simulate.settings import Fluid, Nozzle, Solver

TABLES: dict[str, type[Settings]] = {
    "fluid": Fluid,
    "solver": Solver,
    "nozzle": Nozzle,
    "path": NozzlePath,
    "crack": CrackShape,
}
"""Of a trial file; their settings may vary."""
SETTINGS = ("seed", *(f"{table}.{key}" for table, kind in TABLES.items() for key in kind.model_fields))
"""By dotted name, as a study gives them."""
IN_PLACE_OF = {"fluid.U": "fluid.viscosity_pa_s", "fluid.viscosity_pa_s": "fluid.U"}
"""A trial has one of the two, a study over the other one puts it aside."""
MOST_RUNS = 20_000
"""At a second each they take a night on one core; more is a value too many in a grid."""

Value = TypeVar("Value")


def _by_dotted_name(given: Any) -> Any:
    """TOML reads fluid.U without quotes as a table in a table; both mean the same."""
    if not isinstance(given, dict):
        return given
    named: dict[str, Any] = {}
    for name, value in given.items():
        inner = value if name in TABLES and isinstance(value, dict) else None
        for dotted, content in [(name, value)] if inner is None else [(f"{name}.{key}", inner[key]) for key in inner]:
            if dotted in named:
                raise ValueError(f"{dotted} is given twice")
            # Behind a validator of our own pydantic no longer knows that this was JSON, where a tuple is a list.
            named[dotted] = tuple(content) if isinstance(content, list) else content
    return named


Named = Annotated[dict[str, Value], BeforeValidator(_by_dotted_name)]


class Rows(Settings):
    """Runs one by one."""

    columns: Annotated[tuple[str, ...], Field(min_length=1)]
    rows: Annotated[tuple[tuple[Any, ...], ...], Field(min_length=1, max_length=MOST_RUNS)]
    """A value for each column."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.columns):
                raise ValueError(f"row {number} has {len(row)} values, columns names {len(self.columns)} settings")
        return self


class Range(Settings):
    """Where a Latin hypercube draws a setting."""

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"
    whole: bool = False
    """Round to whole numbers, for settings that are counts."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"low is {self.low:g} and high {self.high:g}: low must be below high")
        if self.scale == "log" and self.low <= 0:
            raise ValueError(f'low is {self.low:g}: above 0, or scale = "linear"')
        return self

    def at(self, share: float) -> float | int:
        """The value that far up the range."""
        if self.scale == "log":
            value = self.low * (self.high / self.low) ** share
        else:
            value = self.low + (self.high - self.low) * share
        # Six digits are finer than any setting is known, and can be read.
        return round(value) if self.whole else float(f"{value:.6g}")


class Latin(Settings):
    """A Latin hypercube: each setting's range in ``count`` slices, each slice drawn once."""

    count: Annotated[int, Field(ge=2, le=MOST_RUNS)]
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    ranges: Annotated[Named[Range], Field(min_length=1)]


class Study(Settings):
    """A study file: the trial it starts from, and what varies."""

    name: Annotated[str, Field(min_length=1, max_length=80, pattern=PRINTABLE)]
    """Also of its folder under reports/."""
    trial: Path
    """A trial file, looked for beside the study file."""
    fixed: Named[Any] = Field(default={})
    """What all runs have in place of the trial's own, by dotted name, for example a coarser radius."""
    grid: Annotated[Named[tuple[Any, ...]], Field(min_length=1)] | None = None
    """Each value of each setting with each of all others; the first one named varies slowest."""
    list: Rows | None = None
    latin: Latin | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        given = [name for name in ("grid", "list", "latin") if getattr(self, name) is not None]
        if len(given) != 1:
            found = "none is" if not given else f"{' and '.join(given)} are"
            raise ValueError(f"give one of [grid], [list] and [latin] to say what varies; {found} given")
        varied = self.varied
        if unknown := [name for name in (*self.fixed, *varied) if name not in SETTINGS]:
            raise ValueError("; ".join(_no_such(name) for name in unknown))
        if twice := sorted({name for name in varied if name in self.fixed or varied.count(name) > 1}):
            raise ValueError(f"{', '.join(twice)}: named twice")
        if empty := [name for name, values in (self.grid or {}).items() if not values]:
            raise ValueError(f"grid.{empty[0]}: no values given")
        if self.runs > MOST_RUNS:
            raise ValueError(f"{self.runs} runs; at most {MOST_RUNS} are allowed")
        return self

    @property
    def varied(self) -> tuple[str, ...]:
        """Dotted names, in the order given."""
        if self.grid is not None:
            return tuple(self.grid)
        return tuple(self.latin.ranges) if self.latin is not None else self.list.columns if self.list else ()

    @property
    def runs(self) -> int:
        if self.grid is not None:
            count = 1
            for values in self.grid.values():
                count *= len(values)
            return count
        return self.latin.count if self.latin is not None else len(self.list.rows) if self.list else 0

    @property
    def folder_name(self) -> str:
        return folder_name(self.name)

    def combinations(self) -> Iterator[dict[str, Any]]:
        """The varied settings of each run, by dotted name."""
        if self.grid is not None:
            rows: Any = itertools.product(*self.grid.values())
        elif self.latin is not None:
            rows = _latin_rows(self.latin)
        else:
            rows = self.list.rows if self.list is not None else ()
        for row in rows:
            yield dict(zip(self.varied, row, strict=True))


@dataclass(frozen=True)
class Planned:
    """One run of a study."""

    number: int
    """From 1, in the order of the study."""
    settings: dict[str, Any]
    """What varies, by dotted name."""
    trial: Trial


def load_study(path: Path) -> Study:
    """Raises InputError where it is missing, no TOML, or holds a key or a value that cannot be."""
    starter = "'sealtwin sweep --example study.toml' writes one to start from"
    return read_settings(Study, path, name="study file", starter=starter)


def plan_runs(study: Study, path: Path, base: Trial) -> list[Planned]:
    """A checked trial for each run.

    Args:
        study: What varies.
        path: Of the study file, for the sentences.
        base: The trial it starts from.

    Raises:
        InputError: settings that cannot be, each told once with the runs that have them; or two runs are the same.
    """
    content = json.loads(base.model_dump_json(exclude_none=True))
    planned: list[Planned] = []
    faults: dict[str, list[int]] = {}
    for number, settings in enumerate(study.combinations(), start=1):
        try:
            trial = checked(Trial, path, _with(content, {**study.fixed, **settings}))
        except InputError as fault:
            for sentence in str(fault).splitlines():
                faults.setdefault(sentence, []).append(number)
        else:
            planned.append(Planned(number, settings, trial))
    raise_faults(faults)
    _refuse_twins(planned, path)
    return planned


def raise_faults(faults: Mapping[str, list[int]]) -> None:
    """Raises InputError with each sentence once, and the numbers of the runs that it is about."""
    if not faults:
        return
    told = [f"{_runs(numbers)}: {sentence}" for sentence, numbers in list(faults.items())[:MOST_FAULTS]]
    more = len(faults) - len(told)
    raise InputError("\n".join([*told, f"and {more} more faults."] if more else told))


def _with(content: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    changed = {name: dict(value) if isinstance(value, dict) else value for name, value in content.items()}
    for name, value in settings.items():
        table, _, key = name.rpartition(".")
        home = changed.setdefault(table, {}) if table else changed
        home[key] = value
        if name in IN_PLACE_OF and IN_PLACE_OF[name] not in settings:
            home.pop(IN_PLACE_OF[name].rpartition(".")[2], None)
    return changed


def _refuse_twins(planned: list[Planned], path: Path) -> None:
    seen: dict[str, int] = {}
    for run in planned:
        first = seen.setdefault(run.trial.model_dump_json(), run.number)
        if first != run.number:
            raise InputError(f"{path}: runs {first} and {run.number} have the same settings; each must differ.")


def _runs(numbers: list[int]) -> str:
    if len(numbers) == 1:
        return f"run {numbers[0]}"
    shown = ", ".join(str(number) for number in numbers[:3])
    return f"runs {shown}" if len(numbers) <= 3 else f"runs {shown} and {len(numbers) - 3} more"


def _no_such(name: str) -> str:
    import difflib

    close = difflib.get_close_matches(name, SETTINGS, n=1, cutoff=0.8)
    if close:
        return f"{name}: no such setting; the nearest is '{close[0]}'"
    return f'{name}: no such setting; a study may vary seed and what is in [{"], [".join(TABLES)}], as "fluid.U"'


def _latin_rows(latin: Latin) -> Iterator[tuple[float | int, ...]]:
    from scipy.stats import qmc

    shares = qmc.LatinHypercube(len(latin.ranges), rng=latin.seed).random(latin.count)
    for row in shares:
        yield tuple(spread.at(float(share)) for spread, share in zip(latin.ranges.values(), row, strict=True))
