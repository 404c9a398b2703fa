"""Can this machine compile and run a Warp kernel? A question for 'sealtwin doctor', apart from the fluid's own kernels.

Those take many seconds to compile on their first run; this one takes a fraction of that.
"""

import warp as wp

from simulate import kernels_selftest as device_code

SIDE = 8
"""Points along each edge of the lattice."""


def touching_pairs(device: str) -> int:
    """Pairs of points one apart in a cubic lattice of 8 x 8 x 8, counted on ``device``. The answer is 3 * 7 * 8 * 8."""
    count = wp.zeros(SIDE**3, dtype=int, device=device)
    for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        wp.launch(device_code.count_pairs, dim=(SIDE, SIDE, SIDE), inputs=[SIDE, *step, count], device=device)
    return int(count.numpy().sum())
