"""Rows shared by threads: each is done once, in slices, and a fault in a thread reaches the caller."""

import numpy as np
import pytest
import warp as wp

from simulate.fluid.launcher import LEAST_SLICE, Launcher
from tests.kernels_rows import copy_row, count_row

ROWS = 5 * LEAST_SLICE + 7


def zeros(rows: int) -> wp.array:
    return wp.zeros(rows, dtype=int, device="cpu")


@pytest.mark.parametrize("threads", [1, 2, 4])
@pytest.mark.parametrize("rows", [0, 1, LEAST_SLICE, ROWS])
def test_each_row_is_done_once_and_none_beyond(threads, rows):
    launcher, seen = Launcher("cpu", threads), zeros(ROWS + 1)
    count = launcher.bind(count_row, seen)
    for _ in range(3):
        count(rows)
    assert np.array_equal(seen.numpy(), 3 * (np.arange(ROWS + 1) < rows))
    assert launcher.kernels == (3 if rows else 0)


def test_two_launches_of_one_kernel_keep_their_own_arguments():
    """Bound by name at the first call, as launches once were, the second would write to the first one's array."""
    launcher, one, other = Launcher("cpu"), zeros(5), zeros(5)
    for seen, times in ((one, 1), (other, 2)):
        count = launcher.bind(count_row, seen)
        for _ in range(times):
            count(5)
    assert (one.numpy() == 1).all()
    assert (other.numpy() == 2).all()


def test_launches_over_the_same_rows_follow_each_other_in_every_slice():
    launcher, seen, copied = Launcher("cpu", 2), zeros(ROWS), zeros(ROWS)
    count, copy = launcher.bind(count_row, seen), launcher.bind(copy_row, seen, copied)
    for turn in range(1, 20):
        launcher.launch(ROWS, count, copy)
        assert (copied.numpy() == turn).all()
    assert launcher.kernels == 2 * 19


@pytest.mark.parametrize("part", [0, 1])
def test_a_fault_in_a_thread_reaches_the_caller_once(part):
    """Also where the caller's own slice fails, while the other thread still works on its slice."""
    launcher, seen = Launcher("cpu", 2), zeros(ROWS)
    count = launcher.bind(count_row, seen)

    class Broken:
        def set_param_at_index(self, *_): ...
        def set_dim(self, _): ...
        def launch(self):
            raise ArithmeticError("in the thread")

    count.commands[part] = Broken()
    with pytest.raises(ArithmeticError, match="in the thread"):
        count(ROWS)
    seen.zero_()
    count = launcher.bind(count_row, seen)
    count(ROWS)
    assert (seen.numpy() == 1).all()
