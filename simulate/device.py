"""Where the kernels run: the choice is the user's, and never changed in silence."""

import math
import platform

import warp as wp

from sealtwin.errors import InputError

# Warp's banner goes to stdout, which belongs to results.
wp.config.log_level = wp.LOG_WARNING


def choose_device(name: str) -> str:
    """Warp's name of the device. "auto" is the first CUDA device where there is one, else the CPU.

    Raises InputError where a device that was asked for is not there, or is a GPU that cannot record frames.
    """
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
    """Of a GPU's own memory; no bound on a CPU, whose memory the operating system lends."""
    return math.inf if name == "cpu" else float(wp.get_device(name).free_memory)


def _require_recording(name: str) -> None:
    """A frame asks on the device whether to go on, and its scans take their memory within it."""
    if not wp.is_conditional_graph_supported():
        raise InputError(
            f"device {name}: its driver cannot repeat a recorded frame, which takes one of CUDA 12.4 or newer. Update "
            "NVIDIA's driver, or take --device cpu."
        )
    if not wp.is_mempool_supported(name):
        raise InputError(f"device {name}: it has no memory pools, which a recorded frame needs. Take --device cpu.")


def describe_device(name: str) -> str:
    """One line for the report: what the run was computed on."""
    if name == "cpu":
        return f"CPU ({platform.processor() or platform.machine()}), Warp {wp.__version__}"
    return f"{wp.get_device(name).name} ({name}), Warp {wp.__version__}"
