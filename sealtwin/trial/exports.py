"""Write files for other programs and machines: robot programs, masks, and drawings for CAD.

A robot program is written only for a path within the limits of the cell.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, get_args

from digitise.robots.cell import LANGUAGES, ProgramOptions, PumpTable, RobotCell, read_pump
from digitise.robots.robot_path import RobotPath, place_path
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Trajectory
from sealtwin.core.run_folder import RunFolder, look_into, require_folder, stage_key
from sealtwin.core.settings import checked, read_settings
from sealtwin.trial.job import display_path, other_versions, require_digitised
from sealtwin.trial.trial_file import load_trial

ExportKind = Literal["mask", "dxf"]
KINDS: tuple[ExportKind, ...] = get_args(ExportKind)
REPORT = "robot.json"
USES = ("outline.json", "trajectory.csv")


def export_run(folder: Path, kinds: Sequence[ExportKind], out: Path) -> list[Path]:
    """Write files of the given ``kinds`` to ``out``, with the name of the photo, mesh or drawing.

    Returns the written files. Raises InputError, before it writes any file, if the run is not digitised or cannot be
    written in a format, or if a file with the same name and different content exists.
    """
    from digitise.exports import dxf_text, mask_png

    require_folder(out)
    require_digitised(look_into(folder))
    file, outline = load_trial(folder / "trial.toml").shown_by.file, record_files.read_outline(folder)
    contents: dict[Path, bytes] = {}
    if "mask" in kinds:
        contents[out / f"{file.stem}_mask.png"] = mask_png(outline, file.name)
    if "dxf" in kinds:
        contents[out / f"{file.stem}.dxf"] = dxf_text(outline, record_files.read_trajectory(folder)).encode()
    files.write_unless_other(contents)
    return list(contents)


@dataclass(frozen=True)
class CellFile:
    """Content of a robot's cell file, with the table of its pump."""

    settings: RobotCell
    name: str  # Name of the cell file, for messages
    pump: PumpTable | None
    inputs: Mapping[str, str]  # Hashes of the cell file and the pump's file, by file name

    @classmethod
    def read(cls, source: Path | Mapping[str, Any]) -> "CellFile":
        """Read a cell file, or take its content from a mapping.

        For a mapping, the path of the pump's file is relative to the current folder. Raises the same errors as
        ``read_settings``, and InputError if the weighings of the pump cannot be used.
        """
        if isinstance(source, Path):
            starter = "'sealtwin robot --example cell.toml' writes an example"
            settings = read_settings(RobotCell, source, name="cell file", starter=starter)
            name, folder, paths = source.name, source.parent, [source]
        else:
            settings, name, folder, paths = checked(RobotCell, Path("cell"), source), "cell", Path(), []
        paths += [] if settings.pump is None else [folder / settings.pump.file]
        pump = None if settings.pump is None else read_pump(settings.pump, folder)
        return cls(settings, name, pump, {path.name: files.sha256(path) for path in paths})


def write_robot_files(folder: RunFolder, cell_file: Path, options: ProgramOptions, out: Path | None) -> dict[str, Any]:
    """Write the path of a run in each format to ``out`` (default: robot/ in the run folder).

    All files are computed before the first one is written. Returns the content of robot.json, with the folder, the
    names of edited files that were renamed, and a sentence if a version with other stage numbers computed the path.

    Raises InputError if the run is not digitised, if the cell file is not valid, or if the path exceeds a limit of the
    cell.
    """
    began = time.monotonic()
    require_digitised(folder)
    outline = record_files.read_outline(folder.path)
    trajectory = replace(record_files.read_trajectory(folder.path), has_origin=outline.has_origin)
    cell = CellFile.read(cell_file)
    origin = origin_of(folder.path, load_trial(folder.path / "trial.toml").name, outline, USES)
    origin["edited_by_hand"] = sorted(set(folder.edited("digitise")) & set(USES))
    target = out or folder.path / "robot"
    report, renamed = write_programs(target, trajectory, cell, options, origin, folder if out is None else None)
    if out is None:
        settings = {"formats": kinds_of(cell, options)}
        inputs = report["inputs"]
        outputs = [f"robot/{name}" for name in (*report["files"], REPORT)]
        wall_time_s, numbers = time.monotonic() - began, folder.numbers_of("digitise")
        facts = {"numbers": numbers, "from_user": [*cell.inputs]}
        folder.record("robot", stage_key(inputs, settings, numbers), settings, inputs, outputs, wall_time_s, **facts)
    others = other_versions(folder, stage="digitise")
    return {**report, "folder": display_path(target), "kept": renamed, "other_versions": others}


def origin_of(folder: Path, trial: str, outline: Outline, names: Sequence[str]) -> dict[str, Any]:
    """Return the origin of a path for the header of a program. ``names`` are the files in ``folder`` with the path."""
    return {
        "trial": trial,
        "run": folder.resolve().name,
        "path_source": outline.path_source,
        "inputs": files.hashes(folder, names),
        "edited_by_hand": [],
    }


