"""Device code that raises the surface of a bed to its particles, along vertical lines in square cells. Millimetres.

It uses double precision, as the solid's crossings do.
"""

import warp as wp

from simulate.kernels.run_module import run_kernel

wp.set_module_options({"enable_backward": False})


@wp.struct
class Lines:
    """The crossings of the cells' vertical lines with the solid's facets, sorted by cell and then by height."""

    cell_mm: wp.float64
    low: wp.vec2i  # The first cell along each axis
    shape: wp.vec2i
    last: wp.array[int]  # The highest crossing of each cell, or -1
    cell: wp.array[int]
    z_mm: wp.array[wp.float64]
    upward: wp.array[int]  # 1 for a facet that faces up


@wp.struct
class Liquid:
    """The particles, and the top of the liquid above each crossing."""

    position_mm: wp.array[wp.vec3d]
    top_mm: wp.array[wp.float64]


@wp.func
def raise_over(
    liquid: Liquid,  # in, out: top_mm
    tops: int,
    here: wp.vec3d,
    half_mm: wp.float64,
    reach_mm: wp.float64,
    lines: Lines,
):
    """Raise the liquid to ``half_mm`` above a particle, at upward crossings of the lines of cells within reach.

    Only the stretch of a line at the particle's height is raised. ``tops`` is the place of the first crossing's top.
    """
    size = lines.cell_mm
    reach = int(wp.ceil(reach_mm / size))
    row = int(wp.floor(here[0] / size))
    column = int(wp.floor(here[1] / size))
    for a in range(row - reach, row + reach + 1):
        if a < lines.low[0] or a >= lines.low[0] + lines.shape[0]:
            continue
        along = (wp.float64(a) + wp.float64(0.5)) * size - here[0]
        for b in range(column - reach, column + reach + 1):
            if b < lines.low[1] or b >= lines.low[1] + lines.shape[1]:
                continue
            across = (wp.float64(b) + wp.float64(0.5)) * size - here[1]
            if along * along + across * across > reach_mm * reach_mm:
                continue
            cell = (a - lines.low[0]) * lines.shape[1] + b - lines.low[1]
            below = lines.last[cell]
            while below >= 0:
                if lines.cell[below] != cell:
                    below = -1
                elif lines.z_mm[below] >= here[2]:
                    below = below - 1
                else:
                    break
            if below >= 0 and lines.upward[below] == 1:
                wp.atomic_max(liquid.top_mm, tops + below, here[2] + half_mm)


@run_kernel
def raise_surface(
    liquid: Liquid,  # in, out: top_mm
    half_mm: wp.float64,
    reach_mm: wp.float64,
    lines: Lines,
):
    """Raise the liquid above each upward crossing to ``half_mm`` above the highest particle near the cell's line."""
    raise_over(liquid, 0, liquid.position_mm[wp.tid()], half_mm, reach_mm, lines)
