"""A sweep: all runs of a study brought up to date, in a folder of their own."""

import hashlib
import json
import os
import platform
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sealtwin.errors import InputError
from sealtwin.progress import Progress
from sealtwin.store import files, stage_files
from sealtwin.store.folder import HOLDER, LOCK, holding, open_folder, require_folder, stage_key
from sealtwin.store.tables import write_sheet
from sealtwin.study.bench import INPUTS
from sealtwin.study.estimate import Size, estimate, in_words, measured_pace, require_disk, require_memory, size_of
from sealtwin.study.ledger import LEDGER, STATES, Entry, Ledger, StudyRun, profile_path, run_path
from sealtwin.study.study import Planned, Study, load_study, plan_runs, raise_faults
from sealtwin.study.workers import Task, run_here
from sealtwin.trials.job import require_sample, stage_settings, start_job
from sealtwin.trials.made import DIGITISED
from sealtwin.trials.pipeline import run_stages
from sealtwin.trials.result import shown
from sealtwin.trials.trial import Trial, load_trial

BUG, SOME_FAILED = 1, 6
TABLE = "runs.csv"
FIGURES = ("mean_error_mm", "worst_error_mm", "worst_at_mm", "volume_ratio", "spilled_particles", "particles")
"""Of a run, in the table; the rest is in its summary.json."""
TOLD = 8
"""Failed runs in the answer; all of them are in the table."""


@dataclass(frozen=True)
class Wish:
    """How the user wants a sweep to go."""

    device: str
    jobs: int
    batch: int
    keep_runs: bool = False
    retry: bool = False
    """Failed runs too."""
    dry_run: bool = False
    dask: str | None = None


@dataclass(frozen=True)
class Report:
    """What the command says at its end."""

    content: dict[str, Any]
    lines: list[str]
    exit_code: int


def sweep(file: Path, out: Path | None, wish: Wish, progress: Progress) -> Report:
    """Compute whatever of a study is not done yet.

    Args:
        file: The study.
        out: Its folder; None: reports/<name of the study>.
        wish: How.
        progress: Told of estimate, progress and faults.

    Raises:
        InputError: settings that cannot be, of all runs at once, before the first one starts; or a folder that is not
            this study's.
        BusyError: another process works in the folder.
    """
    from simulate.device import free_bytes

    study = load_study(file)
    base = file.parent / study.trial
    planned = plan_runs(study, file, load_trial(base))
    _require_fluid(planned, base)
    require_sample(planned[0].trial, base.parent)
    folder = out or Path("reports", study.folder_name)
    _refuse_foreign(folder)
    with holding(folder), progress, Ledger(folder, create=True) as ledger:
        _adopt(folder, ledger, study)
        files.write_if_new(folder / "study.toml", file.read_bytes())
        samples = _digitise(planned, base.parent, folder, progress)
        entries, largest = _entries(planned, samples, folder, wish.device)
        ledger.plan(entries)
        ledger.put_back(_to_redo(ledger.runs(), folder, wish))
        expected = estimate(ledger.runs(), largest, wish.jobs, wish.batch, keep_runs=wish.keep_runs)
        progress.note(
            f"{study.name}: {len(entries)} runs of {largest.particles:,} particles at most. {expected.sentence}"
        )
        require_disk(expected, shutil.disk_usage(folder).free, shown(folder))
        if wish.dask is None:
            require_memory(expected, free_bytes(wish.device), wish.device, wish.batch)
        if expected.runs and not wish.dry_run:
            _run(folder, ledger, wish, progress)
        _write_table(folder / TABLE, ledger.runs())
        return _report(folder, ledger)


def cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def status(folder: Path) -> Report:
    """What is known of a sweep, also while it runs. Raises InputError where ``folder`` holds none."""
    with Ledger(folder) as ledger:
        return _report(folder, ledger)


def _require_fluid(planned: Sequence[Planned], base: Path) -> None:
    if planned[0].trial.fluid is None:
        raise InputError(f"{base}: no [fluid] table; give U and D_cm, or viscosity_pa_s, there or in the study.")


def _refuse_foreign(folder: Path) -> None:
    require_folder(folder)
    if not folder.is_dir() or (folder / LEDGER).is_file():
        return
    foreign = sorted(found.name for found in folder.iterdir() if found.name not in {LOCK, HOLDER})
    if foreign:
        raise InputError(
            f"{folder}: holds files that no sweep wrote ({', '.join(foreign[:3])}); give --out another folder."
        )


