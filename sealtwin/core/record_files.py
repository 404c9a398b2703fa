"""Write records to the files of a run folder, and read them back."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator, with_config
from typing_extensions import TypedDict

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts
from sealtwin.core.mesh_file import read_mesh
from sealtwin.core.records import FaceLabel, Floats, Outline, Profile, Run, Sample, Sections, Solid, Trajectory
from sealtwin.core.run_figures import FastFill, FilledBy, RunHealth
from sealtwin.core.solid_figures import Box, SolidFigures

TRAJECTORY_COLUMNS = ("t_s", "x_mm", "y_mm", "z_mm", "s_mm", "speed_mm_s", "flow_mm3_s")
PARTICLE_COLUMNS = ("x_mm", "y_mm", "z_mm", "vx_mm_s", "vy_mm_s", "vz_mm_s", "age_s", "spilled")
PROFILE_COLUMNS = ("s_mm", "level_mm")
PROFILE, LEVEL = "profile.csv", "level.csv"
LEVEL_COLUMNS = (*PROFILE_COLUMNS, "low_95_mm", "high_95_mm")
"""Columns for the mean level of several runs and its 95 % band. A column for the level of each run may follow."""

Positive = Annotated[float, Field(gt=0)]
Amount = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=0)]


class Result(BaseModel):
    """Base class of JSON files whose content is checked.

    Types must be exact and numbers finite. Unknown keys are accepted.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="allow", allow_inf_nan=False)


FURTHER = ConfigDict(strict=True, extra="allow", allow_inf_nan=False)


@with_config(FURTHER)
class RunFluid(TypedDict, total=False):
    """Settings of a run's fluid that are read from simulation.json."""

    density_kg_m3: Positive | None
    yield_stress_pa: Amount


@with_config(FURTHER)
class RunSolver(TypedDict, total=False):
    """Settings of a run's solver that are read from simulation.json."""

    settle_s: Amount


@with_config(FURTHER)
class RunNozzle(TypedDict, total=False):
    """Settings of a run's nozzle that are read from simulation.json."""

    diameter_mm: Positive | None


@with_config(FURTHER)
class RunSettings(TypedDict, total=False):
    """Settings of a run that are read from simulation.json."""

    fluid: RunFluid
    solver: RunSolver
    nozzle: RunNozzle
    sample: dict[str, Any]


class Simulation(Result, FilledBy):
    """Content of simulation.json: the data of a run, except its particles."""

    particles: Count
    radius_mm: Positive
    particle_volume_mm3: Positive
    dispensed_volume_mm3: Positive
    escaped_particles: Count
    spilled_particles: Count
    device: str
    settings: RunSettings
    health: RunHealth
    fast_fill: FastFill | None = Field(default=None, validation_alias="bed")
    remarks: Facts = ()
    doubts: Facts = ()

    @model_validator(mode="after")
    def _has_sealant(self) -> Self:
        if not self.particles and self.has_particles:
            raise ValueError("particles is 0, but bed, the fast model's fill, is missing")
        return self

    @property
    def volume_ratio(self) -> float:
        """Ratio of the settled to the dispensed volume of sealant. Raises ValueError if it was not recorded."""
        if (ratio := self.health.volume_ratio) is None:
            raise ValueError("health.volume_ratio is missing")
        return ratio


class SolidFile(Result):
    """Content of solid.json, except the figures in ``SolidFigures``."""

    tilt: str
    wall_angles_deg: tuple[float, float]
    depth_mm: float
    block_mm: Box
    cavity_volume_mm3: float
    sections: Sections
    face_label: Annotated[str, Field(pattern="^[0-4]*$")]


AGAIN = "Run its stage again."
Kind = TypeVar("Kind")


def write_outline(folder: Path, outline: Outline) -> None:
    """Write outline.json, with numbers and texts first and polylines last."""
    names = ("length_mm", "mean_width_mm", *(field.name for field in fields(outline)))
    values = {name: getattr(outline, name) for name in names}
    ordered = sorted(values.items(), key=lambda item: isinstance(item[1], np.ndarray))
    files.write_json(folder / "outline.json", {name: _rounded(value) for name, value in ordered})


def read_outline(folder: Path) -> Outline:
    return read_record(Outline, folder / "outline.json")


