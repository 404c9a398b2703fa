"""Settings of a run: the tables [fluid], [solver] and [nozzle] of a trial file."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, Tag, model_validator

from sealtwin.core.errors import InputError, present
from sealtwin.core.run_figures import FAST, Method
from sealtwin.core.settings import ByForm, Likely, Settings
from simulate.material_curve import Course, CurveOrFile, read_curve
from simulate.material_file import Material, read_material
from simulate.shear_law import Law

STIFFEST_U = 1e6
"""Largest U that is accepted: a hundred times the U of the paper's stiffest fluid, and practically a solid. The substep
of a run may limit U to a smaller value."""
MAX_YIELD_PA = 1e4  # Largest yield stress in Pa, that of hardened paste. It carries a column of paste one metre high
PAPERS_NOZZLE_MM = 2.4  # Inner diameter of the paper's nozzle
PAPERS_D_CM = 0.3  # D of the paper, which was fitted together with U, because D cannot be measured
# Water has 0.001 Pa s, epoxy 0.1 to 10, honey 2 to 20, hot bitumen and hot sealants 0.1 to 6 (ASTM D6690), cement paste
# 0.1 to 5 (Mohammed et al. 2014).
VISCOSITY = Likely(0.0, 50.0, "Pa s", "in mPa s")
DENSITY = Likely(700.0, 3500.0, "kg/m3", "in g/cm3 or N/m3")  # From alcohol to heavy mortar
SLOPE = Likely(-12.0, 12.0, "degrees", "in percent")  # Roads stay below 12 degrees
NOZZLE = Likely(0.0, 2.0, "mm for a crack of this width", "the outer diameter, or in tenths of a mm", of_width=True)
FAST_READS = (
    *("U", "D_cm", "wall_share", "viscosity_pa_s", "consistency_pa_s_n", "flow_index"),
    *("density_kg_m3", "yield_stress_pa", "material"),
)
"""Settings of [fluid] that the fast model supports. D_cm is only a reason why the model is not valid. If any other
setting differs from its default, the sealant is refused, so that no setting is silently ignored."""
MIN_WALL_SHARE = 0.05  # Smallest wall_share. With less, the wall would have almost no effect


class GivenLaw(NamedTuple):
    """A law of flow, and the other settings that may be given together with the setting that selects it."""

    law: Law
    beside: tuple[str, ...]


_STRESSES = ("yield_stress_pa", "structuration_pa_per_s", "yield_stress_most_pa")
LAWS = {
    "material": GivenLaw(Law.HERSCHEL_BULKLEY, ("viscosity_pa_s",)),
    "curve": GivenLaw(Law.BINGHAM, ("density_kg_m3",)),
    "U": GivenLaw(Law.BINGHAM, (*_STRESSES, "density_kg_m3")),
    "viscosity_pa_s": GivenLaw(Law.BINGHAM, (*_STRESSES, "density_kg_m3")),
    "consistency_pa_s_n": GivenLaw(Law.HERSCHEL_BULKLEY, ("flow_index", *_STRESSES, "density_kg_m3")),
}
"""Laws of flow, by the setting that selects them. If a fluid has several of these settings, the first one selects."""
VISCOSITIES_PA_S = tuple(key for key in LAWS if key not in ("material", "curve", "U"))
"""Settings that select a law of flow, and whose value is the viscosity at a shear rate of 1/s."""


def excluded_by(key: str) -> list[str]:
    """Return the settings that cannot be given together with a key of ``LAWS``, because they belong to other laws."""
    of_laws = dict.fromkeys(name for law_key, law in LAWS.items() for name in (law_key, *law.beside))
    return [name for name in of_laws if name not in (key, "material", *LAWS[key].beside)]


OF_MATERIAL = ("yield_stress_pa", "density_kg_m3", "consistency_pa_s_n", "flow_index")
"""Settings whose values come from a material, including None. If the material has no viscosity, viscosity_pa_s may be
given in addition."""
MaterialOrFile = Annotated[Annotated[Path, Tag("one")] | Annotated[Material, Tag("several")], ByForm]


class FreshPaste(NamedTuple):
    """Viscosity at a shear rate of 1/s, and yield stress, of sealant as it leaves the nozzle."""

    viscosity_pa_s: float | None  # None if U is given
    yield_stress_pa: float


class Fluid(Settings):
    """The sealant: the paper's U and D, a viscosity, K and n of the Herschel-Bulkley law, a curve or a material."""

    U: float | None = Field(default=None, ge=0, le=STIFFEST_U)
    """Weight of the fluid's viscosity in Eq. 5. It is dimensionless, with lengths in cm as in the paper. In a frame of
    7.23 ms at a radius of 0.4 mm, U = 1 is 1.07e-6 m2/s, about the viscosity of water. Without a yield stress,
    particles move before U acts, so even a fluid with a large U flows like water."""
    D_cm: float | None = Field(default=None, ge=0, le=1e3)
    """Weight of the walls' drag in Eq. 5, for a whole frame. Default: the paper's 0.3 if U is given. If the viscosity
    is given by another setting, the fluid sticks to the walls by default."""
    wall_share: float | None = Field(default=None, ge=MIN_WALL_SHARE, le=1)
    """Stress at walls and floor, divided by the stress in the paste at the same shear rate. Default: 1, for rough walls
    to which the paste sticks. With 0.5, the paste slides along a wall if the stress at the wall is more than half the
    yield stress. It cannot be combined with D_cm, which also sets the drag of the walls."""
    viscosity_pa_s: Annotated[float | None, VISCOSITY] = Field(default=None, ge=0, le=1e4)
    """Dynamic viscosity, given instead of U. With a yield stress, it is the plastic viscosity (Bingham). Cement grouts
    have 0.15 to 0.46 Pa s (Mohammed et al. 2014, doi:10.4236/eng.2014.65026). Particles move with the velocity after
    viscosity has acted. With U and no yield stress, particles move before viscosity acts, as in the paper."""
    consistency_pa_s_n: float | None = Field(default=None, ge=0, le=1e4)
    """Consistency K of the Herschel-Bulkley law, in Pa s^n. The stress is yield_stress_pa + K gamma^flow_index at a
    shear rate gamma. K is the viscosity at a shear rate of 1/s. Give K instead of viscosity_pa_s if flow_index is not
    1."""
    flow_index: float | None = Field(default=None, ge=0.2, le=2)
    """Power n of the shear rate in the stress. Default: 1, for a viscosity that does not depend on the shear rate. With
    n below 1, the paste is thinner at higher shear rates, and with n above 1 thicker. Values other than 1 need
    consistency_pa_s_n."""
    density_kg_m3: Annotated[float, DENSITY] = Field(default=1690.0, ge=1, le=2e4)
    """Density of the sealant. Default: cement paste with a water-cement ratio of 0.67, from cement of 3150 and water of
    1000 kg/m3. The density converts viscosity_pa_s into U, and relates stresses to weight. It does not change how fast
    sealant falls. A density below 1 would be a gas."""
    yield_stress_pa: float = Field(default=0.0, ge=0, le=1e4)
    """Yield stress of fresh paste. At lower stresses the paste does not flow. Cement grouts have 5 to 37 Pa (Mohammed
    et al. 2014, cited for viscosity_pa_s)."""
    structuration_pa_per_s: float = Field(default=0.0, ge=0, le=1e3)
    """Increase of the yield stress per second while the paste cures. The increase is the same at rest and in motion."""
    yield_stress_most_pa: float | None = Field(default=None, ge=0, le=1e4)
    """Yield stress at which the increase by structuration_pa_per_s ends. Default: the increase does not end."""
    curve: CurveOrFile | None = None
    """Viscosity and yield stress over age. It replaces U, viscosity_pa_s and the three settings of the yield stress.
    Give a CSV file, or its columns age_s, viscosity_pa_s and yield_stress_pa. Between rows the yield stress and the
    logarithm of the viscosity are linear. Outside the ages they are constant."""
    material: MaterialOrFile | None = None
    """File material.toml, written by 'sealtwin material'. It defines the yield stress, the density and, if measured,
    either the viscosity or consistency_pa_s_n and flow_index. Its uncertainties are used unless [uncertainty] declares
    others."""
    freeze_after_s: float | Literal["never"] = "never"
    """Age at which a particle is fixed in place, or "never". It models the stiffening of the sealant, which determines
    the slope of the settled surface. In Python the default is "never". A trial file must state the setting. The paper's
    solver had no yield stress, and fixed particles at 2.58 s so that fewer than 2,500 particles moved. Without freezing
    and without a yield stress, the surface becomes level."""

    @model_validator(mode="before")
    @classmethod
    def _beside_u(cls, table: Any) -> Any:
        """Add the paper's D_cm if U is given without D_cm. The trial then equals a trial that states this D_cm."""
        if isinstance(table, dict) and table.get("U") is not None and table.get("D_cm") is None:
            return {**table, "D_cm": PAPERS_D_CM}
        return table

    def loaded(self, folder: Path) -> Self:
        """Return a copy in which file names of tables are replaced by the tables. Paths are relative to ``folder``.

        Raises InputError for a file that cannot be used.
        """
        if isinstance(self.material, Path):
            return self._with(read_material(folder / self.material), folder / self.material)
        curve = read_curve(folder / self.curve) if isinstance(self.curve, Path) else self.curve
        return self.model_copy(update={"curve": curve})

    def _with(self, material: Material, file: Path) -> Self:
        """Return a copy with the values of a material, and with the material itself."""
        if (self.viscosity_pa_s is None) == (material.thickness is None):
            problem = "no viscosity: add fluid.viscosity_pa_s"
            if material.thickness is not None:
                measured = "a viscosity" if material.viscosity_pa_s is not None else "a consistency_pa_s_n"
                problem = (
                    f"{measured}, but fluid.viscosity_pa_s is {self.viscosity_pa_s:g}: leave fluid.viscosity_pa_s out"
                )
            raise InputError(f"{file}: the material has {problem}.")
        numbers = {
            "viscosity_pa_s": self.viscosity_pa_s or material.viscosity_pa_s,
            **{key: getattr(material, key) for key in OF_MATERIAL},
        }
        return self.model_copy(update={"material": material, **numbers})

    @property
    def given_by(self) -> str | None:
        """Key of ``LAWS`` that selects the law of flow. None if there is none.

        If a material file has been read, this is the key whose value comes from the material.
        """
        keys = [key for key in LAWS if getattr(self, key) is not None]
        return next((key for key in keys if not isinstance(getattr(self, key), Material)), None)

    @property
    def law(self) -> Law:
        return LAWS[present(self.given_by, "a law of flow")].law

    @property
    def course(self) -> Course:
        """Viscosity and yield stress over age, after files are loaded. The viscosity is NaN if U is given."""
        if isinstance(self.curve, Path):
            raise ValueError("curve is a file that has not been read: call loaded() first")
        if self.curve is not None:
            return self.curve.course
        viscosity_pa_s = np.nan if self.given_by in ("U", "material", None) else getattr(self, self.given_by)
        age_s, stress_pa = np.zeros(1), np.array([self.yield_stress_pa])
        if self.structuration_pa_per_s:
            most_pa = MAX_YIELD_PA if self.yield_stress_most_pa is None else self.yield_stress_most_pa
            age_s = np.array([0.0, (most_pa - self.yield_stress_pa) / self.structuration_pa_per_s])
            stress_pa = np.array([self.yield_stress_pa, most_pa])
        return Course(age_s, np.full(len(age_s), viscosity_pa_s), stress_pa)

    @property
    def fresh(self) -> "FreshPaste":
        """Viscosity and yield stress of the sealant as it leaves the nozzle."""
        viscosity, stress = self.course.at_age(np.zeros(1))
        return FreshPaste(None if np.isnan(viscosity[0]) else float(viscosity[0]), float(stress[0]))

    @property
    def yields(self) -> bool:
        """True if the paste has a yield stress at some age."""
        return bool(self.course.yield_stress_pa.any())

    @property
    def freezes(self) -> bool:
        """True if particles are fixed in place at some age."""
        return self.freeze_after_s != "never"

    @property
    def unread_by_fast_model(self) -> dict[str, Any]:
        """Settings that are not in ``FAST_READS`` and differ from their defaults, with these defaults."""
        # A trial file must state freeze_after_s. Only ``Fluid`` has a default for it.
        fields = {**type(self).model_fields, **Fluid.model_fields}.items()
        return {
            key: field.default for key, field in fields if key not in FAST_READS and getattr(self, key) != field.default
        }

    @property
    def suits_fast_model(self) -> bool:
        """True if the fast model, on which a plan is based, supports the sealant."""
        return not self.unread_by_fast_model and (self.yields or self.fresh.viscosity_pa_s is not None)

    def _check(self) -> None:
        if isinstance(self.material, Material):
            other = [key for key in OF_MATERIAL if getattr(self, key) != getattr(self.material, key)]
            if other:
                raise ValueError(f"{other[0]} differs from its value in material: leave out material or {other[0]}")
        self._check_law()
        if self.wall_share is not None and self.D_cm is not None:
            raise ValueError(
                f"wall_share is {self.wall_share:g} and D_cm is {self.D_cm:g}, but both set the drag of the walls: "
                "give D_cm with U, or wall_share with viscosity_pa_s"
            )
        if self.freeze_after_s != "never" and self.freeze_after_s <= 0:
            raise ValueError(f'freeze_after_s is {self.freeze_after_s}: give a number above 0, or "never"')
        if self.yield_stress_most_pa is not None and self.yield_stress_most_pa < self.yield_stress_pa:
            raise ValueError(
                f"yield_stress_most_pa is {self.yield_stress_most_pa:g}, below yield_stress_pa, which is "
                f"{self.yield_stress_pa:g}: curing only raises the yield stress. Give a larger yield_stress_most_pa"
            )

    def _check_law(self) -> None:
        """Raise ValueError unless the settings select exactly one law of flow."""
        if (key := self.given_by) is None:
            raise ValueError(f"no viscosity is given: give one of {', '.join(reversed(LAWS))}")
        # A flow index of 1 may be given with any law except the Herschel-Bulkley law.
        unset = {name: field.default for name, field in Fluid.model_fields.items()}
        conflicts = [name for name in excluded_by(key) if getattr(self, name) != unset[name]]
        if beside := [name for name in conflicts if (name, self.flow_index) != ("flow_index", 1.0)]:
            belongs = "; flow_index needs consistency_pa_s_n" if beside == ["flow_index"] else ""
            raise ValueError(
                f"{key} cannot be combined with {', '.join(beside)}, because each sets the law of flow: leave one of "
                f"them out{belongs}"
            )
        if key == "consistency_pa_s_n" and self.flow_index in (None, 1.0):
            raise ValueError(
                f"consistency_pa_s_n is {self.consistency_pa_s_n:g}: give flow_index too, or viscosity_pa_s instead"
            )


