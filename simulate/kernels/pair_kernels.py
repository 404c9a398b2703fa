"""The kernels that sum over pairs of particles, with the inner loops that suit a device."""

from functools import cache
from typing import Any, NamedTuple

import warp as wp

from simulate.kernels import listing, listing_cpu, pair_sums, pair_sums_cpu
from simulate.kernels.neighbours import neighbour_kernels
from simulate.kernels.pressure import PressureKernels, pressure_kernels
from simulate.kernels.run_module import MODULE
from simulate.kernels.viscosity import ViscosityKernels, viscosity_kernels


class PairKernels(NamedTuple):
    list_neighbours: Any
    pressure: PressureKernels
    viscosity: ViscosityKernels


@cache
def pair_kernels(native: bool) -> PairKernels:
    """The same algorithm with the plain loops, or with those that a CPU runs eight or sixteen pairs at a time."""
    search, loops = (listing_cpu, pair_sums_cpu) if native else (listing, pair_sums)
    kind = f"simulate.kernels.pair_kernels.{'native' if native else 'plain'}"
    # What few runs launch is compiled apart, for them alone.
    module, seldom = MODULE if native else wp.get_module(kind), wp.get_module(f"{kind}.seldom")
    return PairKernels(
        neighbour_kernels(search, module),
        pressure_kernels(loops, module, seldom),
        viscosity_kernels(loops, module, seldom, skips_solved=not native),
    )


# A kernel that its module gets after it was compiled has it compiled once more.
pair_kernels(native=True)
