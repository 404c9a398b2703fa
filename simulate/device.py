"""Where the kernels run: the choice is the user's, and never changed in silence."""

import platform

import warp as wp

from sealtwin.errors import InputError

# Warp's banner goes to stdout, which belongs to results.
wp.config.log_level = wp.LOG_WARNING


def choose_device(name: str) -> str:
    """Warp's name of the device. "auto" is the first CUDA device where there is one, else the CPU.

    Raises InputError where a device that was asked for is not there.
    """
    present = [str(device) for device in wp.get_devices()]
    if name == "auto":
        return next((device for device in present if device.startswith("cuda")), "cpu")
    if name == "cuda":
        name = "cuda:0"
    if name not in present:
        raise InputError(f"device {name} is not here; allowed are auto and {', '.join(present)}.")
    return name


def describe_device(name: str) -> str:
    """One line for the report: what the run was computed on."""
    if name == "cpu":
        return f"CPU ({platform.processor() or platform.machine()}), Warp {wp.__version__}"
    return f"{wp.get_device(name).name} ({name}), Warp {wp.__version__}"
