"""Is this machine fit: versions, devices, and each stage on a task whose answer is known."""

import time
from collections.abc import Callable
from typing import Any

from sealtwin.store.folder import versions


def examine() -> dict[str, Any]:
    """Versions, devices and self-tests; ``healthy`` is whether all of them passed."""
    checks: dict[str, str] = {}
    healthy = True
    for name, check in SELF_TESTS.items():
        began = time.perf_counter()
        try:
            found = check()
        except Exception as fault:  # The doctor's very task is to say which part fails, and how.
            checks[name] = f"FAILED: {type(fault).__name__}: {fault}"
            healthy = False
        else:
            checks[name] = f"ok, {found} ({time.perf_counter() - began:.1f} s)"
    return {"version": 1, "versions": versions(), "checks": checks, "healthy": healthy}


def _photo() -> str:
    """OpenCV reads back the markers it draws: a build without aruco is a common fault."""
    import cv2
    import numpy as np

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    photo = np.full((160, 160), 255, np.uint8)
    photo[30:130, 30:130] = cv2.aruco.generateImageMarker(dictionary, 7, 100)
    _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(photo)
    if ids is None or ids.ravel().tolist() != [7]:
        raise RuntimeError(f"drew marker 7, found {ids}")
    return "a marker drawn and found"


def _mesh() -> str:
    """A box less a box is known to the last digit."""
    from manifold3d import Manifold

    left = (Manifold.cube((10.0, 10.0, 10.0)) - Manifold.cube((4.0, 4.0, 10.0))).volume()
    if abs(left - 840.0) > 1e-9:
        raise RuntimeError(f"10 x 10 x 10 less 4 x 4 x 10 mm came out as {left} mm3, not 840")
    return "a cavity cut to its exact volume"


def _devices() -> str:
    from simulate.device import choose_device, describe_device

    return ", ".join(dict.fromkeys(describe_device(choose_device(name)) for name in ("cpu", "auto")))


def _fluid() -> str:
    """Kernels compiled, run and recorded on the device that "auto" takes, against answers known by hand."""
    from simulate.device import choose_device
    from simulate.selftest import SIDE, touching_pairs, turns_of_a_recording

    device = choose_device("auto")
    found = touching_pairs(device)
    if found != 3 * 7 * 8 * 8:
        raise RuntimeError(f"a lattice of 8 x 8 x 8 has {found} touching pairs on {device}, not {3 * 7 * 8 * 8}")
    turns = turns_of_a_recording(device)
    if turns != SIDE:
        raise RuntimeError(f"a recorded loop of {SIDE} turns took {turns} on {device}")
    return f"kernels compiled, run and recorded on {device}"


def _report() -> str:
    """A figure as SVG, without a screen."""
    import io

    from matplotlib.figure import Figure

    page = io.BytesIO()
    Figure().savefig(page, format="svg")
    if b"<svg" not in page.getvalue():
        raise RuntimeError("Matplotlib wrote no SVG")
    return "a figure drawn without a screen"


SELF_TESTS: dict[str, Callable[[], str]] = {
    "photo": _photo,
    "mesh": _mesh,
    "devices": _devices,
    "fluid": _fluid,
    "report": _report,
}
