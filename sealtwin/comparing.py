"""Finished run folders side by side."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sealtwin import files
from sealtwin.errors import InputError
from sealtwin.folder import MANIFEST
from sealtwin.job import stage_settings
from sealtwin.result import shown
from sealtwin.trial import Trial, load_trial
from validate.studies.sheet import write_sheet_of_figures
from validate.studies.side_by_side import Side, differing, replicate_words, side_by_side

PAGE, CONTENT = "compare.html", "compare.json"
NOT_SETTINGS = ("name", "note", "output")
"""Of a trial: what changes no result."""
MOST = 28
"""Runs on a page: every stroke in every colour."""


@dataclass(frozen=True)
class Compared:
    """What the command says at its end."""

    content: dict[str, Any]
    lines: list[str]


def compare_runs(folders: Sequence[Path], out: Path) -> Compared:
    """Write compare.html, compare.json and figures/ into ``out``.

    Raises InputError where a folder is no finished run, or is named twice, or there are too many.
    """
    if len(folders) > MOST:
        raise InputError(f"{len(folders)} runs: at most {MOST} can be told apart; 'sealtwin map' shows a study.")
    twice = [str(folder) for folder, times in Counter(folder.resolve() for folder in folders).items() if times > 1]
    if twice:
        raise InputError(f"{twice[0]}: named twice; a run compared with itself differs in nothing.")
    trials = [_trial(folder) for folder in folders]
    names = Counter(trial.name for trial in trials)
    sides = [
        _side(folder, trial, trial.name if names[trial.name] == 1 else f"{trial.name} ({shown(folder)})")
        for folder, trial in zip(folders, trials, strict=True)
    ]
    sheet = side_by_side(sides)
    written = write_sheet_of_figures(out, PAGE, sheet)
    content = {
        "version": 1,
        "page": shown(out / PAGE),
        "runs": [
            {
                "name": side.name,
                "folder": shown(folder),
                "mean_error_mm": side.metrics.get("mean_error_mm"),
                "role": side.metrics.get("role"),
                "facts": dict(side.facts),
            }
            for folder, side in zip(folders, sides, strict=True)
        ],
        "differing": differing(sides),
        "replicates": replicate_words(sides),
        "files": [CONTENT, *written],
    }
    files.write_json(out / CONTENT, content)
    lines = [f"{name}: {', '.join(str(value) for value in values)}" for name, values in content["differing"].items()]
    return Compared(content, [sheet.finding, *lines, f"Page: {shown(out / PAGE)}"])


def _trial(folder: Path) -> Trial:
    if not (folder / MANIFEST).is_file():
        raise InputError(f"{folder}: no run folder (it has no {MANIFEST}). 'sealtwin run TRIAL' makes one.")
    if not (folder / "profile.csv").is_file():
        raise InputError(f"{folder}: not simulated yet. 'sealtwin simulate {folder}' goes on.")
    return load_trial(folder / "trial.toml")


def _side(folder: Path, trial: Trial, name: str) -> Side:
    readings, sheet, metrics = None, "", {}
    if trial.readings is not None:
        from validate.caliper import read_readings

        if not (folder / "comparison.json").is_file():
            raise InputError(f"{folder}: not held against its readings yet. 'sealtwin validate {folder}' does that.")
        outline, solid = files.read_outline(folder), files.read_solid(folder)
        readings = read_readings(folder / trial.readings.file, trial.readings, outline.length_mm, solid.depth_mm)
        sheet = files.sha256(folder / trial.readings.file)
        metrics = files.read_json(folder / "comparison.json")
    simulation = files.read_json(folder / "simulation.json")
    with files.understood(folder / "simulation.json"):
        facts = {
            "particles": simulation["particles"],
            "particle radius (mm)": simulation["radius_mm"],
            "spilled particles": simulation["spilled_particles"],
            "escaped particles (must be 0)": simulation["escaped_particles"],
            "volume kept": simulation["health"]["volume_ratio"],
            "frames": simulation["health"]["frames"],
            "time of the frames (s)": simulation["health"]["frames_s"],
        }
    return Side(
        name=name,
        settings=_flat(trial.model_dump(mode="json", exclude=set(NOT_SETTINGS))),
        profile=files.read_profile(folder),
        readings=readings,
        sheet=sheet,
        metrics=metrics,
        facts=facts,
        replicate_of=_replicate_of(trial),
    )


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
