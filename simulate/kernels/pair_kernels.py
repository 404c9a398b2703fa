"""Kernels that sum over pairs of particles, with the inner loops for the chosen device."""

from functools import cache
from typing import Any, NamedTuple

import warp as wp

from simulate.kernels import listing, listing_cpu, pair_sums, pair_sums_cpu
from simulate.kernels.neighbours import neighbour_kernels
from simulate.kernels.pressure import pressure_kernels
from simulate.kernels.run_module import MODULE
from simulate.kernels.viscosity import viscosity_kernels


class PairKernels(NamedTuple):
    """Kernels that sum over pairs, with the inner loops for the chosen device."""

    list_neighbours: Any
    measure_density: Any
    correct: Any
    measure_shear: Any
    weigh_pairs: Any
    apply_matrix: Any
    pass_velocity: Any


@cache
def pair_kernels(native: bool) -> PairKernels:
    """Return the kernels with plain loops or, if ``native``, with a CPU's loops over eight or sixteen pairs."""
    search, loops = (listing_cpu, pair_sums_cpu) if native else (listing, pair_sums)
    kind = f"simulate.kernels.pair_kernels.{'native' if native else 'plain'}"
    # Kernels that few runs need are compiled in a separate module.
    module, seldom = MODULE if native else wp.get_module(kind), wp.get_module(f"{kind}.seldom")
    return PairKernels(
        neighbour_kernels(search, module),
        *pressure_kernels(loops, module),
        *viscosity_kernels(loops, module, seldom, skips_solved=not native),
    )


# The kernels are made now. If a kernel is added to a compiled module, the module is compiled again.
pair_kernels(native=True)