def _adopt(folder: Path, ledger: Ledger, study: Study) -> None:
    held = ledger.fact("study")
    if held is not None and held != study.name:
        raise InputError(f"{folder}: holds the study '{held}'; this is '{study.name}'. Give --out another folder.")
    ledger.state_fact("study", study.name)


def _digitise(planned: Sequence[Planned], source: Path, folder: Path, progress: Progress) -> dict[int, str]:
    """Each crack once, into samples/: the name of its folder there, by the run's number.

    Raises InputError with the runs that each fault is about.
    """
    samples: dict[int, str] = {}
    made: set[str] = set()
    faults: dict[str, list[int]] = {}
    for run in planned:
        settings = stage_settings(run.trial, "digitise")
        name = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:12]
        samples[run.number] = name
        if name in made:
            continue
        made.add(name)
        try:
            with open_folder(folder / "samples" / name, create=True) as sample:
                run_stages(start_job(run.trial, source, sample, "cpu", progress), ("digitise",))
        except InputError as fault:
            faults.setdefault(str(fault), []).append(run.number)
    raise_faults(faults)
    return samples


def _entries(
    planned: Sequence[Planned], samples: dict[int, str], folder: Path, device: str
) -> tuple[list[Entry], Size]:
    """The ledger's rows, and the size of the largest run. Raises InputError where settings do not fit a crack."""
    from simulate.fit import check_fit

    entries: list[Entry] = []
    faults: dict[str, list[int]] = {}
    sizes: dict[str, Size] = {}
    cracks = {name: _Crack(folder / "samples" / name, planned[0].trial) for name in dict.fromkeys(samples.values())}
    for run in planned:
        trial, name = run.trial, samples[run.number]
        crack = cracks[name]
        settings = stage_settings(trial, "simulate")
        # Of the fluid only its age at freezing counts for the size.
        alike = stage_key({}, {**settings, "fluid": trial.fluid and trial.fluid.freeze_after_s, "sample": name})
        kin = stage_key({}, {**settings, "fluid": None, "sample": name})
        try:
            assert trial.fluid is not None, "checked before"
            check_fit(crack.outline, crack.solid, trial.fluid, trial.solver, trial.nozzle)
            if alike not in sizes:
                sizes[alike] = size_of(trial, crack.trajectory, crack.outline.mean_width_mm)
        except InputError as fault:
            faults.setdefault(str(fault), []).append(run.number)
            continue
        readings = stage_settings(trial, "validate")["readings"]
        key = stage_key(crack.inputs, {**settings, "readings": readings, "device": device})
        entries.append(
            Entry(
                key, run.number, run.settings, trial.model_dump_json(exclude_none=True), name, kin, sizes[alike].work_s
            )
        )
    raise_faults(faults)
    return entries, max(sizes.values(), key=lambda size: (size.particles, size.bytes))


class _Crack:
    """A digitised sample, and the hashes of what runs are made from."""

    def __init__(self, folder: Path, trial: Trial) -> None:
        self.outline, self.solid = stage_files.read_outline(folder), stage_files.read_solid(folder)
        self.trajectory = stage_files.read_trajectory(folder)
        names: list[str] = [*DIGITISED]
        if trial.readings is not None:
            names.append(f"{INPUTS}/{trial.readings.file.name}")
        self.inputs = {name: files.sha256(folder / name) for name in names}


def _to_redo(runs: Sequence[StudyRun], folder: Path, wish: Wish) -> list[str]:
    """Done runs whose files are not as they were written; failed ones on request."""
    return [
        run.key
        for run in runs
        if (run.state == "failed" and wish.retry) or (run.state == "done" and not _is_kept(run, folder, wish.keep_runs))
    ]


def _is_kept(run: StudyRun, folder: Path, keep_runs: bool) -> bool:
    profile = profile_path(folder, run.key)
    if not profile.is_file() or run.figures is None or files.sha256(profile) != run.figures["profile_sha256"]:
        return False
    return not keep_runs or (run_path(folder, run.key) / "particles.csv").is_file()


