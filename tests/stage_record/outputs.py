"""Small outputs of each stage: traced walls, solids and paths, kernels and runs, comparisons and calibrations."""

import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import trimesh

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.settings import CrackShape, NozzlePath, Tilt
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.files import as_json
from sealtwin.core.records import Floats, Outline, Profile, Sample, Trajectory
from simulate.device import start_warp
from simulate.fluid.solver import FluidSolver, substeps_for
from simulate.injection import prepare
from simulate.pour import Pour
from simulate.profile import measure_profile, volume_ratio
from simulate.settings import Fluid, Nozzle, Solver
from simulate.setup.release_schedule import plan_releases
from simulate.setup.rheology import Rheology
from simulate.slot import run as fast_model
from simulate.spread_law import flat_stress_pa, stretched_stress_pa
from tests.support.evidence import make_evidence, make_run, slope
from tests.support.photos import evenly_scaled, mortar, with_crack, write_png
from tests.support.shapes import outline_between, wandering_crack
from tests.support.small_fluids import engine_with, in_rows, lattice, path, sample_of, slot
from validate.calibration.emulator import Emulator
from validate.calibration.posterior import ReadLevels, reach_of
from validate.calibration.summary import predicted_by_runs
from validate.compare import assess
from validate.readings.read_readings import read_readings
from validate.settings import Readings, Uncertainty
from validate.uncertainty.computed import Effect, SizeRuns, Spread

SAMPLES = 24

Nudge = Callable[[Any], Floats]
"""Function through which outputs take their inputs: it returns them as they are, or each moved by a rounding."""
Outputs = dict[str, Floats]


def sampled(values: Any) -> Floats:
    """Return a few values as they are; of many some, evenly spaced, and the mean and root mean square of all."""
    flat = np.asarray(values, dtype=float).ravel()
    if len(flat) <= SAMPLES:
        return flat
    some = flat[np.linspace(0, len(flat) - 1, SAMPLES).astype(int)]
    return np.array([*some, flat.mean(), np.sqrt(np.mean(flat**2))])


ENDS_PX = (20.0, 82.0), (200.0, 80.0)


def traced(nudge: Nudge) -> Outputs:
    return {name: sampled(values) for name, values in _walls(nudge).items()}


def solids(nudge: Nudge) -> Outputs:
    return {name: sampled(values) for name, values in {**_solids(nudge), **_path(nudge)}.items()}


def _walls(nudge: Nudge) -> dict[str, Any]:
    drawn = with_crack(mortar((220, 160)), [(20, 82), (80, 70), (140, 96), (200, 80)], 18)
    with tempfile.TemporaryDirectory() as place:
        photo = evenly_scaled(write_png(Path(place) / "crack.png", drawn))
    photo = replace(photo, brightness=nudge(photo.brightness).astype(photo.brightness.dtype))
    outline = trace_outline(photo, find_path(photo, ENDS_PX))
    return {
        "left wall": outline.left_wall_mm,
        "right wall": outline.right_wall_mm,
        "width": outline.width_mm,
        "centreline": outline.centreline_mm,
    }


def _solids(nudge: Nudge) -> dict[str, Any]:
    outline, arrays = _nudged(wandering_crack(), nudge), dict[str, Any]()
    for tilt in get_args(Tilt):
        solid = build_solid(outline, CrackShape.model_validate({"depth_mm": 12.0, "tilt": tilt}))
        # Not the vertices themselves: rounding gives them another order, and cuts a plane into other triangles.
        mesh = trimesh.Trimesh(solid.vertices_mm, solid.faces, process=False)
        arrays[f"{tilt}: bounds and centroid"] = [*mesh.bounds.ravel(), *mesh.center_mass]
        arrays[f"{tilt}: inertia"] = mesh.moment_inertia
        arrays[f"{tilt}: area and volume"] = [mesh.area, mesh.volume]
        arrays[f"{tilt}: cavity and sections"] = [solid.cavity_volume_mm3, *solid.sections.area_mm2[::40]]
    return arrays


def _path(nudge: Nudge) -> dict[str, Any]:
    path = NozzlePath(volume_ml=0.3, speed_mm_s=5.0, trim_mm=1.0)
    planned = plan_trajectory(_nudged(wandering_crack(), nudge), path, 300.0)
    return {"path: place": planned.position_mm, "path: time": planned.t_s, "path: flow": planned.flow_mm3_s}