def write_solid(folder: Path, solid: Solid) -> None:
    """Write crack.stl and crack.ply in millimetres, crack.glb, and solid.json.

    crack.glb is in metres with y up, as glTF requires. solid.json contains the data that these formats cannot contain:
    units, labels of the triangles, and volumes.
    """
    import trimesh

    x_mm, y_mm, z_mm = solid.vertices_mm.T
    gltf_m = np.column_stack([x_mm, z_mm, -y_mm]) / 1e3
    for suffix, points in ((".stl", solid.vertices_mm), (".ply", solid.vertices_mm), (".glb", gltf_m)):
        with files.replacing(folder / f"crack{suffix}") as temporary:
            trimesh.Trimesh(points, solid.faces, process=False).export(temporary)
    keys = ("tilt", "wall_angles_deg", "depth_mm", "block_mm", "cavity_volume_mm3")
    content = {
        "units": "mm",
        **{key: getattr(solid, key) for key in keys},
        "sections": {key: _rounded(values) for key, values in vars(solid.sections).items() if values is not None},
        **solid.figures.recorded(),
        # The text contains one digit for each triangle of crack.ply, in the same order.
        "face_label": "".join(str(label) for label in solid.face_label),
        "face_label_meaning": {str(label.value): label.name.lower() for label in FaceLabel},
    }
    files.write_json(folder / "solid.json", content)


def read_solid(folder: Path) -> Solid:
    """Read a solid: its triangles from crack.ply, and everything else from solid.json.

    The triangles of crack.ply are in the same order as the labels in solid.json.
    """
    path = folder / "solid.json"
    content = read_record(SolidFile, path)
    mesh = read_mesh(folder / "crack.ply", "Digitise again.")
    with files.reading_stage_file(path):
        if len(content.face_label) != len(mesh.faces):
            raise ValueError(
                f"face_label has {len(content.face_label)} labels, but crack.ply has {len(mesh.faces)} faces"
            )
        if content.tilt == "modelled" and not content.sections.by_level:
            raise ValueError("sections.below_mm2, the area of each section below each level, is missing")
    return Solid(
        vertices_mm=mesh.vertices,
        faces=mesh.faces,
        face_label=np.array([int(digit) for digit in content.face_label], np.int64),
        **{name: getattr(content, name) for name in SolidFile.model_fields.keys() - {"face_label"}},
        figures=read_record(SolidFigures, path),
    )


def write_trajectory(folder: Path, trajectory: Trajectory) -> None:
    """Write trajectory.csv, and for other programs trajectory.txt with "x y z" in mm in each line."""
    files.write_table(folder / "trajectory.csv", TRAJECTORY_COLUMNS, trajectory_rows(trajectory))
    lines = [f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in trajectory.position_mm]
    files.write_text(folder / "trajectory.txt", "\n".join(lines) + "\n")


def trajectory_rows(path: Trajectory) -> Floats:
    """Return the rows of trajectory.csv, with the columns ``TRAJECTORY_COLUMNS``."""
    return np.column_stack([path.t_s, path.position_mm, path.s_mm, path.speed_mm_s, path.flow_mm3_s])


def read_trajectory(folder: Path) -> Trajectory:
    t_s, x_mm, y_mm, z_mm, *others = files.read_table(folder / "trajectory.csv", TRAJECTORY_COLUMNS).T
    return Trajectory(t_s, np.column_stack([x_mm, y_mm, z_mm]), *others)


def write_sample(folder: Path, sample: Sample) -> None:
    """Write a digitised sample without its readings. The trajectory is written last and marks a complete folder."""
    write_outline(folder, sample.outline)
    write_solid(folder, sample.solid)
    write_trajectory(folder, sample.trajectory)


def read_sample(folder: Path) -> Sample:
    """Read a digitised sample without readings. Raises InputError if a file is missing or damaged."""
    return Sample(read_outline(folder), read_solid(folder), read_trajectory(folder))


def write_run(folder: Path, run: Run) -> None:
    """Write particles.csv, and simulation.json with all data of a run except the particles."""
    rows = np.column_stack([run.position_mm, run.velocity_mm_s, run.age_s, run.spilled.astype(float)])
    files.write_table(folder / "particles.csv", PARTICLE_COLUMNS, rows)
    content: dict[str, Any] = {name: getattr(run, name) for name in Simulation.model_fields}
    content["health"] = run.health.recorded()
    content["bed"] = content.pop("fast_fill")
    absent = {name for name in ("bed", "remarks", "doubts") if not content[name]}
    files.write_json(folder / "simulation.json", {key: content[key] for key in content if key not in absent})


def read_simulation(folder: Path) -> Simulation:
    """Read simulation.json. Raises InputError with the first key that is not valid."""
    return read_record(Simulation, folder / "simulation.json")


