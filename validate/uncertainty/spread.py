"""What the extra runs of a trial left: its level at three particle sizes, and what each declared doubt does to it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from sealtwin.records import Floats
from validate.uncertainty.design import Effect
from validate.uncertainty.numerics import Convergence, converge


@dataclass(frozen=True)
class Size:
    """The trial's run with particles of one size, the physics held the same."""

    radius_mm: float
    level_mm: Floats


@dataclass(frozen=True)
class Spread:
    """Levels at ``s_mm``, (k,)."""

    s_mm: Floats
    sizes: tuple[Size, Size, Size]
    """Finer, the trial's own, coarser."""
    effects: tuple[Effect, ...]
    """Of each input whose standard uncertainty is declared; levels at ``s_mm``."""
    effect_scatter_mm: float | None
    """Of a level's effect by the scatter of single runs; None where the design has no column to spare."""
    design_radius_mm: float | None
    """Of the particles in the runs of the effects; None where no input is declared."""

    def converged(self, values: Sequence[float]) -> Convergence:
        """Of a number that the three sizes gave, in the order of ``sizes``."""
        fine_mm, middle_mm, coarse_mm = (size.radius_mm for size in self.sizes)
        fine, middle, coarse = values
        return converge(fine, middle, coarse, finer=middle_mm / fine_mm, coarser=coarse_mm / middle_mm)

    def content(self) -> dict[str, Any]:
        """For a JSON file."""
        return {
            "version": 1,
            "s_mm": self.s_mm,
            "sizes": [vars(size) for size in self.sizes],
            "effects": [vars(effect) for effect in self.effects],
            "effect_scatter_mm": self.effect_scatter_mm,
            "design_radius_mm": self.design_radius_mm,
        }

    @classmethod
    def of(cls, content: dict[str, Any]) -> Self:
        """Back from it. Raises KeyError, TypeError or ValueError where somebody changed it."""
        sizes = [Size(float(one["radius_mm"]), np.array(one["level_mm"], float)) for one in content["sizes"]]
        fine, middle, coarse = sizes
        effects = [Effect(one["name"], one["standard"], np.array(one["level_mm"], float)) for one in content["effects"]]
        s_mm = np.array(content["s_mm"], float)
        if any(len(one.level_mm) != len(s_mm) for one in (*sizes, *effects)):
            raise ValueError("not one level for each s_mm")
        return cls(
            s_mm,
            (fine, middle, coarse),
            tuple(effects),
            content["effect_scatter_mm"],
            content["design_radius_mm"],
        )
