"""Figures of a run: its numerical health, and the fill that the fast model computes."""

from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict

from sealtwin.core.facts import Facts

Method = Literal["particles", "slot"]
"""Method that fills a crack.

particles: particles in three dimensions; slot: the fast model, which averages the flow over cross-sections."""
PARTICLES, FAST = get_args(Method)
BRIDGES = "fluid.bridges"  # Key of the warning about a paste whose yield stress may hold it up between the walls
Known = Annotated[
    float | None, BeforeValidator(lambda value: None if isinstance(value, float) and not np.isfinite(value) else value)
]
"""A number, or None if it does not exist, such as the error of a stretch without readings."""


class RunHealth(BaseModel):
    """Numbers that show the numerical health of a run. A number is None if it was not recorded or does not apply.

    The report's table of numerical health has a label and a unit for each number.
    """

    # The solver may record further numbers.
    model_config = ConfigDict(frozen=True, extra="allow")

    density_error_mean: Known = None  # Compression as a fraction of the rest density, like the next two
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
    finer: int | None = None  # Factor by which the substeps were increased, if the run failed with fewer
    particles_a_release: int | None = None
    wall_particles: int | None = None
    particles_across: Known = None
    setup_s: Known = None  # Computing time before the first frame
    frames_s: Known = None  # Computing time of all frames
    viscosity_m2_s: Known = None  # Viscosity over density. None for U without a yield stress: U is not a viscosity
    viscosity_pa_s: Known = None
    viscosity_added_m2_s: Known = None  # Numerical viscosity that the particles add
    U: Known = None
    D_cm: Known = None
    yield_stress_pa: Known = None
    reynolds: Known = None
    bond: Known = None
    bingham: Known = None
    volume_factor: Known = None  # Final particle volume in the density sum, divided by the volume of Eq. 6
    volume_ratio: Known = None  # Volume of the settled particles divided by the dispensed volume
    flat_mm: Known = None  # Level at rest. None for a fluid that has a yield stress or freezes
    to_rest_mm: Known = None  # 95th percentile of the distance between the level and the level at rest

    def recorded(self) -> dict[str, Any]:
        """Return the recorded numbers by name."""
        return self.model_dump(exclude_unset=True)


class FastFill(BaseModel):
    """Result of the fast model: volumes of sealant, and the figures that show whether the model is valid."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    dispensed_mm3: float
    in_crack_mm3: float  # Volume below the face
    above_face_mm3: float
    in_flight_mm3: float  # Volume that is dispensed but still falling at the end of the run
    held_slope: float  # Slope at which the paste rests between the walls
    mound_mm: float  # Height of the mound that remains at the nozzle's last position
    fill: float  # Dispensed volume divided by the volume of the crack
    above_mm: float  # Highest level above the face. 0 if the level stays below the face
    unfit: Facts  # Reasons why the model is not valid for this case. Empty if it is valid


class FilledBy:
    """Base class of the records of a run. It states whether particles or the fast model computed the run."""

    fast_fill: FastFill | None  # Result of the fast model. None for a run with particles

    @property
    def has_particles(self) -> bool:
        """True for a run with particles, False for the fast model."""
        return self.fast_fill is None

    @property
    def unfit(self) -> Facts:
        """Reasons why the fast model is not valid for this case. Empty for a run with particles."""
        return () if self.fast_fill is None else self.fast_fill.unfit
