"""What the stages leave in a run folder, record by record, written and read back."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import (
    Comparison,
    FaceLabel,
    Floats,
    Integers,
    Outline,
    Profile,
    Run,
    Sections,
    Solid,
    Trajectory,
)
from sealtwin.store.files import read_json, replacing, understood, write_json, write_text
from sealtwin.store.result_files import Judged, Simulation, understood_as
from sealtwin.store.tables import read_table, write_table

TRAJECTORY_COLUMNS = ("t_s", "x_mm", "y_mm", "z_mm", "s_mm", "speed_mm_s", "flow_mm3_s")
PARTICLE_COLUMNS = ("x_mm", "y_mm", "z_mm", "vx_mm_s", "vy_mm_s", "vz_mm_s", "age_s", "spilled")
PROFILE_COLUMNS = ("s_mm", "level_mm")
POLYLINES = ("centreline", "left_wall", "right_wall", "outline")
HIGHEST_MM = 1e3
"""Of a level, above the face or below it: the deepest crack that is taken has half of that."""
FARTHEST = 1e7
"""Of any other number of a table, in mm, mm/s or s. A particle that falls for a minute is there; beyond it the single
precision in which a run is computed knows no millimetre."""


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
