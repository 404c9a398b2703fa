"""What is known of a run's numbers of particles before it starts."""

import pytest

from simulate.course import course_of
from simulate.injection import prepare
from simulate.settings import Fluid, Nozzle, Solver
from tests.fluids import path, slot


@pytest.mark.parametrize("freeze_after_s", [0.2, "never"])
def test_a_course_is_what_a_run_then_has_in_every_frame(freeze_after_s):
    """To the particle: nothing spills here. It bounds the room that is made for those that move."""
    solid, outline = slot(12.0)
    fluid = Fluid(U=30.0, D_cm=0.3, freeze_after_s=freeze_after_s)
    solver, nozzle = Solver(radius_mm=0.6, settle_s=0.25), Nozzle()
    run = prepare(solid, outline, path(outline, 0.12, speed_mm_s=20.0), [fluid], solver, nozzle, seed=1, device="cpu")
    course = course_of(run.schedule, fluid, solver.settle_s)
    assert course.frames == run.frames
    assert course.out[-1] == run.schedule.particles
    for out, moving in zip(course.out, course.moving, strict=True):
        run.advance()
        assert (run.out, run.moving) == (out, moving)
    assert (run.moving == 0) == (freeze_after_s != "never")
