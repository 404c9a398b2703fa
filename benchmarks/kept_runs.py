"""Results of particle runs that are kept in the repository, and the stage numbers that they were computed by.

A table of runs has a row for each run, which is added as soon as the run ends: a benchmark that was stopped goes on.

``NAME.json`` beside a file or folder of kept results has the numbers. A benchmark reads no results of other numbers
than this version's: it leaves with a sentence that names the command which computes them anew.
"""

import csv
import json
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import digitise
import simulate
import validate
from sealtwin.core.files import write_json
from sealtwin.core.run_folder import other_numbers
from tests.support.paths import ROOT

PARTS: dict[str, int] = {
    "tracing": digitise.TRACING_NUMBER,
    "solids": digitise.SOLIDS_NUMBER,
    "simulate": simulate.STAGE_NUMBER,
    "validate": validate.STAGE_NUMBER,
}
"""Number of each stage, ``digitise`` in two parts, since some results depend on one of them alone."""


@dataclass(frozen=True)
class KeptRuns:
    """Kept results: a file or a folder of this folder."""

    path: Path
    command: str
    """Command that computes them anew."""
    stages: tuple[str, ...] = ("tracing", "solids", "simulate")
    """Stages, or parts of them, that compute them."""

    @property
    def other_numbers(self) -> str:
        """Words on how the numbers of what is kept differ from this version's; empty if they do not, or none is."""
        if not self.path.exists():
            return ""
        recorded = json.loads(self._beside.read_text(encoding="utf-8")) if self._beside.is_file() else {}
        return other_numbers(recorded, self._own)

    def require(self) -> None:
        """Leave with exit code 1 if other stage numbers computed what is kept."""
        if other := self.other_numbers:
            raise SystemExit(f"{self._name}: computed by {other}: '{self.command}' computes them again.")

    def begin(self) -> None:
        """Begin to add results: state this version's numbers, and remove results of other numbers, which git has."""
        if other := self.other_numbers:
            print(f"{self._name}: computed by {other}: removed, and computed anew.", flush=True)
            shutil.rmtree(self.path) if self.path.is_dir() else self.path.unlink()
        write_json(self._beside, self._own)

    @property
    def _own(self) -> dict[str, int]:
        return {stage: PARTS[stage] for stage in self.stages}

    @property
    def _beside(self) -> Path:
        return self.path.with_suffix(".json")

    @property
    def _name(self) -> str:
        return self.path.relative_to(ROOT).as_posix() if self.path.is_relative_to(ROOT) else str(self.path)


def rows_in(table: Path) -> list[list[str]]:
    """Return the rows of a table of runs, without its header; none if there is no table yet."""
    return [*csv.reader(table.read_text(encoding="utf-8").splitlines())][1:] if table.is_file() else []


def add_rows(table: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Add rows to a table of runs, which gets the header first if it is new."""
    with table.open("a", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([*([] if file.tell() else [header]), *rows])
