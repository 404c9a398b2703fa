"""Addresses of compiled kernels and of their arguments, for walks. All private names of Warp are in this file."""

import ctypes
import sys
from typing import Any, NamedTuple


class CompiledCall(NamedTuple):
    """A kernel as a CPU calls it: with the address of a launch's bounds, and that of its arguments."""

    function: int  # Address
    bounds: ctypes.Structure
    arguments: list[Any]
    """Copies of the arguments. A ``Span`` comes first."""


def compiled_call(command: Any, copies: int) -> CompiledCall | None:
    """Return a recorded launch of one thread as an address; None if this version of Warp has other names for it."""
    try:
        from warp._src.context import _build_cpu_args_structs

        kernel, hooks, values = command.kernel, command.hooks, command.params
        arguments = [_build_cpu_args_structs(kernel, hooks, values, False)[0] for _ in range(copies)]
        function = ctypes.cast(hooks.forward, ctypes.c_void_p).value
    except (ImportError, AttributeError, TypeError):
        return None
    return CompiledCall(function, command.bounds, arguments) if function and command.block_dim == 1 else None


def yield_function() -> int:
    """Return the address of the operating system's function by which a thread lets others run."""
    windows = sys.platform == "win32"
    library: Any = ctypes.WinDLL("kernel32") if windows else ctypes.CDLL(None)
    return ctypes.cast(library.SwitchToThread if windows else library.sched_yield, ctypes.c_void_p).value or 0
