"""Device code of the viscosity: Eq. 5 of the paper, its implicit form and a yield stress in it. Units are cm and s.

A particle's viscosity is given as the weight of its pairs in a substep. The weight is U of Eq. 5 divided by h sqrt(pi),
or the weight that is equivalent to a viscosity and a yield stress. In the implicit form, the force of a pair acts along
the line between the two particles, with the mean of both volumes. This conserves momentum and angular momentum. The
explicit passes are Eq. 5 as in the paper.
"""

from types import ModuleType
from typing import Any

import warp as wp

from simulate.kernels.conjugate_gradients import Search, Symmetric, System, full, is_solved
from simulate.kernels.lanes import lane, lanes
from simulate.kernels.neighbours import Neighbours
from simulate.kernels.pair_sums import DragSums, GradientSums
from simulate.kernels.run_module import kernel_in
from simulate.kernels.status import Particles, Span, end_of
from simulate.shear_law import Law

wp.set_module_options({"enable_backward": False})

HERSCHEL_BULKLEY = wp.constant(int(Law.HERSCHEL_BULKLEY))
WALL_MOMENT = wp.constant(0.057)
"""Weight of a wall in the fit of the shear rate, divided by h and by the sum of ``no_slip_weight``. It replaces the
neighbours that are missing behind the wall."""
MIN_MOMENT = wp.constant(6.0e-5)
"""Moment of the neighbours, divided by h^5, that is added to the fit, so that the gradient is 0 along a direction with
too few neighbours. It is a thousandth of the moment in a liquid."""


@wp.struct
class Paste:
    """Constants of the fluid of each run, by the number of the run, and constants of all runs."""

    by_age: wp.array2d[wp.vec2]
    """Two values by run and age in frames: the pair weight without a yield stress at a shear rate of 1/s, and the yield
    stress divided by the density, in cm2/s2. The values of the last age apply to all later ages."""
    law: wp.array[int]  # ``Law`` of flow
    flow_index: wp.array[float]  # n of the Herschel-Bulkley law
    drag: wp.array[float]  # D of Eq. 5 in a substep, divided by h sqrt(pi)
    sticks: wp.array[float]  # 1 for a fluid that sticks to walls by its viscosity, 0 for a fluid with a given D
    wall_share: wp.array[float]  # Stress at a wall, divided by the stress inside the fluid
    yields: wp.array[int]  # 1 for a fluid that has a yield stress at some age
    per_viscosity: float  # Weight of pairs for each cm2/s of viscosity
    slowest_shear: float  # Shear rate in 1/s below which the viscosity is constant
    frames_to_freeze: wp.array[int]  # Age in frames at which a particle is frozen


@wp.func
def apparent_weight(paste: Paste, run: int, weight: float, yield_stress: float, shear: float):
    """Return the viscosity at a shear rate as a pair weight, as ``shear_law.apparent_viscosity`` does on the host.

    ``weight`` is the viscosity at a shear rate of 1/s without the yield stress. ``yield_stress`` is divided by the
    density.
    """
    # The shear rate has a smooth lower limit.
    gamma = wp.sqrt(shear * shear + paste.slowest_shear * paste.slowest_shear)
    viscous = weight
    if paste.law[run] == HERSCHEL_BULKLEY:
        viscous = weight * wp.pow(gamma, paste.flow_index[run] - 1.0)
    return viscous + paste.per_viscosity * yield_stress / gamma


@wp.func
def shear_of(sums: GradientSums, walls: DragSums, moves: wp.vec3, volume: float, support: float):
    """Return the shear rate, sqrt(2 D:D), from a linear fit to the velocities around a particle.

    D is the symmetric part of the velocity gradient. The velocity at walls is 0.
    """
    fit = full(sums[:6])
    changes = wp.mat33(*sums[6:15])
    normal = wp.normalize(walls[3:6])
    # A wall has the weight of the particles that are missing behind it.
    moment = WALL_MOMENT * support / volume
    fit += moment * walls[2] * wp.outer(normal, normal)
    changes += moment * walls[1] * wp.outer(moves, normal)
    # If there are too few neighbours, the gradient is 0.
    least = MIN_MOMENT * support * support * support * support * support / volume
    for axis in range(3):
        fit[axis, axis] += least
    gradient = changes * wp.inverse(fit)
    rate = gradient + wp.transpose(gradient)
    return wp.sqrt(0.5 * wp.ddot(rate, rate))


