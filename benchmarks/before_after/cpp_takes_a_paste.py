"""The program in C++ that the fluid is timed against takes the substeps of paste that a run of the shipped trial takes.

600 particles in a tank 8.9 mm wide, from frame 6 on; how far those of both programs are apart after it.
"""

import json
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np

from benchmarks.pbf_cpp import CppStep
from sealtwin.trial.trial_file import load_trial
from simulate.setup_checks import rheology_of
from tests.fluids import engine_with, hewn, lattice
from tests.shapes import straight_slot

SIDE_MM, DEPTH_MM, RIM_MM = 8.9, 8.8, 5.0
FRAME_S, SUBSTEPS = 7.14e-3, 3

half, outer = SIDE_MM / 2, SIDE_MM / 2 + RIM_MM
body = manifold3d.Manifold.cube((2 * outer, 2 * outer, DEPTH_MM + RIM_MM))
body = body.translate((-outer, -outer, -DEPTH_MM - RIM_MM))
body -= manifold3d.Manifold.cube((SIDE_MM, SIDE_MM, DEPTH_MM + 1)).translate((-half, -half, -DEPTH_MM))
crack = hewn(body, (-outer, -outer, outer, outer), DEPTH_MM), straight_slot(SIDE_MM, SIDE_MM)
inside = half - 0.35
block = lattice(np.array([-inside, -inside, 0.35 - DEPTH_MM]), np.array([inside, inside, 0.0]), 0.72)
block = block[np.argsort(block[:, 2], kind="stable")][:600]

trial = load_trial(Path("fixtures/paper-trial/trial.toml"))
assert trial.fluid is not None
settings: dict[str, Any] = trial.solver.model_dump() | {"substeps": SUBSTEPS}
paste = rheology_of(trial.fluid, 4 * trial.solver.size_mm / 10, FRAME_S)
engine = engine_with(block, crack, frame_s=FRAME_S, fluid=paste, **settings)
for frame in range(1, 6):
    engine.begin_frame(frame)
    for _ in range(SUBSTEPS):
        engine.step()
engine.begin_frame(6)
before_mm, theirs = engine.state.position_mm(), CppStep(engine, SIDE_MM, DEPTH_MM, 1)
for _ in range(SUBSTEPS):
    engine.step()
    theirs.step()
ours_mm = engine.state.position_mm()
way = float(np.median(np.linalg.norm(ours_mm - before_mm, axis=1)))
apart = float(np.median(np.linalg.norm(theirs.place_mm - ours_mm, axis=1))) / way
print(
    json.dumps({"line": f"after a frame of paste {apart:.2g} of its way of {way:.3f} mm apart", "sound": apart < 1e-3})
)
