"""Choose the device that runs the kernels, and check that Warp's cache of compiled kernels has room.

The user chooses the device, and it is never changed silently.
"""

import math
import os
import platform
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import warp as wp
from warp.utils import array_scan

from sealtwin.core.errors import InputError
from simulate.kernels import selftest as device_code

# Otherwise Warp would print a banner on stdout, which is for results.
wp.config.log_level = wp.LOG_WARNING
# With Warp's default inlining threshold, 9000, kernels are not faster and take a quarter longer to compile.
wp.config.cpu_compiler_flags = "-march=native -mllvm=-inline-threshold=1000 -mllvm=-slp-recursion-max-depth=4"
# A run compiles only one module, so precompiled headers would save no time.
wp.config.use_precompiled_headers = False
# Threads that launch kernels at the same time would write to each other's stack.
wp.config.enable_tiles_in_stack_memory = False

SIDE = 8  # Number of points along each edge of the test lattice, and of repetitions of the test loop
NO_DRIVER = b"Could not find or load the NVIDIA CUDA driver"
"""Warp's warning on a machine without a GPU, which is suppressed."""
NEEDED_BYTES = 20_000_000
"""Disk space that must be free, in bytes: ten times the largest compiled module. LLVM ends the process if a disk is
full."""


@cache
def start_warp() -> None:
    """Start Warp. Its warning about a missing GPU is suppressed. All other text that it writes to stderr is passed on.

    Raises InputError if the cache of kernels cannot be written.
    """
    try:
        terminal = os.dup(2)
    except OSError:
        # There is no stderr.
        _begin()
        return
    with tempfile.TemporaryFile() as captured:
        try:
            os.dup2(captured.fileno(), 2)
            _begin()
        finally:
            os.dup2(terminal, 2)
            os.close(terminal)
            captured.seek(0)
            for line in captured:
                if NO_DRIVER not in line:
                    os.write(2, line)


def choose_device(name: str) -> str:
    """Return Warp's name of the device. "auto" is the first GPU, or the CPU if there is no GPU.

    Raises InputError if the machine has no such device, or if the device is a GPU that cannot record frames.
    """
    start_warp()
    present = [str(device) for device in wp.get_devices()]
    if name == "auto":
        name = next((device for device in present if device.startswith("cuda")), "cpu")
    if name == "cuda":
        name = "cuda:0"
    if name not in present:
        raise InputError(f"device {name} is not on this machine. Give auto or one of {', '.join(present)}.")
    # On a GPU, a frame is recorded with its loops and scans.
    if name != "cpu" and not wp.is_conditional_graph_supported():
        raise InputError(
            f"device {name}: its driver cannot replay a recorded frame, which needs CUDA 12.4 or newer. Update "
            "NVIDIA's driver, or give --device cpu."
        )
    if name != "cpu" and not wp.is_mempool_supported(name):
        raise InputError(f"device {name}: it has no memory pools, which a recorded frame needs. Give --device cpu.")
    return name


def free_bytes(name: str) -> float:
    """Return the free memory of a GPU in bytes. Infinite for a CPU, whose memory the operating system manages."""
    return math.inf if name == "cpu" else float(wp.get_device(name).free_memory)


def describe_device(name: str) -> str:
    """Return a description of the device as one line, for reports."""
    if name == "cpu":
        return f"CPU ({platform.processor() or platform.machine()}), Warp {wp.__version__}"
    return f"{wp.get_device(name).name} ({name}), Warp {wp.__version__}"


def touching_pairs(device: str) -> int:
    """Test a device: return the number of neighbouring pairs that it counts in a cubic lattice of 8 x 8 x 8 points.

    A working device counts 3 * 7 * 8 * 8 pairs.
    """
    count = wp.zeros(SIDE**3, dtype=int, device=device)
    for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        wp.launch(device_code.count_pairs, dim=(SIDE, SIDE, SIDE), inputs=[SIDE, *step, count], device=device)
    return int(count.numpy().sum())


def turns_of_a_recording(device: str) -> int:
    """Test a device: replay a recorded loop and a scan, and return the number of repetitions: 8 on a working device.

    Frames of the fluid are such recordings. Old GPU drivers do not support them.
    """
    turns, more = wp.zeros(1, dtype=int, device=device), wp.full(1, 1, dtype=int, device=device)
    ones, sums = wp.full(SIDE, 1, dtype=int, device=device), wp.zeros(SIDE, dtype=int, device=device)

    def turn() -> None:
        wp.launch(device_code.count_turn, dim=1, inputs=[SIDE, turns, more], device=device)

    wp.load_module(device_code, device=device)
    with wp.ScopedCapture(device=device, force_module_load=False) as capture:
        wp.capture_while(more, turn)
        array_scan(ones, sums)
    recorded: Any = capture.graph
    wp.capture_launch(recorded)
    return int(turns.numpy()[0]) if int(sums.numpy()[-1]) == SIDE else 0


@contextmanager
def _naming_the_cache() -> Iterator[None]:
    """Convert an OSError into an InputError that names the cache and WARP_CACHE_PATH."""
    try:
        yield
    except OSError as fault:
        cache = fault.filename or wp.config.kernel_cache_dir or "the home folder"
        raise InputError(
            f"{cache}: the cache of compiled kernels cannot be stored there ({fault.strerror or fault}). "
            f"Set WARP_CACHE_PATH to a writable folder with at least {NEEDED_BYTES / 1e6:.0f} MB free."
        ) from fault


def _begin() -> None:
    """Start Warp. Raises InputError if its cache has no room for a module: only writing a file detects a quota."""
    with _naming_the_cache():
        wp.init()
        with tempfile.TemporaryFile(dir=wp.config.kernel_cache_dir) as probe:
            probe.write(bytes(NEEDED_BYTES))
