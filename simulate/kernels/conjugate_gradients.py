"""Device code of the conjugate gradients that solve the viscosity's linear system, for all runs together.

Runs are independent: the results of a run are bit-identical with any number of threads and of other runs. On a GPU, a
block of threads sums one part of a run, or all its parts. Each thread processes every 64th row (``LANES``). A tile adds
up the threads' sums, in an order that depends only on the block's width. On a CPU, a block has one thread, which
processes all rows.
"""

from functools import partial
from typing import Any

import warp as wp

from simulate.kernels.lanes import over_block
from simulate.kernels.run_module import run_kernel
from simulate.kernels.status import Particles, Span

wp.set_module_options({"enable_backward": False})

CHUNKS = wp.constant(64)
"""Number of parts of a run that are summed separately, the same on all devices and with any number of threads."""

ROUNDS = wp.constant(1.0e-5)
"""If the difference of two float32 sums is below this fraction of the curvature, it may be only rounding error."""

UNIT_ROUNDOFF = wp.constant(6.0e-8)  # Unit roundoff of float32
ROUNDINGS = wp.constant(16.0)
"""Smallest goal of a solve, as a multiple of the residual that is left if each velocity is rounded to float32 once. It
is 16 because each row is a sum over about 40 pairs."""

LANES = 64  # Threads of a GPU's block. With the paper's run, a part has up to 230 rows, and with 132 such runs 12.

Sums = wp.types.vector(length=5, dtype=wp.float32)

Symmetric = wp.types.vector(length=6, dtype=wp.float32)
"""Symmetric matrix as its elements xx, yy, zz, xy, yz, zx."""


@wp.struct
class System:
    """Linear system (I + A) v_new = v of backward Euler for Eq. 5. Arrays have one entry per row unless stated."""

    links: wp.array2d[wp.vec3h]
    """Links of the pairs (``pair_sums.link_pairs_by``), in the same slots as in the fluid's neighbour lists."""
    drag: wp.array[float]  # Drag by the walls
    restraint: wp.array[float]  # Drag by the walls and by neighbours at rest
    inverse: wp.array[Symmetric]  # Inverse of the particle's diagonal block of I + A
    at_walls: wp.array[float]  # Weight of pairs with a wall to which the fluid sticks, by particle
    shear: wp.array[float]  # Shear rate in 1/s after the last substep, by particle


@wp.struct
class Search:
    """State of the conjugate gradients in the form of Chronopoulos and Gear.

    Vectors have one entry per row, and scalars have one entry per run.

    The scaled residual is the residual times the inverse of each particle's diagonal block (Jacobi's preconditioner).
    It has one entry per particle, because the matrix is applied to it.
    """

    residual: wp.array[wp.vec3]
    product: wp.array[wp.vec3]  # The matrix times the scaled residual
    curvature: wp.array[float]  # Dot product of the scaled residual and ``product``
    direction: wp.array[wp.vec3]
    pull: wp.array[wp.vec3]  # The matrix times the direction
    partial: wp.array2d[Sums]  # Sums of each part of a run
    left: wp.array2d[float]  # Square of each part's new residual
    error: wp.array[float]
    length: wp.array[float]  # Length of the step along the direction
    turn: wp.array[float]  # Multiple of the last direction that is added to the next direction
    goal: wp.array[float]
    holds: wp.array[float]  # Number of particles, plus the drag by walls and by particles at rest
    iterations: wp.array[int]
    more: wp.array[int]  # A single number, 1 if a run needs another iteration
    unsolved: wp.array[int]  # 1 for each run in which a search ended above its goal


def new_system(rows: int, at_walls: Any, shear: Any, device: str) -> Any:
    """Return a system without links. ``at_walls`` and ``shear`` are arrays with one entry per particle."""
    system, zeros = System(), partial(wp.zeros, device=device)
    system.drag = zeros(rows)
    system.restraint = zeros(rows)
    system.inverse = zeros(rows, Symmetric)
    system.at_walls = at_walls
    system.shear = shear
    return system


