"""Heaps of paste and of liquid in a slot by a second solver, OpenFOAM's interFoam, kept as tables.

    python -m benchmarks.interfoam [--keep FOLDER] CASE...    run cases, and put them into the tables beside this file
    python -m benchmarks.interfoam                            their names

It needs interFoam on the path (Debian: apt-get install openfoam, and WM_PROJECT_DIR=/usr/share/openfoam), which
nothing else here does: ``python -m benchmarks.heaps`` judges the solver by the tables. A heap of paste takes two to
four minutes of one core, one of liquid eight to twenty.

``heaps.csv`` has a row for each time: tan of the surface between 25 and 90 % of its height, that height, and the
height of the centre of all paste. ``profiles.csv`` has the surface: in the slot's middle, where tan and height are
taken, and its mean over the width, with the films that stay on the walls. ``liquids.csv`` has the front and the centre
of liquids without a yield stress, by which ``python -m benchmarks.channels --only fronts`` judges.

Pressure and velocity are solved in turn, which lets stiff paste flow in long steps: hence steps of 0.1 ms (0.2 for the
thickest liquid), several rounds a step where paste at rest is let go or liquid is thick, and no course of paste beyond
half a second.
"""

import csv
import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Argument, BadParameter, Option

from benchmarks.interfoam.cases import (
    CREEP,
    DENSITY_KG_M3,
    HEAP_MM,
    SIZE_MM,
    TABLES,
    WIDTH_MM,
    Axis,
    Case,
    Mesh,
    Stage,
    write_case,
    write_stage,
)
from benchmarks.physics_tanks import SPRAY
from benchmarks.table import run_benchmark
from sealtwin.core.records import Floats

VISCOSITY_PA_S = 0.0545
"""The paste of ``benchmarks/physics_yield.py``, whose heap and slot these are."""
LIMIT_M2_S = 0.1
COLLAPSE = (Stage(0.05, 2e-4, 5), Stage(0.5, 1e-4, 1))
COLUMN_MM = 1.0
LEVEL_SHARES = 0.25, 0.9
"""Of the height, between which the slope is taken."""
SHOWN_S = (0.1, 0.25, 0.5)


def heap(yield_pa: float, size_mm: float = SIZE_MM, limit: float = LIMIT_M2_S) -> Case:
    """A heap against the closed end of a slot, half of whose width is computed: its middle is a plane of symmetry."""
    reach_mm = 36.0 if yield_pa < 7 else 24.0
    mesh = Mesh(
        Axis((reach_mm, round(reach_mm / size_mm)), (1.375 * reach_mm, round(0.1875 * reach_mm / size_mm))),
        Axis((WIDTH_MM / 2, round(4.5 / size_mm))),
        Axis((18.0, round(18.0 / size_mm)), (25.5, round(3.75 / size_mm))),
    )
    name = f"heap-{yield_pa:g}pa-{size_mm:g}mm-{limit:g}"
    return Case(name, mesh, HEAP_MM, yield_pa, VISCOSITY_PA_S, limit, COLLAPSE, 0.025)


def liquid(viscosity_pa_s: float, size_mm: float = SIZE_MM) -> Case:
    """The same heap, of liquid of the paste's density."""
    mesh = Mesh(
        Axis((27.0, round(27.0 / size_mm)), (36.0, round(4.5 / size_mm))),
        Axis((WIDTH_MM / 2, round(4.5 / size_mm))),
        Axis((24.75, round(24.75 / size_mm))),
    )
    limit_m2_s, creep = viscosity_pa_s / DENSITY_KG_M3, CREEP[viscosity_pa_s]
    name = f"liquid-{viscosity_pa_s:g}pas-{size_mm:g}mm"
    return Case(name, mesh, HEAP_MM, 0.0, viscosity_pa_s, limit_m2_s, (creep,), creep.end_s / 20)


def cases() -> dict[str, Case]:
    heaps = [heap(stress) for stress in (5.0, 9.0, 12.0, 15.0)]
    heaps += [heap(12.0, limit=limit) for limit in (0.03, 0.3)] + [heap(12.0, size_mm=1.0)]
    liquids = [liquid(viscosity) for viscosity in CREEP] + [liquid(2.0, size_mm=1.0)]
    return {case.name: case for case in (*heaps, *liquids)}


def slope(x_mm: Floats, level_mm: Floats) -> float:
    """Tan of a surface between LEVEL_SHARES of its height; infinite where no column lies between them."""
    low, high = (share * level_mm.max() for share in LEVEL_SHARES)
    part = (x_mm <= x_mm[level_mm > low].max()) & (x_mm > x_mm[level_mm > high].max())
    return -float(np.polyfit(x_mm[part], level_mm[part], 1)[0]) if part.sum() > 1 else math.inf


def run(case: Case, folder: Path) -> None:
    """Run a case in a folder of its own."""
    shutil.rmtree(folder, ignore_errors=True)
    write_case(case, folder)
    place = {"WM_PROJECT_DIR": "/usr/share/openfoam"} | dict(os.environ)
    with (folder / "log").open("w") as log:
        for program, stage in (("blockMesh", case.stages[0]), *(("interFoam", stage) for stage in case.stages)):
            write_stage(case, stage, folder)
            subprocess.run([program, "-case", str(folder)], check=True, stdout=log, stderr=log, env=place)


