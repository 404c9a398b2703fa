"""Plan the flow and speed along a path, so that the crack is filled without overspill."""

from pathlib import Path

from pydantic import Field

from sealtwin.core.settings import Settings

RESERVE_MM = 0.25
"""Default of ``reserve_mm``, the depth in mm by which a plan aims lower than ``margin_mm``.

Without a reserve, a plan fills the crack to its face. If the pump then gives 10 % more and the yield stress is 15 %
lower, the plan has more sealant above the face than constant flow, because constant flow leaves low stretches that take
up some of it."""


class PlanOptions(Settings):
    """Options of a plan: options of 'sealtwin plan' and keywords of ``plan_flow``."""

    cell: Path | None = None
    """Cell file of the robot. The plan respects the limits of the cell and of its pump."""
    flow_max_mm3_s: float | None = Field(default=None, ge=0.01, le=1e6)
    """Largest flow, if no cell sets a limit."""
    margin_mm: float = Field(default=0.0, ge=0, le=100)
    """Distance below the face to which the crack should be filled."""
    reserve_mm: float = Field(default=RESERVE_MM, ge=0, le=100)
    """Additional distance below the face, in case the pump gives more or the paste is softer. If it is 0, corrections
    with particle runs may also add sealant."""
    knots: int = Field(default=8, ge=3, le=40)
    """Number of positions along the path at which flow and speed are chosen."""
    verify: int = Field(default=3, ge=1, le=10)
    """Number of rounds. Each round searches a plan and computes it with particles, which correct the next search."""
    seeds: int = Field(default=3, ge=1, le=20)
    """Number of particle runs of the best plan, with different seeds. A 95 % band requires at least two."""
    keep_speed: bool = False
    """Plan only the flow, at the trial's speed."""
    accurate: bool = False
    """Compute with the trial's solver settings, which takes three times as long as drafts. By default, all runs are
    drafts except the last two, which correct the plan and compute its level."""

    @property
    def aim_mm(self) -> float:
        """Distance between the face and the level that a plan aims at."""
        return self.margin_mm + self.reserve_mm
