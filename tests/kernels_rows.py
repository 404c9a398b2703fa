"""Device code for tests: what a row of a launch sees."""

import warp as wp


@wp.kernel(enable_backward=False)
def count_row(begin: int, seen: wp.array[int]):
    row = begin + wp.tid()
    seen[row] = seen[row] + 1


@wp.kernel(enable_backward=False)
def copy_row(begin: int, seen: wp.array[int], copied: wp.array[int]):
    row = begin + wp.tid()
    copied[row] = seen[row]
