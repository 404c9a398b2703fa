"""Limits within which the fast model is valid, and the reasons why it is not valid for a case."""

from dataclasses import dataclass

from sealtwin.core.facts import Fact, Facts, doubt
from sealtwin.core.records import Outline, Solid, Trajectory
from simulate.slot.fill import CELLS, MOUND, HerschelBulkley
from simulate.slot.narrows import narrows
from simulate.slot.sections import sections_of

STEEPEST, TALLEST_MM, FULLEST, HIGHEST_MM = 0.45, 4.0, 0.95, 2.5
"""Largest values for which the model is valid: slope that walls support, height of a mound in mm, filled fraction of
the crack, and level above the face in mm."""
MAX_LEFT_OUT = 0.05
"""Limit for the difference between the volumes of the sections and of the crack, as a fraction. At a depth of 10 mm,
levels are then wrong by half a millimetre."""
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
    left_out: float = 0.0
    """Fraction of the crack's volume that this model's sections leave out, such as side cracks. It is negative if the
    sections have more volume than the crack."""
    is_searched: bool = True
    """False for a crack with stones, and for a mesh: their narrow positions are not searched."""
    held_mm: float = 0.0
    """Step of the level in mm that walls across the crack and necks support, in addition to the sections."""
    dragged: float = 0.0
    """Drag of walls across the crack and necks, as an equivalent length of crack divided by the crack's length."""
    narrowest_mm: float = 0.0
    """Arc length of the position that adds most drag."""

    @property
    def unfit(self) -> Facts:
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
            abs(self.left_out) <= MAX_LEFT_OUT,
            "left-out",
            f"This model's sections have {abs(self.left_out):.0%} {'less' if self.left_out > 0 else 'more'} volume "
            f"than the crack. At most {MAX_LEFT_OUT:.0%} is allowed.",
            self.left_out,
        )
        if not self.is_searched:
            text = "The crack has stones or comes from a mesh, whose narrow positions this model does not see."
            reasons.append(doubt("unfit.stones-or-mesh", text))
        unless(
            self.held_mm <= MAX_HELD_MM and self.dragged <= MAX_DRAGGED,
            "narrow",
            f"A neck or a wall across the crack, mainly at s = {self.narrowest_mm:.1f} mm, supports a step of the "
            f"level of {self.held_mm:.1f} mm, and slows the flow as much as {self.dragged:.2f} times the crack's "
            f"length would. At most {MAX_HELD_MM:g} mm and {MAX_DRAGGED:g} are allowed.",
            self.narrowest_mm,
            "mm",
        )
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
        left_out=1 - sections_mm3 / solid.cavity_volume_mm3,
        is_searched=not outline.islands_mm and solid.tilt != "modelled",
        held_mm=slope * narrow.holds_mm if slope > 0 else 0.0,
        dragged=narrow.drags_mm / outline.length_mm,
        narrowest_mm=narrow.s_mm,
    )