def read_run(folder: Path) -> Run:
    """Read a run from particles.csv and simulation.json.

    Raises InputError if a number is missing or not valid, or if the files are from different runs.
    """
    path = folder / "particles.csv"
    rows = files.read_table(path, PARTICLE_COLUMNS, finite=True)
    simulation = read_simulation(folder)
    counts = len(rows), int((rows[:, 7] > 0).sum())
    if counts != (simulation.particles, simulation.spilled_particles):
        raise InputError(
            f"{path}: has {counts[0]} particles, {counts[1]} of them spilled, but simulation.json has "
            f"{simulation.particles} and {simulation.spilled_particles}. Simulate again."
        )
    numbers = ("radius_mm", "particle_volume_mm3", "escaped_particles")
    keys = (*numbers, "device", "health", "fast_fill", "remarks", "doubts")
    return Run(
        position_mm=rows[:, 0:3],
        velocity_mm_s=rows[:, 3:6],
        age_s=rows[:, 6],
        spilled=rows[:, 7] > 0,
        **{key: getattr(simulation, key) for key in keys},
        fast_level=None if simulation.fast_fill is None else read_profile(folder),
        # The settings are read as JSON, because the record would add defaults and change the order.
        settings=files.read_json(folder / "simulation.json")["settings"],
    )


def write_profile(folder: Path, profile: Profile) -> None:
    files.write_table(folder / PROFILE, PROFILE_COLUMNS, np.column_stack([profile.s_mm, profile.level_mm]))


def read_profile(folder: Path, name: str = PROFILE) -> Profile:
    """Read a profile from the file ``name``.

    Raises InputError if a number is missing, if there are fewer than two rows, or if s does not increase.
    """
    path = folder / name
    rows = files.read_table(path, PROFILE_COLUMNS, finite=True)
    if len(rows) < 2 or (np.diff(rows[:, 0]) <= 0).any():
        raise InputError(f"{path}: expected at least two rows, with s_mm increasing from row to row. Simulate again.")
    return Profile(*rows.T, source="simulation")


def write_level(folder: Path, s_mm: Floats, levels_mm: Mapping[int, Floats], half_mm: float) -> None:
    """Write level.csv: the mean level of several seeds, its band of half-width ``half_mm``, and the level of each seed.

    ``levels_mm`` contains the level of each seed at ``s_mm``, (k,).
    """
    mean_mm = np.mean([*levels_mm.values()], axis=0)
    columns = (*LEVEL_COLUMNS, *map(_column_of, levels_mm))
    rows = np.column_stack([s_mm, mean_mm, mean_mm - half_mm, mean_mm + half_mm, *levels_mm.values()])
    files.write_table(folder / LEVEL, columns, rows)


def read_level(folder: Path) -> Profile:
    """Read the mean level of all seeds of a run folder. Raises the same errors as ``read_profile``."""
    return read_profile(folder, LEVEL)


def read_levels(folder: Path, seeds: Sequence[int]) -> Floats:
    """Read the level of each of ``seeds`` from level.csv, (seeds, k)."""
    return files.read_table(folder / LEVEL, [*map(_column_of, seeds)], finite=True).T


def _column_of(seed: int) -> str:
    return f"seed_{seed}_mm"


@cache
def _adapter(kind: type[Kind]) -> TypeAdapter[Kind]:
    return TypeAdapter(kind)


def read_record(kind: type[Kind], path: Path, remedy: str = AGAIN, *, strict: bool | None = None) -> Kind:
    """Read a JSON file as a record of the type ``kind``. With ``strict``, values of another type are not converted.

    Raises InputError with the file, the first key that is not valid, its value, and ``remedy``.
    """
    return as_record(kind, files.read_text(path), path, remedy, strict=strict)


def as_record(kind: type[Kind], text: str, where: Path | str, remedy: str, *, strict: bool | None = None) -> Kind:
    """Return a JSON text as a record of the type ``kind``.

    Raises InputError as ``read_record`` does. The message begins with ``where``.
    """
    try:
        record: Kind = _adapter(kind).validate_json(text, strict=strict)
        # A field of the type Any accepts NaN and infinity; parse_json refuses them.
        files.parse_json(text)
        return record
    except ValidationError as faults:
        fault = faults.errors()[0]
        key = ".".join(str(part) for part in fault["loc"] if part not in ("int", "float")) or "its content"
        value = "" if fault["type"] == "missing" else f" = {fault['input']!r:.60}"
        reason = fault["msg"].removeprefix("Value error, ").removeprefix("Input ")
        raise InputError(
            f"{where}: the content differs from what sealtwin wrote ({key}{value}: {reason}). {remedy}"
        ) from None
    except ValueError as fault:
        raise InputError(f"{where}: not readable JSON ({fault}). {remedy}") from None


def _rounded(value: Any) -> Any:
    """Return an array, or a tuple of arrays, rounded to five decimals. Other values are returned unchanged."""
    if isinstance(value, tuple):
        return tuple(_rounded(item) for item in value)
    return np.round(value, 5) if isinstance(value, np.ndarray) else value
