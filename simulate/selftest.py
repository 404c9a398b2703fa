"""Can this machine compile, run and record a kernel? A question for 'sealtwin doctor', apart from the fluid's kernels.

Those take many seconds to compile on their first run; these take a fraction of that.
"""

from typing import Any

import warp as wp
from warp.utils import array_scan

from simulate import kernels_selftest as device_code

SIDE = 8
"""Points along each edge of the lattice, and turns of the loop."""


def touching_pairs(device: str) -> int:
    """Pairs of points one apart in a cubic lattice of 8 x 8 x 8, counted on ``device``. The answer is 3 * 7 * 8 * 8."""
    count = wp.zeros(SIDE**3, dtype=int, device=device)
    for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        wp.launch(device_code.count_pairs, dim=(SIDE, SIDE, SIDE), inputs=[SIDE, *step, count], device=device)
    return int(count.numpy().sum())


def turns_of_a_recording(device: str) -> int:
    """Of a loop that is recorded once and replayed, which the device itself ends after 8; with a scan beside it.

    A frame of the fluid is such a recording: old drivers of GPUs cannot make it.
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
