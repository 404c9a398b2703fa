"""Choices made before a run: the tables [fluid], [solver] and [nozzle] of a trial file."""

import math
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from sealtwin.core.settings import Settings

STIFFEST_U = 1e6  # A thousand times the paper's stiffest: it stands like a solid, and float32 still solves it

MOST_YIELD_PA = 1e4  # Paste that has set: a column of a metre stands


PAPERS_D_CM = 0.3  # D of the paper, found together with its U; no measurement of a user gives it


class Fluid(Settings):
    """The sealant: the paper's U and D, a viscosity in physical units, or Herschel and Bulkley's; one of the three."""

    U: float | None = Field(default=None, ge=0, le=STIFFEST_U)
    """Weight of the fluid's own viscosity in Eq. 5; no unit where lengths are in cm, as in the paper. A frame of
    7.23 ms at a radius of 0.4 mm turns U = 1 into 1.07e-6 m2/s, about water.
    """
    D_cm: float | None = Field(default=None, ge=0, le=1e3)
    """Weight of the walls' drag in Eq. 5, of a whole frame. Left out, it is the paper's 0.3 beside U, and beside
    viscosity_pa_s the weight with which the fluid sticks to the walls, from viscosity, radius and frame.
    """
    viscosity_pa_s: float | None = Field(default=None, ge=0, le=1e4)
    """Dynamic viscosity in place of U, which follows from the radius and the frame, as does D_cm where it is left out.
    """
    consistency_pa_s_n: float | None = Field(default=None, ge=0, le=1e4)
    """K of Herschel and Bulkley's stress, yield_stress_pa + K gamma^flow_index, in Pa s^n; in place of viscosity_pa_s
    where flow_index is not 1. It is the viscosity at a shear of 1/s.
    """
    flow_index: float = Field(default=1.0, ge=0.2, le=2)
    """Power n of the shear in the stress: 1 is a viscosity that does not depend on it, less thins as it is sheared."""
    density_kg_m3: float = Field(default=1690.0, gt=0, le=2e4)
    """Cement paste of water-cement ratio 0.67, from 3150 and 1000 kg/m3 of its parts. It turns viscosity_pa_s into
    U, and stresses into what they can hold against gravity; the fluid falls alike at any density.
    """
    yield_stress_pa: float = Field(default=0.0, ge=0, le=1e4)
    """Yield stress of fresh paste, below which it stands like a solid (Bingham). Cement grouts have 5 to 37 Pa."""
    structuration_pa_per_s: float = Field(default=0.0, ge=0, le=1e3)
    """Yield stress that a second at rest or in motion adds, as the paste cures."""
    yield_stress_most_pa: float | None = Field(default=None, ge=0, le=1e4)
    """Yield stress at which curing ends; left out, curing does not end."""
    freeze_after_s: float | Literal["never"]
    """Age at which a particle is fixed where it lies. It is the paste's stiffening and makes the slope of the bed:
    2.58 s is the paper's limit of 2,500 moving particles.
    """

    @model_validator(mode="before")
    @classmethod
    def _beside_u(cls, table: Any) -> Any:
        """The paper's D_cm beside U, so that a trial reads alike whether or not it says so."""
        if isinstance(table, dict) and table.get("U") is not None and table.get("D_cm") is None:
            return {**table, "D_cm": PAPERS_D_CM}
        return table

    @property
    def thickness_pa_s(self) -> float | None:
        """Viscosity, or the consistency, which is the viscosity at a shear of 1/s; None beside U."""
        return self.viscosity_pa_s if self.consistency_pa_s_n is None else self.consistency_pa_s_n

    @property
    def most_yield_stress_pa(self) -> float:
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
        if self.flow_index != 1:
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
        if self.most_yield_stress_pa < self.yield_stress_pa:
            raise ValueError(
                f"yield_stress_most_pa is {self.yield_stress_most_pa:g}, below yield_stress_pa, which is "
                f"{self.yield_stress_pa:g}: curing only adds to it"
            )
        return self


ABREAST = 4
"""Particles from wall to wall, as in the paper: with fewer they bridge the walls, with more a run takes long."""