def shares(case: Case, folder: Path) -> Iterator[tuple[float, Floats]]:
    """Yield every time in s that was written, with the paste's share of each cell, (z, y, x)."""
    counts = [axis.size_mm.size for axis in (case.mesh.z, case.mesh.y, case.mesh.x)]
    for path in sorted(folder.glob("[0-9]*/alpha.paste"), key=lambda path: float(path.parent.name)):
        values = path.read_text().split("(", 1)[1].split(")", 1)[0].split()
        yield float(path.parent.name), np.array(values, dtype=float).reshape(counts)


def columns(case: Case, level_mm: Floats) -> tuple[Floats, Floats]:
    """Middles and levels of columns as wide as ``benchmarks/physics_tanks.py`` takes them, of the same volume."""
    lines = case.mesh.x.lines_mm
    volume = np.concatenate([[0.0], np.cumsum(level_mm * case.mesh.x.size_mm)])
    edges = np.arange(0.0, lines[-1] + COLUMN_MM / 2, COLUMN_MM)
    return edges[:-1] + COLUMN_MM / 2, np.diff(np.interp(edges, lines, volume)) / COLUMN_MM


def read_heap(case: Case, folder: Path) -> tuple[list[list[float]], list[list[float]]]:
    """Rows of heaps.csv and of profiles.csv, without what the case is."""
    size, height = case.mesh.z.size_mm, case.mesh.z.lines_mm[1:] - case.mesh.z.size_mm / 2
    figures, profile = [], []
    for t_s, share in shares(case, folder):
        deep = share * size[:, None, None]
        (x, level), (_, middle) = columns(case, deep.sum(axis=0).mean(axis=0)), columns(case, deep.sum(axis=0)[0])
        by_height = (deep.mean(axis=1) * case.mesh.x.size_mm).sum(axis=1)
        figures.append([t_s, slope(x, middle), float(middle.max()), float(by_height @ height / by_height.sum())])
        if round(t_s, 6) in SHOWN_S:
            wet = middle > 0.05
            profile += [[t_s, *row] for row in zip(x[wet], level[wet], middle[wet], strict=True)]
    return figures, profile


def front_mm(case: Case, share: Floats) -> float:
    """Where a liquid ends in x, but for its SPRAY."""
    volume = (share * case.mesh.z.size_mm[:, None, None]).mean(axis=1).sum(axis=0) * case.mesh.x.size_mm
    behind = np.concatenate([[0.0], np.cumsum(volume)]) / volume.sum()
    return float(np.interp(1 - SPRAY, behind, case.mesh.x.lines_mm))


def put(table: str, heads: Sequence[str], key: Sequence[str], rows: Sequence[Sequence[float]]) -> None:
    """Put rows into a table in place of those that begin with the same key."""
    path = TABLES / table
    kept: list[list[str]] = []
    if path.exists():
        with path.open(newline="") as file:
            kept = [row for row in list(csv.reader(file))[1:] if row[: len(key)] != list(key)]
    kept += [[*key, *(f"{value:.4g}" for value in row)] for row in rows]
    kept.sort(key=lambda row: [float(part) for part in row])
    with path.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([heads, *kept])


def record(case: Case, folder: Path) -> None:
    """Put a case that was run into the tables."""
    if not case.yield_pa:
        heights = [figures[-1] for figures in read_heap(case, folder)[0]]
        rows = [
            [t_s, front_mm(case, share), height]
            for (t_s, share), height in zip(shares(case, folder), heights, strict=True)
        ]
        key = [f"{case.viscosity_pa_s:g}", f"{case.mesh.x.size_mm[0]:g}"]
        put("liquids.csv", ["viscosity_pa_s", "mesh_mm", "t_s", "front_mm", "centre_mm"], key, rows)
        return
    key = [f"{case.yield_pa:g}", f"{case.mesh.x.size_mm[0]:g}", f"{case.limit_m2_s:g}"]
    heads = ["yield_pa", "mesh_mm", "limit_m2_s", "t_s"]
    figures, profile = read_heap(case, folder)
    put("heaps.csv", [*heads, "tan", "height_mm", "centre_mm"], key, figures)
    if case.limit_m2_s == LIMIT_M2_S:
        put("profiles.csv", ["yield_pa", "mesh_mm", "t_s", "x_mm", "level_mm", "middle_mm"], key[:2], profile)


def main(
    names: Annotated[list[str] | None, Argument(help="names of cases")] = None,
    keep: Annotated[Path | None, Option(help="keep interFoam's own files there")] = None,
) -> None:
    all_cases = cases()
    if unknown := {*(names or ())} - {*all_cases}:
        raise BadParameter(f"no case {', '.join(sorted(unknown))}")
    if not names:
        print(*all_cases, sep="\n")
    with tempfile.TemporaryDirectory() as spare:
        for name in names or ():
            folder = (keep or Path(spare)) / name
            run(all_cases[name], folder)
            record(all_cases[name], folder)
            print(name, flush=True)


if __name__ == "__main__":
    run_benchmark(main)
