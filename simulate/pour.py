"""Inputs of a run, in which a nozzle pours sealant into a crack."""

from dataclasses import dataclass, field, replace

from sealtwin.core.facts import Facts
from sealtwin.core.records import Sample
from sealtwin.core.settings import doubts_of
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver

MIN_MOUTH_MM = 1.5  # Smallest mouth width with which the nozzle's diameter is compared. Nozzles are rarely below 3 mm


@dataclass(frozen=True)
class Pour:
    """Inputs of runs in which a nozzle pours sealant into a crack: one run for each fluid, all computed together."""

    sample: Sample
    fluids: tuple[Fluid, ...]
    solver: Solver
    nozzle: Nozzle = field(default_factory=Nozzle)
    """The nozzle, with its diameter as a number."""
    seed: int = 0
    slope: SampleSlope = LEVEL

    def __post_init__(self) -> None:
        object.__setattr__(self, "nozzle", self.nozzle.over(self.sample.outline.mean_width_mm))

    @property
    def fluid(self) -> Fluid:
        """The only fluid. Raises ValueError if there are several fluids."""
        (fluid,) = self.fluids
        return fluid

    @property
    def each(self) -> list["Pour"]:
        """One pour for each fluid."""
        return [replace(self, fluids=(fluid,)) for fluid in self.fluids]

    @property
    def doubts(self) -> Facts:
        """Warnings about settings of the only fluid, the nozzle and the slope that are outside their likely range."""
        mouth_mm = self.sample.solid.figures.mouth_width_mm or self.sample.outline.mean_width_mm
        return doubts_of(self.fluid, self.nozzle, self.slope, width_mm=max(mouth_mm, MIN_MOUTH_MM))
