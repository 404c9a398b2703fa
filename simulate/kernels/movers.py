"""Device code of who moves: release, freezing by age, and the list of movers, in the order of memory or of the cells.

A CPU takes one particle after the other and lists in one pass; a GPU marks the movers, sums the marks up, and lists
each mover where its sum says.
"""

import warp as wp

from simulate.kernels.run_module import cpu_block, run_kernel
from simulate.kernels.status import ASLEEP, FROZEN, MOVING, WAITING, Particles, Span, bring_to_rest
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
def grow_older(points: Span, particles: Particles, paste: Paste):
    """Release the particles of this frame, and fix those older than the paste's stiffening time.

    Those asleep are fixed too: a sleeper that woke later would be one mover more than the run has room for, and the
    paper's bound on its cost is that of the particles that are younger.
    """
    for i in range(points.begin + wp.tid(), points.end, points.step):
        # Most of a long run are fixed, and are asked for nothing else.
        status = particles.status[i]
        if status > ASLEEP and status != WAITING:
            continue
        age = particles.frame[0] - particles.release_frame[i]
        if age < 0:
            continue
        if status == WAITING:
            particles.status[i] = MOVING
        if age >= paste.frames_to_freeze[i // particles.per_run]:
            particles.status[i] = FROZEN
            bring_to_rest(particles, i)


@wp.func_native(
    cpu_block(
        f"enum {{ MOVING = {int(MOVING)} }};",
        """
// The arrays lie without gaps; their pointers stay in registers.
const int *status = particles.status.data, *number = order.number.data;
int *particle = particles.mover.data, *first_row = particles.first_row.data;
int found = 0, run = 0;
if (by_cell) {
    for (int k = 0; k < count; ++k)
        if (status[number[k]] == MOVING) particle[found++] = number[k];
    return;
}
for (int i = 0, next = 0; i < count; ++i) {
    if (i == next) first_row[run++] = found, next += particles.per_run;
    if (status[i] == MOVING) particle[found++] = i;
}
first_row[particles.first_row.shape[0] - 1] = particles.movers.data[0] = found;
""",
    )
)
def list_first(count: int, particles: Particles, order: Order, by_cell: int): ...


@run_kernel
def list_in_order(
    points: Span,
    particles: Particles,  # out: mover, movers and first_row
    order: Order,
    by_cell: int,
):
    """List the movers among the first points in memory, or among the first of the cells; for one thread of a CPU.

    By cell they have the rows of their runs as in memory, which a list in memory's order has found.
    """
    list_first(points.end, particles, order, by_cell)


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
    particles: Particles,  # out: mover, movers and first_row
    order: Order,
    by_cell: int,
):
    """List the movers, in memory's order with the rows of each run, or by cell, which leaves each run its rows."""
    k = wp.tid()
    i = k
    if by_cell == 1:
        i = order.number[k]
    row = order.row[k]
    moves = particles.status[i] == MOVING
    if moves:
        particles.mover[row] = i
    if by_cell == 1:
        return
    count = particles.status.shape[0]
    if k % particles.per_run == 0:
        particles.first_row[k // particles.per_run] = row
    if k == count - 1:
        total = row + wp.where(moves, 1, 0)
        particles.movers[0] = total
        particles.first_row[count // particles.per_run] = total
