"""A sweep: all runs of a study brought up to date, in a folder of their own."""

import hashlib
import json
import platform
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.run_folder import HOLDER, foreign_names, holding, open_folder, require_folder, stage_key
from sealtwin.core.tables import write_sheet
from sealtwin.study.estimate import RunSize, estimate, require_disk, require_memory, size_of
from sealtwin.study.runner import INPUTS, Computing, compute, read_bench
from sealtwin.study.study_file import PlannedRun, load_study, plan_runs, raise_faults
from sealtwin.study.study_folder import (
    STATES,
    Plan,
    StudyRun,
    holds_study,
    read_plan,
    remove_temporary_files,
    resume,
    write_plan,
)
from sealtwin.trial.job import DIGITISED, require_sample, shown, stage_settings, start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.trial_file import load_trial

BUG, SOME_FAILED = 1, 6
TABLE = "runs.csv"
FIGURES = ("mean_error_mm", "worst_error_mm", "worst_at_mm", "volume_ratio", "spilled_particles", "particles")
"""Figures of a run in the table; the others are in its summary.json."""


@dataclass(frozen=True)
class SweepOptions(Computing):
    """Options for computing a sweep."""

    retry: bool = False  # Compute failed runs again
    dry_run: bool = False
    shard: tuple[int, int] = (1, 1)  # The i-th of n parts of the study


def sweep(file: Path, out: Path | None, options: SweepOptions, progress: Progress) -> dict[str, Any]:
    """Compute all runs of a study that are not done yet, and return the --json object of the command.

    ``out`` is its folder; None: reports/<name of the study>.

    Raises:
        InputError: Settings of any run cannot be used, which is checked before the first one starts; or the folder is
            not this study's.
        BusyError: Another process works in the folder.
    """
    from simulate.device import free_bytes

    study = load_study(file)
    base = file.parent / study.trial
    planned = plan_runs(study, file, load_trial(base))
    if planned[0].trial.fluid is None:
        raise InputError(f"{base}: no [fluid] table; give U and D_cm, or viscosity_pa_s, there or in the study.")
    require_sample(planned[0].trial, base.parent)
    shard, shards = options.shard
    if shards > len(planned):
        raise InputError(f"--shard {shard}/{shards}: the study has {len(planned)} runs, so at most as many shards.")
    folder = out or Path("reports", study.folder_name + (f"-{shard}-of-{shards}" if shards > 1 else ""))
    refuse_foreign(folder)
    with holding(folder), progress:
        plan = Plan(study.name, [], len(planned), time.time())
        _adopt(folder, plan)
        files.write_if_new(folder / "study.toml", file.read_bytes())
        planned = planned[shard - 1 :: shards]
        samples = _digitise(planned, base.parent, folder, progress)
        runs, largest = _runs(planned, samples, folder, options.device)
        runs = resume(folder, replace(plan, runs=runs), retry=options.retry, keep_runs=options.keep_runs)
        expected = estimate(runs, largest, options.jobs, options.batch, keep_runs=options.keep_runs)
        progress.note(f"{study.name}: {len(runs)} runs of {largest.particles:,} particles at most. {expected.sentence}")
        require_disk(expected, shutil.disk_usage(folder).free, shown(folder))
        if options.scheduler is None:
            require_memory(expected, free_bytes(options.device), options.device, options.batch)
        if expected.runs and not options.dry_run:
            runs = compute(folder, runs, options, "Sweeping", progress)
        return report(folder, replace(plan, runs=runs))


def status(folder: Path) -> dict[str, Any]:
    """Report how far a sweep is, also while it runs. Raises InputError if ``folder`` holds none."""
    return report(folder, read_plan(folder), _holder(folder), table=False)


def refuse_foreign(folder: Path) -> None:
    """Raises InputError where a folder holds files, but no study."""
    require_folder(folder)
    if folder.is_dir() and not holds_study(folder) and (foreign := foreign_names(folder)):
        raise InputError(
            f"{folder}: holds files that no sweep wrote ({', '.join(foreign[:3])}); give --out another folder."
        )


def _adopt(folder: Path, plan: Plan) -> None:
    """Make the folder that study's. Raises InputError if it holds another one."""
    if not holds_study(folder):
        write_plan(folder, plan)
    held = read_plan(folder).study
    if held != plan.study:
        raise InputError(f"{folder}: holds the study '{held}'; this is '{plan.study}'. Give --out another folder.")
    remove_temporary_files(folder)


def _digitise(planned: Sequence[PlannedRun], source: Path, folder: Path, progress: Progress) -> dict[int, str]:
    """Digitise each crack once, into samples/, and return the folder's name for the number of each run.

    Raises InputError with the runs that each fault concerns.
    """
    runs: dict[str, list[PlannedRun]] = {}
    for run in planned:
        settings = json.dumps(stage_settings(run.trial, "digitise"), sort_keys=True)
        runs.setdefault(hashlib.sha256(settings.encode()).hexdigest()[:12], []).append(run)
    faults: dict[str, list[int]] = {}
    for name, alike in runs.items():
        try:
            with open_folder(folder / "samples" / name, create=True) as sample:
                run_stages(start_job(alike[0].trial, source, sample, "cpu", progress), ("digitise",))
        except InputError as fault:
            faults.setdefault(str(fault), []).extend(run.number for run in alike)
    raise_faults(faults)
    return {run.number: name for name, alike in runs.items() for run in alike}


