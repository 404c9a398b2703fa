"""Device code of the neighbour lists. Each moving particle has one list."""

from types import ModuleType
from typing import Any

import warp as wp

from simulate.kernels.cells import CellArrays
from simulate.kernels.lanes import lane, lanes
from simulate.kernels.run_module import kernel_in
from simulate.kernels.status import Particles, Span, end_of

wp.set_module_options({"enable_backward": False})

# Each kind of fault is one bit. A particle's faults are the sum of these bits.
NEIGHBOURS_FULL = wp.constant(1)
WALLS_FULL = wp.constant(2)

BLOCK = wp.constant(64)
NOWHERE_CM = 1e6  # x, y and z of the dummy point that pads lists, far from all particles


@wp.struct
class Neighbours:
    """Lists of the fluid and wall particles near each moving particle.

    For a CPU's loops, the lists follow each other in one array, in windows that begin at multiples of sixteen entries.
    A block of ``BLOCK`` rows has 16 times ``room`` entries, and a thread processes whole blocks. On a GPU, each row has
    its own window, and ``room`` is 0.
    """

    store: wp.array[int]
    wall_store: wp.array[int]  # Entries of the wall lists if each row has its own window
    fluid: wp.array2d[int]
    fluid_at: wp.array[int]  # Window of each row
    fluid_count: wp.array[int]
    wall: wp.array2d[int]
    wall_at: wp.array[int]
    wall_count: wp.array[int]
    room: int
    lanes: int  # Number of GPU threads that share a row
    lacking: wp.array[int]  # 1 if a block has too few entries for its lists
    wall_particle: wp.array[wp.vec4]  # Position of each wall particle, and its weight


def neighbour_kernels(search: ModuleType, module: Any) -> Any:
    """Return the kernel ``list_neighbours``, with the search from the module ``search``."""
    list_rows, block = search.list_rows, search.ROWS

    @kernel_in(module)
    def list_neighbours(
        rows: Span,
        particles: Particles,
        cells: CellArrays,
        wall_cells: CellArrays,
        near: Neighbours,  # out
    ):
        """List the fluid and wall particles that are closer than a cell's size, without the particle itself.

        Fluid and walls have cells of the same size. If a list has too few slots, the particle gets a fault.
        """
        for first in range(rows.begin + wp.tid() // lanes(), end_of(rows, particles), rows.step):
            if first % block > 0:
                continue
            last = wp.min(first + block, particles.mover_count[0])
            list_rows(first, last, particles, cells, wall_cells, near)
            if lane() > 0:
                continue
            for row in range(first, last):
                i = particles.mover[row]
                if near.fluid_count[row] > near.fluid.shape[1]:
                    near.fluid_count[row] = near.fluid.shape[1]
                    particles.fault[i] |= NEIGHBOURS_FULL
                if near.wall_count[row] > near.wall.shape[1]:
                    near.wall_count[row] = near.wall.shape[1]
                    particles.fault[i] |= WALLS_FULL

    return list_neighbours