class PresetConstants(NamedTuple):
    """Constants of a preset, possibly changed by the user's settings."""

    iterations: int  # Pressure iterations per substep
    volume_factor: float
    """Volume of a particle in the density sum, divided by its volume by Eq. 6, 4 sqrt(2) f^3 R^3. If the run adjusts
    this factor, this is only the value at the start."""
    wall: Literal["calibrated", "source"]
    """Weight of wall particles in the density sum. calibrated: they replace the half of the kernel that is behind a
    wall. source: 1 / W(0), as in the paper's solver."""
    frozen_answer: float  # Multiplier of a frozen neighbour, divided by the particle's own


PACKING = 0.97  # The paper's f of Eq. 6: effective radius of a particle, divided by its radius


def particle_volume(radius: float) -> float:
    """Return the volume of a particle by Eq. 6, 4 sqrt(2) f^3 R^3, in the cube of the radius' unit."""
    return 4 * math.sqrt(2) * (PACKING * radius) ** 3


SPHERE = 4 / 3 * math.pi / particle_volume(1.0)
"""Volume of a sphere of radius R, divided by a particle's volume by Eq. 6: 0.811. The paper's solver uses it as a
particle's mass."""

# A run starts at this volume factor and ends between 0.95 and 1.20.
ACCURATE = PresetConstants(iterations=4, volume_factor=1.07, wall="calibrated", frozen_answer=1.0)
PRESETS = {
    "accurate": ACCURATE,
    "draft": ACCURATE,
    "paper": PresetConstants(iterations=4, volume_factor=SPHERE, wall="source", frozen_answer=0.0),
}


