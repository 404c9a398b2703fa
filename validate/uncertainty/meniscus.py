"""Meniscus of a sealant that wets the walls: its level in the middle of the crack is below its mean level.

Simulations ignore surface tension and give the mean level, but a caliper reads the middle. The two differ by the sag,
which this module computes.
"""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats, Outline, Solid
from sealtwin.core.regime import SURFACE_TENSION_N_M, capillary_length_mm, raise_and_height_mm
from validate.uncertainty.budget import Component, Kind, draws_for, uniforms

WIDTHS = 32  # Number of widths at which a meniscus is computed. Interpolation is then exact to 0.2 %.
MIN_MM = 0.005  # Smallest meniscus that a report can show, since it has hundredths of a mm


@dataclass(frozen=True)
class Mouth:
    """Width of the crack at the face along s, and density of the sealant, which shape its meniscus.

    Without a density, gravity is left out, which makes the meniscus deeper.
    """

    s_mm: Floats
    width_mm: Floats
    density_kg_m3: float | None

    @classmethod
    def of(cls, outline: Outline, solid: Solid, density_kg_m3: float | None) -> "Mouth":
        opening = float(np.tan(np.radians(solid.wall_angles_deg)).sum()) if solid.tilting.floor_traced else 0.0
        return cls(outline.s_mm, outline.width_mm + opening * solid.depth_mm, density_kg_m3)

    def at_mm(self, s_mm: Floats) -> Floats:
        """Return the width in mm at each s, (n,)."""
        return np.interp(s_mm, self.s_mm, self.width_mm)

    def sag_mm(
        self, s_mm: Floats, level_mm: Floats, surface_tension_n_m: float = SURFACE_TENSION_N_M, *, read: bool = False
    ) -> Floats:
        """Return how far the level in the middle is below the mean level if the walls are fully wetted, (n,).

        ``level_mm`` is the mean level or, if ``read`` is True, the level in the middle. A meniscus that would climb
        past the edges of the mouth stays at them. A level above the face has no meniscus. Walls that lean by 10 degrees
        change the meniscus by up to 4 %.
        """
        density = self.density_kg_m3
        capillary_mm = capillary_length_mm(surface_tension_n_m, density) if density else np.inf
        width_mm = self.at_mm(s_mm)
        some_mm = np.linspace(0.0, width_mm.max(), WIDTHS + 1)
        some = np.array([(0.0, 0.0), *(raise_and_height_mm(width, capillary_mm) for width in some_mm[1:].tolist())])
        mean_mm, wall_mm = (np.interp(width_mm, some_mm, column) for column in some.T)
        climb_mm = wall_mm if read else wall_mm - mean_mm
        return mean_mm * np.clip(-level_mm / np.maximum(climb_mm, 1e-9), 0.0, 1.0)

    def meniscus(
        self, s_mm: Floats, level_mm: Floats, surface_tension_n_m: float | None, kind: Kind
    ) -> Component | None:
        """Return the error of taking the mean level for the level in the middle. Returns None if there is no meniscus.

        The error is only downward. It is a uniformly distributed fraction of ``sag_mm``, for contact angles from 0 to
        90 degrees, or for a yield stress that keeps the surface flat. If no surface tension is declared, the surface
        tension of water is used.
        """
        tension_n_m = SURFACE_TENSION_N_M if surface_tension_n_m is None else surface_tension_n_m
        sag_mm = self.sag_mm(s_mm, level_mm, tension_n_m, read=kind == "readings")
        if sag_mm.max() < MIN_MM:
            return None
        declared = surface_tension_n_m is not None
        return Component(
            "meniscus" if declared else f"meniscus of up to {sag_mm.max():.2f} mm in the middle",
            "declared" if declared else "assumed",
            -uniforms("meniscus", 1, draws_for(len(s_mm))) * sag_mm,
            shared=True,
            kind=kind,
            setting="uncertainty.surface_tension_n_m",
        )
