"""Rows shared by threads: each is done once, in slices, and a fault in a thread reaches the caller."""

import signal
import threading
import time

import numpy as np
import pytest
import warp as wp

from simulate.fluid.launcher import LEAST_SLICE, Launcher
from tests.kernels import count_row
from tests.programs import interruptible

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


class Broken:
    """A part of a launch that fails, whatever slice it is given."""

    def __init__(self, before=lambda: None):
        self._before = before

    def set_param_at_index(self, *_): ...
    def set_dim(self, _): ...
    def launch(self):
        self._before()
        raise ArithmeticError("in the thread")


@pytest.mark.parametrize("parts", [(0,), (1,), (1, 3), (0, 2)])
def test_a_fault_in_a_thread_reaches_the_caller_once(parts):
    """Also where the caller's own slice fails, while other threads still work on theirs, and where two of them do.

    Broken on purpose, with the threads after the first fault not waited for, the last launch raises the second fault.
    """
    launcher, seen = Launcher("cpu", 4), zeros(ROWS)
    count = launcher.bind(count_row, seen)
    for part in parts:
        count.commands[part] = Broken()
    with pytest.raises(ArithmeticError, match="in the thread"):
        count(ROWS)
    check_next(launcher, seen)


def test_a_launch_after_one_that_was_interrupted_waits_for_its_own_threads():
    """Ctrl-C reaches the caller while it waits; the thread goes on, and ends with a fault that nobody asks for."""
    launcher, seen = Launcher("cpu", 2), zeros(ROWS)
    count = launcher.bind(count_row, seen)

    def interrupt() -> None:
        time.sleep(0.05)
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
        time.sleep(0.2)

    count.commands[1] = Broken(interrupt)
    with interruptible(), pytest.raises(KeyboardInterrupt):
        count(ROWS)
    check_next(launcher, seen)


def check_next(launcher: Launcher, seen: wp.array) -> None:
    seen.zero_()
    launcher.bind(count_row, seen)(ROWS)
    assert (seen.numpy() == 1).all()
