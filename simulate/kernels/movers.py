"""Device code of who moves: release, freezing by age, and the list of movers, in memory's order and in that of the cells.

A CPU takes one point after the other and lists in one pass; a GPU marks the movers, sums the marks up, and lists each
where its sum says.
"""

import warp as wp

from simulate.kernels.run_module import run_kernel
from simulate.kernels.status import ASLEEP, FROZEN, MOVING, WAITING, Movers, Particles, Span, bring_to_rest
from simulate.kernels.viscosity import Paste

wp.set_module_options({"enable_backward": False})


@wp.struct
class Order:
    """All particles in the order of their cells."""

    number: wp.array[int]
    row: wp.array[int]  # On a GPU the number of movers before each, in one order or the other


@run_kernel
def count_frame(particles: Particles):
    """Advance the frame number on the device, so that a recorded frame has its own number when it is replayed."""
    particles.frame[0] = particles.frame[0] + 1


@run_kernel
def grow_older(particles: Particles, paste: Paste):
    """Release the particles of this frame, and fix those older than the paste's stiffening time.

    Those asleep are fixed too: a sleeper that woke later would be one mover more than the run has room for, and the
    paper's bound on its cost is that of the particles that are younger.
    """
    i = wp.tid()
    age = particles.frame[0] - particles.release_frame[i]
    if age < 0:
        return
    if particles.status[i] == WAITING:
        particles.status[i] = MOVING
    if particles.status[i] <= ASLEEP and age >= paste.frames_to_freeze[i // particles.per_run]:
        particles.status[i] = FROZEN
        bring_to_rest(particles, i)


@run_kernel
def list_in_order(
    points: Span,
    particles: Particles,
    order: Order,
    by_cell: int,
    movers: Movers,  # out
):
    """List the movers among the first points in memory, or among the first of the cells; for one thread of a CPU.

    By cell they have the rows of their runs as in memory, which a list in memory's order has found.
    """
    found = int(0)
    run = int(0)
    for k in range(points.begin, points.end):
        i = k
        if by_cell == 1:
            i = order.number[k]
        elif k == run * particles.per_run:
            movers.first_row[run] = found
            run += 1
        if particles.status[i] == MOVING:
            movers.particle[found] = i
            found += 1
    if by_cell == 0:
        movers.first_row[movers.first_row.shape[0] - 1] = found
        movers.count[0] = found


@wp.kernel
def mark_movers(
    particles: Particles,
    order: Order,  # out: row
    by_cell: int,
):
    k = wp.tid()
    i = k
    if by_cell == 1:
        i = order.number[k]
    order.row[k] = wp.where(particles.status[i] == MOVING, 1, 0)


@wp.kernel
def list_marked(
    particles: Particles,
    order: Order,
    by_cell: int,
    movers: Movers,  # out
):
    """List the movers, in memory's order with the rows of each run, or by cell, which leaves each run its rows."""
    k = wp.tid()
    i = k
    if by_cell == 1:
        i = order.number[k]
    row = order.row[k]
    moves = particles.status[i] == MOVING
    if moves:
        movers.particle[row] = i
    if by_cell == 1:
        return
    count = particles.status.shape[0]
    if k % particles.per_run == 0:
        movers.first_row[k // particles.per_run] = row
    if k == count - 1:
        total = row + wp.where(moves, 1, 0)
        movers.count[0] = total
        movers.first_row[count // particles.per_run] = total
