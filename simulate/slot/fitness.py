"""The domain in which the fast model may be believed, and in words why a case is outside and what brings it inside."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sealtwin.core.records import Outline, Solid, Trajectory
from simulate.slot.fill import CELLS
from simulate.slot.flux import HerschelBulkley
from simulate.slot.mound import MOUND
from simulate.slot.narrows import goes_on, narrows
from simulate.slot.sections import Trapezoids, sections_of, trapezoid_misfit

STEEPEST, TALLEST_MM, FULLEST, HIGHEST_MM = 0.45, 4.0, 0.95, 2.5
"""Largest slope that the walls hold, height of a mound, share of the crack that is filled, and level over the face."""


class Limit(NamedTuple):
    """The largest number of a case in the model's domain."""

    most: float
    digits: int  # Decimals of a number in the sentence
    sentence: str  # On a larger number: it and the largest one are filled in


LIMITS = {
    "slope": Limit(
        STEEPEST,
        2,
        "The walls hold the paste at a slope of {}; above {} it stacks under the nozzle, which a section's mean cannot "
        "show.",
    ),
    "mound_mm": Limit(
        TALLEST_MM,
        1,
        "A mound of about {} mm stays under the nozzle's last place, held by the walls or by the paste itself; "
        "particles agree with this model on mounds of up to {} mm.",
    ),
    "fill": Limit(
        FULLEST,
        2,
        "The sealant is {} of the crack's volume; above {} it runs over the face, which this model does not follow.",
    ),
    "above_mm": Limit(
        HIGHEST_MM,
        1,
        "The level stands up to {} mm above the face, and of overspill this model knows a slump beside the mouth "
        "alone; {} mm are allowed.",
    ),
}
"""Limits of the numbers that settings move, by name in ``Fitness``; a report's page judges by them too."""
MOST_MISFIT = 0.05
"""Largest difference of areas below a level between a mesh's sections and trapezoids: at a depth of 10 mm, levels are
wrong by half a millimetre. Also that of the volume of the sections from the crack's."""
MOST_HELD_MM, MOST_DRAGGED = 0.5, 0.25
"""Largest step of the level that narrow places hold beyond what sections do, and largest share of the crack's length
that they add to the way of a liquid. At both a fill with those places is off by 0.6 mm at most (decision 0175)."""


