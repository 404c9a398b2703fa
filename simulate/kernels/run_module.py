"""The Warp module of all kernels that a run on a CPU launches.

A compiler reads Warp's headers anew for each module, which takes it longer than ten kernels do. Modules of their own
are what a GPU alone launches, to sort, to list who moves, to sum over pairs, to solve and to measure beds, the kernels
of the two-level pressure and of the printed viscosity, and what tests launch.
"""

from typing import Any

import warp as wp

MODULE = wp.get_module("simulate.kernels")


def run_kernel(function: Any) -> Any:
    """Make a kernel of the module of all runs."""
    return wp.kernel(function, enable_backward=False, module=MODULE)


def cpu_block(*parts: str) -> str:
    """A block of C++ for a CPU, in which, and only in which, the compiler may reorder sums.

    A GPU's compiler, which is given the whole module, skips it.
    """
    block = "{\n#pragma clang fp reassociate(on) contract(fast)\n" + "".join(parts) + "\n}"
    return f"\n#ifndef __CUDA_ARCH__\n{block}\n#endif\n"
