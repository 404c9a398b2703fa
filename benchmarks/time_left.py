"""The whole time that six long commands name while they run, over the time that they took; by the clock.

    python -m benchmarks.time_left [--only plan]

Each command computes the shipped trial, or a crack drawn for it, in a process of its own, and its lines are read as a
person reads them: the time so far, with the time left, is the whole time. Judged is what is said between a tenth and
nine tenths of the work. The first line counts too, but is by a model and not judged. Nothing else may run beside it.
"""

import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from benchmarks.against import HERE, processor
from benchmarks.table import Row, one_of, run_benchmark
from sealtwin.core import record_files

FIXTURE = HERE / "fixtures" / "paper-trial"
FACTOR = 1.5
FROM, TO = 0.1, 0.9  # Shares of the time between which the lines are judged
SHORT_S = 20.0  # A command that takes less need not say how long
LEFT = re.compile(r"about (\d+(?:\.\d+)?) (s|min|h)\b")
UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
STUDY = """
name = "paste"
trial = "trial.toml"
[fixed]
"fluid.freeze_after_s" = "never"
[grid]
"fluid.yield_stress_pa" = [6, 12, 24]
"fluid.U" = [10, 30]
"""
PASTE = 'viscosity_pa_s = 1.0\nyield_stress_pa = 12.0\nfreeze_after_s = "never"'
"""It takes the place of U, D and freezing, which a plan does not take."""
FREE = ("--free", "fluid.yield_stress_pa=3:24", "--free", "fluid.viscosity_pa_s=0.2:3")
SCALE = ("--mm-per-px", "0.1375", "--ends", "719,658", "1403,259")
READINGS = """
[readings]
file = "emulated.csv"
data = "synthetic"
role = "calibrated-on"
"""
"""Readings of a run of the paste with another seed: those of the shipped trial are reproduced by no such paste."""
EVERY_MM, REPEATS, SCATTER_MM = 5.0, 3, 0.15
SEALTWIN = sys.executable, "-m", "sealtwin"
COMMANDS: Mapping[str, tuple[str, ...]] = {
    "run": ("run", "trial.toml"),
    "quick": ("quick", "photo.jpg", *SCALE, "--depth-mm", "16", "--preset", "accurate"),
    "sweep": ("sweep", "study.toml"),
    "validate": ("validate", "coarser", "--uncertainty"),
    "calibrate": ("calibrate", "emulated.toml", *FREE),
    "plan": ("plan", "paste.toml", "--set", "path.trim_mm=3", "--flow-max-mm3-s", "680"),
}
BEFORE: Mapping[str, tuple[str, ...]] = {
    "validate": ("run", "trial.toml", "--set", "solver.radius_mm=0.55", "--out", "coarser"),
    "calibrate": ("run", "paste.toml", "--set", "seed=7", "--out", "real"),
}
"""Commands whose results another one needs; they are not timed."""


class Line(NamedTuple):
    at_s: float
    whole_s: float  # Time so far and the time left


def main(only: Annotated[list[str] | None, one_of(COMMANDS)] = None) -> list[Row]:
    print(processor(), flush=True)
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        lay_out(home)
        return [row for each in only or COMMANDS for row in _rows(each, home)]


def lay_out(home: Path) -> None:
    """Write the files that ``COMMANDS`` read."""
    home.mkdir(exist_ok=True)
    for file in FIXTURE.iterdir():
        (home / file.name).write_bytes(file.read_bytes())
    (home / "study.toml").write_text(STUDY, encoding="utf-8")
    trial, _, _ = (FIXTURE / "trial.toml").read_text(encoding="utf-8").partition("[readings]")
    (home / "paste.toml").write_text(re.sub(r"U = .*\nD_cm = .*\nfreeze_after_s = .*", PASTE, trial), encoding="utf-8")


def prepare(name: str, home: Path) -> None:
    """Compute what a command needs."""
    if name in BEFORE:
        subprocess.run([*SEALTWIN, *BEFORE[name]], cwd=home, check=True, capture_output=True)
    if name == "calibrate":
        _emulate_readings(home)


def _emulate_readings(home: Path) -> None:
    """Write a trial whose readings are those of the run in ``home / "real"``, with scatter."""
    real = record_files.read_profile(home / "real")
    s_mm = np.arange(EVERY_MM, real.s_mm[-1], EVERY_MM)
    scatter_mm = np.random.default_rng(0).normal(0, SCATTER_MM, (REPEATS, len(s_mm)))
    columns = np.vstack([s_mm, np.interp(s_mm, real.s_mm, real.level_mm) + scatter_mm])
    header = ",".join(["s_mm", *(f"level_{number + 1}_mm" for number in range(REPEATS))])
    np.savetxt(home / "emulated.csv", columns.T, fmt="%.2f", delimiter=",", header=header, comments="")
    (home / "emulated.toml").write_text((home / "paste.toml").read_text(encoding="utf-8") + READINGS, encoding="utf-8")


def _rows(name: str, home: Path) -> Iterator[Row]:
    prepare(name, home)
    command = [*SEALTWIN, *COMMANDS[name]]
    began_s, lines = time.monotonic(), list[Line]()
    with subprocess.Popen(command, cwd=home, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        for text in process.stderr:
            at_s = time.monotonic() - began_s
            if left := LEFT.search(text):
                lines.append(Line(at_s, at_s + float(left[1]) * UNITS_S[left[2]]))
            print(f"{at_s:6.0f} s  {text.rstrip()}", flush=True)
    took_s = time.monotonic() - began_s
    if process.returncode not in (0, 5):  # A calibration that finds its readings impossible has done all its work.
        raise SystemExit(f"{' '.join(command)}: exit code {process.returncode}")
    yield Row(f"{name}: time", took_s, "s", SHORT_S)
    yield Row(f"{name}: first line at", lines[0].at_s if lines else took_s, "s")
    yield Row(f"{name}: whole time of the first line over the truth", lines[0].whole_s / took_s if lines else 0.0, "")
    ratios = [line.whole_s / took_s for line in lines if FROM * took_s <= line.at_s <= TO * took_s]
    yield Row(f"{name}: least whole time over the truth, after a tenth", min(ratios, default=0.0), "", 1 / FACTOR)
    yield Row(f"{name}: most", max(ratios, default=0.0), "", 0.0, FACTOR)


if __name__ == "__main__":
    run_benchmark(main)
