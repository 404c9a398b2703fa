"""Content of run.json: what a run folder holds now."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sealtwin.core import files, record_files
from sealtwin.core.run_folder import RunFolder
from sealtwin.trial.trial_file import Trial


def read_result(folder: RunFolder, trial: Trial) -> dict[str, Any]:
    """Return what the folder holds now, and write it to run.json if that differs."""
    stages = folder.finished()
    result: dict[str, Any] = {
        "version": 1,
        "name": trial.name,
        "folder": shown(folder.path),
        "wall_time_s": round(folder.wall_time_s(), 1),
        "stages": stages,
        "edited": [name for stage in stages for name in folder.edited(stage)],
    }
    with files.understood(folder.path):
        result |= _findings(folder, trial, stages)
    target = folder.path / "run.json"
    if not target.is_file() or files.read_json(target) != result:
        files.write_json(target, result)
    return result


def _findings(folder: RunFolder, trial: Trial, stages: Sequence[str]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    if "digitise" in stages:
        outline, solid = record_files.read_outline(folder.path), files.read_json(folder.path / "solid.json")
        result |= {
            "length_mm": round(outline.length_mm, 3),
            "mean_width_mm": round(outline.mean_width_mm, 3),
            "cavity_volume_mm3": round(solid["cavity_volume_mm3"], 1),
            "sealant_mm3": round(solid["sealant_mm3"], 1),
            "path_source": outline.path_source,
            "scale_source": outline.scale_source,
            "mm_per_px": None if outline.seen_in == "mesh" else round(outline.mm_per_px, 6),
            "scale_uncertainty": outline.scale_uncertainty,
            "scale_residual_mm": outline.scale_residual_mm,
            "camera_tilt_deg": outline.camera_tilt_deg,
            "warnings": [*outline.warnings, *solid["warnings"]],
        }
    if "simulate" in stages:
        simulation = record_files.read_simulation(folder.path)
        result |= {
            "particles": simulation.particles,
            "escaped_particles": simulation.escaped_particles,
            "spilled_particles": simulation.spilled_particles,
            "volume_ratio": round(simulation.volume_ratio, 4),
            "device": simulation.device,
        }
    if "validate" in stages:
        result["report"] = shown(folder.path / "report.html")
        result["readings_role"] = None if trial.readings is None else trial.readings.role
        if trial.readings is not None:
            result |= _compared(record_files.read_comparison(folder.path))
    return result


def _compared(comparison: dict[str, Any]) -> dict[str, Any]:
    found = comparison["uncertainty"]
    mean, numerics = found["mean_level"], found["numerics"]
    return {
        "mean_error_mm": round(comparison["mean_error_mm"], 4),
        "mean_error_95_mm": [round(end, 4) for end in found["mean_error_mm"]],
        "worst_error_mm": round(comparison["worst_error_mm"], 4),
        "worst_at_mm": round(comparison["worst_at_mm"], 2),
        "gate_passed": comparison["passed"],
        "outcome": comparison["outcome"],
        "verdict": comparison["verdict"],
        "mean_level": {
            key: round(value, 4) if isinstance(value, float) else value
            for key, value in mean.items()
            if key in ("error_mm", "data_mm", "numerics_mm", "inputs_mm", "validation_mm", "resolved")
        },
        "particle_sizes": None if numerics is None else {
            "radii_mm": [round(radius_mm, 4) for radius_mm in numerics["radii_mm"]],
            "mean_error_mm": [round(error_mm, 4) for error_mm in numerics["mean_error_mm"]["values"]],
            "kind": numerics["mean_error_mm"]["kind"],
            "band_95_mm": round(numerics["mean_error_mm"]["band"], 4),
        },
        "inputs_mm": {one["name"]: round(one["mean_level_mm"], 4) for one in found["inputs"]},
        "findings": comparison["findings"],
    }  # fmt: skip


def shown(path: Path) -> str:
    """Return a path below the current folder as relative, so that no home folder is named, and others as given."""
    try:
        below = path.absolute().is_relative_to(Path.cwd())
    except FileNotFoundError:
        below = False  # The current folder was deleted.
    return Path(os.path.relpath(path)).as_posix() if below else path.as_posix()