@dataclass(frozen=True)
class Fitness:
    """The case in the numbers that bound the model's domain."""

    slope: float
    """Slope that the paste holds between these walls, filled as they are on average."""
    mound_mm: float
    """Height of what stays standing under the nozzle's last place: the slope times the bed's depth, which the walls
    hold, or 4 tau / rho g, which the paste holds by itself; the larger one."""
    fill: float
    """Volume given over that of the crack."""
    most_pa: float
    """Yield stress up to which the paste fits the crack, filled as the model allows; two digits, rounded down."""
    above_mm: float = 0.0
    """Highest level of the filled bed over the face; 0 where it stays below."""
    misfit: float = 0.0
    """Difference of areas below a level between a mesh's sections and this model's trapezoids, as a share of them."""
    left_out: float = 0.0
    """Share of the crack's volume that this model's sections leave out: side cracks, and room under closed tips whose
    walls open downward. Below 0 if they have more than the crack."""
    held_mm: float = 0.0
    """Step of the level that stones, walls across and necks hold, beyond what sections hold there."""
    dragged: float = 0.0
    """Length of crack that would slow a liquid as much as they do, over that of the crack."""
    narrowest_mm: float = 0.0
    """Arc length of the one that does most."""
    goes_on_mm: float | None = None
    """Arc length of an end beyond which the cavity goes on under the face; None if it ends there."""

    @property
    def unfit(self) -> tuple[str, ...]:
        """Reasons why the model is unfit, a sentence each; none if it is fit."""
        numbers = {name: getattr(self, name) for name in LIMITS}
        found = [
            LIMITS[name].sentence.format(f"{number:.{LIMITS[name].digits}f}", f"{LIMITS[name].most:g}")
            for name, number in numbers.items()
            if number > LIMITS[name].most
        ]
        return (*found, *self.of_the_crack)

    @property
    def of_the_crack(self) -> tuple[str, ...]:
        """Those of the reasons that follow from the crack's shape: as long as it is filled as much, with such paste."""
        found = []
        if self.misfit > MOST_MISFIT:
            found.append(
                f"The walls of this mesh are not straight: below a level, sections hold {self.misfit:.0%} of their "
                f"area more or less than the trapezoids of this model; {MOST_MISFIT:.0%} are allowed."
            )
        if abs(self.left_out) > MOST_MISFIT:
            found.append(
                f"This model's sections have {abs(self.left_out):.0%} {'less' if self.left_out > 0 else 'more'} volume "
                f"than the crack, of which they leave out side cracks and room under closed tips; {MOST_MISFIT:.0%} is "
                "allowed."
            )
        if self.held_mm > MOST_HELD_MM or self.dragged > MOST_DRAGGED:
            found.append(f"{self._narrow}; this model averages them over its sections.")
        if self.goes_on_mm is not None:
            found.append(
                f"The cavity goes on under the face beyond the end of its mouth at s = {self.goes_on_mm:.1f} mm, where "
                "this model has a wall."
            )
        return tuple(found)

    @property
    def _narrow(self) -> str:
        """Return what narrow places do, in words."""
        place = f"Stones, a wall across or a neck, most at s = {self.narrowest_mm:.1f} mm,"
        if not np.isfinite(self.dragged):
            return f"{place} close the crack below the level of the sealant"
        done = []
        if self.held_mm > MOST_HELD_MM:
            done.append(f"hold a step of the level of up to {self.held_mm:.2g} mm ({MOST_HELD_MM:g} are allowed)")
        if self.dragged > MOST_DRAGGED:
            done.append(
                f"slow what flows as {float(f'{self.dragged:.2g}'):g} times the crack's length would "
                f"({MOST_DRAGGED:g} is allowed)"
            )
        return f"{place} {' and '.join(done)}"


def fitness_of(solid: Solid, outline: Outline, trajectory: Trajectory, paste: HerschelBulkley) -> Fitness:
    """The numbers of a case by its settings, without its level; means along the crack, all cells filled alike."""
    sections = sections_of(outline, solid, CELLS, reach_per_mm=0.0)
    sections_mm3 = float(sections.full_mm2.sum()) * sections.step_mm
    fill = trajectory.dispensed_mm3 / sections_mm3
    held_mm = paste.yield_stress_pa / paste.weight_pa_mm
    slope, mound_mm = _held(sections, min(fill, 1.0), held_mm)
    allowed = _held(sections, min(fill, FULLEST), held_mm)
    narrow = narrows(outline, solid, sections, fill)
    excess = max(allowed[0] / STEEPEST, allowed[1] / TALLEST_MM)
    if narrow.drags_mm <= MOST_DRAGGED * outline.length_mm:
        excess = max(excess, slope * narrow.holds_mm / MOST_HELD_MM)
    most_pa = _rounded_down(paste.yield_stress_pa / excess) if excess > 0 else np.inf
    return Fitness(
        slope,
        mound_mm,
        fill,
        most_pa,
        misfit=trapezoid_misfit(sections, solid),
        left_out=1 - sections_mm3 / solid.cavity_volume_mm3,
        held_mm=slope * narrow.holds_mm if slope > 0 else 0.0,
        dragged=narrow.drags_mm / outline.length_mm,
        narrowest_mm=narrow.s_mm,
        goes_on_mm=goes_on(outline, solid),
    )


def _held(sections: Trapezoids, fill: float, held_mm: float) -> tuple[float, float]:
    """Slope and mound that paste of tau / rho g holds in sections filled to a share."""
    area_mm2 = fill * sections.full_mm2
    height_mm = sections.height_mm(area_mm2)
    slope = held_mm / sections.holding_mm(area_mm2, sections.wetted_mm(height_mm))
    return float(slope.mean()), max(float((slope * height_mm).mean()), MOUND * held_mm)


def _rounded_down(value: float) -> float:
    """Return a value above 0 with two digits, rounded down."""
    digit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(np.floor(value / digit) * digit)