def _run(folder: Path, ledger: Ledger, wish: Wish, progress: Progress) -> None:
    began_s, total_s = ledger.progress_s(), sum(run.work_s for run in ledger.runs())
    # Hundredths, since a bar counts in whole steps.
    progress.start("Sweeping", round(100 * (total_s - began_s)))

    def look(ledger: Ledger) -> None:
        counts = {state: ledger.count(state) for state in STATES}
        said = ", ".join(f"{number} {state}" for state, number in counts.items() if number)
        progress.advance(round(100 * (ledger.progress_s() - began_s)), said)

    task = Task(folder, wish.device, wish.batch, wish.keep_runs)
    if wish.dask is None:
        run_here(task, wish.jobs, look)
    else:
        from sealtwin.study.cluster import run_there

        run_there(task, wish.dask, look)


def _report(folder: Path, ledger: Ledger) -> Report:
    runs = ledger.runs()
    failed = [run for run in runs if run.state == "failed"]
    exit_code = BUG if any(run.trace for run in failed) else SOME_FAILED if failed else 0
    content = {
        "version": 1,
        "name": ledger.fact("study"),
        "folder": shown(folder),
        "states": {state: sum(run.state == state for run in runs) for state in STATES},
        "left_s": _left_s(runs, ledger.progress_s()),
        "best": _best(runs),
        "exit_code": exit_code,
        "runs": [_row(run) for run in runs],
    }
    return Report(content, _lines(content, runs, failed), exit_code)


def _left_s(runs: Sequence[StudyRun], behind_s: float) -> float | None:
    """With as many processes as run now; None where none does, or none has finished a run yet."""
    running = sum(run.state == "running" for run in runs)
    pace = measured_pace(runs)
    if not running or pace is None:
        return None
    return round(pace * (sum(run.work_s for run in runs) - behind_s) / running, 1)


def _best(runs: Sequence[StudyRun]) -> dict[str, Any] | None:
    """The run whose surface is nearest to the readings; None where there are none."""
    compared = [(run.figures["mean_error_mm"], run) for run in runs if run.figures and "mean_error_mm" in run.figures]
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
        "frame": run.frame if run.state == "running" else None,
        "frames": run.frames if run.state == "running" else None,
        "reason": run.reason,
        "folder": f"runs/{run.key[:16]}" if run.state == "done" else None,
    }


def _lines(content: dict[str, Any], runs: Sequence[StudyRun], failed: Sequence[StudyRun]) -> list[str]:
    counts = ", ".join(f"{number} {state}" for state, number in content["states"].items() if number)
    lines = [f"{content['name']}: {len(runs)} runs, {counts}."]
    if content["left_s"] is not None:
        lines.append(f"About {in_words(content['left_s'])} left.")
    for run in runs:
        if run.state == "running" and run.heartbeat_unix_s is not None:
            heard_s = max(0.0, time.time() - run.heartbeat_unix_s)
            far = f"frame {run.frame} of {run.frames}" if run.frames else "preparing"
            gone = "; it is gone: the same command goes on" if _is_gone(run) else ""
            who = f"process {run.pid} on {run.host}, heard {heard_s:.0f} s ago{gone}"
            lines.append(f"running: {_named(run)}: {far}, {who}.")
    if content["best"] is not None:
        best = content["best"]
        lines.append(
            f"Nearest to the readings: run {best['number']} ({_said(best['settings'])}), "
            f"{best['mean_error_mm']:.2f} mm on average."
        )
    lines += [f"failed: {_named(run)}: {run.reason}" for run in failed[:TOLD]]
    if len(failed) > TOLD:
        lines.append(f"failed: and {len(failed) - TOLD} more.")
    return [*lines, f"Folder: {content['folder']}"]


def _is_gone(run: StudyRun) -> bool:
    """Whether it was killed together with the parent that would have noticed; of other machines nobody knows."""
    if run.pid is None or run.host != platform.node():
        return False
    try:
        os.kill(run.pid, 0)
    except ProcessLookupError:
        return True
    except PermissionError:
        pass  # Somebody else's, and alive.
    return False


def _named(run: StudyRun) -> str:
    return f"run {run.number} ({_said(run.settings)})"


def _said(settings: dict[str, Any]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in settings.items())


def _write_table(path: Path, runs: Sequence[StudyRun]) -> None:
    """For spreadsheets."""
    rows = [{name: value for name, value in _row(run).items() if name not in ("frame", "frames")} for run in runs]
    write_sheet(path, list(rows[0]), (list(row.values()) for row in rows))
