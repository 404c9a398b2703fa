"""Device code that measures the settled sealant of all runs without copying particles. Units are mm and mm/s.

Numbers have double precision. Sums are computed in a fixed order, over blocks of threads and over the parts of a run.
"""

import warp as wp

from simulate.kernels.lanes import most_over_block, over_block
from simulate.kernels.run_module import run_kernel
from simulate.kernels.status import FROZEN, MOVING, Particles, Span

LANES = 64  # Threads of a GPU's block, as in most launches, because the module is compiled for each width
PARTS = wp.constant(32)
"""Number of parts of a run that are summed separately. The host adds up the sums of the parts. With 32 parts, a single
run uses a quarter of a GPU."""

wp.set_module_options({"enable_backward": False})


@wp.struct
class Lines:
    """Crossings of the cells' vertical lines with the facets of the solid, sorted by cell and then by height."""

    cell_mm: wp.float64
    low: wp.vec2i  # Number of the first cell along each axis
    shape: wp.vec2i
    last: wp.array[int]  # The highest crossing of each cell, or -1
    cell: wp.array[int]
    z_mm: wp.array[wp.float64]
    upward: wp.array[int]  # 1 for a facet that faces up
    ceiling_mm: wp.array[wp.float64]  # Upper end of the free part of the line above each crossing


@wp.struct
class Liquid:
    """The settled particles, and the top of the liquid above each crossing."""

    position_mm: wp.array[wp.vec3d]  # In the rotated frame of the lines. NaN for a particle that has not settled.
    top_mm: wp.array[wp.float64]  # Top of the liquid above each crossing, run by run


@wp.struct
class Sizes:
    """Constants of all runs: unit of length, gravity, speed thresholds, radius, floor, and rotation of the lines."""

    mm: wp.float64  # One millimetre in the solver's unit of length
    down: wp.vec3d  # Direction of gravity
    falls_mm_s: wp.float64  # Downward speed above which a particle may be in flight
    flows_mm_s: wp.float64  # Speed from which paste with a yield stress counts as flowing
    radius_mm: wp.float64
    floor_mm: wp.float64  # Height of the solid's floor
    turn: wp.vec2d  # Cosine and sine of the angle by which the solid's lines are turned


@wp.struct
class Beds:
    """Measured figures of the settled sealant, and the arrays for measuring them."""

    count: wp.array2d[wp.vec4i]
    """Four numbers of particles, by run and part: settled; moving; settled and moving; settled, moving and faster than
    ``flows_mm_s``."""
    length_mm: wp.array2d[wp.float64]  # Wet length of the vertical lines, by run and part
    liquid: Liquid
    """Particles on the sample that are not in flight, and the tops of the liquid, for a batch of runs."""


# Several threads may raise the same top. On a CPU, Warp's ``atomic_max`` is not atomic.
@wp.func_native("""
#ifdef __CUDA_ARCH__
wp::atomic_max(top_mm, line, z_mm);
#else
double* top = top_mm.data + line;
double before = *top;
while (before < z_mm && !__atomic_compare_exchange(top, &before, &z_mm, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED));
#endif
""")
def raise_top(top_mm: wp.array[wp.float64], line: int, z_mm: wp.float64): ...


@wp.func
def raise_around(
    k: int,
    first: int,
    per_run: int,
    half_mm: wp.float64,
    reach_mm: wp.float64,
    lines: Lines,
    liquid: Liquid,  # in, out: top_mm
):
    position = liquid.position_mm[first + k]
    if not wp.isfinite(position):
        return
    tops = k // per_run * lines.z_mm.shape[0]
    size = lines.cell_mm
    reach = int(wp.ceil(reach_mm / size))
    row = int(wp.floor(position[0] / size))
    column = int(wp.floor(position[1] / size))
    for a in range(row - reach, row + reach + 1):
        if a < lines.low[0] or a >= lines.low[0] + lines.shape[0]:
            continue
        along = (wp.float64(a) + wp.float64(0.5)) * size - position[0]
        for b in range(column - reach, column + reach + 1):
            if b < lines.low[1] or b >= lines.low[1] + lines.shape[1]:
                continue
            across = (wp.float64(b) + wp.float64(0.5)) * size - position[1]
            if along * along + across * across > reach_mm * reach_mm:
                continue
            cell = (a - lines.low[0]) * lines.shape[1] + b - lines.low[1]
            below = lines.last[cell]
            while below >= 0:
                if lines.cell[below] != cell:
                    below = -1
                elif lines.z_mm[below] >= position[2]:
                    below = below - 1
                else:
                    break
            if below >= 0 and lines.upward[below] == 1:
                raise_top(liquid.top_mm, tops + below, position[2] + half_mm)


@run_kernel
def raise_surface(
    rows: Span,
    first: int,
    per_run: int,
    half_mm: wp.float64,
    reach_mm: wp.float64,
    lines: Lines,
    liquid: Liquid,  # in, out: top_mm
):
    """Raise the liquid to ``half_mm`` above each particle, on the vertical lines of cells within reach.

    On a line, the liquid is raised only in the free part at the particle's height, which begins at a facet that faces
    up. The first particle is ``first``.
    """
    for k in range(rows.begin + wp.tid(), rows.end, rows.step):
        raise_around(k, first, per_run, half_mm, reach_mm, lines, liquid)


