"""Find the addresses of compiled kernels and of their arguments, for walks.

No other file uses private names of Warp.
"""

import ctypes
import sys
from typing import Any, NamedTuple


class CompiledCall(NamedTuple):
    """A kernel as a CPU calls it: a function, the bounds of a launch and the arguments."""

    function: int  # Address
    bounds: ctypes.Structure
    arguments: list[Any]
    """Copies of the arguments. Each copy begins with a ``Span``."""


def compiled_call(command: Any, copies: int) -> CompiledCall | None:
    """Return the compiled call of a recorded launch of one thread.

    Returns None if this version of Warp uses other private names.
    """
    try:
        from warp._src.context import _build_cpu_args_structs

        kernel, hooks, values = command.kernel, command.hooks, command.params
        arguments = [_build_cpu_args_structs(kernel, hooks, values, False)[0] for _ in range(copies)]
        function = ctypes.cast(hooks.forward, ctypes.c_void_p).value
    except (ImportError, AttributeError, TypeError):
        return None
    return CompiledCall(function, command.bounds, arguments) if function and command.block_dim == 1 else None


def yield_function() -> int:
    """Return the address of the operating system's function with which a thread lets others run."""
    windows = sys.platform == "win32"
    library: Any = ctypes.WinDLL("kernel32") if windows else ctypes.CDLL(None)
    return ctypes.cast(library.SwitchToThread if windows else library.sched_yield, ctypes.c_void_p).value or 0
