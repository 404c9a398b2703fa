"""The slump of a cone of paste on a plate, in particles, and the yield stress that ends it at a given radius."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.records import Floats
from simulate.device import start_warp
from simulate.plate import paste_on_plate
from simulate.settings import particle_volume
from simulate.spread_law import (
    FLATTEST,
    GRAVITY_M_S2,
    Cone,
    flat_stress_pa,
    heap_height_mm,
    spread_radius_mm,
    stretched_stress_pa,
)

LEAST_DIAMETERS = 4.0  # Least height of a heap in particle diameters: fewer layers shear as one layer
FINEST = 32.0  # Least width of a cone in particle radii: with 44 a heap of 60 Pa ends 0.8 % narrower
MOST_PARTICLES = 60_000  # Largest number of particles of a slump: about four minutes of one core


@dataclass(frozen=True)
class Slump:
    """A slump in particles: radius over time, from the moment at which the cone is lifted."""

    stress_pa: float
    volume_mm3: float
    density_kg_m3: float
    t_s: Floats
    radius_mm: Floats  # (n,)
    viscosity_pa_s: float | None  # None if it was changed during the slump
    height_mm: float

    @property
    def at_rest_mm(self) -> float:
        return float(self.radius_mm[-1])


FLAT_GALILEI = 10.0  # rho^2 g V / mu^2 of a slump without inertia, as for a cone that is lifted slowly
THINNED = 20.0  # Viscosity at the start over that at the end, when little of the way remains
THICK_UNTIL, THIN_FROM, ENDS = 28.0, 110.0, 450.0  # Times in units of mu / (rho g V^(1/3))
OUTERMOST = 0.005  # Share of the paste outside the radius that defines the edge: single particles may stray
WALL_ROOM = 1.25  # Half side of the plate over the radius of the flat heap


def radius_of_particles_mm(cone: Cone, stress_pa: float, density_kg_m3: float) -> float:
    """Return the radius of particles for a slump. It is as large as the height of the heap and the cone allow.

    Raises InputError if that needs too many particles.
    """
    at_rest_mm = spread_radius_mm(stress_pa, cone.volume_mm3, density_kg_m3)
    height_mm = float(heap_height_mm(np.array(stress_pa), at_rest_mm, density_kg_m3))
    radius_mm = min(height_mm / LEAST_DIAMETERS / 2, cone.bottom_mm / FINEST)
    if (particles := cone.volume_mm3 / particle_volume(radius_mm)) > MOST_PARTICLES:
        raise InputError(
            f"the heap would be {height_mm:.1f} mm high; with {LEAST_DIAMETERS:g} particles above each other it has "
            f"{particles:,.0f} particles, but at most {MOST_PARTICLES:,} are allowed. Use a larger cone or more "
            f"paste: a heap lower than {FLATTEST:g} of its radius is computed without particles."
        )
    return radius_mm


def slump(cone: Cone, stress_pa: float, density_kg_m3: float, *, steady: bool = False, finer: float = 1.0) -> Slump:
    """Compute the slump of a cone of paste on a plate, without inertia. It takes tens of seconds on the CPU.

    Unless ``steady``, the viscosity is reduced during the slump, which then comes to rest sooner, with the same radius.
    Particles are ``finer`` times smaller than necessary.
    """
    radius_mm = radius_of_particles_mm(cone, stress_pa, density_kg_m3) / finer
    start_warp()
    weight, volume_m3 = density_kg_m3 * GRAVITY_M_S2, cone.volume_mm3 * 1e-9
    thick_pa_s = density_kg_m3 * math.sqrt(GRAVITY_M_S2 * volume_m3 / FLAT_GALILEI)
    unit_s = thick_pa_s / (weight * volume_m3 ** (1 / 3))
    ages_s = [0.0, THICK_UNTIL * unit_s, THIN_FROM * unit_s]
    thin_pa_s = thick_pa_s if steady else thick_pa_s / THINNED
    curve = {
        "age_s": ages_s,
        "viscosity_pa_s": [thick_pa_s, thick_pa_s, thin_pa_s],
        "yield_stress_pa": [stress_pa] * 3,
    }
    reach_mm = WALL_ROOM * 1e3 * float(flat_stress_pa(cone.volume_mm3, 1e3, density_kg_m3) / stress_pa) ** 0.2
    plate = paste_on_plate(cone, radius_mm, max(reach_mm, cone.bottom_mm), density_kg_m3, curve)
    t_s, radii_mm = [0.0], [plate.edge_mm(OUTERMOST)]
    for time_s in plate.run(ENDS * unit_s, every_s=5 * unit_s):
        t_s.append(time_s)
        radii_mm.append(plate.edge_mm(OUTERMOST))
    if not np.isfinite(radii_mm).all():
        raise NumericalError(f"the slump of {stress_pa:g} Pa has a radius that is not finite; please report it.")
    return Slump(
        stress_pa,
        plate.volume_mm3,
        density_kg_m3,
        np.array(t_s),
        np.array(radii_mm),
        thick_pa_s if steady else None,
        plate.height_mm,
    )


STEP = 1.6  # Ratio of the yield stresses of two slumps between which others are interpolated
MOST_SLUMPS = 8


@dataclass
class SlumpCurve:
    """Radius at rest as a function of yield stress, for cones of one shape, computed on demand.

    Slumps of one shape are similar in R / V^(1/3) and tau / (rho g V^(1/3)), and serve for a cone a little larger or
    heavier too. Their stresses are powers of ``STEP``; ``radii`` may be filled from a file.
    """

    cone: Cone
    density_kg_m3: float
    radii: dict[int, float]
    """R / V^(1/3) of slumps. Keys are the powers of ``STEP`` that equal tau / (rho g V^(1/3))."""

    def at(self, power: int) -> float:
        """Return R / V^(1/3) of one slump. It is computed unless it is in ``radii``."""
        if power not in self.radii:
            length_mm = self.cone.volume_mm3 ** (1 / 3)
            stress_pa = STEP**power * self.density_kg_m3 * GRAVITY_M_S2 * length_mm * 1e-3
            computed = slump(self.cone, stress_pa, self.density_kg_m3)
            self.radii[power] = computed.at_rest_mm / computed.volume_mm3 ** (1 / 3)
        return self.radii[power]

    def around(self, reach: float, first: float) -> Iterator[int]:
        """Yield powers whose slumps bracket ``reach``, a value of R / V^(1/3), and that of a stiffer slump.

        ``first`` is the power that is likely to be near it.
        """
        power = round(first)
        yield power
        step = 1 if self.at(power) > reach else -1
        for _ in range(MOST_SLUMPS):
            power += step
            yield power
            if (self.at(power) > reach) != (step > 0):
                # The third slump is a stiffer one, which takes least time.
                yield power + 1 if step > 0 else power + 2
                return
        raise InputError(
            "a cone of that shape does not slump to the measured spread with any yield stress: check the cone's sizes, "
            "the mass and the scale, and that the plate was level."
        )

    def stress_pa(self, volume_mm3: Floats, radius_mm: Floats, density_kg_m3: Floats) -> Floats:
        """Return the yield stress of heaps at rest, (n,), each with its own volume, radius and density.

        It is that of the closed form, times the ratio of slumps to the closed form. The ratio is a straight line
        through three slumps: it changes by a few percent from one to the next, and radii with such coarse particles are
        off by one percent.
        """
        length_mm = np.cbrt(volume_mm3)
        reach = radius_mm / length_mm
        unit_pa = density_kg_m3 * GRAVITY_M_S2 * length_mm * 1e-3
        closed_pa = stretched_stress_pa(volume_mm3, radius_mm, density_kg_m3)
        place = np.log(closed_pa / unit_pa)
        likely = float(np.median(place)) / math.log(STEP)
        powers = np.array(sorted(set(self.around(float(np.median(reach)), likely))))
        # For a volume of 1 mm3 and a weight of 1 Pa/mm.
        closed = stretched_stress_pa(1.0, np.array([self.at(int(power)) for power in powers]), 1e3 / GRAVITY_M_S2)
        slope, start = np.polyfit(np.log(closed), STEP ** powers.astype(float) / closed, 1)
        return closed_pa * (start + slope * np.clip(place, np.log(closed[0]), np.log(closed[-1])))
