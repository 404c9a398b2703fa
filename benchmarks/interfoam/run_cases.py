"""Heaps of paste by a second solver: OpenFOAM's interFoam, whose results lie beside this file as CSV tables.

    python -m benchmarks.interfoam.run_cases --keep FOLDER [--only NAME] [--list]

It needs Debian's package openfoam (1912), which nothing else here does: `benchmarks/heaps.py` reads the tables. Each case is
a structured mesh of hexahedra between no-slip walls, written here point by point, with air above the paste and no surface
tension. interFoam's Herschel-Bulkley model limits the viscosity at low shear to ``limit_m2_s``, so that its paste never
quite stops; the same case with three limits, on two meshes, is extrapolated by whoever reads the tables.

A table has one row for each time and station: ``t_s``, ``s_mm`` (distance from the closed end, or from the axis) and
``level_mm``, the height of the paste there: its volume over the area of the column of cells.
"""

import argparse
import csv
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sealtwin.core.records import Floats

TABLES = Path(__file__).parent
DENSITY_KG_M3 = 1690.0
VISCOSITY_PA_S = 0.0545
"""The paste of the shipped trial."""
SLOT_MM = 3.1
AIR_M2_S, AIR_KG_M3 = 1.48e-5, 1.2

HEADER = "FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\n"


@dataclass(frozen=True)
class Mesh:
    """A structured mesh: ``x``, ``y`` and ``z`` are the lines of its cells in mm.

    A wedge turns y into an angle about the z axis, so that a slice stands for a round heap.
    """

    x: Floats
    y: Floats
    z: Floats
    wedge: bool = False

    @property
    def cells(self) -> tuple[int, int, int]:
        return len(self.x) - 1, len(self.y) - 1, len(self.z) - 1


@dataclass(frozen=True)
class Case:
    name: str
    mesh: Mesh
    heap_mm: tuple[float, float]  # Length, or radius, and height of the paste at the start
    yield_pa: float
    limit_m2_s: float  # Largest kinematic viscosity of the regularised paste
    flow_index: float
    consistency_pa_s_n: float
    end_s: float
    every_s: float


def lines_mm(*spans: tuple[float, float]) -> Floats:
    """Lines from 0: for each span its end and the size of its cells."""
    lines, start = [np.zeros(1)], 0.0
    for end, size in spans:
        lines.append(np.linspace(start, end, max(1, round((end - start) / size)) + 1)[1:])
        start = end
    return np.concatenate(lines)


def heap(yield_pa: float, limit_m2_s: float, fine: bool, flow_index: float = 1.0) -> Case:
    """A heap of 12 x 24 mm against the closed end of a slot; half of the slot, whose middle is a plane of symmetry."""
    size, across = (0.67, 8) if fine else (1.0, 5)
    x, z = lines_mm((36, size), (64, 2 * size)), lines_mm((26, size))
    mesh = Mesh(x, np.linspace(0.0, SLOT_MM / 2, across + 1), z)
    name = f"heap-{yield_pa:g}pa-n{flow_index:g}-limit{limit_m2_s:g}-{'fine' if fine else 'coarse'}"
    # The same stress at 10 /s for any exponent.
    consistency = VISCOSITY_PA_S * 10.0 ** (1 - flow_index)
    return Case(name, mesh, (12.0, 24.0), yield_pa, limit_m2_s, flow_index, consistency, 2.0, 0.05)


def slump(limit_m2_s: float, fine: bool) -> Case:
    """A cylinder of 5 Pa paste on a plate, whose last shape is flat: the height is under a tenth of the radius."""
    size = 0.5 if fine else 0.8
    mesh = Mesh(lines_mm((80, 2 * size)), np.array([-1.0, 1.0]), lines_mm((8, size / 2), (20, size)), wedge=True)
    name = f"slump-5pa-limit{limit_m2_s:g}-{'fine' if fine else 'coarse'}"
    return Case(name, mesh, (28.0, 14.7), 5.0, limit_m2_s, 1.0, VISCOSITY_PA_S, 3.0, 0.1)


def cases() -> list[Case]:
    limits = (0.01, 0.03, 0.1)
    return [
        *(heap(stress, limit, fine) for fine in (False, True) for stress in (12.0, 5.0, 9.0, 15.0) for limit in limits),
        *(heap(12.0, limit, False, flow_index=0.6) for limit in limits),
        *(slump(limit, fine) for fine in (False, True) for limit in limits),
    ]


