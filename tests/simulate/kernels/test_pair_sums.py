"""The inner loops for CPUs, compared with the plain loops that state the equations."""

from types import ModuleType
from typing import Any

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from simulate.kernels import pair_sums, pair_sums_cpu
from simulate.kernels.neighbours import Neighbours
from simulate.kernels.status import Particles
from tests.support.device_loops import sum_kernel
from tests.support.small_fluids import engine_with, lattice, listed_fluid, listed_walls, positions_mm, slot

SUPPORT = 0.16
ROWS, SLOTS, POINTS = 40, 64, 300
Rows = NDArray[Any]


def sums(loops: ModuleType) -> tuple[Rows, Rows]:
    """Sums over a cloud with neighbours within and beyond reach, two at one point; rows have up to 40 neighbours."""
    random = np.random.default_rng(3)
    place = np.column_stack([random.uniform(0, 0.25, (POINTS, 3)), random.uniform(-1, 1, POINTS)])
    place[7, :3] = place[0, :3]
    listed = np.array([random.permutation(POINTS)[:SLOTS] for _ in range(ROWS)])
    listed[0, 0] = 7
    # As in a run, no neighbour is listed behind a row's count.
    listed[np.arange(SLOTS) > np.arange(ROWS)[:, None]] = POINTS
    near, particles = Neighbours(), Particles()
    particles.position = wp.array(np.vstack([place, [[1e6] * 4] * 2]), dtype=wp.vec4, device="cpu")[:POINTS]
    particles.mover = wp.array(np.arange(ROWS), dtype=int, device="cpu")
    particles.velocity, particles.scaled_residual = (
        wp.array(random.normal(0, 10, (POINTS + 2, 3)), dtype=wp.vec3, device="cpu")[:POINTS] for _ in range(2)
    )
    bulk = random.uniform(0.5, 3, (POINTS + 2, 2))
    particles.volume_and_viscosity = wp.array(bulk, dtype=wp.vec2, device="cpu")[:POINTS]
    near.wall_particle = particles.position
    near.fluid = near.wall = wp.array(listed, dtype=int, device="cpu")
    near.fluid_at = near.wall_at = particles.mover
    near.fluid_count = near.wall_count = wp.array(np.arange(ROWS) + 1, dtype=int, device="cpu")
    links = wp.zeros((ROWS, SLOTS), dtype=wp.vec3h, device="cpu")
    out = wp.zeros((ROWS, 48), dtype=float, device="cpu")
    wp.launch(sum_kernel(loops), ROWS, inputs=[particles, near, SUPPORT, links, out], device="cpu")
    pulls = links.numpy().astype(np.float32)
    if loops is pair_sums_cpu:
        # The loops for CPUs store sixteen x, then sixteen y, then sixteen z.
        pulls = pulls.reshape(ROWS, -1, 3, 16).swapaxes(2, 3)
    return out.numpy(), pulls.reshape(ROWS, -1)


def test_cpu_loops_and_plain_loops_give_the_same_pair_sums():
    """Sums in another order differ by float32's rounding: 1e-5 of the largest row, since terms have both signs.

    Links and their sums are rounded to float16, whose last bit may differ.
    """
    plain, native = sums(pair_sums), sums(pair_sums_cpu)
    pulled = np.arange(plain[0].shape[1])[14:17]
    for ours, theirs in zip(native, plain, strict=True):
        apart = np.abs(ours - theirs).max(axis=0) / (np.abs(theirs).max(axis=0) + 1e-30)
        rounded = np.isin(np.arange(len(apart)), pulled) | (ours is native[1])
        assert apart[~rounded].max(initial=0) < 1e-5
        assert apart[rounded].max() < 1e-3
    # Entries behind a row's count are not in its sums.
    assert (native[1] != 0).sum(axis=1)[0] <= 3
    # Products of the links with the velocities' differences are the pulls that ``link_pairs`` sums before rounding.
    out = native[0]
    assert np.abs(out[:, 14:17] - out[:, 45:48]).max() <= 1e-3 * np.abs(out[:, 45:48]).max()


@pytest.mark.parametrize("solver", [{"viscosity_solve": "implicit"}, {"viscosity_solve": "explicit"}])
def test_cpu_loops_and_plain_loops_give_the_same_neighbours_and_steps(solver):
    """Chaos amplifies rounding: after twenty steps, positions may differ by a hundredth of a radius."""
    points = lattice(np.array([0.2, -1.3, -12]), np.array([5.8, 1.3, -2]), 0.69)
    lists, ends = [], []
    for native in (False, True):
        engine = engine_with(points, slot(), native=native, weights=(30.0, 0.3), **solver)
        engine.find_neighbours()
        lists.append([[row.tolist() for row in rows_of(engine)] for rows_of in (listed_fluid, listed_walls)])
        for _ in range(20):
            engine.step()
        ends.append(positions_mm(engine))
    assert lists[0] == lists[1]
    assert max(map(len, lists[0][1])) > 16
    assert np.abs(ends[0] - points).max() > 0.2
    assert np.abs(ends[0] - ends[1]).max() < 0.004