def write_programs(
    target: Path,
    trajectory: Trajectory,
    cell: CellFile,
    options: ProgramOptions,
    origin: Mapping[str, Any],
    run: RunFolder | None = None,
) -> tuple[dict[str, Any], list[str]]:
    """Write the programs of a path and robot.json. Returns the content of robot.json and new names of edited files.

    ``origin`` is the result of ``origin_of``. ``run`` is the run folder, if ``target`` is in a run folder. Without
    ``run``, raises InputError if ``target`` contains files that sealtwin did not write.
    """
    kinds = kinds_of(cell, options)
    path = place_path(trajectory, cell.settings, cell.name, cell.pump)
    report = _report(path, {**origin, "inputs": {**origin["inputs"], **cell.inputs}})
    if cell.pump is not None:
        report["pump"] = _pump(path, trajectory, cell.pump)
    path = replace(path, head=_head(report))
    texts = {LANGUAGES[kind].file: LANGUAGES[kind].text(path) for kind in kinds}
    renamed = _clear_own(target, texts) if run is None else run.clear("robot")
    for name, text in texts.items():
        files.write_text(target / name, text)
    report["files"] = files.hashes(target, texts)
    files.write_json(target / REPORT, report)
    return report, renamed


def kinds_of(cell: CellFile, options: ProgramOptions) -> list[str]:
    """Return the formats to write. Raises InputError if the cell has no table for a requested format."""
    formats = options.formats or cell.settings.formats
    missing = {kind: cell.settings.missing_for(kind) for kind in LANGUAGES}
    for kind, table in missing.items():
        if kind in formats and table is not None:
            raise InputError(
                f"{cell.name}: the format {kind} requires a table [{table}]; 'sealtwin robot --example FILE' shows it."
            )
    return [kind for kind, table in missing.items() if table is None and kind in formats]


def _report(path: RobotPath, origin: Mapping[str, Any]) -> dict[str, Any]:
    trajectory, frame = path.trajectory, path.frame
    return {
        "version": 1,
        "made_by": f"sealtwin {version('sealtwin')}",
        **origin,
        "cell": path.cell.name,
        "units": "; ".join(
            [
                "mm, s, degrees",
                *(f"{language.title} {language.units}" for language in LANGUAGES.values() if language.units),
            ]
        ),
        "length_mm": trajectory.length_mm,
        "duration_s": trajectory.duration_s,
        "waypoints": len(trajectory.t_s),
        "largest_speed_mm_s": float(trajectory.speed_mm_s.max()),
        "sealant_mm3": path.wanted_mm3,
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


def _pump(path: RobotPath, wanted: Trajectory, pump: PumpTable) -> dict[str, Any]:
    """Return the flows that the programs request from a pump, and the uncertainty of the pump's flow."""
    flows = wanted.flow_mm3_s[wanted.flow_mm3_s > 0]
    requested = path.trajectory.flow_mm3_s[path.trajectory.flow_mm3_s > 0]
    return {
        "weighed_mm3_s": list(pump.range_mm3_s),
        "wanted_mm3_s": [float(flows.min()), float(flows.max())],
        "asked_mm3_s": [float(requested.min()), float(requested.max())],
        "interval_95_percent": None if pump.error_95 is None else 100 * pump.error_95,
        "waits_s": path.hold_s,
    }


def _head(report: dict[str, Any]) -> tuple[str, ...]:
    """Return the header lines of each program, which identify the program without another file."""
    frame = report["frame"]
    edited = report["edited_by_hand"]
    return (
        f"{report['made_by']}: nozzle path, cell {report['cell']}",
        f"trial {report['trial']}, run {report['run']}",
        f"path found by: {report['path_source']}",
        *([f"edited by hand after they were written: {', '.join(edited)}"] if edited else []),
        *(f"{name} sha256 {digest}" for name, digest in report["inputs"].items()),
        f"{report['length_mm']:.2f} mm in {report['duration_s']:.2f} s, {report['sealant_mm3']:.1f} mm3, "
        f"{report['waypoints']} waypoints, at most {report['largest_speed_mm_s']:.3f} mm/s",
        f"frame: {frame['taught_points']} taught points, worst residual {frame['worst_residual_mm']:.3f} mm, scale "
        f"{frame['scale_of_the_points']:.5f}, face {frame['tilt_deg']:.2f} degrees from level",
    )


def _clear_own(target: Path, texts: dict[str, str]) -> list[str]:
    """Delete the files of an earlier call, which robot.json lists, in a folder outside the run folder.

    Returns an empty list. Raises InputError if a file that sealtwin did not write would be replaced.
    """
    require_folder(target)
    written: dict[str, str] = {}
    if (target / REPORT).is_file():
        with files.reading_stage_file(target / REPORT):
            names = files.read_json(target / REPORT)["files"]
            written = {language.file: names[language.file] for language in LANGUAGES.values() if language.file in names}
    for name in (*texts, *written):
        path = target / name
        if path.is_file() and written.get(name) != files.sha256(path):
            raise InputError(
                f"{path}: 'sealtwin robot' did not write this file, or it was changed. It is not replaced; give "
                "another --out."
            )
    for name in written:
        (target / name).unlink(missing_ok=True)
    return []
