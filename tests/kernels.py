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
def weigh(paste: Paste, shear: wp.array[float], weight: wp.array2d[float]):
    run, i = wp.tid()
    fresh = paste.by_age[run, 0]
    weight[run, i] = apparent_weight(paste, run, fresh[0], fresh[1], shear[i])


@cache
def sum_kernel(loops: ModuleType, kernel: str) -> Any:
    """Stores what each sum of ``loops`` is for the first points of a cloud, (row, 48), and the links of pairs."""
    module = wp.get_module(f"tests.pairs.{loops.__name__}.{kernel}")
    sum_density, sum_walls, sum_correction = loops.sum_density, loops.sum_walls, loops.sum_correction
    sum_gradient, link_pairs, sum_drag = loops.sum_gradient, loops.link_pairs_by(kernel), loops.sum_drag
    sum_pulled, sum_eq5 = loops.sum_pulled, loops.sum_eq5_by(kernel)

    @wp.kernel(enable_backward=False, module=module)
    def all_sums(
        particles: Particles,
        near: Neighbours,
        support: float,
        links: wp.array2d[wp.vec3h],
        out: wp.array2d[float],
    ):
        row = wp.tid()
        density = sum_density(particles, near, row, support)
        walls = sum_walls(particles, near, row, support)
        correction = sum_correction(particles, near, row, support, -0.3)
        for k in range(5):
            out[row, k] = density[k]
        for k in range(4):
            out[row, 5 + k] = walls[k]
        for k in range(3):
            out[row, 9 + k] = correction[k]
        coupled = link_pairs(particles, near, row, support, links)
        pulled = sum_pulled(particles, near, row, links)
        for k in range(2):
            out[row, 12 + k] = coupled[k]
        for k in range(3):
            out[row, 14 + k] = pulled[k]
        drag = sum_drag(particles, near, row, support)
        for k in range(6):
            out[row, 17 + k] = drag[k]
        gradient = sum_gradient(particles, near, row, support)
        for k in range(15):
            out[row, 23 + k] = gradient[k]
        printed = sum_eq5(particles, particles.velocity, near, row, support)
        for k in range(4):
            out[row, 38 + k] = printed[k]
        for k in range(6):
            out[row, 42 + k] = coupled[7 + k]

    return all_sums
