"""Choices made before a run: the tables [fluid], [solver] and [nozzle] of a trial file."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, Tag, model_validator

from sealtwin.core.errors import InputError
from sealtwin.core.run_figures import FAST, Method
from sealtwin.core.settings import Settings
from simulate.material_curve import (
    ByForm,
    CoolingCurve,
    CoolingOrFile,
    Course,
    CurveOrFile,
    MaterialCurve,
    course_of_tables,
    fault_of,
    read_table,
)
from simulate.material_file import Material, read_material

STIFFEST_U = 1e6
"""A hundred times the paper's stiffest: it stands like a solid. What a run can solve for depends on its substep."""
THICKNESSES = ("U", "viscosity_pa_s", "consistency_pa_s_n")
"""Settings of which one says how thick a fluid is, unless a curve does."""

MOST_YIELD_PA = 1e4  # Paste that has set: a column of a metre stands


PAPERS_D_CM = 0.3  # D of the paper, found together with its U; no measurement of a user gives it


REPLACED_BY_CURVE = (
    *("U", "viscosity_pa_s", "consistency_pa_s_n", "flow_index"),
    *("yield_stress_pa", "structuration_pa_per_s", "yield_stress_most_pa"),
)
"""Settings of a fluid that its curve gives."""
BESIDE_NO_MATERIAL = (
    *("U", "consistency_pa_s_n", "flow_index", "density_kg_m3", "yield_stress_pa", "structuration_pa_per_s"),
    *("yield_stress_most_pa", "curve", "cooling"),
)
"""Settings that a measured material gives, or that another rheology would need."""
MaterialOrFile = Annotated[Annotated[Path, Tag("one")] | Annotated[Material, Tag("several")], ByForm]


class FreshPaste(NamedTuple):
    """Stress of fresh sealant at a shear: its yield stress and, at 1/s, its viscosity times the shear."""

    viscosity_pa_s: float | None  # None beside U
    yield_stress_pa: float


