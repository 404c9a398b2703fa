"""The settings of a particle run, checked for a crack and in the solver's units, before walls and particles exist."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sealtwin.core.records import Outline, Solid, Trajectory
from simulate.fluid.solver import Domain
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver
from simulate.setup.release_schedule import ParticleCounts, Schedule, course_of, plan_releases
from simulate.setup.rheology import Rheology
from simulate.setup.signed_distance import SolidSurface
from simulate.setup_checks import check_damping, check_fit, check_outlet, domain_of, solved_as


@dataclass(frozen=True)
class SetupCase:
    solver: Solver  # With a particle radius for this crack
    fluids: tuple[Fluid, ...]
    pastes: tuple[Rheology, ...]  # The fluids in the solver's units
    schedule: Schedule
    courses: tuple[ParticleCounts, ...]  # One for each fluid
    domain: Domain
    substeps: int

    def check_outlet(
        self, surface: SolidSurface, outline: Outline, trajectory: Trajectory, nozzle: Nozzle, seed: int
    ) -> None:
        """Raise InputError if a particle would be released inside the solid or nearer to it than its clearance."""
        sizes = {"radius_mm": self.solver.size_mm, "diameter_mm": nozzle.diameter_mm}
        check_outlet(self.schedule, trajectory, outline, surface, **sizes, seed=seed)


def case_of(
    solid: Solid,
    outline: Outline,
    trajectory: Trajectory,
    fluids: Sequence[Fluid],
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    slope: SampleSlope = LEVEL,
    finer: int = 1,
) -> SetupCase:
    """Check settings, except the outlet. Several ``fluids`` must have the same number of substeps, times ``finer``.

    File names of their tables are relative to the current folder. Raises InputError if the settings do not fit the
    crack, and ValueError if the numbers of substeps differ.
    """
    solver = solver.for_crack(outline.mean_width_mm, nozzle)
    fluids = [fluid.loaded(Path()) for fluid in fluids]
    for fluid in fluids:
        check_fit(outline, solid, fluid, solver, nozzle, slope)
    schedule = plan_releases(trajectory, solver.size_mm, nozzle.diameter_mm, seed)
    courses = tuple(course_of(schedule, fluid, solver.settle_s) for fluid in fluids)
    domain = domain_of(solid, outline, trajectory, solver.size_mm)
    solved = [solved_as(fluid, solver, schedule.frame_s, courses[0].frames) for fluid in fluids]
    substeps, *others = {substeps for _, substeps in solved}
    if others:
        raise ValueError(
            "Fluids that need different numbers of substeps cannot be computed together. Compute them one by one."
        )
    substeps *= finer
    check_damping(solver, schedule.frame_s / substeps)
    return SetupCase(solver, tuple(fluids), tuple(paste for paste, _ in solved), schedule, courses, domain, substeps)
