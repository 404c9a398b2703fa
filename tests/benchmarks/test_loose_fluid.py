"""Fluid that is poured from a source, with the volume that was released so far."""

import numpy as np
import pytest

from benchmarks.hollow import Box, Hollow
from benchmarks.loose_fluid import LooseFluid
from benchmarks.measured_pours import fed
from simulate.device import start_warp
from simulate.settings import Solver, particle_volume
from simulate.setup_checks import solved_as
from tests.support.small_fluids import sealant

FLOW_MM3_S, RADIUS_MM = 2000.0, 1.0


def test_a_pour_contains_the_released_volume_and_spreads_evenly():
    start_warp()
    schedule = fed(FLOW_MM3_S, 1.0, RADIUS_MM, height_mm=9.0, diameter_mm=10.0)
    solver = Solver(radius_mm=RADIUS_MM)
    paste, _ = solved_as(sealant(viscosity_pa_s=2.0), solver.model_copy(update={"substeps": 1}), schedule.frame_s, 400)
    pour = LooseFluid.put(Hollow(Box((-40, -40, 0), (40, 40, 14))), schedule, paste, solver)
    counts, reaches_mm = list[int](), list[float]()
    for _ in pour.run(1.0, 0.5):
        counts.append(len(pour.place_mm))
        reaches_mm.append(float(np.quantile(np.hypot(*pour.place_mm[:, :2].T), 0.99)))
    assert np.array(counts) * particle_volume(RADIUS_MM) == pytest.approx([1000.0, 2000.0], rel=0.03)
    assert reaches_mm[0] < reaches_mm[1] < 30
    assert pour.escaped == 0
    assert np.linalg.norm(pour.place_mm[:, :2].mean(axis=0)) < 1.0