class Fluid(Settings):
    """The sealant: the paper's U and D, a viscosity, Herschel and Bulkley's two numbers, or a curve; one of them."""

    U: float | None = Field(default=None, ge=0, le=STIFFEST_U)
    """Weight of the fluid's own viscosity in Eq. 5; without a unit if lengths are in cm, as in the paper. A frame of
    7.23 ms at a radius of 0.4 mm turns U = 1 into 1.07e-6 m2/s, about water; without a yield stress particles move
    before it acts, and no U makes them viscous.
    """
    D_cm: float | None = Field(default=None, ge=0, le=1e3)
    """Weight of the walls' drag in Eq. 5, of a whole frame. Left out, it is the paper's 0.3 beside U, and beside
    any other viscosity the fluid sticks to the walls.
    """
    viscosity_pa_s: float | None = Field(default=None, ge=0, le=1e4)
    """Dynamic viscosity in place of U, which follows from the radius and the frame. Particles move with the velocity
    that it leaves; with U, and without a yield stress, they move before it acts, as in the paper (decision 0155).
    """
    consistency_pa_s_n: float | None = Field(default=None, ge=0, le=1e4)
    """K of Herschel and Bulkley's stress, yield_stress_pa + K gamma^flow_index, in Pa s^n; in place of viscosity_pa_s
    where flow_index is not 1. It is the viscosity at a shear of 1/s.
    """
    flow_index: float | None = Field(default=None, ge=0.2, le=2)
    """Power n of the shear in the stress. Left out, or 1, the viscosity does not depend on it; less thins as it is
    sheared, and needs consistency_pa_s_n.
    """
    density_kg_m3: float = Field(default=1690.0, ge=1, le=2e4)
    """Density of the sealant; by default of cement paste of water-cement ratio 0.67, whose parts have 3150 and 1000. It
    turns viscosity_pa_s into U, and stresses into what they can hold against gravity. The fluid falls alike at any
    density. Below 1 it is a gas.
    """
    yield_stress_pa: float = Field(default=0.0, ge=0, le=1e4)
    """Yield stress of fresh paste, below which it stands like a solid (Bingham). Cement grouts have 5 to 37 Pa."""
    structuration_pa_per_s: float = Field(default=0.0, ge=0, le=1e3)
    """Growth of the yield stress per second, at rest and in motion, as the paste cures."""
    yield_stress_most_pa: float | None = Field(default=None, ge=0, le=1e4)
    """Yield stress at which curing ends; left out, curing does not end."""
    curve: CurveOrFile | None = None
    """Viscosity and yield stress over age or over temperature, in place of U, viscosity_pa_s and the three settings of
    the yield stress: a CSV file, or its columns viscosity_pa_s, yield_stress_pa and either age_s or temperature_c.
    Between rows the logarithm of the viscosity is linear, and so is the yield stress. Before the first age and after
    the last they stay.
    """
    cooling: CoolingOrFile | None = None
    """Temperature of the sealant over its age, for a curve over temperature: a CSV file, or its columns age_s and
    temperature_c. It may not leave the curve's temperatures.
    """
    material: MaterialOrFile | None = None
    """A material.toml of 'sealtwin material', which gives yield stress, density and, if it has one, the viscosity.
    Their uncertainties are those of [uncertainty] unless others are declared.
    """
    freeze_after_s: float | Literal["never"] = "never"
    """Age at which a particle is fixed where it is, or "never": the default in Python, and a trial file must say it. It
    stands for the paste's stiffening, and makes the slope of the bed. The paper's solver froze at 2.58 s, its limit of
    2,500 moving particles, and had no yield stress. A fluid with neither levels out.
    """

    @model_validator(mode="before")
    @classmethod
    def _beside_u(cls, table: Any) -> Any:
        """The paper's D_cm beside U, so that a trial reads alike whether or not it says so."""
        if isinstance(table, dict) and table.get("U") is not None and table.get("D_cm") is None:
            return {**table, "D_cm": PAPERS_D_CM}
        return table

    def loaded(self, folder: Path) -> Self:
        """The same with the columns of its tables in place of their files, which lie in ``folder``.

        Raises InputError for a file that cannot be used.
        """
        if isinstance(self.material, Path):
            return self._with(read_material(folder / self.material), folder / self.material)
        curve = read_table(folder / self.curve, MaterialCurve) if isinstance(self.curve, Path) else self.curve
        cooling = read_table(folder / self.cooling, CoolingCurve) if isinstance(self.cooling, Path) else self.cooling
        file = folder / self.cooling if isinstance(self.cooling, Path) else None
        if curve is not None and (fault := fault_of(curve, cooling, file)):
            raise InputError(f"{fault}.")
        return self.model_copy(update={"curve": curve, "cooling": cooling})

    def _with(self, material: Material, file: Path) -> Self:
        """Return the same with the numbers of a material, whose record it keeps."""
        if (self.viscosity_pa_s is None) == (material.viscosity_pa_s is None):
            said = "no viscosity: give fluid.viscosity_pa_s beside it"
            if material.viscosity_pa_s is not None:
                said = f"a viscosity, and fluid.viscosity_pa_s is {self.viscosity_pa_s:g} beside it: leave it out"
            raise InputError(f"{file}: has {said}.")
        numbers = {
            "viscosity_pa_s": self.viscosity_pa_s or material.viscosity_pa_s,
            "yield_stress_pa": material.yield_stress_pa,
            "density_kg_m3": material.density_kg_m3,
        }
        return self.model_copy(update={"material": material, **numbers})

    @property
    def course(self) -> Course | None:
        """Viscosity and yield stress over age, of a fluid with a curve whose files are read."""
        if isinstance(self.curve, Path) or isinstance(self.cooling, Path):
            raise ValueError("the curve is a file that is not read yet; see loaded")
        return None if self.curve is None else course_of_tables(self.curve, self.cooling)

    @property
    def fresh(self) -> "FreshPaste":
        """The sealant as it leaves the nozzle."""
        if (course := self.course) is not None:
            viscosity, stress = course.at(np.zeros(1))
            return FreshPaste(float(viscosity[0]), float(stress[0]))
        viscosity_pa_s = self.viscosity_pa_s if self.consistency_pa_s_n is None else self.consistency_pa_s_n
        return FreshPaste(viscosity_pa_s, self.yield_stress_pa)

    @property
    def most_yield_stress_pa(self) -> float:
        if (course := self.course) is not None:
            return float(course.yield_stress_pa.max())
        if self.yield_stress_most_pa is not None:
            return self.yield_stress_most_pa
        return self.yield_stress_pa if self.structuration_pa_per_s == 0 else MOST_YIELD_PA

    @property
    def yields(self) -> bool:
        """The paste has a yield stress, or gets one."""
        return self.most_yield_stress_pa > 0

    @property
    def freezes(self) -> bool:
        """Particles are fixed by their age."""
        return self.freeze_after_s != "never"

    @model_validator(mode="after")
    def _check(self) -> Self:
        if isinstance(self.material, Material) and (self.yield_stress_pa, self.density_kg_m3) != (
            self.material.yield_stress_pa,
            self.material.density_kg_m3,
        ):
            raise ValueError("material is a table of other numbers than those beside it: leave either out")
        if isinstance(self.material, Path):
            beside = [key for key in BESIDE_NO_MATERIAL if getattr(self, key) != Fluid.model_fields[key].default]
            if beside:
                raise ValueError(
                    f"{', '.join(beside)} beside material: it gives yield stress, density and viscosity itself, and "
                    "the others need another law; leave them out"
                )
        elif self.curve is not None or self.cooling is not None:
            self._check_curve()
        elif self.flow_index not in (None, 1):
            for key in ("U", "viscosity_pa_s"):
                if (given := getattr(self, key)) is not None:
                    raise ValueError(
                        f"flow_index is {self.flow_index:g} and {key} {given:g}: give consistency_pa_s_n in its place"
                    )
            if self.consistency_pa_s_n is None:
                raise ValueError(f"flow_index is {self.flow_index:g}: give consistency_pa_s_n beside it")
        elif self.consistency_pa_s_n is not None:
            raise ValueError(
                f"consistency_pa_s_n is {self.consistency_pa_s_n:g} and flow_index 1: give viscosity_pa_s, or another "
                "flow_index"
            )
        elif (self.U is None) == (self.viscosity_pa_s is None):
            raise ValueError("give either U (with D_cm) or viscosity_pa_s, one of the two and not both")
        if self.freeze_after_s != "never" and self.freeze_after_s <= 0:
            raise ValueError(f'freeze_after_s is {self.freeze_after_s}: above 0, or "never"')
        if self.curve is None and self.most_yield_stress_pa < self.yield_stress_pa:
            raise ValueError(
                f"yield_stress_most_pa is {self.yield_stress_most_pa:g}, below yield_stress_pa, which is "
                f"{self.yield_stress_pa:g}: curing only adds to it"
            )
        return self

    def _check_curve(self) -> None:
        if self.curve is None:
            raise ValueError("cooling without curve: give the table of viscosity_pa_s over temperature_c too")
        beside = [name for name in REPLACED_BY_CURVE if getattr(self, name) != Fluid.model_fields[name].default]
        if beside:
            raise ValueError(f"{beside[0]} beside curve, which gives it at every age: give one of the two")
        if isinstance(self.curve, Path) or isinstance(self.cooling, Path):
            return
        if fault := fault_of(self.curve, self.cooling):
            raise ValueError(fault)


