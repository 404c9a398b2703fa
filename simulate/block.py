"""Settings and result of a block of fluid that is released."""

from dataclasses import dataclass

from pydantic import Field

from sealtwin.core.arrays import Floats, HasSummary, ReadOnly
from sealtwin.core.settings import Settings


class FluidBlock(Settings):
    """A block of fluid at rest behind a gate.

    The gate is at x = 0, and the block is behind it. The walls behind and beside the block end at the gate, and a level
    plate is ahead, as in a dam break.
    """

    length_mm: float = Field(gt=0, le=2000)
    """Length of the block, from the back wall to the gate."""
    width_mm: float = Field(gt=0, le=2000)
    """Width of the block, across the flow."""
    height_mm: float = Field(gt=0, le=2000)
    """Height of the block above the floor."""
    ahead_mm: float | None = Field(default=None, gt=0, le=5000)
    """Length of the plate ahead of the gate. Default: twice the sum of the block's length and height."""
    duration_s: float = Field(gt=0, le=600)
    """Simulated time in s. The run ends earlier if everything comes to rest."""
    every_s: float = Field(default=0.05, gt=0)
    """Time in s between two rows of the result."""

    @property
    def end_mm(self) -> float:
        """Position x of the end of the plate."""
        return 2 * (self.length_mm + self.height_mm) if self.ahead_mm is None else self.ahead_mm


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class BlockRelease(ReadOnly, HasSummary):
    """Flow of a block of fluid after its gate is removed."""

    t_s: Floats
    """Times since the gate was removed, (n,)."""
    front_mm: Floats
    """Distance of the front from the gate along x, (n,). Up to 0.2 % of the fluid, as spray, may be ahead of it."""
    height_mm: Floats
    """Height of the highest fluid above the floor, (n,)."""
    volume_ratio: Floats
    """Volume below the fluid's surface, divided by the volume of the block, (n,)."""
    position_mm: Floats
    """Positions of the particles at the end, (m, 3): x from the gate, y from the middle, z from the floor."""
    radius_mm: float
    """Radius of the particles."""
    at_rest: bool
    """True if all particles are at rest at the end."""

    @property
    def main_figures(self) -> dict[str, str]:
        state = "at rest" if self.at_rest else "moving"
        return {"front": f"{self.front_mm[-1]:.1f} mm", "after": f"{self.t_s[-1]:.3g} s, {state}"}
