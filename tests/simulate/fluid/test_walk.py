"""Launches of kernels over rows, singly and in sequences (walks) that several threads share."""

from typing import Any

import numpy as np
import pytest
import warp as wp

from simulate.fluid.launcher import Launcher
from simulate.fluid.walk import Extent, fixed
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
def test_a_launch_on_any_number_of_threads_processes_each_row_once(threads, rows, together, way):
    """``rows`` is the array's number of rows at the time of the launch; rows beyond it are left out."""
    present, seen = wp.full(1, ROWS, int, device="cpu"), zeros(ROWS + 1)
    launcher = Launcher("cpu", Extent(present, together), threads)
    parts = (launcher.bind(count_row, seen),)
    launcher.walk(parts, ROWS)
    present.fill_(rows)
    for _ in range(3):
        launcher.walk(parts, ROWS)
    assert np.array_equal(seen.numpy(), 3 * (np.arange(ROWS + 1) < rows) + (np.arange(ROWS + 1) < ROWS))


def test_the_installed_warp_provides_its_table_of_compiled_kernels():
    """Without the table a run uses one core and takes 2 % longer."""
    launcher, seen = Launcher("cpu", fixed(ROWS, "cpu"), 2), zeros(ROWS)
    parts = (launcher.bind(count_row, seen),)
    launcher.walk(parts, ROWS)
    assert launcher._walks[parts].table is not None


@pytest.mark.parametrize("threads", [1, 2, 4])
@pytest.mark.parametrize("turns", [0, 1, 5])
def test_a_loop_of_launches_repeats_until_its_condition_is_0(threads, turns, way):
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
