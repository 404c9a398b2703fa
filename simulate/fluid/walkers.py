"""The threads of a CPU that share the launches of walks."""

from queue import SimpleQueue
from threading import Thread
from typing import Any

import warp as wp

from simulate.fluid.compiled_calls import yield_function
from simulate.fluid.walk import Walk
from simulate.kernels import walk as code

FEWEST_ALONE, MOST_ALONE = 8, 512
"""Numbers of walks that the caller makes alone after another thread lost its core to other work: the fewest take some
5 ms. They double each time."""


def slices_for(threads: int) -> int:
    """Return the number of slices of a launch: two for each of several threads."""
    return 1 if threads == 1 else 2 * threads


class Walkers:
    """The caller's thread and, in the background, ``threads`` - 1 others, which end with this object.

    The others take slices of a walk while they have a core. The caller takes those that are left.
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
        self._alone, self._next_alone = 0, FEWEST_ALONE  # Walks to make alone, now and after the next loss of a core
        launches: list[Any] = [
            wp.launch(code.walk_table, 1, [shared, worker, threads, slices], device="cpu", block_dim=1, record_cmd=True)
            for worker in range(threads)
        ]
        self._launch, *others = launches
        for begin, launch in zip(self._begin, others, strict=True):
            Thread(target=_follow, args=(begin, launch), daemon=True).start()

    def take(self, walk: Walk) -> None:
        """Make the launches of a walk."""
        if walk.table is None:
            walk.launch_each()
            return
        control = self._control
        control[code.TABLE], control[code.LINES], control[code.BOUNDS] = walk.table
        alone = self._alone > 0
        control[code.INVITED] = 1 if alone else self._threads
        if alone:
            self._alone -= 1
        else:
            for left, begin in zip(self._left, self._begin, strict=True):
                if control[left]:
                    control[left] = 0
                    begin.put(True)
        late = control[code.LATE]
        self._launch.launch()
        if control[code.LATE] != late:
            self._alone, self._next_alone = self._next_alone, min(2 * self._next_alone, MOST_ALONE)
        elif not alone:
            self._next_alone = max(FEWEST_ALONE, self._next_alone - 1)

    def __del__(self) -> None:
        for begin in self._begin:
            begin.put(False)


def _follow(begin: "SimpleQueue[bool]", launch: Any) -> None:
    while begin.get():
        launch.launch()