MAX_SUBSTEPS = 1000
STEEPEST_DEG = 45.0  # Largest allowed slope of a sample


class Solver(Settings):
    """Settings of the numerical method. Equations: Macklin & Müller 2013 (PBF), and the paper's Eqs 1 to 6."""

    model: Method | None = None
    """Model of the flow. particles (default): the fluid in three dimensions. slot: the flow along the crack, averaged
    over sections. slot takes a tenth of a second, and is meant for screening. It models neither the jet nor overspill.
    The report states for which cases it is valid."""
    preset: Literal["accurate", "draft", "paper"] = "accurate"
    """Preset of the particle model. accurate: the sealant keeps its dispensed volume. draft: the same fluid with larger
    particles and longer substeps, for searches. paper: the constants of the paper's solver, with which the sealant
    loses a fifth to a quarter of its volume. The level measured in the paper agrees with accurate if the walls flare,
    and with paper if they lean."""
    radius_mm: Annotated[float, Field(gt=0, le=10)] | Literal["auto"] = "auto"
    """Radius of a particle. "auto" chooses the radius for four particles across this crack or, if that needs too many
    particles, the smallest possible radius. The paper has 0.4, which is four particles across its crack of 3.1 mm.
    A draft replaces a smaller radius by the radius for 2.6 particles across, or by one up to a tenth smaller with which
    two particles leave the nozzle together. With half the radius, a run takes about ten times as long."""
    accurate_radius_mm: float | None = Field(default=None, gt=0, le=10)
    """Radius that a draft has replaced. Only the record of a draft has this setting. If it is given, radius_mm, U and
    D_cm are the values of the draft. Otherwise a draft replaces radius_mm, and converts U and D_cm to its particles."""
    substeps: int | None = Field(default=None, ge=1, le=MAX_SUBSTEPS)
    """Number of substeps per frame. Default: enough that g dt², with the substep dt, is below 0.03 h, or below 0.035 h
    if pressure is carried over. With the default, a run that fails is computed again with twice as many. Compression
    decreases with the square of the number of substeps."""
    iterations: int | None = Field(default=None, ge=1, le=1000)
    """Number of pressure iterations per substep. Default: 4, or 3 if pressure is carried over from the last substep.
    Pressure is carried over if the fluid is viscous enough, and is given in physical units or has a yield stress."""
    volume_factor: float | None = Field(default=None, ge=0.5, le=2)
    """Volume of a particle in the density sum, divided by its volume by Eq. 6. Default: 0.811 with preset paper. With
    the other presets, the factor is adjusted during the run so that the sealant keeps its dispensed volume, and the run
    records the last value."""
    relaxation: float = Field(default=1.5, ge=1e-3, le=1e3)
    """Relaxation epsilon of Eq. 1, multiplied by h^2. With the default, epsilon is 60 per cm2 at h = 1.6 mm, as in the
    paper. At 0, the multiplier of an isolated particle would be undefined. With far larger values than allowed, there
    would be no pressure."""
    damping_per_s: float = Field(default=0.2, ge=0, le=1e3)
    """Damping eta of Eq. 4, as a rate. It is not divided by a particle's mass of 0.3 mg, which would be unstable. It
    may be at most 1 divided by the substep (550 in the paper's trial). At this value, a particle loses all its speed in
    a substep."""
    viscosity_solve: Literal["implicit", "explicit"] = "implicit"
    """Solution of the viscosity. implicit: one linear solve per substep for any U, which conserves momentum, with the
    pair weight (1 - r²/h²)³. explicit: Eq. 5 in q passes with exp(-r²/h²) up to h, as in the paper, as a reference.
    Both give the same viscosity. explicit is slow for U above 1000 or D above 1. At most 5000 passes are allowed, which
    is enough for yield stresses below 1 Pa."""
    sleep: bool = True
    """If True, paste with a yield stress is no longer computed once it has come to rest, until something hits it or
    flows past it. The settled sealant is nearly the same, and the run takes only 60 to 75 % of the time."""
    settle_s: float = Field(default=2.0, ge=0, le=3600)
    """Time between the last release of sealant and the measurement of the profile. In the default time, a paste comes
    to rest. It is 0 in the paper."""

    def _check(self) -> None:
        if self.accurate_radius_mm is not None and (self.preset != "draft" or self.radius_mm == "auto"):
            raise ValueError(
                f"accurate_radius_mm is {self.accurate_radius_mm:g}: only the record of a draft has this setting, with "
                "a number for radius_mm. Leave it out"
            )

    @property
    def has_particles(self) -> bool:
        """True for the particle model.

        False for the fast model, for which there are no device, no checkpoints and no estimate of the time.
        """
        return self.model != FAST

    @property
    def size_mm(self) -> float:
        """Particle radius in mm. Raises ValueError for "auto", which a run replaces by a number."""
        if self.radius_mm == "auto":
            raise ValueError('radius_mm = "auto" needs the crack\'s width: give a number')
        return self.radius_mm

    @property
    def scheme(self) -> PresetConstants:
        """Constants of the preset, some of which are replaced by the user's settings."""
        preset = PRESETS[self.preset]
        return preset._replace(
            iterations=self.iterations or preset.iterations, volume_factor=self.volume_factor or preset.volume_factor
        )

    @property
    def keeps_volume(self) -> bool:
        """True if the run adjusts its volume factor."""
        return self.preset != "paper" and self.volume_factor is None


