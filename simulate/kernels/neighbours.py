"""Device code of the neighbours: a list for each particle that moves, and who wakes whom."""

from types import ModuleType
from typing import Any

import warp as wp

from simulate.kernels.cells import CellArrays
from simulate.kernels.run_module import run_kernel
from simulate.kernels.status import ASLEEP, MOVING, Movers, Particles, Span, end_of

wp.set_module_options({"enable_backward": False})

BLOCK = wp.constant(64)
NOWHERE_CM = 1e6  # x, y and z of the dummy point that pads lists: no particle comes near it


@wp.struct
class Neighbours:
    """Lists of the fluid and wall particles near each mover.

    For a CPU's loops they lie one behind the other, and are windows of one store that begin at every sixteenth entry.
    ``BLOCK`` rows share ``room`` sixteens of it, and a thread has whole blocks. On a GPU each row has a window of its
    own, and ``room`` is 0.
    """

    store: wp.array[int]
    wall_store: wp.array[int]  # That of the walls' lists where each row has a window of its own
    fluid: wp.array2d[int]
    fluid_at: wp.array[int]  # Window of each row
    fluid_count: wp.array[int]
    wall: wp.array2d[int]
    wall_at: wp.array[int]
    wall_count: wp.array[int]
    room: int
    lacking: wp.array[int]  # 1 once a block has too little room for what was found
    wall_particle: wp.array[wp.vec4]  # Position of each wall particle, and the share of the surface that it stands for


def neighbour_kernels(search: ModuleType, module: Any) -> Any:
    """The kernel ``list_neighbours`` with the search of ``search``."""
    list_rows, block = search.list_rows, search.ROWS

    @wp.func(module=module)
    def cut(count: wp.array[int], row: int, slots: int):
        """Returns whether a list had too few slots for what was found."""
        found = count[row]
        count[row] = wp.min(found, slots)
        return found > slots

    @wp.kernel(enable_backward=False, module=module)
    def list_neighbours(
        rows: Span,
        movers: Movers,
        cells: CellArrays,
        wall_cells: CellArrays,
        fluid_full: int,
        walls_full: int,
        position: wp.array[wp.vec4],
        near: Neighbours,  # out
        fault: wp.array[int],  # in, out
    ):
        """List the fluid and the wall particles nearer than a cell's size, the particle itself apart.

        The cells of both are the same; a list that is too short sets ``fault``.
        """
        for first in range(rows.begin + wp.tid(), end_of(rows, movers), rows.step):
            if first % block > 0:
                continue
            last = wp.min(first + block, movers.count[0])
            list_rows(first, last, movers, cells, wall_cells, position, near)
            for row in range(first, last):
                i = movers.particle[row]
                if cut(near.fluid_count, row, near.fluid.shape[1]):
                    fault[i] = fault[i] | fluid_full
                if cut(near.wall_count, row, near.wall.shape[1]):
                    fault[i] = fault[i] | walls_full

    return list_neighbours


@run_kernel
def wake(
    rows: Span,
    movers: Movers,
    particles: Particles,
    yields: wp.array[float],
    fast: float,
    restless_s: float,
    rested_s: float,
    near: Neighbours,
    drag: wp.array[float],
    held: wp.array[float],
    quiet_s: wp.array[float],  # in, out
):
    """Wake the sleeping neighbours of a particle that is fast, or was above its yield stress for ``restless_s``.

    They count as quiet for ``rested_s``, until they flow.
    Several threads may write to one of them; all write the same.
    """
    for row in range(rows.begin + wp.tid(), end_of(rows, movers), rows.step):
        # Most particles have no neighbour at rest: walls alone hold them.
        if held[row] == drag[row]:
            continue
        i = movers.particle[row]
        if yields[i // particles.per_run] == 0.0:
            continue
        if wp.length(particles.velocity[i]) > fast or quiet_s[i] < -restless_s:
            for slot in range(near.fluid_count[row]):
                j = near.fluid[near.fluid_at[row], slot]
                if particles.status[j] == ASLEEP:
                    particles.status[j] = MOVING
                    quiet_s[j] = rested_s