ABREAST = 4
"""Particles from wall to wall, as in the paper: with fewer they bridge the walls, with more a run takes long."""


class Scheme(NamedTuple):
    """The constants that the two presets choose; effective values, nothing left open."""

    iterations: int  # Pressure iterations a substep
    volume_factor: float
    """Volume of a particle in the density sum over 4 sqrt(2) f^3 R^3 of Eq. 6: at the start, where the run keeps its
    volume by itself.
    """
    wall: Literal["calibrated", "source"]
    """Strength of wall particles: completing the missing half of the kernel, or 1 / W(0)."""
    frozen_answer: float  # Multiplier that a frozen neighbour answers with, over the particle's own


PACKING = 0.97  # f of Eq. 6, the paper's: the effective radius of a particle over its radius.


def particle_volume(radius: float) -> float:
    """Volume of a particle by Eq. 6, 4 sqrt(2) f^3 R^3, in the cube of the radius' unit."""
    return 4 * math.sqrt(2) * (PACKING * radius) ** 3


SPHERE = 4 / 3 * math.pi / particle_volume(1.0)
"""Volume of a sphere of radius R over that of Eq. 6: the mass in the solver that the paper built on. 0.811."""

PRESETS = {
    # Where a run begins; it ends between 0.95 and 1.20 (decision 0113).
    "accurate": Scheme(iterations=4, volume_factor=1.07, wall="calibrated", frozen_answer=1.0),
    "paper": Scheme(iterations=4, volume_factor=SPHERE, wall="source", frozen_answer=0.0),
}

