"""Rheology of a sealant in the solver's units, and the fluids' constants on the device."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from sealtwin.core.records import Floats
from simulate.kernels import viscosity as device_code
from simulate.setup.resolution import ACCURATE_RESOLUTION
from simulate.shear_law import Law, apparent_viscosity

VISCOSITY_PER_U = 0.1185
"""Factor that converts U into the kinematic viscosity, nu = VISCOSITY_PER_U U h^4 / dt, with lengths in cm. It is half
the second moment of the weight, divided by h^4. Shear waves confirmed it to 5 %."""
PARTICLE_VISCOSITY = 0.010
"""Viscosity that particles add to a fluid because they push each other, divided by R^2 / dt, at the substep of preset
accurate. It was measured to a factor of two, in shear waves of 30 to 300 mm/s and in channels."""
DAMPING_FACTOR = 33.0
"""Factor of nu dt / h^2 in the damping. It is a third of the sum of a particle's pair weights in a liquid."""
OSCILLATION_SHEAR_PER_S = 10.0
"""Shear rate, in 1/s, in a column of weak paste that oscillates under its own pressure."""
CM2_IN_M2 = 1e4
NEVER = 2**30  # Value of an age in frames that means never


class Rheology(NamedTuple):
    """Rheology of one run. The weights of Eq. 5 are for a whole frame. Stresses are divided by the density."""

    viscous_weight: float  # U of Eq. 5.
    wall_weight_cm: float  # D of Eq. 5.
    viscosity_pa_s: float = 0.0  # Viscosity of fresh paste at a shear rate of 1/s, as given or computed from U
    sticks: bool = False  # True if the fluid sticks to walls by its viscosity. D is then 0.
    wall_share: float = 1.0  # Stress at a wall, divided by the stress inside the fluid
    law: Law = Law.HERSCHEL_BULKLEY
    flow_index: float = 1.0
    yield_cm2_s2: float = 0.0  # Yield stress of fresh paste
    frames_to_freeze: int = NEVER
    physical: bool = False  # True if the viscosity was given in physical units, not as the paper's U
    by_age: Floats | None = None
    """U and yield stress by age in frames, (n, 2). The last row applies to later ages. None if both are constant."""

    @property
    def course(self) -> Floats:
        """U and yield stress by age in frames, (n, 2)."""
        if self.by_age is not None:
            return self.by_age
        return np.array([[self.viscous_weight, self.yield_cm2_s2]])

    @property
    def yields(self) -> bool:
        """True if the paste has a yield stress at some age."""
        return bool(self.course[:, 1].any())

    @property
    def moves_after_viscosity(self) -> bool:
        """True if particles move after viscosity has acted. In the paper's Algorithm 1, they move before."""
        return self.yields or self.physical

    def apparent_cm2_s(self, shear_per_s: float, support: float, frame_s: float, *, yields: bool = True) -> Floats:
        """Return the kinematic viscosity in cm2/s at a shear rate, by age in frames, (n,). ``support`` is h in cm.

        If ``yields`` is False, the yield stress is left out.
        """
        weight, stress = self.course.T
        viscosity = kinematic_viscosity(1.0, support, frame_s) * weight
        return np.asarray(
            apparent_viscosity(self.law, viscosity, stress if yields else 0 * stress, shear_per_s, self.flow_index)
        )

    def damping(self, support: float, frame_s: float, substeps: int) -> float:
        """Return the fraction of a particle's speed that viscosity removes in a substep among neighbours at rest.

        It is computed to first order at ``OSCILLATION_SHEAR_PER_S``. The smallest value over all ages is returned.
        ``support`` is h in cm.
        """
        viscosity = self.apparent_cm2_s(OSCILLATION_SHEAR_PER_S, support, frame_s)
        return float(DAMPING_FACTOR * viscosity.min() * frame_s / substeps / support**2)


