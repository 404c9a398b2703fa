"""Device code for moving particles: release, freezing by age, sleep below the yield stress, and the list of movers.

The list is in the order of memory or of cells. A CPU makes the list in one pass. A GPU marks the moving particles and
adds up the marks. The sum of the marks before a moving particle is the particle's row in the list.
"""

import warp as wp

from simulate.kernels.conjugate_gradients import System
from simulate.kernels.neighbours import Neighbours
from simulate.kernels.run_module import cpu_block, run_kernel
from simulate.kernels.status import ASLEEP, FROZEN, MOVING, WAITING, Particles, Span, bring_to_rest, end_of
from simulate.kernels.viscosity import Paste

wp.set_module_options({"enable_backward": False})


@wp.struct
class Order:
    """All particles in the order of their cells."""

    number: wp.array[int]
    row: wp.array[int]  # On a GPU, number of moving particles before each particle, in the order of the list


@run_kernel
def count_frame(rows: Span, particles: Particles):
    """Increase the frame number on the device, so that a replayed frame has the right number. There is a single row."""
    particles.frame[0] += 1


@run_kernel
def grow_older(points: Span, particles: Particles, paste: Paste):
    """Release the particles of this frame, and freeze particles that reach the freezing age.

    Sleeping particles are frozen too. If one woke later, the run could have more moving particles than rows.
    """
    for i in range(points.begin + wp.tid(), points.end, points.step):
        # Most particles of a long run are frozen and are skipped here.
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


@run_kernel
def wake(
    rows: Span,
    particles: Particles,
    paste: Paste,
    fast: float,
    restless_s: float,
    rested_s: float,
    near: Neighbours,
    system: System,
):
    """Wake the sleeping neighbours of a particle that is fast, or that has flowed for ``restless_s``.

    A woken particle starts with a quiet time of ``rested_s``. Several threads may write to the same neighbour, but all
    write the same value.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        # Most particles have no neighbour at rest. For these, both values are equal.
        if system.restraint[row] == system.drag[row]:
            continue
        i = particles.mover[row]
        if paste.yields[i // particles.per_run] == 0:
            continue
        if wp.length(particles.velocity[i]) > fast or particles.quiet_s[i] < -restless_s:
            for slot in range(near.fluid_count[row]):
                j = near.fluid[near.fluid_at[row], slot]
                if particles.status[j] == ASLEEP:
                    particles.status[j] = MOVING
                    particles.quiet_s[j] = rested_s


@run_kernel
def fall_asleep(
    rows: Span,
    particles: Particles,
    paste: Paste,
    system: System,
    frame_s: float,
    patience_s: float,
    slowest_shear: float,
    slowest: float,
):
    """Bring to rest each particle that has been quiet for ``patience_s``."""
    for row in range(rows.begin + wp.tid(), end_of(rows, particles), rows.step):
        i = particles.mover[row]
        if particles.status[i] != MOVING or paste.yields[i // particles.per_run] == 0:
            continue
        quiet = wp.min(particles.quiet_s[i], 0.0) - frame_s
        if system.shear[i] < slowest_shear and wp.length(particles.velocity[i]) < slowest:
            quiet = wp.max(particles.quiet_s[i], 0.0) + frame_s
        particles.quiet_s[i] = quiet
        if quiet >= patience_s:
            particles.status[i] = ASLEEP
            bring_to_rest(particles, i)


@wp.func_native(
    cpu_block(
        f"enum {{ MOVING = {int(MOVING)} }};",
        """
// The arrays have no gaps; their pointers stay in registers.
const int *status = particles.status.data, *number = order.number.data;
int *particle = particles.mover.data, *first_row = particles.first_row.data;
int listed = 0, run = 0;
if (by_cell) {
    for (int k = 0; k < count; ++k)
        if (status[number[k]] == MOVING) particle[listed++] = number[k];
    return;
}
for (int i = 0, next = 0; i < count; ++i) {
    if (i == next) first_row[run++] = listed, next += particles.per_run;
    if (status[i] == MOVING) particle[listed++] = i;
}
first_row[particles.first_row.shape[0] - 1] = particles.mover_count.data[0] = listed;
""",
    )
)
def list_first(count: int, particles: Particles, order: Order, by_cell: int): ...


@run_kernel
def list_in_order(
    points: Span,
    particles: Particles,  # out: mover, mover_count and first_row
    order: Order,
    by_cell: int,
):
    """List the moving particles among the first points, in the order of memory or, if ``by_cell`` is 1, of the cells.

    One thread of a CPU does this. The rows of a run are the same in both orders.
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
    particles: Particles,  # out: mover, mover_count and first_row
    order: Order,
    by_cell: int,
):
    """List the marked particles in the order of memory, and store the first row of each run.

    If ``by_cell`` is 1, list them in the order of the cells, in the same rows of each run.
    """
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
        particles.mover_count[0] = total
        particles.first_row[count // particles.per_run] = total