def _nudged(outline: Outline, nudge: Nudge) -> Outline:
    """Return the crack a rounding larger or smaller: points that coincide stay together."""
    roundings = nudge(np.ones(100)) - 1
    # One draw alone may be three times as large, and so would be the tolerance of the record.
    size = 1 + float(np.sign(roundings[0]) * np.sqrt(np.mean(roundings**2)))
    lines = size * outline.centreline_mm, size * outline.left_wall_mm, size * outline.right_wall_mm
    return outline_between(*lines, outline.ends, outline.face_mm)


PASTE = Rheology(10.0, 0.0, sticks=True, flow_index=0.6, yield_cm2_s2=70.0, physical=True)
FLUIDS: dict[str, dict[str, Any]] = {
    "U and D_cm": {"U": 30.0, "D_cm": 0.3},
    "viscosity_pa_s": {"viscosity_pa_s": 1.0},
    "Bingham": {"viscosity_pa_s": 1.0, "yield_stress_pa": 20.0},
    "Herschel-Bulkley": {"consistency_pa_s_n": 4.0, "flow_index": 0.5, "yield_stress_pa": 10.0},
}
FRAMES = 8  # By then the sealant is between the walls and on the floor; later frames amplify rounding


def simulated(nudge: Nudge) -> Outputs:
    start_warp()
    arrays = {**_kernels(nudge), **_fluids(nudge), **_releases(nudge), **_fast_model(nudge), **_read_level(nudge)}
    return {name: sampled(values) for name, values in arrays.items()}


def _kernels(nudge: Nudge) -> dict[str, Any]:
    engine = _filled_slot(nudge)
    engine.find_neighbours()
    rows, state, before_mm = engine.rows, engine.state, engine.state.position_mm()
    engine.pressure.measure_density(rows)
    arrays = {"density": state.density.numpy(), "wall particles": engine.walls.position_and_share.numpy()}
    engine.viscosity.measure_shear(rows)
    engine.viscosity.solve_implicit(rows)
    arrays["speed after the viscosity's solve"] = state.velocity.numpy()
    arrays["drag of the walls"] = engine.viscosity.system.drag.numpy()[:rows][np.argsort(in_rows(engine))]
    engine.pressure.correct(rows)
    arrays["way of one correction"] = state.position_mm() - before_mm
    whole = _filled_slot(nudge)
    whole.step()
    arrays["way of a substep"] = whole.state.position_mm() - before_mm
    slow_cm_s = 1e-4
    slow = _filled_slot(nudge, slow_cm_s)
    slow.find_neighbours()
    slow.viscosity.measure_shear(rows)
    slow.viscosity.solve_implicit(rows)
    arrays["speed of slow paste after the viscosity's solve"] = slow.state.velocity.numpy() / slow_cm_s
    return arrays


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
    arrays: dict[str, Any] = {}
    for name, table in FLUIDS.items():
        fluid = Fluid.model_validate({**table, "freeze_after_s": "never"})
        run = prepare(Pour(sample_of(crack, _trajectory(nudge)), (fluid,), solver, nozzle, seed=1))
        for _ in range(FRAMES):
            run.advance()
        state = run.engine.state
        arrays[f"{name}: place"] = state.position_mm()[: run.out]
        arrays[f"{name}: speed"] = state.velocity.numpy()[: run.out]
        arrays[f"{name}: substeps and iterations"] = [run.engine.substeps, *map(float, run.engine.iterations[0])]
    fluids, frames_s = (Rheology(0.0, 0.0), Rheology(1000.0, 0.0, physical=True)), np.linspace(0.002, 0.04, 12)
    arrays["substeps by frame"] = [substeps_for(solver, fluid, frame_s) for fluid in fluids for frame_s in frames_s]
    return arrays


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
    run, level = fast_model.pour(Pour(Sample(outline, solid, way), (fluid,), Solver(model="slot", settle_s=1.0)))
    bed = run.fast_fill
    assert bed is not None
    figures = [bed.in_crack_mm3, bed.above_face_mm3, bed.held_slope, bed.mound_mm, run.health.volume_ratio]
    return {"fast model: level": level.level_mm, "fast model: bed": figures}


