"""Cases of interFoam: paste of Herschel and Bulkley let go in a slot, on a structured mesh of hexahedra.

All walls hold the paste (no slip), there is no surface tension, and what lies above the paste is a gas of which neither
weight nor viscosity matters. interFoam's Herschel-Bulkley model limits the viscosity at low shear, so that its paste
never quite stops: a case is run with several limits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sealtwin.core.records import Floats

TABLES = Path(__file__).parent
WIDTH_MM, HEAP_MM = 3.1, (12.0, 24.0)
SIZE_MM = 0.75
DENSITY_KG_M3 = 1690.0
GAS_KG_M3, GAS_M2_S = 10.0, 1e-4
"""As heavy as keeps the pressure's equations well-conditioned: 0.6 % of the paste's weight, 2 % of its viscosity."""
SOLVERS = """solvers
{
    "alpha.paste.*" { nAlphaCorr 1; nAlphaSubCycles 1; cAlpha 1; }
    "pcorr.*" { solver PCG; preconditioner DIC; tolerance 1e-5; relTol 0; }
    p_rgh { solver PCG; preconditioner DIC; tolerance 1e-6; relTol 0.02; }
    p_rghFinal { $p_rgh; relTol 0.005; }
    "U.*" { solver PBiCGStab; preconditioner DILU; tolerance 1e-8; relTol 0.001; }
}
relaxationFactors { equations { ".*" 1; } }
"""
SCHEMES = """ddtSchemes { default Euler; }
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


class Axis:
    """Cells along an axis: for each span its end in mm, and its number of equal cells."""

    def __init__(self, *spans: tuple[float, int]) -> None:
        self.spans = spans
        lines, start = [np.zeros(1)], 0.0
        for end, cells in spans:
            lines.append(np.linspace(start, end, cells + 1)[1:])
            start = end
        self.lines_mm: Floats = np.concatenate(lines)
        self.size_mm: Floats = np.diff(self.lines_mm)

    @property
    def grading(self) -> str:
        """Length and cells of each span, and no growth within, as blockMesh reads them."""
        lengths = np.diff([0.0, *(end for end, _ in self.spans)])
        parts = zip(lengths, self.spans, strict=True)
        return "(" + " ".join(f"({length:.9g} {cells} 1)" for length, (_, cells) in parts) + ")"


@dataclass(frozen=True)
class Mesh:
    """A structured mesh from 0 on: along the slot from its end wall, across from its middle, and up."""

    x: Axis
    y: Axis
    z: Axis


class Stage(NamedTuple):
    """A part of a run. Paste at rest that is let go needs several rounds of viscosity, velocity and pressure a step."""

    end_s: float
    step_s: float
    """Longest time step."""
    rounds: int


CREEP = {0.5: Stage(0.5, 1e-4, 4), 2.0: Stage(0.5, 1e-4, 4), 5.0: Stage(2.0, 2e-4, 4)}
"""Of liquids, by their viscosity in Pa s: until the front is some particles on. A single round leaves the viscosity of
thick liquid half solved.
"""


@dataclass(frozen=True)
class Case:
    name: str
    mesh: Mesh
    heap_mm: tuple[float, float]
    """Length and height of the paste at the start."""
    yield_pa: float
    viscosity_pa_s: float
    limit_m2_s: float
    """Largest kinematic viscosity of the paste."""
    stages: Sequence[Stage]
    every_s: float
    """Between what is written."""