LEAST_TWO_LEVEL_ITERATIONS = 4
"""Least number of iterations of two-level pressure: with 3 a column at rest moves at 9 cm/s, since particles have no
time to answer their nodes.
"""
TWO_LEVEL = PRESETS["accurate"]._replace(iterations=5, volume_factor=1.05)
"""Constants of two-level pressure. With 4 iterations one particle in a hundred of a settled column is 2 % too dense.
Decision 0065.
"""


MOST_SUBSTEPS = 1000
STEEPEST_DEG = 45.0  # Bound of both slopes of a sample: roads stay below 12 degrees


class Solver(Settings):
    """The numerical method. Equations: Macklin & Müller 2013 (PBF), and the paper's Eqs 1 to 6."""

    model: Method | None = None
    """particles, the default: the fluid in three dimensions. slot: the flow along the crack, averaged over sections, in
    a tenth of a second; for screening within its domain, which a report names. It has no particles, jet or overspill.
    """
    preset: Literal["accurate", "paper"] = "accurate"
    """accurate keeps the dispensed volume; paper takes the constants of the solver that the paper built on, which
    lose a fifth to a quarter of it. Lean walls fit the paper's bed with the second, flared walls with the first.
    """
    radius_mm: Annotated[float, Field(gt=0, le=10)] | Literal["auto"] = 0.4
    """Radius of a particle: 0.4 is four abreast in a crack of 3.1 mm, as in the paper; "auto" is four abreast in this
    crack. Half the radius takes about ten times as long.
    """
    substeps: int | None = Field(default=None, ge=1, le=MOST_SUBSTEPS)
    """Substeps per frame. Default: enough that a particle falls less than 0.03 h in one, 4 in the paper's trial.
    Compression falls with their square.
    """
    pressure: Literal["local", "two-level"] = "local"
    """local: iterations hand pressure from neighbour to neighbour, and leave a column of 16 mm 12 % compressed at its
    floor. two-level: each solves for the whole crack too, and leaves it under 2 %, but for one particle in a hundred;
    a run takes about a quarter longer.
    """
    iterations: int | None = Field(default=None, ge=1, le=1000)
    """Pressure iterations a substep; left out, 4, or 5 where the pressure has two levels. Fluids in physical units or
    with a yield stress that are viscous enough to carry pressure over from the last substep have 3, or 2.
    """
    volume_factor: float | None = Field(default=None, ge=0.5, le=2)
    """Volume of a particle in the density sum over that of Eq. 6. Left out, preset accurate finds it on the way, so
    that the bed keeps the dispensed volume, and the run records the one it ended with; paper has 0.811.
    """
    relaxation: float = Field(default=1.5, ge=1e-3, le=1e3)
    """epsilon h^2 of Eq. 1: 60 per cm2 at h = 1.6 mm, as in the paper, and the same at any scale. At 0 a particle
    alone has no multiplier; far above the limit nothing holds the fluid apart.
    """
    damping_per_s: float = Field(default=0.2, ge=0, le=1e3)
    """eta of Eq. 4, as a rate: divided by a particle's mass of 0.3 mg it would be unstable. No more than
    one over a substep, in which it then takes all of a particle's speed: 550 in the paper's trial.
    """
    viscosity_solve: Literal["implicit", "explicit"] = "implicit"
    """implicit: one linear solve a substep, whatever U, by pairs that keep momentum. explicit: Eq. 5 in q passes as
    the paper has it; the reference, slow for U above 1000 or D above 1. At most 5000 passes: pastes of under 1 Pa.
    """
    sleep: bool = True
    """Paste with a yield stress that has come to rest is left where it lies until something hits it or flows on beside
    it: nearly the same bed, in three fifths to three quarters of the time. False computes on.
    """
    settle_s: float = Field(default=0.0, ge=0, le=3600)
    """Time between the last release and the profile. None in the paper."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.pressure == "two-level":
            if self.preset == "paper":
                raise ValueError(
                    'pressure is "two-level" and preset "paper", which is the solver that the paper built on, as it '
                    'was: take preset = "accurate", or pressure = "local"'
                )
            if self.iterations is not None and self.iterations < LEAST_TWO_LEVEL_ITERATIONS:
                raise ValueError(
                    f'iterations is {self.iterations}: with pressure = "two-level" fewer than '
                    f"{LEAST_TWO_LEVEL_ITERATIONS} leave the fluid boiling; give more, or leave it out"
                )
        return self

    @property
    def has_particles(self) -> bool:
        """False for the fast model, which needs no device, no checkpoint and no estimate of time."""
        return self.model != FAST

    @property
    def size_mm(self) -> float:
        """The radius, once it is a number: ``for_crack`` makes it one."""
        if self.radius_mm == "auto":
            raise ValueError("the radius follows from the crack's width; see for_crack")
        return self.radius_mm

    def for_crack(self, width_mm: float) -> Self:
        """The same with a radius for a crack of that mean width, where the radius is "auto"."""
        if self.radius_mm != "auto":
            return self
        return self.model_copy(update={"radius_mm": min(10.0, float(f"{width_mm / ABREAST / 2:.3g}"))})

    @property
    def scheme(self) -> Scheme:
        """The preset's constants with what the user set in their place."""
        preset = TWO_LEVEL if self.pressure == "two-level" else PRESETS[self.preset]
        return preset._replace(
            iterations=self.iterations or preset.iterations, volume_factor=self.volume_factor or preset.volume_factor
        )

    @property
    def carries_pressure(self) -> bool:
        """Pressure may begin with what the last substep's came to; on two levels, or as the paper's, it begins at 0."""
        return self.preset == "accurate" and self.pressure == "local"

    @property
    def keeps_volume(self) -> bool:
        """The run finds its volume factor on the way."""
        return self.preset == "accurate" and self.volume_factor is None


