"""Figures of a run other than its particles: numerical health, and the fill that the fast model computes."""

from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict

from sealtwin.core.facts import Fact

Method = Literal["particles", "slot"]
"""Method that fills a crack: particles in three dimensions, or the fast model, the flow averaged over sections."""
PARTICLES, FAST = get_args(Method)
BRIDGES = "fluid.bridges"  # Key of the doubt about paste that its yield stress supports between the walls
Known = Annotated[
    float | None, BeforeValidator(lambda value: None if isinstance(value, float) and not np.isfinite(value) else value)
]
"""A number, or None if it does not exist, such as the error of a stretch without readings."""


class RunHealth(BaseModel):
    """Numbers that a run records about itself. A number is None if it was not recorded or does not exist.

    Labels and units of all are in the report's table of numerical health.
    """

    # The solver may record more.
    model_config = ConfigDict(frozen=True, extra="allow")

    density_error_mean: Known = None  # Compression as a share of the rest density, like the next two
    density_error_p95: Known = None
    density_error_max: Known = None
    most_neighbours: int | None = None
    moving_mean: Known = None
    moving_most: int | None = None
    viscosity_iterations_mean: Known = None
    viscosity_iterations_most: int | None = None
    frames: int | None = None
    frame_s: Known = None
    substeps: int | None = None
    finer: int | None = None  # Substeps over those of the settings, if the run failed with fewer
    particles_a_release: int | None = None
    wall_particles: int | None = None
    particles_across: Known = None
    setup_s: Known = None  # Computing time before the first frame
    frames_s: Known = None  # Computing time of all frames
    viscosity_m2_s: Known = None  # None for U without a yield stress, since U is not a viscosity
    viscosity_pa_s: Known = None
    viscosity_added_m2_s: Known = None  # Numerical viscosity that the particles add
    U: Known = None
    D_cm: Known = None
    yield_stress_pa: Known = None
    reynolds: Known = None
    bond: Known = None
    bingham: Known = None
    volume_factor: Known = None  # Volume of a particle in the density sum over that of Eq. 6, at the end
    volume_ratio: Known = None  # Volume of the settled particles over the dispensed volume
    flat_mm: Known = None  # Level at rest of a fluid without yield stress that does not freeze; None for others
    to_rest_mm: Known = None  # Distance of the level from that at rest, at 95 % of the places

    def recorded(self) -> dict[str, Any]:
        """Return the recorded numbers by name."""
        return self.model_dump(exclude_unset=True)


class FastFill(BaseModel):
    """Volumes of sealant by place in a run of the fast model, and the figures that bound the model's domain."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    dispensed_mm3: float
    in_crack_mm3: float  # Below the face
    above_face_mm3: float
    in_flight_mm3: float  # Dispensed but still falling at the end of the run
    held_slope: float  # Slope at which the paste rests between the walls
    mound_mm: float  # Height of the mound that remains at the nozzle's last position
    fill: float  # Dispensed volume over the volume of the crack
    above_mm: float  # Highest level above the face; 0 if the level stays below it
    unfit: tuple[Fact, ...]  # Reasons why the model is unfit for the case; empty if it is fit


class FilledBy:
    """Base class of the records of a run. It states whether the run was computed with particles or the fast model."""

    fast_fill: FastFill | None  # None for a run of particles

    @property
    def has_particles(self) -> bool:
        """False for the fast model, which has no particles."""
        return self.fast_fill is None

    @property
    def unfit(self) -> tuple[Fact, ...]:
        """Reasons why the fast model is unfit for the case; empty for particles."""
        return () if self.fast_fill is None else self.fast_fill.unfit