def _read_level(nudge: Nudge) -> dict[str, Any]:
    """Level and volume of particles that were put down, and stresses by spread."""
    solid, outline = slot(24.0, 4.0, 8.0)
    run = make_run(outline, solid)
    # A lattice would lie on the edges of the columns that the level is read from.
    off_mm = np.random.default_rng(0).uniform(-0.1, 0.1, run.position_mm.shape)
    run = replace(run, position_mm=nudge(run.position_mm + off_mm))
    level = measure_profile(run, outline, solid)
    radius_mm = nudge([40.0, 60.0, 90.0])
    stresses = [*flat_stress_pa(5e4, radius_mm, 1700.0), *stretched_stress_pa(5e4, radius_mm, 1700.0)]
    return {
        "level by particles": level.level_mm,
        "volume by particles": [volume_ratio(run, solid)],
        "stresses by spread": stresses,
    }


S_MM = np.linspace(0, 40, 81)
SHEET = "s_mm,level_1_mm,level_2_mm,level_3_mm\n" + "".join(
    f"{s},{-8 + 0.2 * s + a:.2f},{-8 + 0.2 * s + b:.2f},{-8 + 0.2 * s + c:.2f}\n"
    for s, a, b, c in [
        (1, 0.1, -0.13, 0.02), (5, -0.08, 0.21, 0.05), (10, 0.17, 0.04, -0.11), (15, -0.2, -0.06, 0.03),
        (20, 0.07, 0.12, -0.05), (25, 0.0, -0.14, 0.19), (30, -0.09, 0.08, 0.11), (35, 0.23, -0.02, -0.12),
    ]
)  # fmt: skip


def validated(nudge: Nudge) -> Outputs:
    arrays = {**_compared(nudge), **_calibrated(nudge)}
    return {name: sampled(values) for name, values in arrays.items()}


def _compared(nudge: Nudge) -> dict[str, Any]:
    settings = Readings(file=Path("caliper.csv"), data="measured", role="held-out")
    declared = Uncertainty(volume_ml=0.02, station_mm=0.5)
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "caliper.csv").write_text(SHEET, encoding="utf-8")
        readings = read_readings(Path(place) / "caliper.csv", settings, 40.0, 10.0)
        evidence = make_evidence(Path(place))
    level_mm = nudge(slope(S_MM) + 0.4 * np.sin(S_MM / 5) + 0.2)
    evidence = replace(evidence, profile=Profile(S_MM, level_mm, source="simulation"), readings=readings)
    comparison = assess(evidence, settings, declared, _spread(nudge))
    return _numbers_of("comparison", json.loads(as_json(comparison.model_dump())))


def _numbers_of(name: str, value: Any) -> dict[str, Any]:
    """Return the numbers of a comparison by their place in it, lists of them whole."""
    if isinstance(value, dict):
        return {key: one for inner in value for key, one in _numbers_of(f"{name}: {inner}", value[inner]).items()}
    if isinstance(value, list) and not all(isinstance(one, float | int) for one in value):
        return _numbers_of(name, dict(enumerate(value)))
    return {name: value} if isinstance(value, list | float | int) and value != [] else {}


def _spread(nudge: Nudge) -> Spread:
    sizes = (
        SizeRuns(radius_mm, np.array([nudge(slope(S_MM) + z_mm + off_mm) for off_mm in (-0.03, 0.0, 0.02)]))
        for radius_mm, z_mm in ((0.4, 0.45), (0.5, 0.5), (0.65, 0.6))
    )
    fine, middle, coarse = sizes
    lifted = Effect("volume_ml", 0.02, np.full(81, 0.3))
    return Spread(S_MM, (fine, middle, coarse), (lifted,), 0.02, 0.65, fast_mm=nudge(slope(S_MM) + 0.3))


def _calibrated(nudge: Nudge) -> dict[str, Any]:
    """A prediction by runs, and an emulator of runs whose level two settings move."""
    points = np.random.default_rng(3).random((20, 2))
    s_mm = np.linspace(0, 30, 11)
    shape = np.outer(points[:, 0], np.cos(s_mm / 10)) + np.outer(points[:, 1] ** 2, s_mm / 30)
    levels_mm = nudge(-5 + shape)
    evidence = ReadLevels(s_mm, -5 + 0.4 * np.cos(s_mm / 10) + 0.25 * s_mm / 30, 0.01 * np.eye(11))
    mean_mm, half_mm = predicted_by_runs(levels_mm, evidence)
    tried = np.array([[0.3, 0.6], [0.8, 0.2]])
    reach = reach_of(points, levels_mm, evidence)
    return {
        "prediction by runs": [*mean_mm, *half_mm],
        "calibration: reach": [reach.components, reach.residual_mm, reach.noise_mm],
        "calibration: emulated level": Emulator.fitted(points, levels_mm, 2).levels_mm(tried),
    }
