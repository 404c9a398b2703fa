"""A calibration and a plan by drafts over those by accurate runs: processor time, posterior, and the plan's error.

    python -m benchmarks.searches [--only plan] [--keep DIR]

The crack is that of the shipped trial, with a paste of 12 Pa and EMULATED readings of a run of it with another seed.
Both plans are poured by the same three accurate runs, and the mean of their errors is judged. Results in DIR are not
computed again. All takes about 50 minutes of processor time.
"""

import csv
import json
import re
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Option

from benchmarks.against import HERE, processor
from benchmarks.kept_runs import KeptRuns
from benchmarks.table import Row, one_of, run_benchmark
from digitise.trajectory import plan_trajectory
from sealtwin.core import record_files
from sealtwin.core.files import write_json
from sealtwin.core.records import Floats
from sealtwin.plan.verify import misfit
from sealtwin.trial.trial_file import load_trial
from simulate.run import fill

FIXTURE = HERE / "fixtures" / "paper-trial"
PASTE = 'viscosity_pa_s = 1.0\nyield_stress_pa = 12.0\nfreeze_after_s = "never"'
"""It takes the place of U, D and freezing, which a plan does not take."""
FREE = ("--free", "fluid.yield_stress_pa=3:24", "--free", "fluid.viscosity_pa_s=0.2:3")
READINGS = """
[readings]
file = "emulated.csv"
data = "synthetic"
role = "calibrated-on"
"""
"""Those of the shipped trial are reproduced by no such paste."""
EVERY_MM, REPEATS, SCATTER_MM = 5.0, 3, 0.15
SEALTWIN = sys.executable, "-m", "sealtwin"
SEARCHES: Mapping[str, tuple[str, ...]] = {
    "calibrate": ("calibrate", "emulated.toml", *FREE),
    "plan": ("plan", "paste.toml", "--set", "path.trim_mm=3", "--flow-max-mm3-s", "680"),
}
HOW: Mapping[str, tuple[str, ...]] = {"drafts": (), "accurate": ("--accurate",)}
SEEDS = 3
LEAST_MM3 = 20.0
"""Difference of two plans' errors that is no difference: the seeds of one plan differ by as much."""


def main(
    only: Annotated[list[str] | None, one_of(SEARCHES)] = None,
    keep: Annotated[Path | None, Option(help="folder for results")] = None,
) -> list[Row]:
    print(processor(), flush=True)
    if keep:
        kept = KeptRuns(keep, "python -m benchmarks.searches --keep OTHER")
        kept.begin()
    with tempfile.TemporaryDirectory() as temporary:
        home = (keep or Path(temporary)).resolve()
        _lay_out(home)
        return [row for name in only or SEARCHES for row in {"calibrate": _calibrated, "plan": _planned}[name](home)]


def _lay_out(home: Path) -> None:
    """Write the files that the commands read."""
    home.mkdir(exist_ok=True)
    for file in FIXTURE.iterdir():
        (home / file.name).write_bytes(file.read_bytes())
    trial, _, _ = (FIXTURE / "trial.toml").read_text(encoding="utf-8").partition("[readings]")
    (home / "paste.toml").write_text(re.sub(r"U = .*\nD_cm = .*\nfreeze_after_s = .*", PASTE, trial), encoding="utf-8")


def _emulate_readings(home: Path) -> None:
    """Write a trial whose readings are those of a run of the paste with another seed, with scatter."""
    command = [*SEALTWIN, "run", "paste.toml", "--set", "seed=7", "--out", "real"]
    subprocess.run(command, cwd=home, check=True, capture_output=True)
    real = record_files.read_profile(home / "real")
    s_mm = np.arange(EVERY_MM, real.s_mm[-1], EVERY_MM)
    scatter_mm = np.random.default_rng(0).normal(0, SCATTER_MM, (REPEATS, len(s_mm)))
    columns = np.vstack([s_mm, np.interp(s_mm, real.s_mm, real.level_mm) + scatter_mm])
    header = ",".join(["s_mm", *(f"level_{number + 1}_mm" for number in range(REPEATS))])
    np.savetxt(home / "emulated.csv", columns.T, fmt="%.2f", delimiter=",", header=header, comments="")
    (home / "emulated.toml").write_text((home / "paste.toml").read_text(encoding="utf-8") + READINGS, encoding="utf-8")


