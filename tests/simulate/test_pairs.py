"""The inner loops for CPUs against the plain ones, which are the equations."""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from simulate import kernels_pairs, kernels_pairs_native
from tests.fluids import engine_with, lattice, positions_mm, slot

SUPPORT = 0.16
ROWS, SLOTS, POINTS = 40, 64, 300
Row = NDArray[np.floating]


@cache
def kernels_of(loops: ModuleType) -> dict[str, Any]:
    """One that stores each sum, (row, five)."""
    module = wp.get_module(f"tests.pairs.{loops.__name__}")
    sum_density, sum_walls, sum_correction = loops.sum_density, loops.sum_walls, loops.sum_correction
    sum_shear, couple, sum_drag, sum_pulled = loops.sum_shear, loops.couple, loops.sum_drag, loops.sum_pulled

    @wp.kernel(enable_backward=False, module=module)
    def all_sums(
        place: wp.array[wp.vec4],
        velocity: wp.array[wp.vec3],
        volume: wp.array[float],
        thickness: wp.array[float],
        listed: wp.array2d[int],
        count: wp.array[int],
        support: float,
        coupling: wp.array2d[float],
        out: wp.array2d[float],
    ):
        row = wp.tid()
        here, many = place[row], count[row]
        density = sum_density(place, listed, row, many, here, support)
        walls = sum_walls(place, listed, row, many, here, support)
        correction = sum_correction(place, listed, row, many, here, support, -0.3)
        for k in range(5):
            out[row, k] = density[k]
        for k in range(4):
            out[row, 5 + k] = walls[k]
        for k in range(3):
            out[row, 9 + k] = correction[k]
        out[row, 12] = sum_shear(place, velocity, volume, listed, row, many, here, velocity[row], support)
        out[row, 13] = couple(
            place, volume, thickness, listed, row, many, here, volume[row], thickness[row], support, coupling
        )
        out[row, 14] = sum_drag(place, listed, row, many, here, support)
        pulled = sum_pulled(velocity, coupling, listed, row, many)
        for k in range(3):
            out[row, 15 + k] = pulled[k]

    return {"all": all_sums}


def sums(loops: ModuleType) -> tuple[Row, Row]:
    """Of a cloud with neighbours in and beyond reach, two of them in one place; rows of 0 to 40 neighbours."""
    random = np.random.default_rng(3)
    place = np.column_stack([random.uniform(0, 0.25, (POINTS, 3)), random.uniform(-1, 1, POINTS)])
    place[7, :3] = place[0, :3]
    listed = np.array([random.permutation(POINTS)[:SLOTS] for _ in range(ROWS)])
    listed[0, 0] = 7
    given = {
        "place": wp.array(np.vstack([place, [[9e9] * 4]]), dtype=wp.vec4, device="cpu")[:POINTS],
        "velocity": wp.array(random.normal(0, 10, (POINTS + 1, 3)), dtype=wp.vec3, device="cpu")[:POINTS],
        "volume": wp.array(random.uniform(0.5, 1, POINTS), dtype=float, device="cpu"),
        "thickness": wp.array(random.uniform(0, 3, POINTS), dtype=float, device="cpu"),
        "listed": wp.array(listed, dtype=int, device="cpu"),
        "count": wp.array(np.arange(ROWS) + 1, dtype=int, device="cpu"),
    }
    coupling = wp.zeros((ROWS, SLOTS), dtype=float, device="cpu")
    out = wp.zeros((ROWS, 18), dtype=float, device="cpu")
    wp.launch(kernels_of(loops)["all"], ROWS, inputs=[*given.values(), SUPPORT, coupling, out], device="cpu")
    return out.numpy(), coupling.numpy()


def test_sixteen_at_a_time_are_the_same_sums():
    """To float32's rounding of sums in another order: terms are of both signs, so that 1e-5 is of the largest row."""
    plain, native = sums(kernels_pairs), sums(kernels_pairs_native)
    for ours, theirs in zip(native, plain, strict=True):
        scale = np.abs(theirs).max(axis=0, keepdims=True) + 1e-30
        assert (np.abs(ours - theirs) / scale).max() < 1e-5
    # Nothing of what stands behind a row's count is in its sums.
    assert (native[1] != 0).sum(axis=1)[0] <= 1


def test_both_loops_find_the_same_neighbours_in_the_same_order():
    points = np.random.default_rng(0).uniform([0, -1.5, -8], [6, 1.5, -1], (500, 3))
    lists = []
    for native in (False, True):
        engine = engine_with(points, slot(), native=native)
        engine.find_neighbours()
        near = engine.lists
        lists.append([listed_in(near.fluid, near.fluid_count), listed_in(near.wall, near.wall_count)])
    assert lists[0] == lists[1]
    assert max(map(len, lists[0][1])) > 16


def listed_in(listed: wp.array, count: wp.array) -> list[list[int]]:
    return [sorted(row[:many].tolist()) for row, many in zip(listed.numpy(), count.numpy(), strict=True)]


@pytest.mark.parametrize("solver", [{"viscosity_solve": "implicit"}, {"viscosity_solve": "explicit"}])
def test_twenty_steps_of_both_lie_together(solver):
    """Chaos doubles the last bits' difference in some steps: a hundredth of a radius in twenty."""
    points = lattice(np.array([0.2, -1.3, -12]), np.array([5.8, 1.3, -2]), 0.69)
    ends = []
    for native in (False, True):
        engine = engine_with(points, slot(), native=native, weights=(30.0, 0.3), **solver)
        for _ in range(20):
            engine.step()
        ends.append(positions_mm(engine))
    assert np.abs(ends[0] - points).max() > 0.2
    assert np.abs(ends[0] - ends[1]).max() < 0.004
