"""The bars for the speed of a run, against an earlier state of this program.

    git worktree add ../before 7065196
    python -m benchmarks.speed_bars ../before [--turns 3] [--only trial --only twelve ...]

``trial`` and ``twelve`` have bars against that commit; ``around``, ``accurate`` and ``draft`` against e3aefa51: all of
the trial but its frames, the whole trial from photo to report, and a draft of it. Both trees run the trial and the
study that the older one ships. Kernels are compiled in the first turn. Trees take turns in processes of their own; all
is processor time, and a figure is the median of the ratios of the turns. ``cold`` is what ``benchmarks.cold`` finds.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

from typer import Option

from benchmarks import cold
from benchmarks.against import HERE, processor, turn
from benchmarks.table import Row, one_of, run_benchmark

SHIPPED = """
import re, resource, subprocess
fixture = before / "fixtures/paper-trial"
text = re.sub('file = "(.+)"', lambda match: f'file = "{fixture / match[1]}"', (fixture / "trial.toml").read_text())
"""
DRAFTED = """
if "def drafted" in Path("sealtwin/trial/trial_file.py").read_text():
    text = text.replace('preset = "accurate"', 'preset = "draft"')
    assert 'preset = "draft"' in text
"""
"""The older tree has no drafts: there the trial is accurate."""
RUN = """
trial = scratch / "trial.toml"
trial.write_text(text)
command = [sys.executable, "-m", "sealtwin", "run", str(trial), "--device", "cpu", "--quiet"]
command += ["--out", str(scratch / f"run-{time.time_ns()}")]
ended = subprocess.run(command, check=False, stdout=subprocess.DEVNULL).returncode
assert ended in (0, 5), f"exit code {ended}: neither a kept gate nor a missed one"
used = resource.getrusage(resource.RUSAGE_CHILDREN)
took_s, result = used.ru_utime + used.ru_stime, 1.0
"""
TWELVE = """
import resource, subprocess
fixture = before / "fixtures/paper-trial"
text = (fixture / "study-paper.toml").read_text().split("[grid]")[0]
text = text.replace('"trial.toml"', repr(str(fixture / "trial.toml")))
study = scratch / f"twelve-{time.time_ns()}.toml"
study.write_text(text + '[grid]\\n"fluid.U" = [0.01, 30, 1000, 10000]\\n"fluid.D_cm" = [1e-4, 0.3, 3]\\n')
command = [sys.executable, "-m", "sealtwin", "sweep", str(study), "--jobs", "1", "--device", "cpu"]
subprocess.run([*command, "--out", str(study.with_suffix(""))], check=True, stdout=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
took_s, result = used.ru_utime + used.ru_stime, 1.0
"""
AROUND = """
from benchmarks import cold
from sealtwin.cli.app import main
spent, out = cold._clocked_parts(), str(scratch / f"around-{time.time_ns()}")
trial = before / "fixtures/paper-trial/trial.toml"
sys.argv = ["sealtwin", "run", str(trial), "--device", "cpu", "--quiet", "--out", out]
try:
    main()
except SystemExit as end:
    if end.code:
        raise
took_s, result = cold._processor_s() - spent[cold.FRAMES] - spent[cold.COMPILE], 1.0
"""
AGAINST = {
    "trial": ("the trial, all stages", SHIPPED + RUN, 0.5, "<= 0.33"),
    "twelve": ("12 of the 132 runs at 0.6 mm", TWELVE, 0.5, "<= 0.33"),
    "around": ("what surrounds the frames", AROUND, 0.6, ""),
    "accurate": ("the trial, photo to report", SHIPPED + RUN, 0.85, ""),
    "draft": ("a draft of the trial, photo to report", SHIPPED + DRAFTED + RUN, 0.4, ""),
}


def main(
    before: Path,
    turns: Annotated[int, Option(help="of the rows against that tree")] = 3,
    only: Annotated[list[str] | None, one_of(("cold", *AGAINST))] = None,
) -> list[Row]:
    print(f"{processor()}, load {os.getloadavg()[0]:.1f}")
    chosen = only or ("cold", "trial", "twelve")
    rows = _cold() if "cold" in chosen else []
    for name in AGAINST:
        if name in chosen:
            title, body, bar, goal = AGAINST[name]
            rows.append(Row(f"{title}, over {before.name}", _ratio(body, before.resolve(), turns), "", 0, bar, goal))
    return rows


def _cold() -> list[Row]:
    """Of a process of its own, with as many threads as a user's has."""
    ran = subprocess.run([sys.executable, "-m", "benchmarks.cold"], cwd=HERE, stdout=subprocess.PIPE, text=True)
    print(ran.stdout)
    return cold.judged(**json.loads(ran.stdout.splitlines()[-1]))


def _ratio(body: str, before: Path, turns: int) -> float:
    """Return the median over the turns of our processor time over the other tree's."""
    ratios, body = [], f"before = Path({str(before)!r})\n{body}"
    with tempfile.TemporaryDirectory() as place:
        here, there = (Path(place) / name for name in ("here", "there"))
        for folder in (here, there):
            folder.mkdir()
        for _ in range(turns):
            ours, theirs = turn(body, HERE, here)[0], turn(body, before, there)[0]
            print(f"  {ours:.1f} s, {theirs:.1f} s: {ours / theirs:.3f}", flush=True)
            ratios.append(ours / theirs)
    return statistics.median(ratios)


if __name__ == "__main__":
    run_benchmark(main)
