"""The inputs of a run, which pours sealant into a crack."""

from dataclasses import dataclass, field, replace

from sealtwin.core.facts import Fact
from sealtwin.core.records import Sample
from sealtwin.core.settings import doubts_of
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver

MIN_MOUTH_MM = 1.5  # Smallest mouth width for judging nozzles, which are rarely finer than 3 mm


@dataclass(frozen=True)
class Pour:
    """Inputs of a run: sealant that a nozzle pours into a crack. Several fluids have a run each, in one launch."""

    sample: Sample
    fluids: tuple[Fluid, ...]
    solver: Solver
    nozzle: Nozzle = field(default_factory=Nozzle)
    seed: int = 0
    slope: SampleSlope = LEVEL

    @property
    def fluid(self) -> Fluid:
        """The fluid of a pour that has only one."""
        (fluid,) = self.fluids
        return fluid

    @property
    def each(self) -> list["Pour"]:
        """This pour divided into one pour for each fluid."""
        return [replace(self, fluids=(fluid,)) for fluid in self.fluids]

    @property
    def doubts(self) -> tuple[Fact, ...]:
        """Questions about settings of the only fluid, the nozzle and the slope that are outside their likely range."""
        mouth_mm = self.sample.solid.figures.mouth_width_mm or self.sample.outline.mean_width_mm
        return doubts_of(self.fluid, self.nozzle, self.slope, width_mm=max(mouth_mm, MIN_MOUTH_MM))
