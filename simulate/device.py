"""The device that runs the kernels: the user's choice, which is never changed silently."""

import math
import os
import platform
import tempfile
from functools import cache
from typing import Any

import warp as wp
from warp.utils import array_scan

from sealtwin.core.errors import InputError
from simulate.kernel_cache import guard_kernel_cache, naming_the_cache
from simulate.kernels import selftest as device_code

# Warp's banner goes to stdout, which belongs to results.
wp.config.log_level = wp.LOG_WARNING
# Warp's own threshold for inlining is 9000: kernels are no faster for it, and take a quarter longer to compile.
wp.config.cpu_compiler_flags = "-march=native -mllvm=-inline-threshold=1000 -mllvm=-slp-recursion-max-depth=4"
# A run compiles one module, and to prepare headers takes as long as to read them twice.
wp.config.use_precompiled_headers = False

SIDE = 8  # Number of points along each edge of the test lattice, and of turns of the test loop


NO_DRIVER = b"Could not find or load the NVIDIA CUDA driver"
"""Words of Warp's warning on a machine without a GPU, where there is nothing to warn of."""


@cache
def start_warp() -> None:
    """Start Warp, whose native code warns on stderr of what is no fault; all else that it says is passed on.

    Raises InputError if there is no place for its cache of kernels.
    """
    guard_kernel_cache()
    try:
        terminal = os.dup(2)
    except OSError:
        # Without a stderr nothing can be said on it.
        with naming_the_cache():
            wp.init()
        return
    with tempfile.TemporaryFile() as said:
        try:
            os.dup2(said.fileno(), 2)
            with naming_the_cache():
                wp.init()
        finally:
            os.dup2(terminal, 2)
            os.close(terminal)
            said.seek(0)
            for line in said:
                if NO_DRIVER not in line:
                    os.write(2, line)


def choose_device(name: str) -> str:
    """Warp's name of the device. "auto" is the first CUDA device if there is one, else the CPU.

    Raises InputError where the requested device is absent, or is a GPU that cannot record frames.
    """
    start_warp()
    present = [str(device) for device in wp.get_devices()]
    if name == "auto":
        name = next((device for device in present if device.startswith("cuda")), "cpu")
    if name == "cuda":
        name = "cuda:0"
    if name not in present:
        raise InputError(f"device {name} is not here; allowed are auto and {', '.join(present)}.")
    if name != "cpu":
        _require_recording(name)
    return name


def free_bytes(name: str) -> float:
    """Free memory of a GPU; infinite for a CPU, whose memory the operating system manages."""
    return math.inf if name == "cpu" else float(wp.get_device(name).free_memory)


def _require_recording(name: str) -> None:
    """Raise InputError unless a frame can be recorded: with its loops, and with the memory of its scans."""
    if not wp.is_conditional_graph_supported():
        raise InputError(
            f"device {name}: its driver cannot repeat a recorded frame, which takes one of CUDA 12.4 or newer. Update "
            "NVIDIA's driver, or take --device cpu."
        )
    if not wp.is_mempool_supported(name):
        raise InputError(f"device {name}: it has no memory pools, which a recorded frame needs. Take --device cpu.")


def describe_device(name: str) -> str:
    """One line for the report: the device of the run."""
    if name == "cpu":
        return f"CPU ({platform.processor() or platform.machine()}), Warp {wp.__version__}"
    return f"{wp.get_device(name).name} ({name}), Warp {wp.__version__}"


def touching_pairs(device: str) -> int:
    """Number of pairs of points one apart in a cubic lattice of 8 x 8 x 8: 3 * 7 * 8 * 8 if ``device`` works."""
    count = wp.zeros(SIDE**3, dtype=int, device=device)
    for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        wp.launch(device_code.count_pairs, dim=(SIDE, SIDE, SIDE), inputs=[SIDE, *step, count], device=device)
    return int(count.numpy().sum())


def turns_of_a_recording(device: str) -> int:
    """Number of turns of a recorded loop, which a working device ends after 8; it also replays a scan.

    A frame of the fluid is such a recording, which old GPU drivers cannot make.
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
