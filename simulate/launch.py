"""Launches of kernels over the rows of the movers: recorded once, cut into slices where several threads share them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from queue import SimpleQueue
from threading import Thread
from typing import Any

import warp as wp

LEAST_SLICE = 3000
"""Rows: below it handing a slice to a thread takes longer than the slice."""


class _Helper:
    """A thread that launches what it is handed. Warp's kernels leave Python's lock to others while they run.

    To hand something over takes some 50 us on a virtual machine: a substep hands over as seldom as it can.
    """

    def __init__(self) -> None:
        self._given: SimpleQueue[Any] = SimpleQueue()
        self._done: SimpleQueue[BaseException | None] = SimpleQueue()
        Thread(target=self._work, daemon=True).start()

    def begin(self, commands: Sequence[Any]) -> None:
        self._given.put(commands)

    def finish(self) -> None:
        """Wait for what was begun; raises what it raised."""
        if (fault := self._done.get()) is not None:
            raise fault

    def end(self) -> None:
        self._given.put(None)

    def _work(self) -> None:
        while (commands := self._given.get()) is not None:
            try:
                for command in commands:
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
        self._held: list[list[Any]] | None = None
        self.kernels = 0
        """Launched so far; scans and sorts of Warp's own library are not counted."""

    def rows(self, name: str, kernel: Any, rows: int, *inputs: object) -> None:
        """Over rows 0 to ``rows``; the kernel's first argument is a slice's first row, the rest are ``inputs``."""
        edges = self._edges(rows)
        commands = self._commands.setdefault(name, [])
        while len(commands) < len(edges) - 1:
            commands.append(self._record(kernel, inputs))
        self._share(commands, edges)

    def rows_once(self, kernel: Any, rows: int, *inputs: object) -> None:
        """The same for arguments that change from call to call: nothing is kept."""
        edges = self._edges(rows)
        self._share([self._record(kernel, inputs) for _ in edges[1:]], edges)

    @contextmanager
    def slice_by_slice(self) -> Iterator[None]:
        """Launches over the same rows within it follow each other in each slice, and no slice waits for another.

        So none of them may read of other rows what another one writes.
        """
        self._held = []
        try:
            yield
            held = self._held
        finally:
            self._held = None
        if held:
            self._begin_and_finish([*zip(*held, strict=True)])

    def _record(self, kernel: Any, inputs: Sequence[object]) -> Any:
        return wp.launch(kernel, 1, inputs=[0, *inputs], device=self._device, record_cmd=True)

    def _edges(self, rows: int) -> list[int]:
        """Of the slices; no slice where there is no row."""
        slices = min(1 + len(self._helpers), max(1, rows // LEAST_SLICE)) if rows else 0
        return [rows * part // slices for part in range(slices + 1)] if slices else [0]

    def _share(self, commands: Sequence[Any], edges: Sequence[int]) -> None:
        if len(edges) == 1:
            return
        commands = commands[: len(edges) - 1]
        for command, begin, end in zip(commands, edges, edges[1:], strict=False):
            command.set_param_at_index(0, begin)
            command.set_dim(end - begin)
        self.kernels += 1
        if self._held is None:
            self._begin_and_finish([(command,) for command in commands])
        else:
            self._held.append([*commands])

    def _begin_and_finish(self, slices: Sequence[Sequence[Any]]) -> None:
        helpers = self._helpers[: len(slices) - 1]
        for helper, commands in zip(helpers, slices[1:], strict=True):
            helper.begin(commands)
        for command in slices[0]:
            command.launch()
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
