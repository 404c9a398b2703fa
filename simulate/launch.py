"""Launches of kernels over the rows of the movers: recorded once, cut into slices where several threads share them."""

from queue import SimpleQueue
from threading import Thread
from typing import Any

import warp as wp

LEAST_SLICE = 3000
"""Rows: below it handing a slice to a thread takes longer than the slice."""


class _Helper:
    """A thread that launches what it is handed. Warp's kernels leave Python's lock to others while they run."""

    def __init__(self) -> None:
        self._given: SimpleQueue[Any] = SimpleQueue()
        self._done: SimpleQueue[BaseException | None] = SimpleQueue()
        Thread(target=self._work, daemon=True).start()

    def begin(self, command: Any) -> None:
        self._given.put(command)

    def finish(self) -> None:
        """Wait for what was begun; raises what it raised."""
        if (fault := self._done.get()) is not None:
            raise fault

    def end(self) -> None:
        self._given.put(None)

    def _work(self) -> None:
        while (command := self._given.get()) is not None:
            try:
                command.launch()
            except BaseException as fault:
                # It belongs to the thread that waits, which would else wait for ever.
                self._done.put(fault)
            else:
                self._done.put(None)


class Launcher:
    """Repeats launches with the same arguments, whatever the number of rows.

    A name stands for a kernel with its arguments, bound by the first call: arrays are written to, never replaced.
    """

    def __init__(self, device: str, threads: int = 1) -> None:
        self._device = device
        self._commands: dict[str, list[Any]] = {}
        self._helpers = [_Helper() for _ in range(threads - 1)]
        self.kernels = 0
        """Launched so far; scans and sorts of Warp's own library are not counted."""

    def rows(self, name: str, kernel: Any, rows: int, *inputs: object) -> None:
        """Over rows 0 to ``rows``; the kernel's first argument is a slice's first row, the rest are ``inputs``."""
        if rows == 0:
            return
        slices = min(1 + len(self._helpers), max(1, rows // LEAST_SLICE))
        commands = self._commands.setdefault(name, [])
        while len(commands) < slices:
            commands.append(wp.launch(kernel, 1, inputs=[0, *inputs], device=self._device, record_cmd=True))
        edges = [rows * part // slices for part in range(slices + 1)]
        for command, begin, end in zip(commands, edges, edges[1:], strict=False):
            command.set_param_at_index(0, begin)
            command.set_dim(end - begin)
        self.kernels += 1
        helpers = self._helpers[: slices - 1]
        for helper, command in zip(helpers, commands[1:], strict=False):
            helper.begin(command)
        commands[0].launch()
        for helper in helpers:
            helper.finish()

    def all(self, name: str, kernel: Any, dim: int | tuple[int, ...], *inputs: object) -> None:
        """A kernel without rows, in one piece."""
        if name not in self._commands:
            command = wp.launch(kernel, dim, inputs=list(inputs), device=self._device, record_cmd=True)
            self._commands[name] = [command]
        self.kernels += 1
        self._commands[name][0].launch()

    def __del__(self) -> None:
        for helper in self._helpers:
            helper.end()
