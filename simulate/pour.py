"""A pour: what a run is computed from."""

from dataclasses import dataclass, field, replace

from sealtwin.core.facts import Fact
from sealtwin.core.records import Sample
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver, doubts_of_run


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
        return doubts_of_run(self.sample.outline, self.sample.solid, self.fluid, self.nozzle, self.slope)
