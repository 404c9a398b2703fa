"""Determine the yield stress of a paste from its spread on a plate."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from digitise.settings import PhotoInput
from digitise.spread import SpreadBlob, measure_spread
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats
from sealtwin.material import MeasuredPaste, PasteSettings, PasteValue, by_source, measured_material
from simulate.spread_law import HIGHEST, flat_stress_pa, heap_height_mm, stretched_stress_pa

DRAWS, SEED = 4000, 16
EDGE_N_M = 0.005
"""Coefficient lambda of surface tension for cement pastes, in N/m (Roussel et al. 2005).

Surface tension carries the stress lambda R^2 / V, with R the radius and V the volume of the spread. This stress is
subtracted to get the yield stress."""
EDGE_ERROR_N_M = 0.0015  # Standard uncertainty of lambda, in N/m, if it was not measured. Its value has only one digit
CONE_ERROR_MM = 0.1  # Standard uncertainty of each dimension of a cone in mm, measured with a caliper
MASS_ERROR_G = 0.1  # Standard uncertainty of the mass in g: a kitchen scale, and paste left in the cone
FORMULA = (
    0.25  # Standard uncertainty of the closed form, as a fraction of its stretching term (neglected higher orders)
)
NOT_FOR = (
    "a paste of another age, batch or temperature: pastes stiffen with time and thin when sheared",
    "a flow that is faster than a spread, unless the viscosity was measured with a rheometer",
    "walls on which the paste slips: the plate is assumed to be rough",
    "comparison with a number from another method, unless both methods are named",
)


ConeSize = Annotated[float, Field(ge=0.5, le=1000)]


class Heap(PasteSettings):
    """Settings of a paste that spreads on a plate: options of 'sealtwin material spread'."""

    cone_mm: tuple[ConeSize, ConeSize, ConeSize] | None = None
    """Lower and upper inner diameter of the cone, and its height: 38x19x57 for Kantro's mini-cone."""
    mass_g: float | None = Field(default=None, gt=0, le=1e5)
    """Mass of the paste on the plate. Default: the mass of the full cone."""
    mass_error_g: float = Field(default=MASS_ERROR_G, gt=0, le=1e4)
    """Standard uncertainty of the mass."""
    edge_n_m: float = Field(default=EDGE_N_M, ge=0, le=0.1)
    """Coefficient lambda of surface tension. The default is a value for cement paste."""
    edge_error_n_m: float = Field(default=EDGE_ERROR_N_M, ge=0, le=0.1)
    """Standard uncertainty of lambda."""

    @field_validator("cone_mm")
    @classmethod
    def _wider_below(cls, cone_mm: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        if cone_mm is not None and cone_mm[1] > cone_mm[0]:
            raise ValueError(
                f"the upper diameter {cone_mm[1]:g} is larger than the lower diameter {cone_mm[0]:g}; give the larger, "
                "lower diameter first"
            )
        return cone_mm

    def _check(self) -> None:
        if self.mass_g is None and self.cone_mm is None:
            raise ValueError("the amount of paste is missing; give mass_g, or cone_mm if the cone was full")


@dataclass(frozen=True)
class PasteEstimate(PasteValue):
    """Yield stress in Pa, with further figures of the spread."""

    flat_pa: float  # Yield stress in Pa from the formula of Roussel and Coussot for a flat spread
    height_to_radius: float
    volume_mm3: float
    parts: dict[str, float]  # Standard uncertainty in Pa, by source


def estimate(heap: Heap, spread: SpreadBlob) -> PasteEstimate:
    """Return the yield stress that follows from a spread. Raises InputError if the spread does not determine it."""
    random = np.random.default_rng(SEED)
    noise = {name: random.standard_normal(DRAWS) for name in ("density", "radius", "surface tension", "law", "mass")}
    sizes = random.standard_normal((3, DRAWS))

    def computed(*sources: str) -> tuple[Floats, Floats, Floats, Floats]:
        """Return four values for random errors of ``sources``, (draws,) each.

        They are the yield stress, the stress including surface tension, the stress by the flat formula, and the volume.
        """
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
            raise InputError(
                "the uncertainty of mass, density or spread is as large as the value. Measure this value more exactly."
            )
        flat = flat_stress_pa(volume, radius, density)
        closed = stretched_stress_pa(volume, radius, density)
        closed += FORMULA * off["law"] * (flat - closed)
        # Surface tension carries a stress of lambda R^2 / V.
        return closed - edge * (1e-3 * radius) ** 2 / (1e-9 * volume), closed, flat, volume

    drawn = computed(*noise)[0]
    exact = computed()
    stress, _, flat, volume = (float(values[0]) for values in exact)
    height = float(heap_height_mm(exact[1], spread.radius_mm, heap.density_kg_m3)[0]) / spread.radius_mm
    if height > HIGHEST:
        raise InputError(
            f"the height of the spread is {height:.2f} times its radius, but the formula is only valid up to "
            f"{HIGHEST:g}. Spread more paste, or use a rheometer."
        )
    if not stress > 0:
        raise InputError(
            f"the paste spread to a diameter of {2 * spread.radius_mm:.0f} mm, as water would do, so no yield stress "
            "can be determined. Check mass and density, or use a stiffer paste."
        )
    low, high = np.quantile(drawn, (0.025, 0.975)).tolist()
    parts = {name: float(computed(name)[0].std()) for name in noise}
    interval = max(0.0, min(low, stress)), max(high, stress)
    return PasteEstimate(stress, (high - low) / 4, interval, flat, height, volume, parts)


def material_of(photo: PhotoInput, heap: Heap, warn: Callable[[str], None]) -> MeasuredPaste:
    """Measure a spread in a photo, and return the paste. Raises InputError if the photo does not determine it."""
    spread = measure_spread(photo, Path())
    for warning in spread.warnings:
        warn(warning.text)
    stress = estimate(heap, spread)
    small, large = spread.diameters_mm
    material = measured_material(
        photo.file,
        heap,
        stress,
        method="spread: closed form with stretching, minus surface tension",
        basis=(
            f"spread with a mean diameter of {2 * spread.radius_mm:.2f} mm from its area ({small:.1f} to "
            f"{large:.1f} mm across), {stress.volume_mm3 / 1000:.4g} ml",
            f"height divided by radius {stress.height_to_radius:.3f}; the flat formula of Roussel and Coussot gives "
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
