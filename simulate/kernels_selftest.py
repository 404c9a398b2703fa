"""Device code of the doctor's question: can this machine compile and run a kernel?"""

import warp as wp


@wp.kernel
def count_pairs(
    side: int,
    step_i: int,
    step_j: int,
    step_k: int,
    count: wp.array(dtype=int),  # out
):
    """Whether a point of a cubic lattice has another one step away."""
    i, j, k = wp.tid()
    if i + step_i < side and j + step_j < side and k + step_k < side:
        count[(i * side + j) * side + k] += 1
