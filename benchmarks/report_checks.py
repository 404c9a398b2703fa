"""What a public report is, what a sound answer to its file is, and whether the answer of sealtwin is one."""

import csv
import json
import re
import tempfile
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.reported_files import Maker
from benchmarks.reproductions import LIMIT_S, last_words, run_in
from benchmarks.second_files import PAUSE_S

NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Ended:
    """An answer: its exit code, its words in small letters, what it printed on stdout, its folder for files."""

    code: int
    words: str
    stdout: str
    out: Path

    def says(self, words: Sequence[str]) -> bool:
        """Tell if each of the words is there; those between bars are alternatives."""
        return all(any(one in self.words for one in word.split("|")) for word in words)


Check = Callable[[Ended], bool]
Figures = Callable[[Ended], Sequence[float]]


@dataclass(frozen=True)
class Report:
    address: str
    """On github.com."""
    there: str
    """What went wrong there."""
    make: Maker
    command: str
    sound: tuple[Check, ...]
    """Any of them."""


def refused(*words: str, codes: tuple[int, ...] = (3,)) -> Check:
    return lambda ended: ended.code in codes and ended.says(words)


def held(*words: str) -> Check:
    """Of a lab's folder: a sample held back, with the reason."""
    return refused(*words, codes=(3, 6))


def right(figures: Figures, values: float | Sequence[float], within: float, *words: str) -> Check:
    def check(ended: Ended) -> bool:
        if ended.code != 0 or not ended.says(words):
            return False
        seen, expected = np.atleast_1d(figures(ended)), np.atleast_1d(values)
        return seen.shape == expected.shape and bool(np.all(np.abs(seen - expected) <= within))

    return check


def warned(*words: str, codes: tuple[int, ...] = (0,)) -> Check:
    return refused(*words, codes=codes)


def figure(*keys: str) -> Figures:
    """Figures of --json's object."""
    return lambda ended: [float(json.loads(ended.stdout)[key]) for key in keys]


def numbers(ended: Ended) -> Sequence[float]:
    """All numbers of an array that was printed."""
    return [float(text) for text in NUMBER.findall(ended.stdout)]


def settings(key: str, *samples: str) -> Figures:
    """A setting of the trials that 'sealtwin ingest' wrote, NaN for a sample without one."""

    def look(ended: Ended) -> Sequence[float]:
        found = []
        for sample in samples:
            (trial,) = sorted((ended.out / "lab").glob(f"{sample}*/trial.toml")) or [None]
            table = {} if trial is None else tomllib.loads(trial.read_text(encoding="utf-8"))
            for part in key.split("."):
                table = table.get(part, {})
            found.append(float(table) if isinstance(table, int | float) else float("nan"))
        return found

    return look


def interval_holds(*yields_pa: float) -> Check:
    """The stated 95 % interval of the yield stress holds all of these."""

    def check(ended: Ended) -> bool:
        if ended.code != 0:
            return False
        low, high = json.loads(ended.stdout)["yield_stress_95_pa"]
        return all(low <= value <= high for value in yields_pa)

    return check


def interval_holds_paste(yield_pa: float, viscosity_pa_s: float) -> Check:
    """The stated intervals hold the paste's yield stress and viscosity."""
    of_yield = interval_holds(yield_pa)

    def check(ended: Ended) -> bool:
        if not of_yield(ended):
            return False
        answer = json.loads(ended.stdout)
        error = answer["viscosity_pa_s"] * answer["viscosity_error_percent"] / 100
        return abs(answer["viscosity_pa_s"] - viscosity_pa_s) <= 2 * error

    return check


def feed_is_of_the_path(ended: Ended) -> bool:
    """The G-code's feed along the path is the path's speed in mm/min."""
    if ended.code != 0:
        return False
    answer = json.loads(ended.stdout)
    (program,) = (ended.out / "robot").glob("*.gcode")
    feeds = [float(feed) for feed in re.findall(r"F([\d.]+)", program.read_text(encoding="utf-8"))]
    expected = 60 * answer["length_mm"] / answer["duration_s"]
    return any(abs(feed - expected) <= 0.1 * expected for feed in feeds) and min(feeds) > 0.5 * expected


