"""The kernels that go over pairs of particles, with the inner loops that suit a device."""

from functools import cache
from typing import Any, NamedTuple

import warp as wp

from simulate import kernels_pairs, kernels_pairs_native
from simulate.kernels import PressureKernels, pressure_kernels
from simulate.kernels_neighbours import neighbour_kernels
from simulate.kernels_viscosity import ViscosityKernels, viscosity_kernels


class PairKernels(NamedTuple):
    list_neighbours: Any
    pressure: PressureKernels
    viscosity: ViscosityKernels


@cache
def pair_kernels(native: bool) -> PairKernels:
    """The same algorithm with the plain loops, or with those that a CPU runs sixteen pairs at a time."""
    loops = kernels_pairs_native if native else kernels_pairs
    # Two modules of Warp's: what is native to CPUs must not be compiled for a GPU.
    module = wp.get_module(f"simulate.pairs.{'native' if native else 'plain'}")
    return PairKernels(
        neighbour_kernels(loops, module), pressure_kernels(loops, module), viscosity_kernels(loops, module)
    )
