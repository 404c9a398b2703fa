"""Rows shared by threads: each once, in slices, and faults told to who waits."""

import numpy as np
import pytest
import warp as wp

from simulate.launch import LEAST_SLICE, Launcher
from tests.kernels_rows import copy_row, count_row

ROWS = 5 * LEAST_SLICE + 7


def zeros(rows: int) -> wp.array:
    return wp.zeros(rows, dtype=int, device="cpu")


@pytest.mark.parametrize("threads", [1, 2, 4])
@pytest.mark.parametrize("rows", [0, 1, LEAST_SLICE, ROWS])
def test_each_row_is_done_once_and_none_beyond(threads, rows):
    launcher, seen = Launcher("cpu", threads), zeros(ROWS + 1)
    for _ in range(3):
        launcher.rows("count", count_row, rows, seen)
    launcher.rows_once(count_row, rows, seen)
    assert np.array_equal(seen.numpy(), 4 * (np.arange(ROWS + 1) < rows))
    assert launcher.kernels == (4 if rows else 0)


def test_a_slice_goes_through_all_launches_before_anybody_waits():
    launcher, seen, copied = Launcher("cpu", 2), zeros(ROWS), zeros(ROWS)
    for turn in range(1, 20):
        with launcher.slice_by_slice():
            launcher.rows("count", count_row, ROWS, seen)
            launcher.rows("copy", copy_row, ROWS, seen, copied)
            # Nothing has begun yet.
            assert seen.numpy()[0] == turn - 1
        assert (copied.numpy() == turn).all()


def test_what_goes_wrong_in_a_thread_reaches_who_waits():
    launcher = Launcher("cpu", 2)
    launcher.rows("count", count_row, ROWS, zeros(ROWS))

    class Broken:
        def set_param_at_index(self, *_): ...
        def set_dim(self, _): ...
        def launch(self):
            raise ArithmeticError("in the thread")

    launcher._commands["count"][1] = Broken()
    with pytest.raises(ArithmeticError, match="in the thread"):
        launcher.rows("count", count_row, ROWS)