class SampleSlope(Settings):
    """Slope of the sample's face.

    Coordinates are always relative to the face. The slope changes the direction of gravity.
    """

    crossfall_deg: Annotated[float, SLOPE] = Field(default=0.0, ge=-STEEPEST_DEG, le=STEEPEST_DEG)
    """Slope of the face along y. If it is above 0, the face rises towards +y and sealant runs towards -y. In the plane
    of y and z, this is the angle between the face and the surface of a liquid at rest."""
    gradient_deg: Annotated[float, SLOPE] = Field(default=0.0, ge=-STEEPEST_DEG, le=STEEPEST_DEG)
    """Slope of the face along x. If it is above 0, the face rises towards +x and sealant runs towards -x."""

    @property
    def level(self) -> bool:
        return self.crossfall_deg == 0 == self.gradient_deg

    @property
    def table(self) -> dict[str, Any]:
        """Table [sample] of a run's recorded settings. It is empty for a level sample."""
        return {} if self.level else {"sample": self.model_dump()}

    @property
    def down(self) -> tuple[float, float, float]:
        """Unit vector of gravity in the sample's coordinates."""
        x, y = (math.tan(math.radians(angle)) for angle in (self.gradient_deg, self.crossfall_deg))
        length = math.hypot(x, y, 1.0)
        # The components are subtracted from 0.0, so that a level sample has 0.0 and not -0.0.
        return 0.0 - x / length, 0.0 - y / length, -1.0 / length


LEVEL = SampleSlope()


class Nozzle(Settings):
    """The outlet of the nozzle. Its path, height and flow are in the trajectory."""

    diameter_mm: Annotated[Annotated[float, Field(gt=0, le=100)] | Literal["auto"], NOZZLE] = "auto"
    """Inner diameter of the nozzle. "auto" is the paper's 2.4, or the mean width of a crack that is narrower, since a
    wider nozzle leaves sealant on the face. Sealant is released in layers of as many particles as fit into a disc of
    this diameter: seven with a radius of 0.4 and a diameter of 2.4."""

    @property
    def size_mm(self) -> float:
        """Diameter in mm. Raises ValueError for "auto", which ``over`` replaces by a number."""
        if self.diameter_mm == "auto":
            raise ValueError('diameter_mm = "auto" needs the crack\'s width: call over() first')
        return self.diameter_mm

    def over(self, width_mm: float) -> "Nozzle":
        """Return the nozzle for a crack of this mean width, with its diameter as a number."""
        if self.diameter_mm != "auto":
            return self
        return Nozzle(diameter_mm=min(PAPERS_NOZZLE_MM, float(f"{width_mm:.3g}")))
