"""Limits within which the fast model is valid, and the reasons why it is not valid for a case."""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Outline, Solid, Trajectory
from simulate.slot.fill import CELLS, MOUND, HerschelBulkley
from simulate.slot.narrows import goes_on, narrows
from simulate.slot.sections import sections_of, trapezoid_misfit

STEEPEST, TALLEST_MM, FULLEST, HIGHEST_MM = 0.45, 4.0, 0.95, 2.5
"""Limits of the model: largest slope that walls support, height of a mound in mm, filled fraction of the crack, and
level above the face in mm."""
MAX_MISFIT = 0.05
"""Limit, as a fraction, for two differences: between the areas below a level of a mesh's sections and of trapezoids,
and between the volumes of the sections and of the crack. At a depth of 10 mm, levels are then wrong by half a
millimetre."""
MAX_HELD_MM, MAX_DRAGGED = 0.5, 0.25
"""Limits for narrow positions of a crack: largest step of the level in mm that they may support in addition to the
sections, and largest drag that they may add to a liquid, as a length divided by the crack's length. At both limits, a
fill with narrow positions is off by at most 0.6 mm."""


@dataclass(frozen=True)
class Fitness:
    """Figures of a case that decide whether the model is valid for it."""

    slope: float
    """Slope of the surface that the walls support, at the mean filled depth."""
    mound_mm: float
    """Height of the mound under the nozzle's last position. It is the larger of two heights: ``slope`` times the depth
    of the sealant, for support by the walls, and 4 tau / rho g, for support by the paste itself. tau is the yield
    stress."""
    fill: float
    """Dispensed volume divided by the volume of the crack."""
    above_mm: float = 0.0
    """Highest level of the sealant above the face. It is 0 if the sealant is below the face."""
    misfit: float = 0.0
    """Difference between the areas below a level of a mesh's sections and of this model's trapezoids, as a fraction."""
    left_out: float = 0.0
    """Fraction of the crack's volume that this model's sections leave out: side cracks, and space under the face beyond
    the ends of the mouth. It is negative if the sections have more volume than the crack."""
    held_mm: float = 0.0
    """Step of the level in mm that stones, walls across the crack and necks support, in addition to the sections."""
    dragged: float = 0.0
    """Drag of stones, walls across the crack and necks, as an equivalent length of crack divided by the crack's
    length."""
    narrowest_mm: float = 0.0
    """Arc length of the position that adds most drag."""
    goes_on_mm: float | None = None
    """Arc length of an end of the mouth beyond which the cavity continues under the face. None if there is no such
    end."""

    @property
    def unfit(self) -> tuple[Fact, ...]:
        """Reasons why the model is not valid for this case. Empty if the model is valid."""
        reasons = list[Fact]()

        def unless(allowed: bool, key: str, text: str, value: float, unit: str = "") -> None:
            if not allowed:
                reasons.append(doubt(f"unfit.{key}", text, value, unit))

        unless(
            self.slope <= STEEPEST,
            "slope",
            f"The walls support paste with a slope of {self.slope:.2f}. Above {STEEPEST:g}, paste piles up under the "
            "nozzle, which a section's mean level does not show.",
            self.slope,
        )
        unless(
            self.mound_mm <= TALLEST_MM,
            "mound",
            f"A mound of about {self.mound_mm:.1f} mm stays under the nozzle's last position, supported by the "
            f"walls or by the paste itself. This model agrees with particles only up to {TALLEST_MM:g} mm.",
            self.mound_mm,
            "mm",
        )
        unless(
            self.fill <= FULLEST,
            "overfull",
            f"The sealant has {self.fill:.2f} times the crack's volume. Above {FULLEST:g} it runs over the face, "
            "which this model does not compute.",
            self.fill,
        )
        unless(
            self.above_mm <= HIGHEST_MM,
            "above-face",
            f"The level is up to {self.above_mm:.1f} mm above the face, but this model computes overspill only as a "
            f"slump next to the mouth. At most {HIGHEST_MM:g} mm are allowed.",
            self.above_mm,
            "mm",
        )
        unless(
            self.misfit <= MAX_MISFIT,
            "walls",
            "The walls of this mesh are not straight: the area of a section below a level differs by "
            f"{self.misfit:.0%} from that of this model's trapezoids. At most {MAX_MISFIT:.0%} is allowed.",
            self.misfit,
        )
        unless(
            abs(self.left_out) <= MAX_MISFIT,
            "left-out",
            f"This model's sections have {abs(self.left_out):.0%} {'less' if self.left_out > 0 else 'more'} volume "
            f"than the crack: they do not include side cracks, and space under the face beyond the ends of the "
            f"mouth. At most {MAX_MISFIT:.0%} is allowed.",
            self.left_out,
        )
        places = f"Stones, a wall across the crack or a neck, mainly at s = {self.narrowest_mm:.1f} mm,"
        unless(
            np.isfinite(self.dragged),
            "closed",
            f"{places} close the crack below the level of the sealant.",
            self.narrowest_mm,
            "mm",
        )
        unless(
            not MAX_HELD_MM < self.held_mm < np.inf,
            "held",
            f"{places} support a step of the level of up to {self.held_mm:.1f} mm. This model averages them over its "
            f"sections, and allows at most {MAX_HELD_MM:g} mm.",
            self.held_mm,
            "mm",
        )
        unless(
            not MAX_DRAGGED < self.dragged < np.inf,
            "dragged",
            f"{places} slow the flow as much as {self.dragged:.2f} times the crack's length would. At most "
            f"{MAX_DRAGGED:g} is allowed.",
            self.dragged,
        )
        if self.goes_on_mm is not None:
            text = (
                f"The cavity continues under the face beyond the end of its mouth at s = {self.goes_on_mm:.1f} mm, "
                "but this model has a wall there."
            )
            reasons.append(doubt("unfit.goes-on", text, self.goes_on_mm, "mm"))
        return tuple(reasons)


def fitness_of(solid: Solid, outline: Outline, trajectory: Trajectory, paste: HerschelBulkley) -> Fitness:
    """Return the figures of a case, except ``above_mm``. They are means for cells filled to equal fractions."""
    sections = sections_of(outline, solid, CELLS, reach_per_mm=0.0)
    sections_mm3 = float(sections.full_mm2.sum()) * sections.step_mm
    fill = trajectory.dispensed_mm3 / sections_mm3
    held_mm = paste.yield_stress_pa / paste.weight_pa_mm
    area_mm2 = min(fill, 1.0) * sections.full_mm2
    height_mm = sections.height_mm(area_mm2)
    slopes = paste.wall_share * held_mm / sections.holding_mm(area_mm2, sections.wetted_mm(height_mm))
    slope, narrow = float(slopes.mean()), narrows(outline, solid, sections, fill)
    return Fitness(
        slope,
        max(float((slopes * height_mm).mean()), MOUND * held_mm),
        fill,
        misfit=trapezoid_misfit(sections, solid),
        left_out=1 - sections_mm3 / solid.cavity_volume_mm3,
        held_mm=slope * narrow.holds_mm if slope > 0 else 0.0,
        dragged=narrow.drags_mm / outline.length_mm,
        narrowest_mm=narrow.s_mm,
        goes_on_mm=goes_on(outline, solid),
    )
