"""Finished run folders side by side."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sealtwin.errors import InputError
from sealtwin.progress import Progress
from sealtwin.records import Outline, Profile
from sealtwin.store import files, stage_files
from sealtwin.store.folder import look_into
from sealtwin.store.result_files import Judged, understood_as
from sealtwin.trials.job import STAGES, Job, resume_job, stage_settings
from sealtwin.trials.made import DIGITISED, SIMULATED, made_by
from sealtwin.trials.result import shown
from sealtwin.trials.trial import Trial
from validate.settings import Role
from validate.studies.compare_sheet import compare_sheet
from validate.studies.sheet import write_sheet_of_figures
from validate.studies.side_by_side import Side, differing, first_with_readings, replicate_words
from validate.studies.side_curves import MOST

PAGE, CONTENT = "compare.html", "compare.json"
NOT_SETTINGS = ("name", "note", "output")
"""Of a trial: what changes no result."""
OF_A_COMPARISON = ("readings", "uncertainty")
"""Tables of a trial that comparison.json hangs on, and no other result does."""


@dataclass(frozen=True)
class Compared:
    """What the command says at its end."""

    content: dict[str, Any]
    lines: list[str]


class Held(Judged):
    """comparison.json: the numbers of it that stand on the page."""

    bias_mm: float
    rmse_mm: float
    share_under_1_mm: float
    frechet_mm: float
    flat_level_error_mm: float
    beats_flat_level: bool
    volume_balance_error_mm: float | None = None
    beats_volume_balance: bool | None = None
    simulated_fill_ratio: float | None = None
    role: Role
    uncertainty: dict[str, Any] | None = None


def compare_runs(folders: Sequence[Path], out: Path) -> Compared:
    """Write compare.html, compare.json and figures/ into ``out``.

    Raises InputError where a folder is no finished run, holds results of other settings or other files than it holds
    now, or is named twice, or there are too many.
    """
    if len(folders) > MOST:
        raise InputError(f"{len(folders)} runs: at most {MOST} can be told apart; 'sealtwin map' shows a study.")
    twice = [str(folder) for folder, times in Counter(folder.resolve() for folder in folders).items() if times > 1]
    if twice:
        raise InputError(f"{twice[0]}: named twice; a run compared with itself differs in nothing.")
    jobs = [_finished(folder) for folder in folders]
    names = Counter(job.trial.name for job in jobs)
    sides = [
        _side(job, job.trial.name if names[job.trial.name] == 1 else f"{job.trial.name} ({shown(job.path)})")
        for job in jobs
    ]
    sheet = compare_sheet(sides)
    written = write_sheet_of_figures(out, PAGE, sheet)
    content = {
        "version": 1,
        "page": shown(out / PAGE),
        "runs": [
            {
                "number": number,
                "name": side.name,
                "folder": shown(folder),
                "mean_error_mm": side.metrics.get("mean_error_mm"),
                "role": side.metrics.get("role"),
                "readings_of_run": None if first is None else first + 1,
                "edited": side.edited,
                "facts": dict(side.facts),
            }
            for number, (folder, side, first) in enumerate(
                zip(folders, sides, first_with_readings(sides), strict=True), start=1
            )
        ],
        "differing": differing(sides),
        "replicates": replicate_words(sides),
        "files": [CONTENT, *written],
    }
    files.write_json(out / CONTENT, content)
    lines = [f"{number}: {side.name}" for number, side in enumerate(sides, start=1)]
    lines += [f"{name}: {', '.join(str(value) for value in values)}" for name, values in content["differing"].items()]
    return Compared(content, [*sheet.cautions, sheet.finding, *lines, f"Page: {shown(out / PAGE)}"])


def _finished(folder: Path) -> Job:
    """Its stages checked against its manifest, as 'sealtwin validate' does."""
    job = resume_job(look_into(folder), "cpu", Progress())
    made_by(job, "digitise", DIGITISED)
    made_by(job, "simulate", SIMULATED)
    if job.trial.readings is not None:
        _require_current_comparison(job)
    return job


def _require_current_comparison(job: Job) -> None:
    again = f"'sealtwin validate {job.path}' does that"
    made_with = job.folder.settings_of("validate")
    if made_with is None or not (job.path / "comparison.json").is_file():
        raise InputError(f"{job.path}: not held against its readings yet. {again}.")
    wanted = stage_settings(job.trial, "validate")
    # A setting that another version did not know is not set here either.
    changed = [
        f"[{table}]" for table in OF_A_COMPARISON if _flat(made_with.get(table) or {}) != _flat(wanted[table] or {})
    ]
    if changed := [*changed, *job.folder.changed_since("validate")]:
        raise InputError(f"{job.path}: {changed[0]} is not what was held against the readings. {again} again.")


def _side(job: Job, name: str) -> Side:
    outline = stage_files.read_outline(job.path)
    readings = _readings(job, outline)
    simulation = stage_files.read_simulation(job.path)
    with files.understood(job.path / "simulation.json"):
        volume_ratio = simulation.volume_ratio
    return Side(
        name=name,
        settings=_flat(job.trial.model_dump(mode="json", exclude=set(NOT_SETTINGS))),
        profile=stage_files.read_profile(job.path),
        readings=readings,
        metrics={} if readings is None else _metrics(job.path),
        facts=_facts(job.path),
        replicate_of=_replicate_of(job.trial),
        volume_ratio=volume_ratio,
        escaped_particles=simulation.escaped_particles,
        edited=[file for stage in STAGES for file in job.folder.edited(stage)],
    )


def _readings(job: Job, outline: Outline) -> Profile | None:
    if job.trial.readings is None or job.sheet is None:
        return None
    from validate.caliper import read_readings

    return read_readings(job.sheet, job.trial.readings, outline.length_mm, stage_files.read_solid(job.path).depth_mm)


def _metrics(folder: Path) -> dict[str, Any]:
    metrics = stage_files.read_comparison(folder)
    with files.understood(folder / "comparison.json"):
        understood_as(Held, metrics)
    return metrics


def _facts(folder: Path) -> dict[str, float | None]:
    run = stage_files.read_run(folder)
    with files.understood(folder / "simulation.json"):
        return {
            "particles": len(run.position_mm),
            "particle radius (mm)": run.radius_mm,
            "spilled particles": int(run.spilled.sum()),
            "escaped particles (must be 0)": run.escaped_particles,
            "volume kept": run.health["volume_ratio"],
            "frames": run.health["frames"],
            "time of the frames (s)": run.health["frames_s"],
        }


def _flat(content: dict[str, Any], before: str = "") -> dict[str, Any]:
    """By dotted name; what is not set is left out."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{before}{key}.")
        elif value is not None:
            flat[f"{before}{key}"] = value
    return flat


def _replicate_of(trial: Trial) -> str:
    """Crack as it was ordered, path, paste, solver: not the photo, since each replicate has a sample of its own."""
    digitised = stage_settings(trial, "digitise")
    ordered = {name: digitised[name] for name in ("crack", "path")}
    role = None if trial.readings is None else trial.readings.role
    return json.dumps([ordered, stage_settings(trial, "simulate"), role], sort_keys=True)
