"""Launches of kernels over the rows of the movers: recorded once, cut into slices where several threads share them."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import warp as wp

LEAST_SLICE = 500
"""Rows: below it handing a slice to a thread takes longer than the slice."""


class Launcher:
    """Repeats launches with the same arguments, whatever the number of rows.

    A name stands for a kernel with its arguments, bound by the first call: arrays are written to, never replaced.
    """

    def __init__(self, device: str, threads: int = 1) -> None:
        self._device = device
        self._commands: dict[str, list[Any]] = {}
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self.kernels = 0
        """Launched so far."""

    def rows(self, name: str, kernel: Any, rows: int, *inputs: object) -> None:
        """Over rows 0 to ``rows``; the kernel's first argument is a slice's first row, the rest are ``inputs``."""
        if rows == 0:
            return
        slices = min(self._threads, max(1, rows // LEAST_SLICE))
        commands = self._commands.setdefault(name, [])
        while len(commands) < slices:
            commands.append(wp.launch(kernel, 1, inputs=[0, *inputs], device=self._device, record_cmd=True))
        edges = [rows * part // slices for part in range(slices + 1)]
        for command, begin, end in zip(commands, edges, edges[1:], strict=False):
            command.set_param_at_index(0, begin)
            command.set_dim(end - begin)
        self.kernels += 1
        if slices == 1 or self._pool is None:
            commands[0].launch()
        else:
            list(self._pool.map(lambda command: command.launch(), commands[:slices]))

    def all(self, name: str, kernel: Any, dim: int | tuple[int, ...], *inputs: object) -> None:
        """A kernel without rows, in one piece."""
        if name not in self._commands:
            command = wp.launch(kernel, dim, inputs=list(inputs), device=self._device, record_cmd=True)
            self._commands[name] = [command]
        self.kernels += 1
        self._commands[name][0].launch()