def kinematic_viscosity(weight: float, support: float, step_s: float) -> float:
    """Return the kinematic viscosity in cm2/s if Eq. 5 with U = ``weight`` is applied once in ``step_s``."""
    return VISCOSITY_PER_U * weight * support**4 / step_s


def dynamic_viscosity(weight: float, density_kg_m3: float, support: float, step_s: float) -> float:
    """Return the viscosity in Pa s of Eq. 5 with U = ``weight``, for particles that move after viscosity has acted."""
    return kinematic_viscosity(weight, support, step_s) / CM2_IN_M2 * density_kg_m3


def viscous_weight(kinematic: float, support: float, step_s: float) -> float:
    """Return U for a kinematic viscosity in cm2/s, if Eq. 5 is applied once in ``step_s``."""
    return kinematic * step_s / (VISCOSITY_PER_U * support**4)


def added_viscosity(radius: float, step_s: float) -> float:
    """Return the kinematic viscosity in cm2/s that particles add to any fluid. ``radius`` is in cm.

    If substeps are shorter than with preset accurate, particles push each other more often and add more viscosity.
    """
    usual_s = math.sqrt(ACCURATE_RESOLUTION.fall * 4 * radius / 981.0)
    return PARTICLE_VISCOSITY * radius**2 / step_s * max(1.0, usual_s / step_s) ** 0.75


def no_slip_weight(kinematic: float, support: float, step_s: float) -> float:
    """Return D for a wall to which a fluid with a kinematic viscosity nu sticks, in the length unit of the arguments.

    For a speed proportional to the distance z from the wall, the drag of the wall particles is then equal to the
    viscous stress: nu = integral of (D / dt) B(z) z dz. B(z) is the sum of the drag weights at the distance z.
    """
    radius = support / 4
    z = np.linspace(0.0, support, 2001)
    # The integral of exp(-r^2/h^2), cut off at h, over a plane one radius below the wall.
    plane = np.pi * support**2 * np.maximum(np.exp(-(((z + radius) / support) ** 2)) - np.exp(-1.0), 0.0)
    drag = plane / (2 * radius) ** 2 / (np.sqrt(np.pi) * support)
    return float(kinematic * step_s / np.trapezoid(drag * z, z))


def paste_on_device(
    fluids: Sequence[Rheology], support: float, step_s: float, substeps: int, slowest_shear_per_s: float, device: str
) -> Any:
    """Return the constants of the fluid of each run, for a substep of ``step_s``.

    Below a shear rate of ``slowest_shear_per_s``, the viscosity is constant, so that paste creeps instead of stopping.
    """
    # The weight of Eq. 5 is exp(-r^2/h^2) / (h sqrt(pi)). Its divisor is included in these constants.
    shape = math.sqrt(math.pi) * support

    def by_run(values: Sequence[float], dtype: type = float) -> wp.array:
        return wp.array(np.array(values), dtype, device=device)

    paste = device_code.Paste()
    ages = max(len(fluid.course) for fluid in fluids)
    by_age = np.stack(
        [np.pad(course := fluid.course, ((0, ages - len(course)), (0, 0)), mode="edge") for fluid in fluids]
    )
    by_age[:, :, 0] = by_age[:, :, 0] / substeps / shape
    paste.by_age = wp.array(by_age, wp.vec2, device=device)
    paste.drag = by_run([fluid.wall_weight_cm / substeps / shape for fluid in fluids])
    paste.sticks = by_run([float(fluid.sticks) for fluid in fluids])
    paste.wall_share = by_run([fluid.wall_share for fluid in fluids])
    paste.flow_index = by_run([fluid.flow_index for fluid in fluids])
    paste.per_viscosity = viscous_weight(1.0, support, step_s) / shape
    paste.slowest_shear = slowest_shear_per_s
    paste.law = by_run([fluid.law for fluid in fluids], int)
    paste.yields = by_run([fluid.yields for fluid in fluids], int)
    paste.frames_to_freeze = by_run([fluid.frames_to_freeze for fluid in fluids], int)
    return paste
