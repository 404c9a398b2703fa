from typing import Any

import numpy as np
import pytest
import warp as wp
from scipy.spatial import KDTree

from simulate.fluid.cell_grid import CellGrid
from simulate.fluid.fault_checks import RunFault
from simulate.fluid.launcher import Launcher
from simulate.fluid.state import MoversList, State
from simulate.fluid.walk import fixed
from simulate.kernels import neighbours, status
from simulate.setup.release_schedule import Schedule
from simulate.setup.signed_distance import CM
from tests.support.small_fluids import check, engine_with, in_rows, listed_fluid, listed_walls, slot

SUPPORT_CM = 0.16


def test_neighbour_lists_agree_with_a_kd_tree_search():
    """Points beyond the grid on every side are included."""
    points = np.random.default_rng(0).uniform([-3, -3, -16], [9, 3, 2], (1500, 3))
    engine = engine_with(points, slot(), reach_mm=(np.array([0.0, -1.0, -10.0]), np.array([5.0, 1.0, 0.0])))
    engine.find_neighbours()
    position_cm, rows = engine.state.position_mm() * CM, in_rows(engine)
    expected = KDTree(position_cm).query_ball_point(position_cm, SUPPORT_CM)
    for i, near in zip(rows, listed_fluid(engine), strict=True):
        assert sorted([i, *near]) == sorted(expected[i])
    walls = KDTree(engine.walls.position_and_share.numpy()[:, :3].astype(float)).query_ball_point(
        position_cm, SUPPORT_CM
    )
    assert max(map(len, listed_walls(engine))) > 8
    for i, near in zip(rows, listed_walls(engine), strict=True):
        assert sorted(near) == sorted(walls[i])


def test_the_fault_of_an_overflowing_neighbour_list_names_the_first_affected_particle():
    crowd = np.vstack([[[3.0, 0.0, -1.0]], np.random.default_rng(0).normal([3, 0, -8], 0.1, (200, 3))])
    engine = engine_with(crowd, slot())
    engine.find_neighbours()
    assert check(engine) == {0: RunFault(int(neighbours.NEIGHBOURS_FULL), 1)}


def grid_of(points, out, **options: Any) -> CellGrid:
    """A grid of cells of 0.25 cm over a box of 6, 4 and 5 cells."""
    position = wp.array(np.pad(points, ((0, 0), (0, 1))), dtype=wp.vec4, device="cpu")
    fate = wp.array(out, dtype=int, device="cpu")
    launcher = Launcher("cpu", fixed(len(points), "cpu"))
    return CellGrid(np.zeros(3), np.array([1.5, 1.0, 1.25]), 0.25, position, fate, launcher, **options)


@pytest.mark.parametrize("runs", [1, 3])
def test_the_cell_sorts_of_cpu_and_gpu_give_equal_tables(runs):
    """Both sorts run on the CPU here. Some points are spilled, and some are beyond the grid."""
    many, random = 9000, np.random.default_rng(5)
    points = random.uniform(-0.5, 1.7, (many, 3))
    fate = random.choice([status.MOVING, status.FROZEN, status.SPILLED], many)
    tables = []
    for in_order in (True, False):
        grid = grid_of(points, fate, runs=runs, in_order=in_order)
        grid.fill(many)
        columns, start = (grid.cells.number, grid.cells.x, grid.cells.y, grid.cells.z), grid.cells.start.numpy()
        tables.append([start[:-1], *(column.numpy()[: start[-2]] for column in columns)])
    assert all(map(np.array_equal, *tables))
    assert len(np.unique(tables[0][0])) > 50 * runs


def state_of(count: int, runs: int = 1) -> State:
    """Particles that are all released at once."""
    nowhere = np.zeros((count, 3))
    return State(Schedule(nowhere, nowhere, np.zeros(count, int), np.array([count]), 0.01, count, 1.0), "cpu", runs)


def test_the_gpu_sort_lists_each_moving_particle_once_if_others_have_spilled():
    """Entries that an earlier sort left are behind the last moving particle and are not counted."""
    state, launcher = state_of(200), Launcher("cpu", fixed(200, "cpu"))
    position = wp.array(np.pad(np.random.default_rng(6).uniform(0, 1, (200, 3)), ((0, 0), (0, 1))), dtype=wp.vec4)
    grid = CellGrid(np.zeros(3), np.ones(3), 0.25, position, state.status, launcher, in_order=False)
    movers = MoversList(state, launcher, in_order=False)
    for fate in (status.MOVING, status.SPILLED):
        state.status.assign(np.where(np.arange(200) < 120, fate, status.MOVING).astype(np.int32))
        grid.fill(200)
        movers.find(200)
        movers.sort(grid.cells.number, 200)
    assert sorted(state.particles.mover.numpy()[: movers.number()]) == list(range(120, 200))


@pytest.mark.parametrize("runs", [1, 3])
def test_cpu_and_gpu_lists_of_moving_particles_are_equal(runs):
    """Lists in the order of memory and by cell are compared, and the rows of each run."""
    listed = []
    for in_order in (True, False):
        state = state_of(9000, runs)
        fate = np.random.default_rng(3).choice([status.MOVING, status.ASLEEP, status.FROZEN], state.count)
        state.status.assign(fate.astype(np.int32))
        order = np.random.default_rng(4).permutation(state.count)
        movers = MoversList(state, Launcher("cpu", fixed(state.count, "cpu")), in_order)
        movers.find(state.count)
        in_memory = state.particles.mover.numpy()[: movers.number()].copy()
        movers.sort(wp.array(order, dtype=int, device="cpu"), state.count)
        by_cell = state.particles.mover.numpy()[: movers.number()].copy()
        assert (in_memory == np.flatnonzero(fate == int(status.MOVING))).all()
        assert (by_cell == order[fate[order] == int(status.MOVING)]).all()
        listed.append([*in_memory, *by_cell, *state.particles.first_row.numpy()])
    assert listed[0] == listed[1]