def viscosity_kernels(loops: ModuleType, module: Any, seldom: Any, skips_solved: bool) -> tuple[Any, ...]:
    """Return the viscosity kernels that sum over pairs, in the order of ``PairKernels``, with the loops of ``loops``.

    ``seldom`` is the Warp module for the explicit passes and for the paper's weight W. If ``skips_solved`` is True, the
    products of solved runs are left out, which saves time if several runs use the threads of a GPU. The kernels are
    defined in a function, because Warp binds the functions that a kernel calls when the kernel is defined.
    """
    sum_gradient, sum_drag, sum_pulled = loops.sum_gradient, loops.sum_drag, loops.sum_pulled

    @kernel_in(module)
    def measure_shear(
        rows: Span,
        particles: Particles,  # out: viscosity
        neighbours: Neighbours,
        support: float,
        paste: Paste,
        fresh_shear: float,
        system: System,  # out: shear, at_walls
    ):
        """Measure the shear rate gamma from the last substep's velocities, and the viscosity at this shear rate.

        gamma^2 is the dissipation by a viscosity of 1, in pairs and at walls.
        """
        for row in range(rows.begin + wp.tid() // lanes(), end_of(rows, particles), rows.step):
            i = particles.mover[row]
            run = i // particles.per_run
            gamma = fresh_shear
            at_wall = fresh_shear
            age = particles.frame[0] - particles.release_frame[i]
            if age > 0:
                velocity = particles.velocity[i]
                walls = sum_drag(particles, neighbours, row, support)
                sums = sum_gradient(particles, neighbours, row, support)
                gamma = shear_of(sums, walls, velocity, particles.volume_and_viscosity[i][0], support)
                at_wall = wp.length(velocity) * walls[1] / wp.max(walls[2], 1.0e-20)
            if lane() > 0:
                continue
            system.shear[i] = gamma
            aged = paste.by_age[run, wp.min(age, paste.by_age.shape[1] - 1)]
            bulk = apparent_weight(paste, run, aged[0], aged[1], gamma)
            particles.volume_and_viscosity[i][1] = bulk
            wall = apparent_weight(paste, run, paste.sticks[run] * aged[0], aged[1], at_wall)
            system.at_walls[i] = paste.wall_share[run] * wall

    @kernel_in(module)
    def apply_matrix(
        rows: Span,
        particles: Particles,
        neighbours: Neighbours,
        system: System,
        search: Search,  # out: product and curvature
    ):
        """Multiply the scaled residual by I + A, the matrix of backward Euler on Eq. 5."""
        for row in range(rows.begin + wp.tid() // lanes(), end_of(rows, particles), rows.step):
            i = particles.mover[row]
            if wp.static(skips_solved) and is_solved(search, i // particles.per_run):
                continue
            pulled = sum_pulled(particles, neighbours, row, system.links)
            if lane() > 0:
                continue
            scaled_residual = particles.scaled_residual[i]
            product = (1.0 + system.drag[row]) * scaled_residual + pulled
            search.product[row] = product
            search.curvature[row] = wp.dot(scaled_residual, product)

    return (
        measure_shear,
        _weigh_pairs(loops, module),
        apply_matrix,
        _pass_velocity(loops, seldom),
    )


def _weigh_pairs(loops: ModuleType, module: Any) -> Any:
    """Return the kernel ``weigh_pairs``."""
    link_pairs, sum_drag = loops.link_pairs, loops.sum_drag

    @kernel_in(module)
    def weigh_pairs(
        rows: Span,
        particles: Particles,
        neighbours: Neighbours,
        support: float,
        paste: Paste,
        system: System,  # out: links, drag, restraint and inverse
        search: Search,  # out: residual of the velocity without viscosity, and in ``product`` residual of the guess
    ):
        """Compute the links of pairs, the walls' drag, the particles' diagonal blocks of the matrix, and two residuals.

        The residuals are those of the velocity without viscosity and of the guess.
        """
        for row in range(rows.begin + wp.tid() // lanes(), end_of(rows, particles), rows.step):
            i = particles.mover[row]
            velocity = particles.velocity[i]
            guess = particles.scaled_residual[i]
            sums = link_pairs(particles, neighbours, row, support, system.links)
            walls = sum_drag(particles, neighbours, row, support)
            if lane() > 0:
                continue
            drag = paste.drag[i // particles.per_run] * walls[0] + system.at_walls[i] * walls[1]
            system.drag[row] = drag
            # A pair acts along only one of three directions.
            system.restraint[row] = drag + sums[6] / 3.0
            block = full(sums[:6])
            for axis in range(3):
                block[axis, axis] += 1.0 + drag
            inverse = wp.inverse(block)
            system.inverse[row] = Symmetric(
                inverse[0, 0], inverse[1, 1], inverse[2, 2], inverse[0, 1], inverse[1, 2], inverse[2, 0]
            )
            search.residual[row] = -(sums[7:10] + drag * velocity)
            search.product[row] = velocity - guess - (sums[10:13] + drag * guess)

    return weigh_pairs


def _pass_velocity(loops: ModuleType, module: Any) -> Any:
    """Return the kernel ``pass_velocity``."""
    sum_eq5, sum_drag = loops.sum_eq5, loops.sum_drag

    @kernel_in(module)
    def pass_velocity(
        rows: Span,
        particles: Particles,
        neighbours: Neighbours,
        support: float,
        paste: Paste,
        system: System,  # out: drag, and in ``restraint`` the largest fraction of a velocity that a single pass removes
        passes: float,
        before: wp.array[wp.vec3],
        after: wp.array[wp.vec3],  # out
    ):
        """Make one of the q passes of Eq. 5 as in the paper, with U sum_j m/rho_j W and D sum_k W.

        j are the neighbours, k the wall particles, and q is ``passes``.
        """
        for row in range(rows.begin + wp.tid() // lanes(), end_of(rows, particles), rows.step):
            i = particles.mover[row]
            velocity = before[i]
            pulled = sum_eq5(particles, before, neighbours, row, support)
            walls = sum_drag(particles, neighbours, row, support)
            if lane() > 0:
                continue
            drag = paste.drag[i // particles.per_run] * walls[0] + system.at_walls[i] * walls[1]
            system.drag[row] = drag
            system.restraint[row] = drag + pulled[3]
            after[i] = velocity - (drag * velocity + pulled[:3]) / passes

    return pass_velocity
