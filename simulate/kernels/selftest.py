"""Device code of the doctor's test that this machine compiles and runs kernels."""

import warp as wp


@wp.kernel
def count_pairs(
    side: int,
    step_i: int,
    step_j: int,
    step_k: int,
    count: wp.array(dtype=int),  # out
):
    """Count each point of a cubic lattice that has another one step away."""
    i, j, k = wp.tid()
    if i + step_i < side and j + step_j < side and k + step_k < side:
        count[(i * side + j) * side + k] += 1


@wp.kernel
def count_turn(
    at_most: int,
    turns: wp.array[int],  # in, out
    more: wp.array[int],  # out
):
    """One turn of a loop that the device ends by itself."""
    turns[0] = turns[0] + 1
    if turns[0] < at_most:
        more[0] = 1
    else:
        more[0] = 0
