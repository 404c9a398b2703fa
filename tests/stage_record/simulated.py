"""Small outputs of simulate: kernels, wall particles, four fluids, releases, the read level, the fast model."""

from dataclasses import replace
from typing import Any

import numpy as np

from sealtwin.core.records import Trajectory
from simulate.bead_law import laid_section, slumped_stress
from simulate.device import start_warp
from simulate.fluid.solver import FluidSolver, substeps_for
from simulate.injection import prepare
from simulate.profile import measure_profile, volume_ratio
from simulate.settings import Fluid, Nozzle, Solver
from simulate.setup.release_schedule import plan_releases
from simulate.setup.rheology import Rheology
from simulate.slot.run import pour
from simulate.spread_law import flat_stress_pa, stretched_stress_pa
from tests.evidence import make_run
from tests.fluids import engine_with, lattice, path, slot
from tests.stage_record.sampled import Nudge, Outputs, sampled

PASTE = Rheology(10.0, 0.0, sticks=True, flow_index=0.6, yield_cm2_s2=70.0, yield_most_cm2_s2=70.0, physical=True)
FLUIDS: dict[str, dict[str, Any]] = {
    "U and D_cm": {"U": 30.0, "D_cm": 0.3},
    "viscosity_pa_s": {"viscosity_pa_s": 1.0},
    "Bingham": {"viscosity_pa_s": 1.0, "yield_stress_pa": 20.0},
    "Herschel-Bulkley": {"consistency_pa_s_n": 4.0, "flow_index": 0.5, "yield_stress_pa": 10.0},
}
FRAMES = 8  # By then the sealant is between the walls and on the floor; later frames amplify rounding


def outputs(nudge: Nudge) -> Outputs:
    start_warp()
    found = {**_kernels(nudge), **_fluids(nudge), **_releases(nudge), **_fast_model(nudge), **_read_level(nudge)}
    return {name: sampled(values) for name, values in found.items()}


def _kernels(nudge: Nudge) -> dict[str, Any]:
    engine = _filled_slot(nudge)
    engine.find_neighbours()
    rows, state, before_mm = engine.rows, engine.state, engine.state.position_mm()
    engine.pressure.measure_density(rows)
    found = {"density": state.density.numpy(), "wall particles": engine.walls.position_and_share.numpy()}
    engine.viscosity.measure_shear(rows)
    engine.viscosity.solve_implicit(rows)
    found["speed after the viscosity's solve"] = state.velocity.numpy()
    found["drag of the walls"] = engine.viscosity.system.drag.numpy()[:rows]
    engine.pressure.correct(rows)
    found["way of one correction"] = state.position_mm() - before_mm
    whole = _filled_slot(nudge)
    whole.step()
    found["way of a substep"] = whole.state.position_mm() - before_mm
    slow_cm_s = 1e-4
    slow = _filled_slot(nudge, slow_cm_s)
    slow.find_neighbours()
    slow.viscosity.measure_shear(rows)
    slow.viscosity.solve_implicit(rows)
    found["speed of slow paste after the viscosity's solve"] = slow.state.velocity.numpy() / slow_cm_s
    return found


def _filled_slot(nudge: Nudge, speed_cm_s: float = 5.0) -> FluidSolver:
    """A block of particles between two walls, a little too dense, which moves at random."""
    points_mm = lattice(np.array([0.4, -1.2, -15.6]), np.array([5.6, 1.2, -12.0]), 0.66)
    engine = engine_with(nudge(points_mm), slot(), fluid=PASTE)
    engine.begin_frame(1)
    velocity_cm_s = nudge(np.random.default_rng(0).normal(0, speed_cm_s, (engine.state.count, 3)))
    engine.state.velocity.assign(velocity_cm_s.astype(np.float32))
    return engine


def _fluids(nudge: Nudge) -> dict[str, Any]:
    crack, solver, nozzle = slot(8.0, depth_mm=4.0), Solver(radius_mm=0.5), Nozzle(diameter_mm=2.4)
    found: dict[str, Any] = {}
    for name, table in FLUIDS.items():
        fluid = Fluid.model_validate({**table, "freeze_after_s": "never"})
        run = prepare(*crack, _trajectory(nudge), [fluid], solver, nozzle, seed=1, device="cpu")
        for _ in range(FRAMES):
            run.advance()
        state = run.engine.state
        found[f"{name}: place"] = state.position_mm()[: run.out]
        found[f"{name}: speed"] = state.velocity.numpy()[: run.out]
        found[f"{name}: substeps and iterations"] = [run.engine.substeps, *map(float, run.engine.iterations[0])]
    fluids, frames_s = (Rheology(0.0, 0.0), Rheology(1000.0, 0.0, physical=True)), np.linspace(0.002, 0.04, 12)
    found["substeps by frame"] = [substeps_for(solver, fluid, frame_s) for fluid in fluids for frame_s in frames_s]
    return found


def _trajectory(nudge: Nudge) -> Trajectory:
    way = path(slot(8.0, depth_mm=4.0)[1], 0.06, speed_mm_s=30.0, trim_mm=2.0)
    return replace(way, position_mm=nudge(way.position_mm))


def _releases(nudge: Nudge) -> dict[str, Any]:
    plan = plan_releases(_trajectory(nudge), 0.4, 2.4, 1)
    return {"release: place": plan.position_mm, "release: speed": plan.velocity_mm_s, "release: frame": plan.frame_of}


def _fast_model(nudge: Nudge) -> dict[str, Any]:
    solid, outline = slot(24.0, 4.0, 8.0, "flare", 4.0)
    way = path(outline, 0.5, speed_mm_s=6.0, trim_mm=4.0)
    way = replace(way, flow_mm3_s=nudge(way.flow_mm3_s))
    fluid = Fluid(viscosity_pa_s=2.0, yield_stress_pa=8.0, freeze_after_s="never")
    run, level = pour(solid, outline, way, fluid, Solver(model="slot", settle_s=1.0), Nozzle(), seed=0)
    assert run.bed is not None
    bed = [run.bed.in_crack_mm3, run.bed.above_face_mm3, run.bed.held_slope, run.bed.mound_mm, run.health.volume_ratio]
    return {"fast model: level": level.level_mm, "fast model: bed": bed}


def _read_level(nudge: Nudge) -> dict[str, Any]:
    """Level and volume of particles that were put down, and stresses by spread and bead."""
    solid, outline = slot(24.0, 4.0, 8.0)
    run = make_run(outline, solid)
    # A lattice would lie on the edges of the columns that the level is read from.
    off_mm = np.random.default_rng(0).uniform(-0.1, 0.1, run.position_mm.shape)
    run = replace(run, position_mm=nudge(run.position_mm + off_mm))
    level = measure_profile(run, outline, solid)
    radius_mm, per_mm = nudge([40.0, 60.0, 90.0]), nudge([0.02, 0.05, 0.1])
    stresses = [*flat_stress_pa(5e4, radius_mm, 1700.0), *stretched_stress_pa(5e4, radius_mm, 1700.0)]
    section_mm2 = np.full(3, 20.0)
    return {
        "level by particles": level.level_mm,
        "volume by particles": [volume_ratio(run, solid)],
        "stresses by spread": stresses,
        "stresses by bead": slumped_stress(per_mm, section_mm2),
        "sections by bead": laid_section(per_mm, section_mm2),
    }
