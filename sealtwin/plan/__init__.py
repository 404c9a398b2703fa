"""Plan the flow and speed along a path so that the crack is filled without overspill, or the rest of a pour."""

from pathlib import Path

from pydantic import Field

from sealtwin.core.settings import Settings

RESERVE_MM = 0.25
"""Depth by which a plan aims lower than asked. A plan that fills the crack to its face has more over the face than
constant flow if it gets 10 % more flow and 15 % less stress, since the troughs of constant flow take some of it up.
Unless it is 0, corrections by particles only lower the flow."""


class PlanOptions(Settings):
    """Aim and search of a plan: options of 'sealtwin plan', keywords of ``plan_flow``."""

    cell: Path | None = None
    """The robot's cell file; the plan keeps within its limits and those of its pump."""
    posterior: Path | None = None
    """Draws of the sealant: a CSV whose header names settings, such as fluid.yield_stress_pa."""
    flow_max_mm3_s: float | None = Field(default=None, ge=0.01, le=1e6)
    """Largest flow, if no cell sets it."""
    margin_mm: float = Field(default=0.0, ge=0, le=100)
    """Level to aim at, as a distance below the face."""
    reserve_mm: float = Field(default=RESERVE_MM, ge=0, le=100)
    """Extra distance below the face, in case the pump gives more or the paste is softer. With 0, corrections by
    particles may also add sealant."""
    knots: int = Field(default=8, ge=3, le=40)
    """Places along the path at which flow and speed are chosen."""
    verify: int = Field(default=3, ge=1, le=10)
    """Rounds of search and particle run; each plan is searched with the level of the one before."""
    seeds: int = Field(default=3, ge=1, le=20)
    """Particle runs of the best plan, with a seed each; its 95 % band needs at least two."""
    keep_speed: bool = False
    """Plan only the flow, at the trial's speed."""
    accurate: bool = False
    """Compute with the trial's own solver settings, which takes three times as long as drafts. By default all runs are
    drafts except the last two, which correct the plan and give its level."""

    @property
    def aim_mm(self) -> float:
        """Distance below the face of the level that a plan aims at."""
        return self.margin_mm + self.reserve_mm