def new_search(rows: int, runs: int, device: str) -> Any:
    """Return a search with space for ``rows`` rows of all runs together."""
    search, zeros = Search(), partial(wp.zeros, device=device)
    search.residual = zeros(rows, wp.vec3)
    search.product = zeros(rows, wp.vec3)
    search.curvature = zeros(rows)
    search.direction = zeros(rows, wp.vec3)
    search.pull = zeros(rows, wp.vec3)
    search.partial = zeros((runs, int(CHUNKS)), Sums)
    search.left = zeros((runs, int(CHUNKS)))
    search.error = zeros(runs)
    search.length = zeros(runs)
    search.turn = zeros(runs)
    search.goal = zeros(runs)
    search.holds = zeros(runs)
    search.iterations = zeros(runs, int)
    search.more = zeros(1, int)
    search.unsolved = zeros(runs, int)
    return search


@wp.func
def full(symmetric: Symmetric):
    """Return a symmetric matrix as a full 3 x 3 matrix."""
    xx, yy, zz = symmetric[0], symmetric[1], symmetric[2]
    xy, yz, zx = symmetric[3], symmetric[4], symmetric[5]
    return wp.mat33(xx, xy, zx, xy, yy, yz, zx, yz, zz)


@wp.func
def rows_of(particles: Particles, part: int):
    """Return the first row of a part of a run, and the row after its last row."""
    run = part // CHUNKS
    first = particles.first_row[run]
    rows = particles.first_row[run + 1] - first
    width = (rows + CHUNKS - 1) // CHUNKS
    begin = wp.min(part % CHUNKS * width, rows)
    return wp.vec2i(first + begin, first + wp.min(begin + width, rows))