@wp.func
def is_here(particles: Particles, i: int):
    """Return True for a particle that has been released and is not lost."""
    return particles.status[i] <= FROZEN and wp.isfinite(particles.position[i][:3])


@wp.func
def place_of(particles: Particles, sizes: Sizes, i: int):
    return wp.vec3d(particles.position[i][:3]) / sizes.mm


@wp.func
def speed_of(particles: Particles, sizes: Sizes, i: int):
    return wp.vec3d(particles.velocity[i]) / sizes.mm


@wp.func
def falls(particles: Particles, sizes: Sizes, i: int):
    return wp.dot(speed_of(particles, sizes, i), sizes.down) > sizes.falls_mm_s


@wp.func
def keep_in_bed(
    particles: Particles,
    sizes: Sizes,
    beds: Beds,  # out: the liquid's position_mm
    i: int,
    lies: bool,
):
    x = place_of(particles, sizes, i)
    turned = wp.vec3d(x[0] * sizes.turn[0] - x[1] * sizes.turn[1], x[0] * sizes.turn[1] + x[1] * sizes.turn[0], x[2])
    beds.liquid.position_mm[i] = wp.where(lies, turned, wp.vec3d(wp.float64(wp.nan)))


@run_kernel
def find_lying(
    rows: Span,
    particles: Particles,
    sizes: Sizes,
    beds: Beds,  # out: the liquid's position_mm
):
    """Find settled particles as ``profile.settled`` does, with one block of threads per particle.

    The block of a falling particle searches for settled sealant close below the particle. Other blocks end at once.
    """
    lane = wp.tid() % wp.block_dim()
    for i in range(rows.begin + wp.tid() // wp.block_dim(), rows.end, rows.step):
        present = is_here(particles, i)
        if not present or not falls(particles, sizes, i):
            if lane == 0:
                keep_in_bed(particles, sizes, beds, i, present)
            continue
        position = place_of(particles, sizes, i)
        first = i // particles.per_run * particles.per_run
        around = wp.float64(2.0) * sizes.radius_mm
        bed_mm = sizes.floor_mm
        for j in range(first + lane, first + particles.per_run, wp.block_dim()):
            neighbour = place_of(particles, sizes, j)
            along = neighbour[0] - position[0]
            across = neighbour[1] - position[1]
            near = along * along + across * across <= around * around
            if near and is_here(particles, j) and not falls(particles, sizes, j):
                bed_mm = wp.max(bed_mm, neighbour[2])
        highest_mm = most_over_block(bed_mm)
        if lane == 0:
            keep_in_bed(particles, sizes, beds, i, position[2] <= highest_mm + sizes.radius_mm)


@run_kernel
def count_particles(
    rows: Span,
    particles: Particles,
    sizes: Sizes,
    beds: Beds,  # out: count
):
    lane = wp.tid() % wp.block_dim()
    for part in range(rows.begin + wp.tid() // wp.block_dim(), rows.end, rows.step):
        run = part // PARTS
        width = (particles.per_run + PARTS - 1) // PARTS
        begin = part % PARTS * width
        counts = wp.vec4i(0, 0, 0, 0)
        for k in range(begin + lane, wp.min(begin + width, particles.per_run), wp.block_dim()):
            i = run * particles.per_run + k
            lies = wp.where(wp.isfinite(beds.liquid.position_mm[i]), 1, 0)
            moves = int(0)
            flows = int(0)
            if particles.status[i] == MOVING and is_here(particles, i):
                moves = 1
                if wp.length(speed_of(particles, sizes, i)) >= sizes.flows_mm_s:
                    flows = 1
            counts += wp.vec4i(lies, moves, moves * lies, flows * lies)
        total = over_block(counts)
        if lane == 0:
            beds.count[run, part % PARTS] = total


@run_kernel
def sum_lines(
    rows: Span,
    lines: Lines,
    first_run: int,
    beds: Beds,  # out: length_mm of a batch of runs
):
    """Sum the wet lengths of the vertical lines, from the floor of a free part to the liquid's top or the ceiling."""
    lane = wp.tid() % wp.block_dim()
    for part in range(rows.begin + wp.tid() // wp.block_dim(), rows.end, rows.step):
        run = part // PARTS
        crossings = lines.z_mm.shape[0]
        width = (crossings + PARTS - 1) // PARTS
        begin = part % PARTS * width
        length_mm = wp.float64(0.0)
        for k in range(begin + lane, wp.min(begin + width, crossings), wp.block_dim()):
            top_mm = beds.liquid.top_mm[run * crossings + k]
            if wp.isfinite(top_mm):
                length_mm += wp.min(top_mm, lines.ceiling_mm[k]) - lines.z_mm[k]
        total = over_block(length_mm)
        if lane == 0:
            beds.length_mm[first_run + run, part % PARTS] = total
