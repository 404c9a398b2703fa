"""Determine a paste's yield stress from its spread on a plate."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from digitise.settings import PhotoInput
from digitise.spread import SpreadBlob, measure_spread
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats
from sealtwin.material import MeasuredPaste, PasteOnPlate, PasteValue, by_source, measured_material
from simulate.spread_law import HIGHEST, flat_stress_pa, heap_height_mm, stretched_stress_pa

DRAWS, SEED = 4000, 16
CONE_ERROR_MM = 0.1  # Standard uncertainty of each size of a cone, by caliper
MASS_ERROR_G = 0.1  # Standard uncertainty: a kitchen scale, and paste that sticks to the cone
FORMULA = 0.25  # Standard uncertainty of the closed form over its stretching term: higher orders are neglected
NOT_FOR = (
    "a paste of another age, batch or temperature: pastes stiffen with time and thin when sheared",
    "flow that is faster than a spread, unless the viscosity was measured with a rheometer",
    "walls on which the paste slips: the plate is assumed to be rough",
    "comparison with a number from another method, unless both methods are named",
)


ConeSize = Annotated[float, Field(ge=0.5, le=1000)]


class Heap(PasteOnPlate):
    """Amount, density and initial shape of a paste that spreads: options of 'sealtwin material spread'."""

    cone_mm: tuple[ConeSize, ConeSize, ConeSize] | None = None
    """The cone's inner diameters below and above, and its height: 38x19x57 for Kantro's mini-cone."""
    mass_g: float | None = Field(default=None, gt=0, le=1e5)
    """Mass of the paste on the plate; default: the mass of the full cone."""
    mass_error_g: float = Field(default=MASS_ERROR_G, gt=0, le=1e4)
    """Standard uncertainty of the mass."""

    @field_validator("cone_mm")
    @classmethod
    def _wider_below(cls, cone_mm: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        if cone_mm is not None and cone_mm[1] > cone_mm[0]:
            raise ValueError(f"the larger end of the cone is below, so {cone_mm[1]:g} comes before {cone_mm[0]:g}")
        return cone_mm

    @model_validator(mode="after")
    def _has_an_amount(self) -> Self:
        if self.mass_g is None and self.cone_mm is None:
            raise ValueError("a spread needs the amount of paste: give mass_g, or cone_mm if the cone was full")
        return self


@dataclass(frozen=True)
class PasteEstimate(PasteValue):
    """Yield stress in Pa, with the figures that it was computed from."""

    flat_pa: float  # By Roussel and Coussot's formula alone
    height_to_radius: float
    volume_mm3: float
    parts: dict[str, float]  # Standard uncertainty by source, Pa


def estimate(heap: Heap, spread: SpreadBlob) -> PasteEstimate:
    """Return the yield stress that a spread shows. Raises InputError if the spread does not determine it."""
    random = np.random.default_rng(SEED)
    noise = {name: random.standard_normal(DRAWS) for name in ("density", "radius", "surface tension", "law", "mass")}
    sizes = random.standard_normal((3, DRAWS))

    def computed(*sources: str) -> tuple[Floats, Floats, Floats, Floats]:
        """Return stress, stress with the part of surface tension, flat formula and volume, with errors of sources."""
        off = {name: values * (name in sources) for name, values in noise.items()}
        density = heap.density_kg_m3 + heap.spread_of_density * off["density"]
        if heap.mass_g is not None:
            volume = 1e6 * (heap.mass_g + heap.mass_error_g * off["mass"]) / density
        else:
            cone_mm = np.array(present(heap.cone_mm, "cone_mm"))[:, None]
            a, b, c = cone_mm + CONE_ERROR_MM * sizes * ("mass" in sources)
            volume = np.pi / 12 * c * (a * a + a * b + b * b)
        radius = spread.radius_mm + spread.radius_error_mm * off["radius"]
        edge = np.maximum(heap.edge_n_m + heap.edge_error_n_m * off["surface tension"], 0.0)
        if (np.minimum(volume, np.minimum(radius, density)) <= 0).any():
            raise InputError("the uncertainty of mass, density or spread is as large as its value: measure it better.")
        flat = flat_stress_pa(volume, radius, density)
        closed = stretched_stress_pa(volume, radius, density)
        closed += FORMULA * off["law"] * (flat - closed)
        # Surface tension carries lambda R^2 / V of the stress.
        return closed - edge * (1e-3 * radius) ** 2 / (1e-9 * volume), closed, flat, volume

    drawn = computed(*noise)[0]
    exact = computed()
    stress, _, flat, volume = (float(values[0]) for values in exact)
    height = float(heap_height_mm(exact[1], spread.radius_mm, heap.density_kg_m3)[0]) / spread.radius_mm
    if height > HIGHEST:
        raise InputError(
            f"the heap's height is {height:.2f} times its radius; the closed form is valid up to {HIGHEST:g}: spread "
            "more paste, or use a rheometer."
        )
    if not stress > 0:
        raise InputError(
            f"the paste spread to {2 * spread.radius_mm:.0f} mm, as far as water would against surface tension: this "
            "shows no yield stress. Check mass and density, or take a thicker paste."
        )
    low, high = np.quantile(drawn, (0.025, 0.975)).tolist()
    parts = {name: float(computed(name)[0].std()) for name in noise}
    interval = max(0.0, min(low, stress)), max(high, stress)
    return PasteEstimate(stress, (high - low) / 4, interval, flat, height, volume, parts)


def material_of(photo: PhotoInput, heap: Heap, warn: Callable[[str], None]) -> MeasuredPaste:
    """Measure a spread in a photo and return the paste. Raises InputError if the photo does not determine it."""
    spread = measure_spread(photo, Path())
    for warning in spread.warnings:
        warn(warning.text)
    stress = estimate(heap, spread)
    small, large = spread.diameters_mm
    material = measured_material(
        photo.file,
        heap,
        stress,
        method="spread, closed form with stretching, surface tension's term subtracted",
        basis=(
            f"spread of {2 * spread.radius_mm:.2f} mm by its area ({small:.1f} to {large:.1f} mm across), "
            f"{stress.volume_mm3 / 1000:.4g} ml",
            f"height over radius {stress.height_to_radius:.3f}; Roussel and Coussot's flat formula alone gives "
            f"{stress.flat_pa:.4g} Pa",
            by_source(stress.parts),
        ),
        not_for=NOT_FOR,
    )
    figures = {
        "spread_mm": 2 * spread.radius_mm,
        "spread_error_mm": 2 * spread.radius_error_mm,
        "unround": spread.unround,
        "height_to_radius": stress.height_to_radius,
        "flat_formula_pa": stress.flat_pa,
        "parts_pa": stress.parts,
    }
    return MeasuredPaste(material, figures)
