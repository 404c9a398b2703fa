"""Volumes that a level lacks of a full crack, and that stand above the face, in mm3."""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.records import Floats, Outline, Solid
from simulate.slot.sections import Trapezoids, sections_of

CELLS = 160  # Half a millimetre of a crack of 80: finer than levels are read


@dataclass(frozen=True)
class Misfit:
    """Volumes between a level and the face."""

    under_mm3: float
    over_mm3: float
    """Volume above the face over the crack's mouth; what lies beside the mouth is not counted."""
    highest_mm: float

    @property
    def total_mm3(self) -> float:
        return self.under_mm3 + self.over_mm3


@dataclass(frozen=True)
class Judge:
    """Sections of a crack as its level is judged on."""

    sections: Trapezoids

    @classmethod
    def of(cls, outline: Outline, solid: Solid) -> "Judge":
        return cls(sections_of(outline, solid, CELLS, reach_per_mm=0.0))

    def misfit(self, s_mm: Floats, level_mm: Floats) -> Misfit:
        it, level_mm = self.sections, np.interp(self.sections.s_mm, s_mm, level_mm)
        filled_mm2, _ = it.area_mm2(np.minimum(level_mm, 0.0) - it.bottom_mm)
        over_mm2 = it.mouth_mm * np.maximum(level_mm, 0.0)
        under_mm2 = it.full_mm2 - np.maximum(filled_mm2, 0.0)
        return Misfit(
            under_mm3=float(under_mm2.sum()) * it.step_mm,
            over_mm3=float(over_mm2.sum()) * it.step_mm,
            highest_mm=float(level_mm.max()),
        )