@wp.func
def keep_sum(search: Search, part: int, lane: int, lane_sums: Sums):
    """Add up the sums of a block's threads and store the total for the part. All threads must call this."""
    total = over_block(lane_sums)
    if lane == 0:
        search.partial[part // CHUNKS, part % CHUNKS] = total


@wp.func
def whole_sum(search: Search, run: int, lane: int):
    """Return to every thread of a block the sum over the parts of a run. All threads must call this."""
    lane_sums = Sums(0.0)
    for chunk in range(lane, CHUNKS, wp.block_dim()):
        lane_sums += search.partial[run, chunk]
    return over_block(lane_sums)


@wp.func
def begins_run(part: int, begin: int):
    """Return True if a part is the first part of its run, or the first part that a thread processes."""
    return part == begin or part % CHUNKS == 0


@run_kernel
def sum_residuals(
    parts: Span,
    particles: Particles,
    system: System,
    search: Search,  # out: partial, and zero in ``more``
):
    """Sum the squares of the right side and of the two residuals, in the preconditioner's norm, and further sums."""
    lane = wp.tid() % wp.block_dim()
    for part in range(parts.begin + wp.tid() // wp.block_dim(), parts.end, parts.step):
        if part + lane == 0:
            search.more[0] = 0
        rows = rows_of(particles, part)
        lane_sums = Sums(0.0)
        for row in range(rows[0] + lane, rows[1], wp.block_dim()):
            inverse = full(system.inverse[row])
            right = particles.velocity[particles.mover[row]]
            lane_sums[0] += wp.dot(right, inverse * right)
            lane_sums[1] += wp.dot(search.residual[row], inverse * search.residual[row])
            lane_sums[2] += wp.dot(search.product[row], inverse * search.product[row])
            lane_sums[3] += 1.0 + system.restraint[row]
            lane_sums[4] += wp.dot(right, right)
        keep_sum(search, part, lane, lane_sums)


@wp.func
def begin_run(search: Search, run: int, squares: Sums, of_the_right: float, of_the_change: float, at_most: int):
    """Choose the start and the goal of a run's search.

    The goal is at most the fraction ``of_the_right`` of the right side. It is also at most the fraction
    ``of_the_change`` of the residual without viscosity, unless that is below rounding.
    """
    # Stiff sealant that moves as a whole has only a residual from rounding. It is estimated as the rounding of the
    # velocities times the size of the matrix, which is the ratio of their squares in the two norms.
    rounded = ROUNDINGS * UNIT_ROUNDOFF * squares[4]
    change = wp.max(of_the_change * of_the_change * squares[1], rounded * rounded / wp.max(squares[0], 1.0e-30))
    search.goal[run] = wp.min(of_the_right * of_the_right * squares[0], change)
    search.error[run] = wp.where(squares[2] < squares[1], squares[2], squares[1])
    search.holds[run] = squares[3]
    search.turn[run] = 0.0
    search.length[run] = 0.0
    search.iterations[run] = 0
    ask_for_more(search, run, at_most)


@wp.func
def ask_for_more(search: Search, run: int, at_most: int):
    """Request another iteration if a run's residual is above its goal.

    The run counts as unsolved after ``at_most`` iterations, or if the residual is not finite. A link outside the range
    of float16 can cause that.
    """
    if search.error[run] <= search.goal[run]:
        return
    if search.iterations[run] < at_most and wp.isfinite(search.error[run]):
        search.iterations[run] += 1
        search.more[0] = 1
    else:
        search.unsolved[run] = 1


@run_kernel
def start_search(
    parts: Span,
    of_the_right: float,
    of_the_change: float,
    at_most: int,
    particles: Particles,
    system: System,
    search: Search,  # out: also all scalars, which blocks do not read here
):
    """Start each run's search from the guess or the velocity without viscosity, whichever has the smaller residual.

    The guess is in the array of the scaled residual.
    """
    lane = wp.tid() % wp.block_dim()
    begin = parts.begin + wp.tid() // wp.block_dim()
    squares = Sums(0.0)
    for part in range(begin, parts.end, parts.step):
        rows = rows_of(particles, part)
        if begins_run(part, begin):
            squares = whole_sum(search, part // CHUNKS, lane)
        if part % CHUNKS + lane == 0:
            begin_run(search, part // CHUNKS, squares, of_the_right, of_the_change, at_most)
        for row in range(rows[0] + lane, rows[1], wp.block_dim()):
            i = particles.mover[row]
            r = search.residual[row]
            # This is False if the residual of the guess is not finite.
            if squares[2] < squares[1]:
                r = search.product[row]
                particles.velocity[i] = particles.scaled_residual[i]
            search.residual[row] = r
            search.direction[row] = wp.vec3(0.0)
            search.pull[row] = wp.vec3(0.0)
            particles.scaled_residual[i] = full(system.inverse[row]) * r


@wp.func
def is_solved(search: Search, run: int):
    return search.error[run] <= search.goal[run]


@run_kernel
def sum_curvature(
    parts: Span,
    particles: Particles,
    search: Search,  # out: partial, and zero in ``more``
):
    lane = wp.tid() % wp.block_dim()
    for part in range(parts.begin + wp.tid() // wp.block_dim(), parts.end, parts.step):
        if part + lane == 0:
            search.more[0] = 0
        if is_solved(search, part // CHUNKS):
            continue
        rows = rows_of(particles, part)
        lane_sums = Sums()
        for row in range(rows[0] + lane, rows[1], wp.block_dim()):
            lane_sums[0] += search.curvature[row]
        keep_sum(search, part, lane, lane_sums)


@wp.func
def way_of(search: Search, run: int, along: float):
    """Return the length of the step along the next direction, and the multiple of the last direction in it."""
    curvature = along
    turn = search.turn[run]
    if turn > 0.0:
        curvature -= turn * search.error[run] / search.length[run]
        # If the difference is only rounding error, the search is restarted.
        if curvature < ROUNDS * along:
            turn = 0.0
            curvature = along
    return wp.vec2(search.error[run] / wp.max(curvature, 1.0e-30), turn)


@run_kernel
def advance_search(
    parts: Span,
    particles: Particles,
    system: System,
    search: Search,  # out: left and the vectors; all blocks read the sums and the scalars
):
    """Update the directions, take the step along them, and sum r . M^-1 r of the new residual r.

    M is the preconditioner.
    """
    lane = wp.tid() % wp.block_dim()
    begin = parts.begin + wp.tid() // wp.block_dim()
    way = wp.vec2(0.0)
    for part in range(begin, parts.end, parts.step):
        run = part // CHUNKS
        if is_solved(search, run):
            continue
        rows = rows_of(particles, part)
        if begins_run(part, begin):
            way = way_of(search, run, whole_sum(search, run, lane)[0])
        lane_sum = float(0.0)
        for row in range(rows[0] + lane, rows[1], wp.block_dim()):
            i = particles.mover[row]
            direction = particles.scaled_residual[i] + way[1] * search.direction[row]
            pull = search.product[row] + way[1] * search.pull[row]
            search.direction[row] = direction
            search.pull[row] = pull
            particles.velocity[i] = particles.velocity[i] + way[0] * direction
            r = search.residual[row] - way[0] * pull
            search.residual[row] = r
            scaled = full(system.inverse[row]) * r
            particles.scaled_residual[i] = scaled
            lane_sum += wp.dot(r, scaled)
        total = over_block(lane_sum)
        if lane == 0:
            search.left[run, part % CHUNKS] = total


@run_kernel
def find_turn(
    runs: Span,
    at_most: int,
    search: Search,  # in, out
):
    """Store the length of the step and the multiple of its direction in the next. Request another step if needed."""
    lane = wp.tid() % wp.block_dim()
    for run in range(runs.begin + wp.tid() // wp.block_dim(), runs.end, runs.step):
        if is_solved(search, run):
            continue
        along = whole_sum(search, run, lane)[0]
        lane_sum = float(0.0)
        for chunk in range(lane, CHUNKS, wp.block_dim()):
            lane_sum += search.left[run, chunk]
        # The sum waits for all threads, so all threads have read the values that one thread changes below.
        error = over_block(lane_sum)
        if lane == 0:
            way = way_of(search, run, along)
            search.length[run] = way[0]
            search.turn[run] = error / wp.max(search.error[run], 1.0e-30)
            search.error[run] = error
            ask_for_more(search, run, at_most)


@run_kernel
def sum_left(
    parts: Span,
    particles: Particles,
    search: Search,  # out: partial
):
    """Sum the residual vectors of each part of a run."""
    lane = wp.tid() % wp.block_dim()
    for part in range(parts.begin + wp.tid() // wp.block_dim(), parts.end, parts.step):
        rows = rows_of(particles, part)
        lane_sums = Sums()
        for row in range(rows[0] + lane, rows[1], wp.block_dim()):
            lane_sums[:3] += search.residual[row]
        keep_sum(search, part, lane, lane_sums)


@run_kernel
def shift_all(parts: Span, particles: Particles, search: Search):
    """Add the same velocity to all particles of a run, so that its summed residual becomes zero.

    Momentum between pairs is then conserved for any residual that the search leaves.
    """
    lane = wp.tid() % wp.block_dim()
    begin = parts.begin + wp.tid() // wp.block_dim()
    by = wp.vec3(0.0)
    for part in range(begin, parts.end, parts.step):
        run = part // CHUNKS
        rows = rows_of(particles, part)
        if begins_run(part, begin):
            left = whole_sum(search, run, lane)
            by = left[:3] / wp.max(search.holds[run], 1.0)
        # If the shift is not finite, it is not applied. The fault check then reports only the particle that caused it.
        if not wp.isfinite(by):
            continue
        for row in range(rows[0] + lane, rows[1], wp.block_dim()):
            i = particles.mover[row]
            particles.velocity[i] = particles.velocity[i] + by
