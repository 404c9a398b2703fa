"""Device code for tests: what a row of a launch sees, and every inner loop of a module side by side."""

from functools import cache
from types import ModuleType
from typing import Any

import warp as wp

from simulate.kernels.neighbours import Neighbours
from simulate.kernels.status import Particles, Span
from simulate.kernels.viscosity import Paste, apparent_weight


@wp.kernel(enable_backward=False)
def count_row(rows: Span, seen: wp.array[int]):
    for row in range(rows.begin + wp.tid(), rows.end, rows.step):
        seen[row] = seen[row] + 1


@wp.kernel(enable_backward=False)
def count_down(rows: Span, left: wp.array[int]):
    left[0] -= 1


@wp.kernel(enable_backward=False)
def weigh(paste: Paste, shear: wp.array[float], weight: wp.array2d[float]):
    run, i = wp.tid()
    fresh = paste.by_age[run, 0]
    weight[run, i] = apparent_weight(paste, run, fresh[0], fresh[1], shear[i])


@wp.func
def store(values: Any, count: int, first: int, row: int, out: wp.array2d[float]):
    for k in range(count):
        out[row, first + k] = values[k]


@cache
def sum_kernel(loops: ModuleType) -> Any:
    """Stores what each sum of ``loops`` is for the first points of a cloud, (row, 48), and the links of pairs."""
    module = wp.get_module(f"tests.pairs.{loops.__name__}")
    sum_density, sum_walls, sum_correction = loops.sum_density, loops.sum_walls, loops.sum_correction
    sum_gradient, link_pairs, sum_drag = loops.sum_gradient, loops.link_pairs, loops.sum_drag
    sum_pulled, sum_eq5 = loops.sum_pulled, loops.sum_eq5

    @wp.kernel(enable_backward=False, module=module)
    def all_sums(
        particles: Particles,
        near: Neighbours,
        support: float,
        links: wp.array2d[wp.vec3h],
        out: wp.array2d[float],
    ):
        row = wp.tid()
        store(sum_density(particles, near, row, support), 5, 0, row, out)
        store(sum_walls(particles, near, row, support), 4, 5, row, out)
        store(sum_correction(particles, near, row, support, -0.3), 3, 9, row, out)
        coupled = link_pairs(particles, near, row, support, links)
        store(coupled, 2, 12, row, out)
        store(sum_pulled(particles, near, row, links), 3, 14, row, out)
        store(sum_drag(particles, near, row, support), 6, 17, row, out)
        store(sum_gradient(particles, near, row, support), 15, 23, row, out)
        store(sum_eq5(particles, particles.velocity, near, row, support), 4, 38, row, out)
        for k in range(6):
            out[row, 42 + k] = coupled[7 + k]

    return all_sums
