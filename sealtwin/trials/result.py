"""What a command says at its end: one object for programs, a few lines for people."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sealtwin.store import files, stage_files
from sealtwin.store.folder import RunFolder
from sealtwin.trials.trial import Trial


def read_result(folder: RunFolder, trial: Trial) -> dict[str, Any]:
    """The --json object of what the folder holds now; written to run.json where it differs."""
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
        outline, solid = stage_files.read_outline(folder.path), files.read_json(folder.path / "solid.json")
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
        simulation = stage_files.read_simulation(folder.path)
        result |= {
            "particles": simulation.particles,
            "escaped_particles": simulation.escaped_particles,
            "spilled_particles": simulation.spilled_particles,
            "volume_ratio": round(simulation.volume_ratio, 4),
            "device": simulation.device,
        }
    if "validate" in stages:
        result["report"] = shown(folder.path / "report.html")
        if trial.readings is not None:
            result |= _compared(stage_files.read_comparison(folder.path))
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
    """Relative where it lies below the current folder, so that no home folder is named; else as it was given."""
    below = path.absolute().is_relative_to(Path.cwd())
    return Path(os.path.relpath(path)).as_posix() if below else path.as_posix()


def headline(result: dict[str, Any], last: str) -> list[str]:
    """The few lines that a person wants at the end of a command whose last stage was ``last``."""
    lines = []
    if "length_mm" in result:
        lines.append(
            f"Crack: {result['length_mm']:.1f} mm long, {result['mean_width_mm']:.2f} mm wide "
            f"(path: {result['path_source']}); "
            f"cavity {result['cavity_volume_mm3'] / 1e3:.2f} ml, sealant {result['sealant_mm3'] / 1e3:.2f} ml."
        )
        lines.append(_scale(result))
    if "particles" in result and last != "digitise":
        lines.append(
            f"Fluid: {result['particles']} particles, {result['escaped_particles']} escaped, "
            f"{result['spilled_particles']} spilled; volume ratio {result['volume_ratio']:.3f}; {result['device']}."
        )
    if "mean_error_mm" in result and last == "validate":
        low_mm, high_mm = result["mean_error_95_mm"]
        lines += [
            f"Error: {result['mean_error_mm']:.2f} mm on average ({low_mm:.2f} to {high_mm:.2f} mm, 95 % by the "
            f"readings), {result['worst_error_mm']:.2f} mm at worst (at {result['worst_at_mm']:.1f} mm).",
            *_examined(result),
            result["verdict"],
            *result["findings"],
        ]
    elif result["edited"] and last == "validate":
        lines.append(f"Edited by hand since: {', '.join(result['edited'])}.")
    if "report" in result and last == "validate":
        lines.append(f"Report: {result['report']}")
    else:
        lines.append(f"Folder: {result['folder']}")
    return lines


def _examined(result: dict[str, Any]) -> list[str]:
    """What the extra runs of --uncertainty say; nothing where there were none."""
    if (sizes := result["particle_sizes"]) is None:
        return []
    errors = ", ".join(f"{error_mm:.2f}" for error_mm in sizes["mean_error_mm"])
    radii = ", ".join(f"{radius_mm:.3g}" for radius_mm in sizes["radii_mm"])
    lines = [
        f"Particle size: mean error {errors} mm at radii of {radii} mm, {sizes['kind']}: "
        f"± {sizes['band_95_mm']:.2f} mm (95 %)."
    ]
    if result["inputs_mm"]:
        from validate.statements.uncertainty import INPUTS

        effects = ", ".join(f"{INPUTS[name][0]} {effect:+.2f} mm" for name, effect in result["inputs_mm"].items())
        lines.append(f"Inputs, each a standard uncertainty up, and what they do to the mean level: {effects}.")
    return lines


def _scale(result: dict[str, Any]) -> str:
    """Where it comes from; and what was measured of it, where it was not given as a number."""
    facts = [result["scale_source"]]
    if result["scale_uncertainty"] is not None:
        facts += [f"{result['mm_per_px']:.4g} mm/px", f"uncertain by {100 * result['scale_uncertainty']:.2g} %"]
    if result["scale_residual_mm"] is not None:
        facts.append(f"residual {result['scale_residual_mm']:.3f} mm")
    if result["camera_tilt_deg"] is not None:
        facts.append(f"camera tilted {result['camera_tilt_deg']:.1f} degrees")
    return f"Scale: {', '.join(facts)}."
