"""The only reader and writer of run folders: every file of one appears whole or not at all."""

import csv
import hashlib
import io
import json
import os
import re
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.errors import InputError, naming
from sealtwin.records import (
    Comparison,
    FaceLabel,
    Floats,
    Integers,
    Outline,
    Pixels,
    Profile,
    Run,
    Sections,
    Solid,
    Trajectory,
)
from sealtwin.store.result_files import Judged, Simulation, understood_as

TRAJECTORY_COLUMNS = ("t_s", "x_mm", "y_mm", "z_mm", "s_mm", "speed_mm_s", "flow_mm3_s")
PARTICLE_COLUMNS = ("x_mm", "y_mm", "z_mm", "vx_mm_s", "vy_mm_s", "vz_mm_s", "age_s", "spilled")
PROFILE_COLUMNS = ("s_mm", "level_mm")
NUMBERS = re.compile(r"\[\s+[-+\d.eE]+(?:,\s+[-+\d.eE]+)*\s+\]")
POLYLINES = ("centreline", "left_wall", "right_wall", "outline")
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""What makes a spreadsheet run a cell; the last four are the full width ones, which some take for the same."""
LARGEST_BYTES = 200_000_000
"""Of a table or a JSON: two million particles. What is larger is none of ours, and would take the machine's memory."""
HIGHEST_MM = 1e3
"""Of a level, above the face or below it: the deepest crack that is taken has half of that."""
FARTHEST = 1e7
"""Of any other number of a table, in mm, mm/s or s. A particle that falls for a minute is there; beyond it the single
precision in which a run is computed knows no millimetre."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside ``path`` that takes its place when the block ends without an error.

    The suffix is kept, since writers choose their format by it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    with naming(path):
        try:
            yield temporary
            with temporary.open("rb+") as written:
                os.fsync(written.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(path: Path, content: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def write_if_new(path: Path, content: bytes) -> None:
    """Leave a file alone that already holds ``content``."""
    if not path.is_file() or path.read_bytes() != content:
        write_bytes(path, content)


def refuse_other(path: Path, content: bytes) -> None:
    """Raises InputError where something else than ``content`` lies at ``path``, which would be lost."""
    if path.exists() and path.read_bytes() != content:
        raise InputError(f"{path}: is there already and is not overwritten; give another name, or move it away.")


def write_png(path: Path, picture: Pixels) -> None:
    import cv2

    encoded, png = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    if not encoded:
        raise RuntimeError("OpenCV could not encode a picture")
    write_bytes(path, png.tobytes())


def write_json(path: Path, content: Any) -> None:
    write_text(path, as_json(content))


def as_json(content: Any) -> str:
    """JSON that any reader accepts: NaN and infinity, which JSON does not have, become null.

    Indented for people, but a list of numbers stays on its line.
    """
    text = json.dumps(_plain(content), indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    return NUMBERS.sub(lambda found: " ".join(found.group().split()).replace("[ ", "[").replace(" ]", "]"), text)


def read_json(path: Path) -> Any:
    """Raises InputError, naming the file, where it is missing or no JSON."""
    try:
        return json.loads(_read_text(path))
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path}: no readable JSON ({fault}). Delete it and run its stage again.") from fault


@contextmanager
def understood(path: Path) -> Iterator[None]:
    """A file of our own that somebody edited may lack anything: name it, and the way back."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as fault:
        reason = f"{type(fault).__name__}: {fault}"
        raise InputError(f"{path}: not as its stage wrote it ({reason}). Run that stage again.") from fault


def sha256(path: Path) -> str:
    with naming(path), path.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


def write_table(path: Path, columns: Sequence[str], rows: Floats, decimals: int = 6) -> None:
    """A CSV of numbers, one header line with units in the names; NaN as an empty field."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow(["" if np.isnan(value) else f"{value:.{decimals}f}" for value in row])
    write_text(path, table.getvalue())


def write_sheet(path: Path, columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> None:
    write_text(path, sheet_text(columns, rows))


def sheet_text(columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> str:
    """A CSV of text and numbers for spreadsheets, in which no text can pass for a formula; None as an empty field."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return table.getvalue()


def as_text_cell(text: str) -> str:
    """What a spreadsheet shows as ``text`` and does not run."""
    return f"'{text}" if text.startswith(FORMULA) else text