def poses_are_metres_and_radians(ended: Ended) -> bool:
    """Positions below 1 m, and rotation vectors no longer than half a turn, the tool pointing down."""
    if ended.code != 0:
        return False
    (program,) = (ended.out / "robot").glob("*.script")
    written = re.findall(r"p\[([^\]]+)\]", program.read_text(encoding="utf-8"))
    poses = [[float(part) for part in one.split(",")] for one in written if re.fullmatch(r"[-\d.,e ]+", one)]
    turns = [float(np.linalg.norm(pose[3:])) for pose in poses if len(pose) == 6]
    return (
        bool(turns)
        and all(max(map(abs, pose[:3])) < 1 for pose in poses)
        and all(abs(turn - np.pi) < 0.01 for turn in turns)
    )


def mean_depth_is(depth_mm: float) -> Check:
    """The cavity's volume over width and length, within 0.4 mm, which the rounded ends take."""

    def check(ended: Ended) -> bool:
        if ended.code != 0:
            return False
        answer = json.loads(ended.stdout)["sample"]
        seen_mm = answer["cavity_volume_mm3"] / answer["mean_width_mm"] / answer["length_mm"]
        return abs(seen_mm - depth_mm) <= 0.4

    return check


def pause_is_kept(ended: Ended) -> bool:
    """The trajectory stands still once, as long as was asked."""
    if ended.code != 0:
        return False
    with (ended.out / "run" / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = [[float(row[name]) for name in ("t_s", "x_mm", "y_mm", "z_mm")] for row in csv.DictReader(file)]
    steps = np.diff(rows, axis=0)
    still_s = steps[np.linalg.norm(steps[:, 1:], axis=1) < 1e-6, 0].sum()
    return bool(abs(still_s - PAUSE_S) < 0.01)


def has_levels(*sets: Sequence[float]) -> Check:
    """The levels printed are one of these sets, in any order."""
    return lambda ended: (
        ended.code == 0
        and any(
            len(numbers(ended)) == len(levels) and np.allclose(sorted(numbers(ended)), sorted(levels), atol=0.001)
            for levels in sets
        )
    )


def judge(report: Report) -> tuple[str, bool]:
    """Return the exit code and the last words of the answer, and whether it is sound."""
    with tempfile.TemporaryDirectory() as scratch:
        given, out = Path(scratch) / "given", Path(scratch) / "out"
        given.mkdir()
        out.mkdir()
        report.make(given)
        ended = run_in(given, out, report.command)
        if ended is None:
            return f"not done in {LIMIT_S} s", False
        printed = f"{ended.stdout}\n{ended.stderr}"
        answer = Ended(ended.returncode, " ".join(printed.lower().split()), ended.stdout, out)
        sound = "Traceback" not in printed and any(check(answer) for check in report.sound)
    return f"exit {ended.returncode}: {last_words(ended)}", sound


TO = "--json --out {out}/run"
SCALED = f"--depth-mm 10 --mm-per-px 0.1 {TO}"
CLICKED = f"--ends 40,150 460,160 {SCALED}"
LINE = f"--width-mm 1 --depth-mm 10 {TO}"
MM3 = figure("cavity_volume_mm3")
WIDTH = figure("mean_width_mm")
LENGTH = figure("length_mm")
LAB = "ingest . --out {out}/lab"
PASTE = "material rheometer curve.csv --density-kg-m3 1690 --data synthetic --json --out {out}/m.toml"
ROBOT = "robot run --cell cell.toml --json --out {out}/robot"
TWELVE = right(figure("yield_stress_pa", "viscosity_pa_s"), (12, 1.5), 0.1)
