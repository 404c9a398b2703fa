"""A run's nozzle path as files for a robot: only where somebody has confirmed it, and only within the cell's limits."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.errors import InputError
from sealtwin.store import files, stage_files
from sealtwin.store.folder import RunFolder, require_folder, stage_key
from sealtwin.store.settings_file import read_settings
from sealtwin.trials.result import shown
from sealtwin.trials.trial import load_trial

if TYPE_CHECKING:
    from digitise.robots.cell import Cell, Format
    from digitise.robots.placed import RobotPath

REPORT = "robot.json"
USES = ("outline.json", "trajectory.csv")
NAMES: "dict[Format, str]" = {
    "txt": "path.txt",
    "csv": "path.csv",
    "spel": "path.prg",
    "gcode": "path.gcode",
    "urscript": "path.script",
}


def write_robot_files(
    folder: RunFolder,
    cell_file: Path,
    formats: Sequence[str],
    out: Path | None,
    *,
    allow_automatic: bool,
) -> dict[str, Any]:
    """Write the path in each of ``formats``, or in those of the cell, into ``out``, or into robot/ of the run.

    "all" among them stands for every format that the cell has tables for.

    All files are made before the first is written: a refusal leaves what was there.

    Returns:
        The content of robot.json, which is written beside them.

    Raises:
        InputError: the run is not digitised, its path was found automatically and nobody has confirmed it, the cell
            file has a fault, or the path is beyond one of its limits.
    """
    began = time.monotonic()
    if folder.settings_of("digitise") is None:
        raise InputError(
            f"{folder.path}: digitise is not finished. Run 'sealtwin run TRIAL --out {folder.path}' first."
        )
    outline, trajectory = stage_files.read_outline(folder.path), stage_files.read_trajectory(folder.path)
    if outline.path_source == "automatic" and not allow_automatic:
        raise InputError(
            f"{folder.path}: the crack was found automatically, and nobody has confirmed it; no robot is sent along "
            "such a path. Look at overlay.png, give its ends in the trial file (ends_px) and digitise again; or, "
            "having looked, give --allow-automatic."
        )
    from digitise.robots.cell import Cell
    from digitise.robots.placed import place_path

    cell = read_settings(
        Cell, cell_file, name="cell file", starter="'sealtwin robot --example cell.toml' writes one to start from"
    )
    kinds = _kinds(cell, cell_file, formats)
    inputs = {name: files.sha256(folder.path / name) for name in USES} | {cell_file.name: files.sha256(cell_file)}
    path = place_path(trajectory, cell, cell_file.name)
    report = _report(folder, path, outline.path_source, inputs)
    path = replace(path, head=_head(report))
    texts = {name: text(path) for name, text in _writers(kinds).items()}
    target = out or folder.path / "robot"
    if out is None:
        kept = folder.clear("robot")
    else:
        kept = []
        _clear_own(target, texts)
    for name, text in texts.items():
        files.write_text(target / name, text)
    report["files"] = {name: files.sha256(target / name) for name in texts}
    files.write_json(target / REPORT, report)
    if out is None:
        settings = {"formats": kinds, "allow_automatic": allow_automatic}
        outputs = [f"robot/{name}" for name in (*texts, REPORT)]
        wall_time_s = time.monotonic() - began
        folder.record(
            "robot", stage_key(inputs, settings), settings, inputs, outputs, wall_time_s, given=[cell_file.name]
        )
    return {**report, "folder": shown(target), "kept": kept}


def headline(report: dict[str, Any]) -> list[str]:
    """The few lines that a person wants at the end."""
    frame = report["frame"]
    return [
        f"Path: {report['length_mm']:.1f} mm in {report['duration_s']:.1f} s, {report['sealant_mm3'] / 1000:.3g} ml; "
        f"the worst of {frame['taught_points']} taught points misses by {frame['worst_residual_mm']:.2f} mm, "
        f"the face is {frame['tilt_deg']:.1f} degrees from level.",
        f"Robot files: {', '.join([*report['files'], REPORT])} in {report['folder']}",
    ]


def _kinds(cell: "Cell", cell_file: Path, asked: Sequence[str]) -> "list[Format]":
    """Those asked for, each once."""
    from digitise.robots.cell import FORMATS

    wanted: list[Format] = []
    for kind in FORMATS:
        table = cell.missing_for(kind)
        if kind in (asked or cell.formats) and table is not None:
            raise InputError(
                f"{cell_file}: no [{table}] table, which --format {kind} needs; 'sealtwin robot --example FILE' shows "
                "one."
            )
        if table is None and (kind in (asked or cell.formats) or "all" in asked):
            wanted.append(kind)
    return wanted


def _report(folder: RunFolder, path: "RobotPath", source: str, inputs: dict[str, str]) -> dict[str, Any]:
    trajectory, frame = path.trajectory, path.frame
    edited = set(folder.edited("digitise")) & set(USES)
    return {
        "version": 1,
        "made_by": f"sealtwin {version('sealtwin')}",
        "trial": load_trial(folder.path / "trial.toml").name,
        "run": folder.path.resolve().name,
        "cell": path.cell.name,
        "path_source": source,
        "confirmed": source != "automatic",
        "inputs": inputs,
        "edited_by_hand": sorted(edited),
        "units": "mm, s, degrees; URScript m and rad",
        "length_mm": trajectory.length_mm,
        "duration_s": trajectory.duration_s,
        "waypoints": len(trajectory.t_s),
        "largest_speed_mm_s": float(trajectory.speed_mm_s.max()),
        "sealant_mm3": float(trajectory.given_mm3.sum()),
        "frame": {
            "taught_points": len(frame.taught_mm),
            "worst_residual_mm": float(frame.residual_mm.max()),
            "limit_mm": path.cell.frame_limit_mm,
            "scale_of_the_points": frame.scale,
            "tilt_deg": path.tilt_deg,
            "rotation": frame.rotation.tolist(),
            "origin_mm": frame.origin_mm.tolist(),
        },
        "warnings": list(path.warnings),
    }


def _head(report: dict[str, Any]) -> tuple[str, ...]:
    """What whoever opens a program must be able to tell without any other file."""
    frame = report["frame"]
    confirmed = "" if report["confirmed"] else " - NOT CONFIRMED BY ANYBODY"
    edited = report["edited_by_hand"]
    return (
        f"{report['made_by']}: nozzle path, cell {report['cell']}",
        f"trial {report['trial']}, run {report['run']}",
        f"path found by: {report['path_source']}{confirmed}",
        *([f"edited by hand since: {', '.join(edited)}"] if edited else []),
        *(f"{name} sha256 {digest}" for name, digest in report["inputs"].items()),
        f"{report['length_mm']:.2f} mm in {report['duration_s']:.2f} s, {report['sealant_mm3']:.1f} mm3, "
        f"{report['waypoints']} waypoints, at most {report['largest_speed_mm_s']:.3f} mm/s",
        f"frame: {frame['taught_points']} taught points, worst residual {frame['worst_residual_mm']:.3f} mm, scale "
        f"{frame['scale_of_the_points']:.5f}, face {frame['tilt_deg']:.2f} degrees from level",
    )


def _clear_own(target: Path, texts: dict[str, str]) -> None:
    """Remove what an earlier call left in a folder of the user's: its report says what that was.

    Raises InputError where a file lies there that was not written so, and would be replaced.
    """
    require_folder(target)
    written: dict[str, str] = {}
    if (target / REPORT).is_file():
        with files.understood(target / REPORT):
            listed = files.read_json(target / REPORT)["files"]
            written = {name: listed[name] for name in NAMES.values() if name in listed}
    for name in (*texts, *written):
        path = target / name
        if path.is_file() and written.get(name) != files.sha256(path):
            raise InputError(f"{path}: is not as sealtwin robot wrote it, and is not replaced; give another --out.")
    for name in written:
        (target / name).unlink(missing_ok=True)


def _writers(kinds: "Sequence[Format]") -> "dict[str, Callable[[RobotPath], str]]":
    from digitise.robots.gcode import gcode_text
    from digitise.robots.spel import spel_text
    from digitise.robots.tables import points_text, table_text
    from digitise.robots.urscript import urscript_text

    writers: dict[Format, Callable[[RobotPath], str]] = {
        "txt": points_text,
        "csv": table_text,
        "spel": spel_text,
        "gcode": gcode_text,
        "urscript": urscript_text,
    }
    return {NAMES[kind]: writers[kind] for kind in kinds}
