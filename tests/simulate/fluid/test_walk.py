"""Launches over rows, alone and in walks that several threads share."""

import time
from typing import Any

import numpy as np
import pytest
import warp as wp

from simulate.fluid.launcher import Launcher
from simulate.fluid.walk import Extent, fixed
from simulate.fluid.walkers import FEWEST_ROWS, Walkers
from simulate.kernels import walk as code
from tests.support.device_loops import count_down, count_row

ROWS = 1003


def zeros(rows: int) -> Any:
    return wp.zeros(rows, dtype=int, device="cpu")


@pytest.fixture(params=["by table", "one by one"])
def way(request, monkeypatch) -> str:
    """By the table of compiled kernels, or as it is if Warp has other private names."""
    if request.param == "one by one":
        monkeypatch.setattr("simulate.fluid.walk.compiled_call", lambda *_: None)
    return request.param


@pytest.mark.parametrize("together", [1, 64, ROWS])
@pytest.mark.parametrize("threads", [1, 4])
@pytest.mark.parametrize("rows", [0, 17, ROWS])
def test_each_row_is_taken_once_and_none_beyond(threads, rows, together, way):
    """``rows`` of each walk are those that the array has when it comes by."""
    present, seen = wp.full(1, ROWS, int, device="cpu"), zeros(ROWS + 1)
    launcher = Launcher("cpu", Extent(present, together), threads)
    parts = (launcher.bind(count_row, seen),)
    launcher.walk(parts, ROWS)
    present.fill_(rows)
    for _ in range(3):
        launcher.walk(parts, ROWS)
    assert np.array_equal(seen.numpy(), 3 * (np.arange(ROWS + 1) < rows) + (np.arange(ROWS + 1) < ROWS))


def test_the_installed_warp_allows_walks():
    """Without them a run takes one core, and 2 % longer."""
    launcher, seen = Launcher("cpu", fixed(ROWS, "cpu"), 2), zeros(ROWS)
    parts = (launcher.bind(count_row, seen),)
    launcher.walk(parts, ROWS)
    assert launcher._walks[parts].table is not None


@pytest.mark.parametrize("threads", [1, 2, 4])
@pytest.mark.parametrize("turns", [0, 1, 5])
def test_a_repeated_part_is_taken_until_its_condition_is_0(threads, turns, way):
    launcher, left, (before, within, after) = Launcher("cpu", fixed(50, "cpu"), threads), zeros(1), map(zeros, [50] * 3)
    first, again, last = (launcher.bind(count_row, seen) for seen in (before, within, after))
    down = launcher.bind(count_down, left, extent=fixed(1, "cpu"))

    def loop(rows: int) -> None:
        def body() -> None:
            again(rows)
            down(1)

        launcher.repeat(left, body)

    for _ in range(20):
        left.fill_(turns)
        launcher.walk((first, loop, last), ROWS)
    assert (before.numpy() == 20).all()
    assert (within.numpy() == 20 * turns).all()
    assert (after.numpy() == 20).all()


@pytest.mark.parametrize("threads", [2, 4])
def test_a_launch_begins_after_all_slices_of_the_one_before(threads):
    """Each thread of many walks adds to rows that another thread had before, as slices change between two extents."""
    launcher, seen = Launcher("cpu", fixed(ROWS, "cpu"), threads), zeros(ROWS)
    parts = tuple(launcher.bind(count_row, seen, extent=fixed(ROWS, "cpu", together)) for together in (1, 400, 1, 700))
    for _ in range(2000):
        launcher.walk(parts, ROWS)
    assert (seen.numpy() == 8000).all()


def test_a_walk_does_not_wait_for_threads_that_do_not_come(monkeypatch):
    monkeypatch.setattr("simulate.fluid.walkers._follow", lambda *_: None)
    launcher, seen = Launcher("cpu", fixed(ROWS, "cpu"), 4), zeros(ROWS)
    launcher.walk((launcher.bind(count_row, seen),), ROWS)
    assert (seen.numpy() == 1).all()


def test_the_caller_goes_on_alone_for_a_while_after_another_thread_lost_its_core_for_long(monkeypatch):
    now_s = [0.0]
    monkeypatch.setattr("simulate.fluid.walkers.time.perf_counter", lambda: now_s[0])
    launcher, seen = Launcher("cpu", fixed(ROWS, "cpu"), 2), zeros(ROWS)
    parts = (launcher.bind(count_row, seen),)
    launcher.walk(parts, ROWS)
    walkers: Walkers = launcher._walkers
    command, lost_s = walkers._launch, [0.01, 0.01, 0.01, 0, 0, 0]

    class Late:
        """A launch that waits for a slice of another thread."""

        def launch(self) -> None:
            walkers._control[code.LOST] += round(lost_s.pop(0) * 1e6 / code.SPIN_US)
            command.launch()

    walkers._launch = Late()
    invited = []
    for now_s[0] in (1.0, 1.001, 1.002, 1.003, 1.29, 1.32):
        launcher.walk(parts, ROWS)
        invited.append(walkers._control[code.INVITED])
    # Losses of 10 ms cost 0.2 s each, and 0.3 s are to spare.
    assert invited == [2, 2, 1, 1, 1, 2]
    assert (seen.numpy() == 7).all()


def test_a_thread_without_a_walk_sleeps():
    launcher, seen = Launcher("cpu", fixed(ROWS, "cpu"), 2), zeros(ROWS)
    launcher.walk((launcher.bind(count_row, seen),), ROWS)
    control = launcher._walkers._control
    assert any(control[code.WORKERS + code.LINE + 1] or time.sleep(0.01) for _ in range(1000))


@pytest.mark.parametrize(("rows", "invited"), [(FEWEST_ROWS - 1, 1), (FEWEST_ROWS, 2)])
def test_the_caller_takes_few_rows_alone(rows, invited):
    launcher, seen = Launcher("cpu", fixed(ROWS, "cpu"), 2), zeros(ROWS)
    launcher.walk((launcher.bind(count_row, seen),), rows)
    assert launcher._walkers._control[code.INVITED] == invited
