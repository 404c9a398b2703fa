"""The Warp module of all kernels that a run on a CPU launches.

A compiler reads Warp's headers for each module, which takes longer than compiling ten kernels. Other modules contain
the kernels that only a GPU launches (to sort, to list movers and to sum over pairs), those of the explicit viscosity,
and those of tests.
"""

from typing import Any

import warp as wp

MODULE = wp.get_module("simulate.kernels")


def run_kernel(function: Any) -> Any:
    """Make a kernel of this module from a function."""
    return wp.kernel(function, enable_backward=False, module=MODULE)


def cpu_block(*parts: str) -> str:
    """Return a block of C++ for a CPU. In this block the compiler may reorder sums.

    A GPU's compiler gets the whole module and skips the block.
    """
    block = "{\n#pragma clang fp reassociate(on) contract(fast)\n" + "".join(parts) + "\n}"
    return f"\n#ifndef __CUDA_ARCH__\n{block}\n#endif\n"