def write_case(case: Case, folder: Path) -> None:
    """Write mesh, start and settings of a case."""
    filled = _filled(case)
    _write(folder / "system" / "blockMeshDict", "dictionary", _block_mesh(case.mesh))
    _write(folder / "system" / "fvSchemes", "dictionary", SCHEMES)
    gravity = "dimensions [0 1 -2 0 0 0 0]; value (0 0 -9.81);\n"
    _write(folder / "constant" / "g", "uniformDimensionedVectorField", gravity)
    _write(folder / "constant" / "turbulenceProperties", "dictionary", "simulationType laminar;\n")
    _write(
        folder / "constant" / "transportProperties",
        "dictionary",
        f"""phases (paste air); sigma 0;
paste
{{
    transportModel HerschelBulkley; rho {DENSITY_KG_M3};
    HerschelBulkleyCoeffs
    {{
        k {case.viscosity_pa_s / DENSITY_KG_M3:.9g}; n 1;
        tau0 {case.yield_pa / DENSITY_KG_M3:.9g}; nu0 {case.limit_m2_s};
    }}
}}
air {{ transportModel Newtonian; nu {GAS_M2_S}; rho {GAS_KG_M3}; }}
""",
    )
    _write_field(
        folder / "0" / "U",
        "volVectorField",
        "dimensions [0 1 -1 0 0 0 0]; internalField uniform (0 0 0);",
        walls="type noSlip;",
        sky="type pressureInletOutletVelocity; value uniform (0 0 0);",
    )
    _write_field(
        folder / "0" / "p_rgh",
        "volScalarField",
        "dimensions [1 -1 -2 0 0 0 0]; internalField uniform 0;",
        walls="type fixedFluxPressure; value uniform 0;",
        sky="type totalPressure; p0 uniform 0;",
    )
    shares = "\n".join(f"{share:.6g}" for share in filled.ravel())
    _write_field(
        folder / "0" / "alpha.paste",
        "volScalarField",
        f"dimensions [0 0 0 0 0 0 0];\ninternalField nonuniform List<scalar>\n{filled.size}\n(\n{shares}\n);\n",
        walls="type zeroGradient;",
        sky="type inletOutlet; inletValue uniform 0; value uniform 0;",
    )


def write_stage(case: Case, stage: Stage, folder: Path) -> None:
    """Write how long and how carefully interFoam goes on from the last time that it wrote."""
    _write(
        folder / "system" / "controlDict",
        "dictionary",
        f"""application interFoam; startFrom latestTime; startTime 0; stopAt endTime; endTime {stage.end_s};
deltaT 1e-5; writeControl adjustableRunTime; writeInterval {case.every_s}; purgeWrite 0; writeFormat ascii;
writePrecision 6; timeFormat general; timePrecision 6; runTimeModifiable no;
adjustTimeStep yes; maxCo 0.5; maxAlphaCo 0.5; maxDeltaT {stage.step_s};
""",
    )
    rounds = f"nOuterCorrectors {stage.rounds}; nCorrectors 2; nNonOrthogonalCorrectors 0;"
    _write(folder / "system" / "fvSolution", "dictionary", f"{SOLVERS}PIMPLE {{ momentumPredictor yes; {rounds} }}\n")


def _write_field(path: Path, kind: str, inside: str, *, walls: str, sky: str) -> None:
    """Write a field with what bounds it; the slot's middle is a plane of symmetry."""
    bounds = f"walls {{ {walls} }} sky {{ {sky} }} middle {{ type symmetryPlane; }}"
    _write(path, kind, f"{inside} boundaryField {{ {bounds} }}\n")


def _write(path: Path, kind: str, content: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"FoamFile {{ version 2.0; format ascii; class {kind}; object {path.name}; }}\n{content}")


def _filled(case: Case) -> Floats:
    """Share of each cell that the paste takes at the start, (z, y, x): the order of blockMesh's cells."""
    length, height = case.heap_mm
    along, up = (
        np.clip((most - axis.lines_mm[:-1]) / axis.size_mm, 0, 1)
        for most, axis in ((length, case.mesh.x), (height, case.mesh.z))
    )
    return up[:, None, None] * np.ones(case.mesh.y.size_mm.size)[None, :, None] * along[None, None, :]


def _block_mesh(mesh: Mesh) -> str:
    axes = (mesh.x, mesh.y, mesh.z)
    (x0, x1), (y0, y1), (z0, z1) = ((axis.lines_mm[0], axis.lines_mm[-1]) for axis in axes)
    points = [(*corner, z) for z in (z0, z1) for corner in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    cells, grading = " ".join(str(axis.size_mm.size) for axis in axes), " ".join(axis.grading for axis in axes)
    return (
        "scale 0.001;\nvertices\n(\n"
        + "\n".join(f"({x:.9g} {y:.9g} {z:.9g})" for x, y, z in points)
        + f"""
);
blocks ( hex (0 1 2 3 4 5 6 7) ({cells}) simpleGrading ({grading}) );
edges ();
boundary
(
    walls {{ type wall; faces ((0 3 2 1) (0 4 7 3) (1 2 6 5) (3 7 6 2)); }}
    sky {{ type patch; faces ((4 5 6 7)); }}
    middle {{ type symmetryPlane; faces ((0 1 5 4)); }}
);
"""
    )