class Scheme(NamedTuple):
    """The constants that the two presets choose; effective values, nothing left open."""

    iterations: int  # Pressure iterations a substep
    volume_factor: float  # Volume of a particle in the density sum, over 4 sqrt(2) f^3 R^3 of Eq. 6.
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
    # What freezes is 7 % denser than at rest, and more where new sealant presses into it: decision 0011.
    "accurate": Scheme(iterations=4, volume_factor=1.1, wall="calibrated", frozen_answer=1.0),
    "paper": Scheme(iterations=4, volume_factor=SPHERE, wall="source", frozen_answer=0.0),
}
YIELDING_VOLUME_FACTOR = 1.07
"""Volume factor of the accurate preset with local pressure, where a yield stress holds the bed and nothing freezes. The
preset's 1.10 was measured on beds that freeze, and makes the shipped trial's bed 3 % too large: decision 0084.
"""

LEAST_TWO_LEVEL_ITERATIONS = 4
"""Least number of iterations of two-level pressure: with 3 a column at rest moves at 9 cm/s, since particles have no
time to answer their nodes.
"""
TWO_LEVEL = PRESETS["accurate"]._replace(iterations=5, volume_factor=1.05)
"""Constants of two-level pressure. With 4 iterations one particle in a hundred of a settled column is 2 % too dense.
Sealant that freezes is still denser than at rest, but no longer all of the fluid: decision 0065.
"""


class Solver(Settings):
    """The numerical method. Equations: Macklin & Müller 2013 (PBF), and the paper's Eqs 1 to 6."""

    preset: Literal["accurate", "paper"] = "accurate"
    """accurate keeps the dispensed volume; paper takes the constants of the solver that the paper built on, which
    lose a fifth to a quarter of it. Lean walls fit the paper's bed with the second, flared walls with the first.
    """
    radius_mm: Annotated[float, Field(gt=0, le=10)] | Literal["auto"] = 0.4
    """Radius of a particle: 0.4 is four abreast in a crack of 3.1 mm, as in the paper; "auto" is four abreast in
    this crack.
    """
    substeps: int | None = Field(default=None, ge=1, le=1000)
    """Number of parts of a frame. Left out, as many as keep a particle's fall in one of them under 0.03 h: 4 in the
    paper's trial. Compression falls with their square.
    """
    pressure: Literal["local", "two-level"] = "local"
    """local: iterations hand pressure from neighbour to neighbour, and leave a column of 16 mm 10 % compressed at its
    floor. two-level: each solves for the whole crack too, and leaves it under 2 %, but for one particle in a hundred;
    a run takes about a quarter longer.
    """
    iterations: int | None = Field(default=None, ge=1, le=1000)
    """Pressure iterations a substep; left out, the preset's 4, or 5 where the pressure has two levels."""
    volume_factor: float | None = Field(default=None, ge=0.5, le=2)
    """Volume of a particle in the density sum over that of Eq. 6. Left out, the preset's: 1.10 of accurate, or 1.07
    where the paste has a yield stress and does not freeze; 1.05 of two-level pressure.
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
    the paper has it; the reference, slow for U above 1000 or D above 1.
    """
    sleep: bool = True
    """Paste with a yield stress that has come to rest is left where it lies until something hits it: quick, and
    without any creep. False computes on, at the smallest rate of shear that float32 allows.
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
    def slowest_shear_per_s(self) -> float:
        """Shear below which paste with a yield stress creeps at constant viscosity (the prototype's two values)."""
        return 0.1 if self.sleep else 0.002

    def scheme_for(self, *, yields: bool, freezes: bool) -> Scheme:
        """The preset's constants with what the user set in their place.

        Paste that freezes by its age keeps the factor that was measured on it, with or without a yield stress.
        """
        local_accurate = self.preset == "accurate" and self.pressure == "local"
        preset = TWO_LEVEL if self.pressure == "two-level" else PRESETS[self.preset]
        if local_accurate and yields and not freezes:
            preset = preset._replace(volume_factor=YIELDING_VOLUME_FACTOR)
        return preset._replace(
            iterations=self.iterations or preset.iterations, volume_factor=self.volume_factor or preset.volume_factor
        )


class Nozzle(Settings):
    """The outlet. Its path, height and flow are the trajectory's."""

    diameter_mm: float = Field(default=2.4, gt=0, le=100)
    """The paper's. A release is as many particles as pack its disc, seven at a radius of 0.4 mm."""
