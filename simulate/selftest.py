"""Can this machine compile and run a Warp kernel? A question for 'sealtwin doctor', apart from the fluid's own kernels.

Those take many seconds to compile on their first run; this one takes a fraction of a second.
"""

import warp as wp

SIDE = 8
"""Points along each edge of the lattice."""


@wp.kernel
def count_touching(side: int, count: wp.array(dtype=int)):  # out
    """Neighbours at distance 1 of each point in a cubic lattice."""
    i, j, k = wp.tid()
    found = 0
    for axis in range(3):
        step = wp.vec3i(int(axis == 0), int(axis == 1), int(axis == 2))
        if i + step[0] < side and j + step[1] < side and k + step[2] < side:
            found += 1
        if i - step[0] >= 0 and j - step[1] >= 0 and k - step[2] >= 0:
            found += 1
    count[(i * side + j) * side + k] = found


def touching_pairs(device: str) -> int:
    """Pairs of points one apart in a cubic lattice of 8 x 8 x 8, counted on ``device``. The answer is 3 * 7 * 8 * 8."""
    count = wp.zeros(SIDE**3, dtype=int, device=device)
    wp.launch(count_touching, dim=(SIDE, SIDE, SIDE), inputs=[SIDE, count], device=device)
    return int(count.numpy().sum()) // 2
