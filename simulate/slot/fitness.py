"""The domain in which the fast model may be believed, and in words why a case is outside."""

from dataclasses import dataclass

from sealtwin.core.records import Outline, Solid, Trajectory
from simulate.slot.fill import CELLS
from simulate.slot.flux import HerschelBulkley
from simulate.slot.sections import sections_of

STEEPEST, TALLEST_MM, FULLEST = 0.45, 3.0, 0.95
"""Largest slope that the walls hold, the same times the bed's depth, and share of the crack that is filled."""


@dataclass(frozen=True)
class Fitness:
    """The case in the three numbers that bound the model's domain."""

    slope: float
    """Slope that the paste holds between these walls, filled as they are on average."""
    mound_mm: float
    """The slope times the bed's depth, about the height of what stays standing under the nozzle's last place."""
    fill: float
    """Volume given over that of the crack."""

    @property
    def unfit(self) -> tuple[str, ...]:
        """Reasons why the model is unfit, a sentence each; none where it is fit."""
        found = []
        if self.slope > STEEPEST:
            found.append(
                f"The walls hold the paste at a slope of {self.slope:.2f}; above {STEEPEST:g} it stacks under the "
                "nozzle, which a section's mean cannot show."
            )
        if self.mound_mm > TALLEST_MM:
            found.append(
                f"A mound of about {self.mound_mm:.1f} mm, the held slope times the bed's depth, stays under the "
                f"nozzle's last place, and this model spreads it; {TALLEST_MM:g} mm are allowed."
            )
        if self.fill > FULLEST:
            found.append(
                f"The sealant is {self.fill:.2f} of the crack's volume; above {FULLEST:g} it runs over the face, which "
                "this model does not follow."
            )
        return tuple(found)


def fitness_of(solid: Solid, outline: Outline, trajectory: Trajectory, paste: HerschelBulkley) -> Fitness:
    """The numbers of a case; means along the crack, each cell filled to the same share."""
    sections = sections_of(outline, solid, CELLS, reach_per_mm=0.0)
    fill = trajectory.dispensed_mm3 / float(sections.full_mm2.sum()) / sections.step_mm
    area_mm2 = min(fill, 1.0) * sections.full_mm2
    height_mm = sections.height_mm(area_mm2)
    held_mm = paste.yield_stress_pa / paste.weight_pa_mm
    slope = held_mm / sections.holding_mm(area_mm2, sections.wetted_mm(height_mm))
    return Fitness(float(slope.mean()), float((slope * height_mm).mean()), fill)
