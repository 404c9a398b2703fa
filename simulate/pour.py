"""A pour: what a run is computed from."""

from dataclasses import dataclass, field, replace

from sealtwin.core.facts import Fact
from sealtwin.core.records import Sample
from sealtwin.core.settings import doubts_of
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver

LEAST_MOUTH_MM = 1.5  # Nozzles are rarely finer than 3 mm, whatever the crack


@dataclass(frozen=True)
class Pour:
    """Sealant that a nozzle gives into a crack. With several fluids, each has a run of its own in one launch."""

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
        """A pour for each fluid."""
        return [replace(self, fluids=(fluid,)) for fluid in self.fluids]

    @property
    def doubts(self) -> tuple[Fact, ...]:
        """Questions on settings of the only fluid, the nozzle and the slope that are outside their likely range."""
        mouth_mm = self.sample.solid.figures.mouth_width_mm or self.sample.outline.mean_width_mm
        return doubts_of(self.fluid, self.nozzle, self.slope, width_mm=max(mouth_mm, LEAST_MOUTH_MM))