def write_case(case: Case, folder: Path) -> None:
    """Write mesh, start and settings of a case."""
    mesh = case.mesh
    for part in ("0", "constant", "system"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    (folder / "system" / "blockMeshDict").write_text(_block_mesh(mesh))
    (folder / "system" / "controlDict").write_text(
        HEADER.format(kind="dictionary", name="controlDict")
        + f"""application interFoam; startFrom startTime; startTime 0; stopAt endTime; endTime {case.end_s};
deltaT 1e-5; writeControl adjustableRunTime; writeInterval {case.every_s}; purgeWrite 0; writeFormat ascii;
writePrecision 6; timeFormat general; timePrecision 6; runTimeModifiable no;
adjustTimeStep yes; maxCo 0.5; maxAlphaCo 0.5; maxDeltaT 1e-3;
"""
    )
    (folder / "system" / "fvSchemes").write_text(
        HEADER.format(kind="dictionary", name="fvSchemes")
        + """ddtSchemes { default Euler; }
gradSchemes { default Gauss linear; }
divSchemes
{
    div(rhoPhi,U) Gauss linearUpwind grad(U); div(phi,alpha) Gauss vanLeer; div(phirb,alpha) Gauss linear;
    div(((rho*nuEff)*dev2(T(grad(U))))) Gauss linear;
}
laplacianSchemes { default Gauss linear corrected; }
interpolationSchemes { default linear; }
snGradSchemes { default corrected; }
"""
    )
    (folder / "system" / "fvSolution").write_text(
        HEADER.format(kind="dictionary", name="fvSolution")
        + """solvers
{
    "alpha.paste.*" { nAlphaCorr 1; nAlphaSubCycles 1; cAlpha 1; }
    "pcorr.*" { solver PCG; preconditioner DIC; tolerance 1e-5; relTol 0; }
    p_rgh { solver PCG; preconditioner DIC; tolerance 1e-7; relTol 0.02; }
    p_rghFinal { $p_rgh; relTol 0; }
    "U.*" { solver PBiCGStab; preconditioner DILU; tolerance 1e-8; relTol 0.001; }
}
PIMPLE { momentumPredictor yes; nOuterCorrectors 2; nCorrectors 2; nNonOrthogonalCorrectors 0; }
relaxationFactors { equations { ".*" 1; } }
"""
    )
    (folder / "constant" / "g").write_text(
        HEADER.format(kind="uniformDimensionedVectorField", name="g") + "dimensions [0 1 -2 0 0 0 0]; value (0 0 -9.81);\n"
    )
    (folder / "constant" / "turbulenceProperties").write_text(
        HEADER.format(kind="dictionary", name="turbulenceProperties") + "simulationType laminar;\n"
    )
    (folder / "constant" / "transportProperties").write_text(
        HEADER.format(kind="dictionary", name="transportProperties")
        + f"""phases (paste air); sigma 0;
paste
{{
    transportModel HerschelBulkley; rho {DENSITY_KG_M3};
    HerschelBulkleyCoeffs
    {{
        k {case.consistency_pa_s_n / DENSITY_KG_M3:.9g}; n {case.flow_index};
        tau0 {case.yield_pa / DENSITY_KG_M3:.9g}; nu0 {case.limit_m2_s};
    }}
}}
air {{ transportModel Newtonian; nu {AIR_M2_S}; rho {AIR_KG_M3}; }}
"""
    )
    sides = 'middle { type symmetryPlane; } "front|back" { type wedge; } axis { type empty; } '
    (folder / "0" / "U").write_text(
        HEADER.format(kind="volVectorField", name="U")
        + "dimensions [0 1 -1 0 0 0 0]; internalField uniform (0 0 0); boundaryField { walls { type noSlip; } "
        + "sky { type pressureInletOutletVelocity; value uniform (0 0 0); } "
        + sides
        + "}\n"
    )
    (folder / "0" / "p_rgh").write_text(
        HEADER.format(kind="volScalarField", name="p_rgh")
        + "dimensions [1 -1 -2 0 0 0 0]; internalField uniform 0; boundaryField { "
        + "walls { type fixedFluxPressure; value uniform 0; } sky { type totalPressure; p0 uniform 0; } "
        + sides
        + "}\n"
    )
    (folder / "0" / "alpha.paste").write_text(
        HEADER.format(kind="volScalarField", name="alpha.paste")
        + "dimensions [0 0 0 0 0 0 0];\ninternalField nonuniform List<scalar>\n"
        + f"{np.prod(mesh.cells)}\n(\n"
        + "\n".join(f"{share:.6g}" for share in _filled(case).ravel())
        + "\n);\nboundaryField { walls { type zeroGradient; } "
        + "sky { type inletOutlet; inletValue uniform 0; value uniform 0; } "
        + sides
        + "}\n"
    )


def _filled(case: Case) -> Floats:
    """Share of each cell that the paste takes at the start, (z, y, x): the order of blockMesh's cells."""
    length, height = case.heap_mm
    x, y, z = case.mesh.x, case.mesh.y, case.mesh.z
    along = np.clip((length - x[:-1]) / np.diff(x), 0, 1)
    up = np.clip((height - z[:-1]) / np.diff(z), 0, 1)
    return up[:, None, None] * np.ones(len(y) - 1)[None, :, None] * along[None, None, :]


def _block_mesh(mesh: Mesh) -> str:
    """One block, whose lines are graded by a section for each cell."""

    def grading(lines: Floats) -> str:
        lengths = np.diff(lines)
        return "(" + " ".join(f"({length:.9g} 1 1)" for length in lengths) + ")"

    x, y, z = mesh.x, mesh.y, mesh.z
    if mesh.wedge:
        # A wedge of 2 degrees has its edge in the axis; the first two corners of each floor fall together there.
        half = np.tan(np.radians(1.0)) * x[-1]
        corners = [(0, 0), (x[-1], -half), (x[-1], half), (0, 0)]
        points = [(*corner, height) for height in (z[0], z[-1]) for corner in (corners[0], corners[1], corners[2])]
        block = "hex (0 1 2 0 3 4 5 3)"
        patches = """walls { type wall; faces ((0 1 2 0) (1 4 5 2)); } sky { type patch; faces ((3 4 5 3)); }
    front { type wedge; faces ((0 1 4 3)); } back { type wedge; faces ((0 2 5 3)); }
    axis { type empty; faces ((0 3 3 0)); }"""
    else:
        plan = [(x[0], y[0]), (x[-1], y[0]), (x[-1], y[-1]), (x[0], y[-1])]
        points = [(*corner, height) for height in (z[0], z[-1]) for corner in plan]
        block = "hex (0 1 2 3 4 5 6 7)"
        patches = """walls { type wall; faces ((0 3 2 1) (0 4 7 3) (1 2 6 5) (3 7 6 2)); }
    sky { type patch; faces ((4 5 6 7)); } middle { type symmetryPlane; faces ((0 1 5 4)); }"""
    nx, ny, nz = mesh.cells
    return (
        HEADER.format(kind="dictionary", name="blockMeshDict")
        + "scale 0.001;\nvertices\n(\n"
        + "\n".join(f"({px:.9g} {py:.9g} {pz:.9g})" for px, py, pz in points)
        + f"\n);\nblocks ( {block} ({nx} {ny} {nz}) simpleGrading ({grading(x)} {grading(y)} {grading(z)}) );\n"
        + f"edges ();\nboundary\n(\n    {patches}\n);\n".replace("} ", "}\n    ")
    )


def read_levels(case: Case, folder: Path) -> list[tuple[float, float, float]]:
    """Rows of time in s, station and level in mm, for all times that were written."""
    nx, ny, nz = case.mesh.cells
    middles = (case.mesh.x[1:] + case.mesh.x[:-1]) / 2
    times = sorted((float(path.name), path) for path in folder.iterdir() if re.fullmatch(r"[0-9.]+", path.name))
    rows = []
    for time_s, path in times:
        if not (path / "alpha.paste").exists():
            continue
        text = (path / "alpha.paste").read_text()
        values = text.split("(", 1)[1].split(")", 1)[0].split()
        share = np.array(values, dtype=float).reshape(nz, ny, nx)
        level = (share * np.diff(case.mesh.z)[:, None, None]).sum(axis=0).mean(axis=0)
        rows += [(time_s, float(s), float(h)) for s, h in zip(middles, level, strict=True)]
    return rows


def run_case(case: Case, keep: Path) -> Path:
    """Run a case in its folder under ``keep``; returns its table."""
    folder = keep / case.name
    shutil.rmtree(folder, ignore_errors=True)
    write_case(case, folder)
    with (folder / "log").open("w") as log:
        for program in ("blockMesh", "interFoam"):
            subprocess.run([program, "-case", str(folder)], check=True, stdout=log, stderr=log)
    table = TABLES / f"{case.name}.csv"
    with table.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t_s", "s_mm", "level_mm"])
        writer.writerows((f"{t:g}", f"{s:.4g}", f"{h:.4g}") for t, s, h in read_levels(case, folder))
    return table


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=Path, help="folder for the cases of interFoam")
    parser.add_argument("--only", default="", help="part of the names of the cases to run")
    parser.add_argument("--list", action="store_true", help="print the names of the cases")
    options = parser.parse_args(arguments)
    for case in cases():
        if options.only not in case.name:
            continue
        if options.list or options.keep is None:
            print(case.name, *case.mesh.cells)
        else:
            print(run_case(case, options.keep), flush=True)


if __name__ == "__main__":
    main()