def read_table(path: Path, columns: Sequence[str]) -> Floats:
    """Rows of a CSV that ``write_table`` wrote, (n, len(columns)). Raises InputError, naming file and line."""
    return read_rows(path, _read_text(path), columns)


def read_rows(path: Path, text: str, columns: Sequence[str], delimiter: str = ",") -> Floats:
    """``read_table`` of ``text``, whatever file it comes from."""
    reader = csv.DictReader(io.StringIO(text), delimiter=delimiter)
    # Eight bytes a number; lists of lists take ten times that.
    numbers, line = array("d"), 1
    try:
        if missing := set(columns) - set(reader.fieldnames or ()):
            raise InputError(f"{path}, line 1: no column {', '.join(sorted(missing))}; expected {','.join(columns)}.")
        for line, row in enumerate(reader, start=2):
            try:
                numbers.extend([np.nan if row[name] == "" else float(row[name]) for name in columns])
            except (TypeError, ValueError):
                found = str([row[name] for name in columns])
                raise InputError(f"{path}, line {line}: expected {len(columns)} numbers, found {found:.80}.") from None
    except csv.Error as fault:
        raise InputError(f"{path}, after line {line}: no readable CSV ({fault}).") from None
    return np.array(numbers, dtype=float).reshape(-1, len(columns))


def write_outline(folder: Path, outline: Outline) -> None:
    content: dict[str, Any] = {
        "length_mm": outline.length_mm,
        "mean_width_mm": outline.mean_width_mm,
        "mm_per_px": outline.mm_per_px,
        "scale_source": outline.scale_source,
        "scale_residual_mm": outline.scale_residual_mm,
        "path_source": outline.path_source,
        "ends": outline.ends,
        "face_mm": outline.face_mm,
        "scale_uncertainty": outline.scale_uncertainty,
        "camera_tilt_deg": outline.camera_tilt_deg,
        "branches_kept": outline.branches_kept,
        "branches_mm": [np.round(line, 5) for line in outline.branches_mm],
        "islands_mm": [np.round(ring, 5) for ring in outline.islands_mm],
        "warnings": outline.warnings,
    }
    for name in POLYLINES:
        for unit in ("mm", "px"):
            content[f"{name}_{unit}"] = np.round(getattr(outline, f"{name}_{unit}"), 5)
    write_json(folder / "outline.json", content)


def read_outline(folder: Path) -> Outline:
    path = folder / "outline.json"
    content = read_json(path)
    with understood(path):
        lines = {f"{name}_{unit}": np.array(content[f"{name}_{unit}"]) for name in POLYLINES for unit in ("mm", "px")}
        for name, points in lines.items():
            if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points.astype(float)).all():
                raise ValueError(f"{name} is no list of points")
        return Outline(
            **lines,
            ends=tuple(content["ends"]),
            face_mm=None if content["face_mm"] is None else tuple(content["face_mm"]),
            mm_per_px=content["mm_per_px"],
            scale_source=content["scale_source"],
            scale_residual_mm=content["scale_residual_mm"],
            path_source=content["path_source"],
            warnings=tuple(content["warnings"]),
            islands_mm=tuple(np.array(ring, dtype=float) for ring in content["islands_mm"]),
            branches_mm=tuple(np.array(line, dtype=float) for line in content["branches_mm"]),
            branches_kept=content["branches_kept"],
            scale_uncertainty=content["scale_uncertainty"],
            camera_tilt_deg=content["camera_tilt_deg"],
        )


def write_solid(folder: Path, solid: Solid) -> None:
    """crack.stl and crack.ply in millimetres, crack.glb as glTF has it: metres, y up.

    solid.json says what none of these formats can: units, labels, volumes.
    """
    import trimesh

    x_mm, y_mm, z_mm = solid.vertices_mm.T
    vertices = {
        ".stl": solid.vertices_mm,
        ".ply": solid.vertices_mm,
        ".glb": np.column_stack([x_mm, z_mm, -y_mm]) / 1e3,
    }
    for suffix, points in vertices.items():
        with replacing(folder / f"crack{suffix}") as temporary:
            trimesh.Trimesh(points, solid.faces, process=False).export(temporary)
    write_json(
        folder / "solid.json",
        {
            "units": "mm",
            "tilt": solid.tilt,
            "wall_angles_deg": solid.wall_angles_deg,
            "depth_mm": solid.depth_mm,
            "block_mm": solid.block_mm,
            "cavity_volume_mm3": solid.cavity_volume_mm3,
            "sections": {key: np.round(values, 5) for key, values in vars(solid.sections).items()},
            **solid.report,
            # A digit for each triangle of crack.ply, in its order.
            "face_label": "".join(str(label) for label in solid.face_label),
            "face_label_meaning": {str(label.value): label.name.lower() for label in FaceLabel},
        },
    )


