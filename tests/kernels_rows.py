"""Device code for tests: what a row of a launch sees."""

import warp as wp

from simulate.kernels.status import Span


@wp.kernel(enable_backward=False)
def count_row(rows: Span, seen: wp.array[int]):
    for row in range(rows.begin + wp.tid(), rows.end, rows.step):
        seen[row] = seen[row] + 1


@wp.kernel(enable_backward=False)
def copy_row(rows: Span, seen: wp.array[int], copied: wp.array[int]):
    for row in range(rows.begin + wp.tid(), rows.end, rows.step):
        copied[row] = seen[row]