def _computed(name: str, how: str, home: Path) -> tuple[Path, float]:
    """Return the folder of a search, computed if it is not kept, and its processor time."""
    folder, facts = home / f"{name}-{how}", home / f"{name}-{how}.json"
    if not facts.is_file():
        command = [*SEALTWIN, *SEARCHES[name], *HOW[how], "--out", folder.name]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*command, "--device", "cpu", "--quiet"], cwd=home, check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        write_json(facts, {"cpu_s": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime})
    cpu_s = json.loads(facts.read_text(encoding="utf-8"))["cpu_s"]
    print(f"{name}, {how}: {cpu_s:.0f} s", flush=True)
    return folder, cpu_s


def _calibrated(home: Path) -> Iterator[Row]:
    if not (home / "emulated.toml").is_file():
        _emulate_readings(home)
    (drafts, draft_s), (accurate, accurate_s) = (_computed("calibrate", how, home) for how in HOW)
    yield Row("calibrate: processor time, over accurate runs", draft_s / accurate_s, "", 0, 0.5)
    ours, theirs = (_posterior(folder) for folder in (drafts, accurate))
    for name, draws in theirs.items():
        low, median, high = np.quantile(np.log(draws), [0.05, 0.5, 0.95])
        own_low, own, own_high = np.quantile(np.log(ours[name]), [0.05, 0.5, 0.95])
        off = float(abs(own - median) / (high - low))
        yield Row(f"calibrate: {name}, median by accurate runs", float(np.exp(median)), "")
        yield Row(f"calibrate: {name}, median by drafts", float(np.exp(own)), "")
        yield Row(f"calibrate: {name}, medians apart, over the 90 % width (logarithms)", off, "", 0, 0.25)
        wider = float((own_high - own_low) / (high - low))
        yield Row(f"calibrate: {name}, 90 % width over that of accurate runs", wider, "")


def _posterior(folder: Path) -> dict[str, Floats]:
    (*names,), *rows = csv.reader((folder / "posterior.csv").read_text(encoding="utf-8").splitlines())
    return dict(zip(names, np.array(rows, dtype=float).T, strict=True))


def _planned(home: Path) -> Iterator[Row]:
    (drafts, draft_s), (accurate, accurate_s) = (_computed("plan", how, home) for how in HOW)
    yield Row("plan: processor time, over accurate runs", draft_s / accurate_s, "", 0, 0.5)
    ours, theirs = (_poured(folder) for folder in (drafts, accurate))
    for how, errors_mm3 in (("accurate runs", theirs), ("drafts", ours)):
        yield Row(f"plan by {how}: error, mean of {SEEDS} accurate runs", float(errors_mm3.mean()), "mm3")
        yield Row(f"plan by {how}: their range", float(np.ptp(errors_mm3)), "mm3")
    constant = json.loads((accurate / "plan.json").read_text(encoding="utf-8"))["baselines"]["constant flow"]
    yield Row("constant flow: error of an accurate run", _total(constant), "mm3")
    worse = float(ours.mean() - theirs.mean())
    yield Row("plan by drafts: its error, less that by accurate runs", worse, "mm3", -np.inf, LEAST_MM3)


def _total(figures: Mapping[str, Any]) -> float:
    return figures["under_mm3"] + figures["over_mm3"]


def _poured(folder: Path) -> Floats:
    """Return the errors of a plan in accurate runs, (SEEDS,), under and over the face."""
    kept = folder / "poured.json"
    if not kept.is_file():
        trial = load_trial(folder / "trial.toml").loaded(folder)
        sample = record_files.read_sample(folder / "sample")
        its_path = plan_trajectory(sample.outline, trial.path, sample.solid.cavity_volume_mm3, sample.solid.sections)
        errors = []
        for seed in range(SEEDS):
            _, profile = fill(replace(sample, trajectory=its_path), *trial.physics, seed=seed)
            errors.append(misfit(sample.outline, sample.solid, profile.s_mm, profile.level_mm).total_mm3)
        write_json(kept, {"total_mm3": errors})
    return np.array(json.loads(kept.read_text(encoding="utf-8"))["total_mm3"])


if __name__ == "__main__":
    run_benchmark(main)
