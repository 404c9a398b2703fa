"""The fast model in cracks with room that its sections leave out: a side crack, and walls that open at closed tips."""

import json

import numpy as np

from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.records import Outline, Sample
from simulate.settings import Fluid, Nozzle, Solver
from simulate.slot.run import pour
from tests.shapes import CUT, closed_crack, straight_slot, with_ring

FILL = 0.5
LIQUID = Fluid(viscosity_pa_s=0.1, freeze_after_s="never")


def filled(outline: Outline, tilt: str, angle_deg: float) -> tuple[float, bool]:
    """Share of its sections that half of the cavity fills, and whether the model is said to be unfit."""
    shape = CrackShape.model_validate({"depth_mm": 12.0, "tilt": tilt, "wall_angle_deg": angle_deg})
    solid = build_solid(outline, shape)
    path = NozzlePath(volume_ml=FILL * solid.cavity_volume_mm3 / 1e3, trim_mm=4.0, speed_mm_s=4.0)
    trajectory = plan_trajectory(outline, path, solid.cavity_volume_mm3, solid.sections)
    run, _ = pour(Sample(outline, solid, trajectory), LIQUID, Solver(model="slot"), Nozzle(), seed=0)
    assert run.fast_fill is not None
    return run.fast_fill.fill, bool(run.unfit)


ring_mm = np.array([(0, -3), (40, -3), (40, 3), (22, 3), (22, 20), (18, 20), (18, 3), (0, 3)], dtype=float)
cases = {
    "side crack": filled(with_ring(straight_slot(40.0, 6.0, CUT), ring_mm), "vertical", 0.0),
    "closed tips": filled(closed_crack(4, 30.0, 8.0), "flare", 25.0),
    "plain": filled(straight_slot(40.0, 6.0, CUT), "vertical", 0.0),
}
line = ", ".join(f"{name} {fill:.2f} {'unfit' if unfit else 'fit'}" for name, (fill, unfit) in cases.items())
sound = [unfit for _, unfit in cases.values()] == [True, True, False]
print(json.dumps({"line": f"filled share for {FILL}: {line}", "sound": sound}))
