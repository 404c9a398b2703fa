"""The Warp module of all kernels that a run on a CPU launches.

A compiler reads Warp's headers for each module, which takes longer than compiling ten kernels. Other modules contain
the kernels that only a GPU launches (to sort, to list movers and to sum over pairs), those of the explicit viscosity,
and those of tests.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import warp as wp

MODULE = wp.get_module("simulate.kernels")


def kernel_in(module: Any) -> Callable[[Any], Any]:
    """Return a decorator that makes a kernel of a Warp module from a function."""
    return partial(wp.kernel, enable_backward=False, module=module)


run_kernel = kernel_in(MODULE)


def cpu_block(*parts: str) -> str:
    """Return a block of C++ for a CPU. In this block the compiler may reorder sums.

    A GPU's compiler gets the whole module and skips the block.
    """
    block = "{\n#pragma clang fp reassociate(on) contract(fast)\n" + "".join(parts) + "\n}"
    return f"\n#ifndef __CUDA_ARCH__\n{block}\n#endif\n"