class SampleSlope(Settings):
    """The slopes of the sample's face. Its frame stays square to the face, and gravity turns in it."""

    crossfall_deg: float = Field(default=0.0, ge=-STEEPEST_DEG, le=STEEPEST_DEG)
    """Slope of the face along y: above 0 it rises towards +y, and sealant runs towards -y. The surface of a liquid at
    rest leaves the face by this angle in the plane of y and z.
    """
    gradient_deg: float = Field(default=0.0, ge=-STEEPEST_DEG, le=STEEPEST_DEG)
    """Slope of the face along x: above 0 it rises towards +x, and sealant runs towards -x."""

    @property
    def level(self) -> bool:
        return self.crossfall_deg == 0 == self.gradient_deg

    @property
    def table(self) -> dict[str, Any]:
        """The table [sample] of a run's recorded settings, by its name; none for a level sample."""
        return {} if self.level else {"sample": self.model_dump()}

    @property
    def down(self) -> tuple[float, float, float]:
        """Unit vector of gravity in the sample's frame."""
        x, y = (math.tan(math.radians(angle)) for angle in (self.gradient_deg, self.crossfall_deg))
        length = math.hypot(x, y, 1.0)
        # Subtracted, so that a level sample has no -0.0.
        return 0.0 - x / length, 0.0 - y / length, -1.0 / length


LEVEL = SampleSlope()


class Nozzle(Settings):
    """The outlet. Its path, height and flow are the trajectory's."""

    diameter_mm: float = Field(default=2.4, gt=0, le=100)
    """Inner diameter; 2.4 in the paper. Each release is as many particles as pack its disc: seven, of radius 0.4."""
