"""Public reports, the acceptable answers to their files, and the run of a command on such a file.

An acceptable answer is a correct figure, or a refusal or warning that names file and cause; it was decided before the
file was first read. A wrong or assumed figure without a warning is not acceptable, and neither is a traceback.
"""

import io
import json
import re
import warnings
from collections.abc import Callable, Sequence
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

import sealtwin as st
from sealtwin.core.errors import InputError
from tests.support import ingested_lab as labs

NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
LONG_SLOT_MM3 = 60.0 * 4.0 * 10.0


@dataclass(frozen=True)
class Ended:
    """An answer: its exit code, its words in small letters, what it printed on stdout, its folder for files."""

    code: int
    words: str
    stdout: str
    out: Path

    def says(self, words: Sequence[str]) -> bool:
        """Return whether each of the words is there; those between bars are alternatives."""
        return all(any(one in self.words for one in word.split("|")) for word in words)


Command = str | Callable[[], object]
"""Words after ``sealtwin``, with {out} for an empty folder to write to; or a call of the Python functions."""
Maker = Callable[[Path], object]
"""Makes the files of a report in a folder."""
Check = Callable[[Ended], bool]
Figures = Callable[[Ended], Sequence[float]]


@dataclass(frozen=True)
class Report:
    address: str
    """Path of the report on github.com."""
    command: Command
    sound: tuple[Check, ...]
    """Checks of the answer, of which one must pass."""
    make: Maker


REPORTS: list[Report] = []


def report(address: str, command: Command, *sound: Check) -> Callable[[Maker], Maker]:
    """Add a report on the file that the function below makes; its first line says what went wrong there."""

    def add(make: Maker) -> Maker:
        REPORTS.append(Report(address, command, sound, make))
        return make

    return add


def answer_to(one: Report, folder: Path) -> Ended:
    given, out = folder / "given", folder / "out"
    given.mkdir()
    out.mkdir()
    one.make(given)
    with chdir(given), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        code, stdout, stderr = _run(one.command, out)
    words = " ".join([stdout, stderr, *(str(warning.message) for warning in caught)])
    return Ended(code, " ".join(words.lower().split()), stdout, out)


def _run(command: Command, out: Path) -> tuple[int, str, str]:
    if isinstance(command, str):
        ended = labs.sealtwin(*(word.format(out=out) for word in command.split()))
        if ended.exception and not isinstance(ended.exception, SystemExit):
            raise ended.exception
        return ended.exit_code, ended.stdout, ended.stderr
    with redirect_stdout(io.StringIO()) as printed:
        try:
            printed.write(str(command()))
        except InputError as fault:
            return 3, "", str(fault)
    return 0, printed.getvalue(), ""


def refused(*words: str, codes: tuple[int, ...] = (3,)) -> Check:
    return lambda ended: ended.code in codes and ended.says(words)


def held(*words: str) -> Check:
    """Check that a sample of a lab's folder is held back with the reason."""
    return refused(*words, codes=(3, 6))


def right(figures: Figures, values: float | Sequence[float], within: float, *words: str) -> Check:
    def check(ended: Ended) -> bool:
        if ended.code != 0 or not ended.says(words):
            return False
        values_seen, expected = np.atleast_1d(figures(ended)), np.atleast_1d(values)
        return values_seen.shape == expected.shape and bool(np.all(np.abs(values_seen - expected) <= within))

    return check


def warned(*words: str, codes: tuple[int, ...] = (0,)) -> Check:
    return refused(*words, codes=codes)


def figure(*keys: str) -> Figures:
    """Figures of --json's object, or of its sample."""

    def look(ended: Ended) -> Sequence[float]:
        content = json.loads(ended.stdout)
        return [float((content | (content.get("sample") or {}))[key]) for key in keys]

    return look


def numbers(ended: Ended) -> Sequence[float]:
    """All numbers of an array that was printed."""
    return [float(text) for text in NUMBER.findall(ended.stdout)]


def has_levels(*sets: Sequence[float]) -> Check:
    """The levels printed are one of these sets, in any order."""
    return lambda ended: (
        ended.code == 0
        and any(
            len(numbers(ended)) == len(levels) and np.allclose(sorted(numbers(ended)), sorted(levels), atol=0.001)
            for levels in sets
        )
    )


TO = "--json --out {out}/run"
SCALED = f"--depth-mm 10 --mm-per-px 0.1 {TO}"
CLICKED = f"--ends 40,150 460,160 {SCALED}"
LINE = f"--width-mm 1 --depth-mm 10 {TO}"
MM3 = figure("cavity_volume_mm3")
WIDTH = figure("mean_width_mm")
LENGTH = figure("length_mm")
LAB = "ingest . --out {out}/lab"
PASTE = "material rheometer curve.csv --density-kg-m3 1690 --data synthetic --json --out {out}/m.toml"
TWELVE = right(figure("yield_stress_pa", "viscosity_pa_s"), (12, 1.5), 0.1)
SLOT = right(MM3, LONG_SLOT_MM3, 24)
ALONG = f"digitise a.dxf --line CENTRELINE {LINE}"
BETWEEN = f"digitise a.dxf --walls UPPER LOWER --depth-mm 10 {TO}"
CSV, XLSX = (partial(lambda name: st.read_readings(name).level_mm, name) for name in ("a.csv", "a.xlsx"))
MESH = f"digitise block.{{}} --units mm {TO.replace('{', '{{').replace('}', '}}')}".format
WIDE = right(WIDTH, 2.1, 0.2)
THREE = has_levels((-2.0, -2.1, -2.2))