def read_solid(folder: Path) -> Solid:
    """Geometry from crack.ply, whose order the labels follow; the rest from solid.json."""
    content = read_json(folder / "solid.json")
    vertices_mm, faces = _read_mesh(folder / "crack.ply")
    own = {"units", "tilt", "wall_angles_deg", "depth_mm", "block_mm", "cavity_volume_mm3"}
    own |= {"sections", "face_label", "face_label_meaning"}
    with understood(folder / "solid.json"):
        if len(content["face_label"]) != len(faces):
            raise ValueError(f"{len(content['face_label'])} labels for the {len(faces)} faces of crack.ply")
        return Solid(
            vertices_mm=vertices_mm,
            faces=faces,
            face_label=np.array([int(digit) for digit in content["face_label"]], dtype=np.int64),
            block_mm=tuple(content["block_mm"]),
            depth_mm=content["depth_mm"],
            tilt=content["tilt"],
            wall_angles_deg=tuple(content["wall_angles_deg"]),
            cavity_volume_mm3=content["cavity_volume_mm3"],
            sections=Sections(**{key: np.array(values, float) for key, values in content["sections"].items()}),
            report={key: value for key, value in content.items() if key not in own},
        )


def write_trajectory(folder: Path, trajectory: Trajectory) -> None:
    """trajectory.csv, and trajectory.txt with x y z a line for simulators and robots that read nothing else."""
    rows = np.column_stack(
        [trajectory.t_s, trajectory.position_mm, trajectory.s_mm, trajectory.speed_mm_s, trajectory.flow_mm3_s]
    )
    write_table(folder / "trajectory.csv", TRAJECTORY_COLUMNS, rows)
    lines = [f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in trajectory.position_mm]
    write_text(folder / "trajectory.txt", "\n".join(lines) + "\n")


def read_trajectory(folder: Path) -> Trajectory:
    rows = read_table(folder / "trajectory.csv", TRAJECTORY_COLUMNS)
    return Trajectory(
        t_s=rows[:, 0], position_mm=rows[:, 1:4], s_mm=rows[:, 4], speed_mm_s=rows[:, 5], flow_mm3_s=rows[:, 6]
    )


def write_run(folder: Path, run: Run) -> None:
    """particles.csv, and simulation.json with what is not per particle."""
    rows = np.column_stack([run.position_mm, run.velocity_mm_s, run.age_s, run.spilled.astype(float)])
    write_table(folder / "particles.csv", PARTICLE_COLUMNS, rows)
    write_json(
        folder / "simulation.json",
        {
            "particles": len(run.position_mm),
            "radius_mm": run.radius_mm,
            "particle_volume_mm3": run.particle_volume_mm3,
            "dispensed_volume_mm3": run.dispensed_volume_mm3,
            "escaped_particles": run.escaped_particles,
            "spilled_particles": run.spilled_particles,
            "device": run.device,
            "settings": run.settings,
            "health": run.health,
        },
    )


def read_simulation(folder: Path) -> Simulation:
    """simulation.json, checked. Raises InputError, naming the field."""
    return _simulation(folder)[0]


def read_run(folder: Path) -> Run:
    """Raises InputError where a number is none, or none that can be, or the two files are not of one run."""
    path = folder / "particles.csv"
    rows = read_table(path, PARTICLE_COLUMNS)
    _require_numbers(path, PARTICLE_COLUMNS, rows, dict.fromkeys(PARTICLE_COLUMNS, FARTHEST) | {"spilled": 1.0})
    simulation, content = _simulation(folder)
    counts = len(rows), int((rows[:, 7] > 0).sum())
    if counts != (simulation.particles, simulation.spilled_particles):
        raise InputError(
            f"{path}: {counts[0]} particles, {counts[1]} of them spilled; simulation.json has {simulation.particles} "
            f"and {simulation.spilled_particles}. Simulate again."
        )
    return Run(
        position_mm=rows[:, 0:3],
        velocity_mm_s=rows[:, 3:6],
        age_s=rows[:, 6],
        spilled=rows[:, 7] > 0,
        radius_mm=simulation.radius_mm,
        particle_volume_mm3=simulation.particle_volume_mm3,
        escaped_particles=simulation.escaped_particles,
        device=simulation.device,
        settings=content["settings"],
        health=content["health"],
    )


