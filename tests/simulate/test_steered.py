"""A pour whose flow is set on the way is the same pour as one that was planned."""

import numpy as np
import pytest

from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.errors import InputError
from sealtwin.core.records import Sample
from simulate.run import fill
from simulate.settings import Fluid, Nozzle, Solver
from simulate.steered import SteeredPour
from tests.shapes import straight_slot

OUTLINE = straight_slot(24.0, 4.0)
SOLID = build_solid(OUTLINE, CrackShape(depth_mm=8.0, tilt="vertical"))
MOTION = plan_trajectory(OUTLINE, NozzlePath(trim_mm=4.0, fill=0.8, speed_mm_s=8.0), SOLID.cavity_volume_mm3)
PHYSICS = (
    Fluid(viscosity_pa_s=0.5, yield_stress_pa=4.0, freeze_after_s="never"),
    Solver(radius_mm=0.9, settle_s=1.0, volume_factor=1.05),
    Nozzle(diameter_mm=2.4),
)
FLOW = float(MOTION.flow_mm3_s[0])


def steered(flow: float, most: float) -> SteeredPour:
    pour = SteeredPour(SOLID, OUTLINE, MOTION, *PHYSICS, most_mm3_s=most, seed=1)
    pour.advance(MOTION.t_s[-1], lambda t_s: flow)
    pour.advance(MOTION.t_s[-1] + 1.0, lambda t_s: 0.0)
    return pour


@pytest.mark.broad
def test_a_steady_flow_gives_the_level_of_a_planned_run():
    """Two seeds of such a bed differ by 0.3 mm on average; the mean levels by a tenth."""
    planned_mm = fill(Sample(OUTLINE, SOLID, MOTION), *PHYSICS, seed=1)[1].level_mm
    pour = steered(FLOW, 1.3 * FLOW)
    level_mm = pour.level().level_mm
    assert pour.given_mm3 == pytest.approx(MOTION.dispensed_mm3, rel=0.02)
    assert np.abs(level_mm - planned_mm).mean() < 0.5
    assert level_mm.mean() == pytest.approx(planned_mm.mean(), abs=0.2)


def test_half_of_the_flow_leaves_half_of_the_bed():
    level_mm = steered(FLOW / 2, 1.3 * FLOW).level().level_mm
    assert level_mm.mean() + 8.0 == pytest.approx(0.4 * 8.0, rel=0.15)


def test_a_volume_factor_is_needed():
    solver = PHYSICS[1].model_copy(update={"volume_factor": None})
    with pytest.raises(InputError, match=r"solver\.volume_factor"):
        SteeredPour(SOLID, OUTLINE, MOTION, PHYSICS[0], solver, PHYSICS[2], most_mm3_s=FLOW, seed=1)
