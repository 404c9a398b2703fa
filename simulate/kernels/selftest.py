"""Device code of 'sealtwin doctor', which tests whether this machine can compile and run kernels."""

import warp as wp


@wp.kernel
def count_pairs(
    side: int,
    step_i: int,
    step_j: int,
    step_k: int,
    count: wp.array(dtype=int),  # out
):
    """Count the points of a cubic lattice that have another point one step away."""
    i, j, k = wp.tid()
    if i + step_i < side and j + step_j < side and k + step_k < side:
        count[(i * side + j) * side + k] += 1


@wp.kernel
def count_turn(
    at_most: int,
    turns: wp.array[int],  # in, out
    more: wp.array[int],  # out
):
    """Count a repetition of a loop. The device ends the loop after ``at_most`` repetitions."""
    turns[0] = turns[0] + 1
    if turns[0] < at_most:
        more[0] = 1
    else:
        more[0] = 0