def write_profile(folder: Path, profile: Profile) -> None:
    write_table(folder / "profile.csv", PROFILE_COLUMNS, np.column_stack([profile.s_mm, profile.level_mm]))


def read_profile(folder: Path) -> Profile:
    """Raises InputError where a number is none, or no level, or s does not grow from row to row."""
    path = folder / "profile.csv"
    rows = read_table(path, PROFILE_COLUMNS)
    if len(rows) < 2:
        raise InputError(f"{path}: {len(rows)} rows; a level along a crack has two or more. Simulate again.")
    _require_numbers(path, PROFILE_COLUMNS, rows, {"s_mm": FARTHEST, "level_mm": HIGHEST_MM})
    back = np.flatnonzero(np.diff(rows[:, 0]) <= 0)
    if len(back):
        row = int(back[0]) + 1
        raise InputError(
            f"{path}, line {row + 2}: s_mm = {rows[row, 0]:g} after {rows[row - 1, 0]:g}; it must grow row by row. "
            "Simulate again."
        )
    return Profile(s_mm=rows[:, 0], level_mm=rows[:, 1], data="synthetic", source="simulation")


def write_comparison(folder: Path, comparison: Comparison) -> None:
    write_json(
        folder / "comparison.json",
        {
            "mean_error_mm": comparison.mean_error_mm,
            "worst_error_mm": comparison.worst_error_mm,
            "worst_at_mm": comparison.worst_at_mm,
            "gate": comparison.gate,
            "passed": comparison.passed,
            "outcome": comparison.outcome,
            "verdict": comparison.verdict,
            "findings": comparison.findings,
            **comparison.metrics,
        },
    )


def read_comparison(folder: Path) -> dict[str, Any]:
    """comparison.json, what it leads with checked. Raises InputError, naming the field."""
    path = folder / "comparison.json"
    content = read_json(path)
    with understood(path):
        understood_as(Judged, content)
    return content


def _simulation(folder: Path) -> tuple[Simulation, dict[str, Any]]:
    """Checked; and as it is written, its settings in their order."""
    path = folder / "simulation.json"
    content = read_json(path)
    with understood(path):
        return understood_as(Simulation, content), content


def _require_numbers(path: Path, columns: Sequence[str], rows: Floats, most: Mapping[str, float]) -> None:
    """Raises InputError, naming the line, where a number is none, or larger than any can be, whatever its sign."""
    limits = np.array([most[name] for name in columns])
    # NaN is no less than anything.
    wrong = np.argwhere(~(np.abs(rows) <= limits))
    if len(wrong):
        row, column = (int(index) for index in wrong[0])
        found, name = rows[row, column], columns[column]
        allowed = "expected a number" if np.isnan(found) else f"expected {-limits[column]:g} to {limits[column]:g}"
        raise InputError(f"{path}, line {row + 2}: {name} = {found:g}; {allowed}. Run its stage again.")


def _read_text(path: Path) -> str:
    """Of a file that a stage wrote. Raises InputError where it is not there, or cannot be one."""
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB, as no stage writes it. Run it again.")
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: not found. Run the stage that writes it, or 'sealtwin run' for all.") from None
    except UnicodeDecodeError as fault:
        raise InputError(f"{path}: no UTF-8 text. Run its stage again.") from fault


def _cell(value: str | float | None) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        # Python's writer leaves a lone carriage return without quotes, and readers begin a row there.
        return as_text_cell(value.replace("\r\n", "\n").replace("\r", "\n"))
    return f"{value:.12g}"


def _read_mesh(path: Path) -> tuple[Floats, Integers]:
    import trimesh

    if not path.is_file():
        raise InputError(f"{path}: not found. Digitise again.")
    try:
        mesh = trimesh.load_mesh(path, process=False)
    except Exception as fault:  # A reader of foreign files stumbles over anything.
        raise InputError(f"{path}: no readable PLY ({fault}). Digitise again.") from fault
    if not isinstance(mesh, trimesh.Trimesh):
        raise InputError(f"{path}: no mesh of triangles. Digitise again.")
    return np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.int64)


def _plain(value: Any) -> Any:
    """Arrays to lists, numpy scalars to Python's, NaN and infinity to None."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if isinstance(value, Path):
        return value.name
    return value
