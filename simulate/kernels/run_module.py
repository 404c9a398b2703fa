"""The Warp module of all kernels that a run on a CPU launches.

For each module, the compiler reads Warp's headers, which takes longer than compiling ten kernels. Other modules contain
the kernels that only a GPU launches (to sort, to list moving particles and to sum over pairs), the kernels of the
explicit viscosity, and the kernels of tests.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import warp as wp

MODULE = wp.get_module("simulate.kernels")


def kernel_in(module: Any) -> Callable[[Any], Any]:
    """Return a decorator that turns a function into a kernel of a Warp module."""
    return partial(wp.kernel, enable_backward=False, module=module)


run_kernel = kernel_in(MODULE)


def cpu_block(*parts: str) -> str:
    """Return a block of C++ for a CPU, in which the compiler may reorder sums.

    The compiler for a GPU gets the whole module, but skips this block.
    """
    block = "{\n#pragma clang fp reassociate(on) contract(fast)\n" + "".join(parts) + "\n}"
    return f"\n#ifndef __CUDA_ARCH__\n{block}\n#endif\n"