def _runs(
    planned: Sequence[PlannedRun], samples: dict[int, str], folder: Path, device: str
) -> tuple[list[StudyRun], RunSize]:
    """Return the runs with their keys, and the largest size. Raises InputError if settings do not fit a crack."""
    from simulate.setup_checks import check_fit

    readings = planned[0].trial.readings
    names = [*DIGITISED, *([] if readings is None else [f"{INPUTS}/{readings.file.name}"])]
    homes = {name: folder / "samples" / name for name in dict.fromkeys(samples.values())}
    benches = {name: read_bench(home, None) for name, home in homes.items()}
    inputs = {name: {file: files.sha256(home / file) for file in names} for name, home in homes.items()}
    runs: list[StudyRun] = []
    faults: dict[str, list[int]] = {}
    sizes: dict[Any, RunSize] = {}
    for run in planned:
        trial, name = run.trial, samples[run.number]
        fluid, bench = trial.fluid, benches[name]
        assert fluid is not None, "checked before"
        settings = stage_settings(trial, "simulate")
        kin = stage_key({}, {**settings, "fluid": None, "sample": name})
        # Of the fluid's numbers only its age at freezing counts for the size.
        alike = kin, fluid.freeze_after_s
        try:
            check_fit(bench.outline, bench.solid, fluid, trial.solver, trial.nozzle)
            if alike not in sizes:
                sizes[alike] = size_of(trial, bench.trajectory, bench.outline.mean_width_mm)
        except InputError as fault:
            faults.setdefault(str(fault), []).append(run.number)
            continue
        validated = stage_settings(trial, "validate")["readings"]
        key = stage_key(inputs[name], {**settings, "readings": validated, "device": device})
        content = trial.model_dump(mode="json", exclude_none=True)
        runs.append(StudyRun(run.number, key, run.settings, content, name, kin, sizes[alike].work_s))
    raise_faults(faults)
    return runs, max(sizes.values(), key=lambda size: (size.particles, size.bytes))


def report(folder: Path, plan: Plan, holder: str | None = None, *, table: bool = True) -> dict[str, Any]:
    """Return the --json object of a study, and write its runs as a ``table`` for spreadsheets too."""
    runs = plan.runs
    failed = [run for run in runs if run.state == "failed"]
    rows = [_row(run) for run in runs]
    if table and rows:
        write_sheet(folder / TABLE, list(rows[0]), (list(row.values()) for row in rows))
    return {
        "version": 1,
        "name": plan.study,
        "folder": shown(folder),
        "states": {state: sum(run.state == state for run in runs) for state in STATES},
        "runs_of_study": plan.total,
        "computed_by": holder,
        "left_s": _left_s(plan) if holder else None,
        "best": _best(runs),
        "exit_code": BUG if any(run.trace for run in failed) else SOME_FAILED if failed else 0,
        "runs": rows,
    }


def _left_s(plan: Plan) -> float | None:
    """Expected time until all runs are finished, at the pace since the sweep was started; None before its first run."""
    since = [run for run in plan.runs if (run.finished_unix_s or 0.0) > plan.started_unix_s]
    if not since:
        return None
    elapsed_s = max(run.finished_unix_s or 0.0 for run in since) - plan.started_unix_s
    left = sum(run.work_s for run in plan.runs if run.state == "waiting")
    return round(elapsed_s * left / sum(run.work_s for run in since), 1)


def _holder(folder: Path) -> str | None:
    """Return the process that computes the sweep, or None. Processes of another machine are taken as alive."""
    import psutil

    try:
        holder = json.loads((folder / HOLDER).read_text(encoding="utf-8"))
        if holder["host"] == platform.node() and not psutil.pid_exists(holder["process"]):
            return None
        return f"process {holder['process']} on {holder['host']}"
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _best(runs: Sequence[StudyRun]) -> dict[str, Any] | None:
    """The run whose surface is nearest to the readings; None where there are none."""
    found = ((run, (run.figures or {}).get("mean_error_mm")) for run in runs)
    compared = [(error_mm, run) for run, error_mm in found if error_mm is not None]
    if not compared:
        return None
    error_mm, run = min(compared, key=lambda pair: pair[0])
    return {"number": run.number, "settings": run.settings, "mean_error_mm": round(error_mm, 4)}


def _row(run: StudyRun) -> dict[str, Any]:
    figures = run.figures or {}
    return {
        "number": run.number,
        **run.settings,
        "state": run.state,
        **{name: figures.get(name) for name in FIGURES},
        "wall_s": None if run.wall_s is None else round(run.wall_s, 2),
        "reason": run.reason,
        "folder": f"runs/{run.key[:16]}" if run.state == "done" else None,
    }
