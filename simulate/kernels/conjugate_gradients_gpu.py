"""The kernels of ``conjugate_gradients`` for a GPU: a block of threads adds up each part of a run, or all its parts.

Same names and meaning, but without two launches by run: each block adds up the parts of its run instead. A block's
threads take every so many rows each, and their sums are added up as a tile, in an order that depends on the block's
width alone: the bits are the same each time, and in any company. With one thread to a block, as on a CPU, they are
those of ``conjugate_gradients``.
"""

import warp as wp

from simulate.kernels.conjugate_gradients import (
    CHUNKS,
    Search,
    Sums,
    System,
    advance_row,
    begin_run,
    begins_at_guess,
    is_solved,
    rows_of,
    set_turn,
    set_way,
    shift_of,
    shift_row,
    squares_of,
    start_row,
    way_of,
)
from simulate.kernels.status import Movers, Particles

LANES = 64  # Threads of a block: a part has up to 230 rows in one run of the paper, and 12 in each of its 132

wp.set_module_options({"enable_backward": False, "block_dim": LANES})


@wp.func
def keep_sum(search: Search, part: int, lane: int, own: Sums):
    """Add up what the threads of a part's block have; all of them come here."""
    total = wp.tile_sum(wp.tile(own, preserve_type=True))[0]
    if lane == 0:
        search.partial[part // CHUNKS, part % CHUNKS] = total


@wp.func
def whole_sum(search: Search, run: int, lane: int):
    """The sum over all parts, for all threads of a run's block; all of them come here."""
    own = Sums(0.0)
    for chunk in range(lane, CHUNKS, wp.block_dim()):
        own += search.partial[run, chunk]
    return wp.tile_sum(wp.tile(own, preserve_type=True))[0]


@wp.kernel
def sum_residuals(
    movers: Movers,
    particles: Particles,
    system: System,
    search: Search,  # out: partial, and zero in ``more``
):
    part, lane = wp.tid()
    if part + lane == 0:
        search.more[0] = 0
    rows = rows_of(movers, part)
    own = Sums(0.0)
    for row in range(rows[0] + lane, rows[1], wp.block_dim()):
        own += squares_of(particles, movers, system, search, row)
    keep_sum(search, part, lane, own)


@wp.kernel
def start_search(
    of_the_right: float,
    of_the_change: float,
    at_most: int,
    movers: Movers,
    particles: Particles,
    system: System,
    search: Search,  # out: all scalars too, which no block reads
):
    part, lane = wp.tid()
    rows = rows_of(movers, part)
    squares = whole_sum(search, part // CHUNKS, lane)
    if part % CHUNKS + lane == 0:
        begin_run(search, part // CHUNKS, squares, of_the_right, of_the_change, at_most)
    warm = begins_at_guess(squares)
    for row in range(rows[0] + lane, rows[1], wp.block_dim()):
        start_row(movers, particles, system, search, row, warm)


@wp.kernel
def sum_curvature(
    movers: Movers,
    search: Search,  # out: partial, and zero in ``more``
):
    part, lane = wp.tid()
    if part + lane == 0:
        search.more[0] = 0
    if is_solved(search, part // CHUNKS):
        return
    rows = rows_of(movers, part)
    own = float(0.0)
    for row in range(rows[0] + lane, rows[1], wp.block_dim()):
        own += search.curvature[row]
    keep_sum(search, part, lane, Sums(own, 0.0, 0.0, 0.0, 0.0))


@wp.kernel
def advance_search(
    movers: Movers,
    particles: Particles,
    system: System,
    search: Search,  # out: left, and the vectors; all blocks read the sums and the scalars
):
    part, lane = wp.tid()
    run = part // CHUNKS
    if is_solved(search, run):
        return
    rows = rows_of(movers, part)
    way = way_of(search, run, whole_sum(search, run, lane)[0])
    own = float(0.0)
    for row in range(rows[0] + lane, rows[1], wp.block_dim()):
        own += advance_row(movers, particles, system, search, row, way[0], way[1])
    total = wp.tile_sum(wp.tile(own))[0]
    if lane == 0:
        search.left[run, part % CHUNKS] = total


@wp.kernel
def find_turn(
    at_most: int,
    search: Search,  # in, out
):
    run, lane = wp.tid()
    if is_solved(search, run):
        return
    along = whole_sum(search, run, lane)[0]
    own = float(0.0)
    for chunk in range(lane, CHUNKS, wp.block_dim()):
        own += search.left[run, chunk]
    # The sum waits for all threads: none of them asks above for what one of them writes below.
    error = wp.tile_sum(wp.tile(own))[0]
    if lane == 0:
        set_way(search, run, along)
        set_turn(search, run, error, at_most)


@wp.kernel
def sum_left(
    movers: Movers,
    search: Search,  # out: partial
):
    part, lane = wp.tid()
    rows = rows_of(movers, part)
    own = wp.vec3(0.0)
    for row in range(rows[0] + lane, rows[1], wp.block_dim()):
        own += search.residual[row]
    keep_sum(search, part, lane, Sums(own[0], own[1], own[2], 0.0, 0.0))


@wp.kernel
def shift_all(movers: Movers, particles: Particles, search: Search):
    part, lane = wp.tid()
    run = part // CHUNKS
    rows = rows_of(movers, part)
    by = shift_of(search, run, whole_sum(search, run, lane))
    if not wp.isfinite(by):
        return
    for row in range(rows[0] + lane, rows[1], wp.block_dim()):
        shift_row(movers, particles, row, by)
