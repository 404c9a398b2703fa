"""A block of fluid that is let go, and what comes of it."""

from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from sealtwin.core.records import Floats, Shown
from sealtwin.core.settings import Settings


class FluidBlock(Settings):
    """A block of fluid at rest behind a gate, and where it flows. The gate is at x = 0, the block behind it."""

    length_mm: float = Field(gt=0, le=2000)
    """Length of the block, from the back wall to the gate."""
    width_mm: float = Field(gt=0, le=2000)
    """Width of the block, across the flow."""
    height_mm: float = Field(gt=0, le=2000)
    """Height of the block above the floor."""
    onto: Literal["plate", "channel", "open"] = "plate"
    """plate: walls at the back and beside the block end at the gate, and a level plate is ahead, as in a dam break.
    channel: the side walls continue, and the channel is closed at its end, as in an L-box or the LCPC box. open: all
    walls are lifted, and the block spreads to all sides."""
    ahead_mm: float | None = Field(default=None, gt=0, le=5000)
    """Length of the plate or channel ahead of the gate; if open, distance from the block to the plate's edge. Default:
    twice the block's length and height together."""
    duration_s: float = Field(gt=0, le=600)
    """Time that is computed; less if all comes to rest."""
    every_s: float = Field(default=0.05, gt=0)
    """Time between two figures."""

    @property
    def end_mm(self) -> float:
        """End of the plate or channel, x."""
        return 2 * (self.length_mm + self.height_mm) if self.ahead_mm is None else self.ahead_mm


@dataclass(frozen=True, kw_only=True, repr=False)
class BlockRelease(Shown):
    """A block of fluid from the moment at which its gate is gone."""

    t_s: Floats
    """Times from 0, (n,)."""
    front_mm: Floats
    """Distance of the front from the gate along x, (n,). A share of 0.002 of the fluid, spray, may be ahead of it."""
    height_mm: Floats
    """Height of the highest fluid above the floor, (n,)."""
    volume_ratio: Floats
    """Volume below the fluid's surface over the block's, (n,)."""
    position_mm: Floats
    """Particles at the end, (m, 3): x from the gate, y from the middle, z from the floor."""
    radius_mm: float
    """Radius of the particles."""
    at_rest: bool
    """True if no particle moves at the end."""

    @property
    def main_figures(self) -> dict[str, str]:
        state = "at rest" if self.at_rest else "moving"
        return {"front": f"{self.front_mm[-1]:.1f} mm", "after": f"{self.t_s[-1]:.3g} s, {state}"}
