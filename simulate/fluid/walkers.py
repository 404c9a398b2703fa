"""Threads of a CPU that share the launches of walks."""

import os
import sys
import time
from queue import SimpleQueue
from threading import Thread, get_native_id
from typing import Any

import warp as wp

from simulate.fluid.compiled_calls import yield_function
from simulate.fluid.walk import Walk
from simulate.kernels import walk as code

ALONE, SPARE_S = 20, 0.3
"""If other programs use the cores of the background threads, the caller has to wait. It then works alone for ``ALONE``
times the waiting time, minus ``SPARE_S`` seconds. Rare waits are tolerated, because they cost less time than the
background threads save."""
FEWEST_ROWS = 256  # With fewer rows, only one thread works, because a second thread would save no time
LOWEST = 19  # Niceness of the background threads on Linux, so that they do not take the caller's core


def slices_for(threads: int) -> int:
    """Return the number of slices of a launch: two per thread, or one if there is only one thread."""
    return 1 if threads == 1 else 2 * threads


class Walkers:
    """The caller's thread and ``threads`` - 1 background threads. The background threads end with this object.

    The background threads process slices of a walk while they have a core. The caller processes the remaining slices.
    """

    def __init__(self, threads: int) -> None:
        self._begin: list[SimpleQueue[bool]] = [SimpleQueue() for _ in range(1, threads)]
        self._threads, slices = threads, slices_for(threads)
        shared = code.Control()
        shared.words = wp.zeros(code.WORKERS + code.LINE * slices, wp.uint64, device="cpu")
        self._control = control = shared.words.numpy()
        control[code.STATE] = 1 << 32 | code.DONE
        control[code.YIELD] = yield_function()
        self._left = [code.WORKERS + code.LINE * worker + 1 for worker in range(1, threads)]
        control[self._left] = 1
        self._alone_until_s = 0.0  # Time of ``time.perf_counter``
        launches: list[Any] = [
            wp.launch(code.walk_table, 1, [shared, worker, threads, slices], device="cpu", block_dim=1, record_cmd=True)
            for worker in range(threads)
        ]
        self._launch, *others = launches
        for begin, launch in zip(self._begin, others, strict=True):
            Thread(target=_follow, args=(begin, launch), daemon=True).start()

    def take(self, walk: Walk, rows: int) -> None:
        """Make the launches of a walk. Most launches have ``rows`` rows."""
        if walk.table is None:
            walk.launch_each()
            return
        control = self._control
        control[code.TABLE], control[code.LINES], control[code.BOUNDS] = walk.table
        alone = rows < FEWEST_ROWS or time.perf_counter() < self._alone_until_s
        control[code.INVITED] = 1 if alone else self._threads
        if not alone:
            for left, begin in zip(self._left, self._begin, strict=True):
                if control[left]:
                    control[left] = 0
                    begin.put(True)
        lost = control[code.LOST]
        self._launch.launch()
        if control[code.LOST] != lost:
            lost_s = float(control[code.LOST] - lost) * code.SPIN_US * 1e-6
            self._alone_until_s = max(self._alone_until_s, time.perf_counter() - SPARE_S) + ALONE * lost_s

    def __del__(self) -> None:
        for begin in self._begin:
            begin.put(False)


def _follow(begin: "SimpleQueue[bool]", launch: Any) -> None:
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, get_native_id(), LOWEST)
    while begin.get():
        launch.launch()
