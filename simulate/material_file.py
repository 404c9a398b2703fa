"""A measured paste: the file material.toml with method, date, uncertainties and limits of use."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from sealtwin.core.errors import InputError
from sealtwin.core.records import DataKind
from sealtwin.core.settings import Settings, checked, read_toml
from simulate.shear_law import Law

Sentence = Annotated[str, Field(min_length=1, max_length=300, pattern=r"^[^\x00-\x1f\x7f]*$")]
# Not strict: after a validator with mode="before", pydantic no longer accepts a JSON list as a tuple.
Sentences = Annotated[tuple[Sentence, ...], Field(max_length=20, strict=False)]
Interval = Annotated[tuple[float, float], Field(strict=False)]
NAME = "material file"
KEY_OF_LAW = {Law.BINGHAM: "viscosity_pa_s", Law.HERSCHEL_BULKLEY: "consistency_pa_s_n"}
"""Key for the viscosity in a material file, for each law of flow that a material can have."""
STARTER = "'sealtwin material spread PHOTO' or 'sealtwin material rheometer CSV' writes one"


class Material(Settings):
    """A measured paste, written by 'sealtwin material'. Errors are standard uncertainties."""

    method: Sentence
    """Method of the measurement. Different methods give different numbers."""
    date: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")]
    """Day of the measurement, for example 2026-11-21."""
    data: DataKind
    """Origin of the photo or table from which the paste was measured."""
    yield_stress_pa: float = Field(ge=0, le=1e4)
    """Yield stress of the fresh paste."""
    yield_stress_error_pa: float = Field(ge=0, le=1e4)
    """Standard uncertainty of the yield stress, which is a quarter of the width of its 95 % interval."""
    yield_stress_95_pa: Interval
    """95 % interval of the yield stress."""
    viscosity_pa_s: float | None = Field(default=None, gt=0, le=1e4)
    """Plastic viscosity (Bingham). None if it was not measured."""
    consistency_pa_s_n: float | None = Field(default=None, gt=0, le=1e4)
    """Consistency K of the Herschel-Bulkley law. It is given instead of a viscosity."""
    consistency_95_pa_s_n: Interval | None = None
    """95 % interval of K. The errors of K and n are correlated, so the ends of both intervals do not belong to one flow
    curve."""
    flow_index: float | None = Field(default=None, ge=0.2, le=2)
    """Flow index n of the Herschel-Bulkley law."""
    flow_index_95: Interval | None = None
    """95 % interval of n. If a viscosity is given, the interval includes 1."""
    viscosity_error_percent: float | None = Field(default=None, ge=0, le=1000)
    """Standard uncertainty of the viscosity, or of the viscous stress K rate^n in the middle of the measured shear
    rates. An uncertainty budget changes K by this percentage at the same n."""
    shear_rates_per_s: Interval | None = None
    """Smallest and largest shear rate of the fitted rows."""
    density_kg_m3: float = Field(ge=1, le=2e4)
    """Density of the paste."""
    density_error_kg_m3: float = Field(ge=0, le=2e4)
    """Standard uncertainty of the density."""
    basis: Sentences = ()
    """Sentences that state what was measured, and the sources of the uncertainty."""
    not_for: Sentences
    """Purposes for which these numbers must not be used."""
    doubts: Sentences = ()
    """Sentences about effects that were measured but are not part of the law of flow. Reports show them on page one."""
    radius_mm: float | None = Field(default=None, gt=0, le=10)
    """Particle radius of the runs with which these values were calibrated. A run with another radius is refused."""
    substeps: int | None = Field(default=None, ge=1, le=1000)
    """Number of substeps per frame in the runs of the calibration."""

    @property
    def thickness(self) -> tuple[str, float] | None:
        """Measured viscosity or consistency: its key in [fluid], and its value. None if neither was measured."""
        values = {"viscosity_pa_s": self.viscosity_pa_s, "consistency_pa_s_n": self.consistency_pa_s_n}
        return next(((key, value) for key, value in values.items() if value is not None), None)

    def _check(self) -> None:
        low, high = self.yield_stress_95_pa
        if not low <= self.yield_stress_pa <= high:
            raise ValueError(
                f"yield_stress_pa is {self.yield_stress_pa:g}, which is outside yield_stress_95_pa, {low:g} to {high:g}"
            )
        if (self.consistency_pa_s_n is None) != (self.flow_index is None):
            raise ValueError("consistency_pa_s_n and flow_index belong together: give both, or leave both out")
        if self.viscosity_pa_s is not None and self.consistency_pa_s_n is not None:
            raise ValueError("viscosity_pa_s and consistency_pa_s_n belong to different laws of flow: give only one")
        if (self.thickness is None) != (self.viscosity_error_percent is None):
            raise ValueError(
                "viscosity_error_percent is the uncertainty of viscosity_pa_s or consistency_pa_s_n: give it together "
                "with one of these, or leave both out"
            )


def read_material(path: Path) -> Material:
    """Read a material.toml. Raises InputError if it is missing or invalid."""
    content = read_toml(path, name=NAME, starter=STARTER)
    if content and not content.keys() & Material.model_fields.keys():
        raise InputError(f"{path}: not a {NAME}: its key {next(iter(content))} is not a key of such a file. {STARTER}.")
    return checked(Material, path, content)
