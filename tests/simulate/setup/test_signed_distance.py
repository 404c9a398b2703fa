import manifold3d
import numpy as np
import pytest
import trimesh

from benchmarks.hollow import solid_of
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Solid
from simulate.fluid.solver import FluidSolver
from simulate.kernels.distance import BLOCK
from simulate.setup.signed_distance import CLEARANCE, CM, build_barrier
from tests.support.shapes import straight_slot, wandering_crack
from tests.support.small_fluids import engine_with, lattice, slot

RADIUS_MM = 0.4


def two_slots(septum_mm: float) -> Solid:
    """Two cavities of 3 x 20 x 8 mm, side by side along x, in one block."""
    block = manifold3d.Manifold.cube((44.0, 30.0, 12.0)).translate((-12, -15, -12))
    for side in (-1, 1):
        y = septum_mm / 2 if side > 0 else -septum_mm / 2 - 3
        block -= manifold3d.Manifold.cube((20.0, 3.0, 9.0)).translate((0, y, -8))
    return solid_of(block, (-12.0, -15.0, 32.0, 15.0), 8.0)


def test_distances_at_grid_nodes_are_exact_beside_long_thin_triangles():
    """The expected distances are trimesh's. The face around a crack has triangles 1,000 times as long as high."""
    outline = wandering_crack()
    solid = build_solid(outline, CrackShape(depth_mm=16.0, tilt="flare", wall_angle_deg=5.5))
    grid = build_barrier(solid, outline, RADIUS_MM, "cpu").grid
    row = grid.row.numpy()
    block = np.random.default_rng(0).choice(np.flatnonzero(row >= 0), 8, replace=False)
    node = np.stack(np.meshgrid(*3 * [np.arange(BLOCK + 1)], indexing="ij"), axis=-1).reshape(-1, 3)
    corner = BLOCK * np.column_stack(np.unravel_index(block, tuple(grid.blocks)))
    points = (np.array(grid.corner) + grid.spacing * (corner[:, None] + node).reshape(-1, 3)) / CM
    nearest_mm = np.full(len(points), np.inf)
    for triangle_mm in solid.vertices_mm[solid.faces]:
        closest = trimesh.triangles.closest_point(np.broadcast_to(triangle_mm, (len(points), 3, 3)), points)
        nearest_mm = np.fmin(nearest_mm, np.linalg.norm(closest - points, axis=1))
    nodes_mm = grid.nodes.numpy().reshape(-1, len(node))[row[block]] / CM
    assert np.abs(nodes_mm).ravel() == pytest.approx(nearest_mm, abs=1e-4)


def throw(engine: FluidSolver, step_mm: Floats) -> None:
    """Predict positions ``step_mm`` away, or nearer if a wall is in between."""
    engine.state.velocity.assign(np.asarray(step_mm * CM / engine.step_s, dtype=np.float32))
    engine.predict(engine.rows)


def test_no_particle_crosses_a_thin_wall_in_a_long_step():
    """Steps of up to 20 mm are aimed at the wall between two cavities; particles move until the wall stops them."""
    septum_mm, rng = 0.3, np.random.default_rng(0)
    crack = two_slots(septum_mm), straight_slot(20.0, 3.1)
    side = np.repeat([-1.0, 1.0], 2000)
    y = side * rng.uniform(septum_mm / 2 + 0.4, septum_mm / 2 + 2.6, 4000)
    start = np.column_stack([rng.uniform(0.5, 19.5, 4000), y, rng.uniform(-7.6, -1, 4000)])
    engine = engine_with(start, crack, substeps=4)
    throw(engine, np.column_stack([rng.normal(0, 3, 4000), -side * rng.uniform(0, 20, 4000), rng.normal(0, 1, 4000)]))
    end = engine.state.position_mm()
    below = end[:, 2] < 0
    assert below.sum() > 3000
    assert (np.sign(end[below, 1]) == side[below]).all()
    assert build_barrier(*crack, RADIUS_MM, "cpu").exact_mm(end)[below].min() > 0.4 * CLEARANCE * RADIUS_MM
    assert np.median(np.abs(end[below, 1])) < septum_mm / 2 + RADIUS_MM


@pytest.mark.parametrize(("tilt", "angle_deg"), [("funnel", 11.0), ("flare", 5.5)])
def test_falling_particles_do_not_penetrate_corners_or_converging_walls(tilt, angle_deg):
    """Particles are thrown down at all angles, into a V (funnel) and into corners of floor and wall."""
    crack, rng = slot(12.0, tilt=tilt, angle_deg=angle_deg), np.random.default_rng(1)
    engine = engine_with(rng.uniform([0.6, -1, 0.5], [11.4, 1, 0.5], (2000, 3)), crack, substeps=4)
    for _ in range(4):
        throw(engine, rng.normal(0, [3, 3, 1], (2000, 3)) - [0, 0, 8])
    end = engine.state.position_mm()
    assert build_barrier(*crack, RADIUS_MM, "cpu").exact_mm(end).min() > 0.3 * CLEARANCE * RADIUS_MM
    assert np.quantile(end[:, 2], 0.1) < -4


def test_a_nan_velocity_gives_a_nan_position():
    """The run stops at a NaN position, while a particle that stops in the air would count as bed."""
    engine = engine_with(np.array([[3.0, 0.0, -8.0], [3.0, 0.0, -2.0]]), slot())
    engine.state.velocity.assign(np.asarray([[np.nan, 0, 0], [0, 0, 0]], dtype=np.float32))
    engine.predict(engine.rows)
    assert np.isfinite(engine.state.position.numpy()[:, :3]).all(axis=1).tolist() == [False, True]


def test_a_radius_that_needs_too_fine_a_distance_grid_is_refused():
    with pytest.raises(InputError, match=r"solver.radius_mm is 0.02: its distance grid"):
        build_barrier(*slot(), 0.02, "cpu")


def test_pressure_pushes_no_particle_into_a_wall():
    """Far too dense fluid bursts out of a corner and over the mouth's edges, where a wall is not a plane."""
    solid, outline = slot(12.0, tilt="flare", depth_mm=6.0)
    points = lattice(np.array([0.5, -1.1, -5.6]), np.array([11.5, 1.1, 0.6]), 0.52)
    engine = engine_with(points, (solid, outline), reach_mm=(np.array([-30.0, -30, -6]), np.array([40.0, 30, 40])))
    barrier = build_barrier(solid, outline, RADIUS_MM, "cpu")
    start_mm, nearest_mm = engine.state.position_mm(), []
    for _ in range(12):
        engine.predict(engine.rows)
        engine.find_neighbours()
        engine.pressure.solve(engine.rows)
        nearest_mm.append(barrier.exact_mm(engine.state.position_mm()).min())
        engine.update_velocity(engine.rows)
    assert np.abs(engine.state.position_mm() - start_mm).max() > 5
    assert min(nearest_mm) > 0.8 * CLEARANCE * RADIUS_MM
