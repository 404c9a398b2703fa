"""Launches of kernels with fixed arguments, over rows that several threads share, and recordings of launches.

A GPU replays whole frames; one thread of a CPU replays parts of a substep.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from queue import SimpleQueue
from threading import Thread
from typing import Any

import warp as wp

from simulate.kernels.status import Span

_Answer = SimpleQueue[BaseException | None]
_Tasks = SimpleQueue[tuple[Any, _Answer] | None]
BLOCK = 64  # Threads of a GPU's block: with 256 the rows of one run occupy only ten of its processors
LEAST_SLICE = 3000  # Least rows of a slice: handing a smaller one to a thread takes longer than computing it
ROWS_ALIKE = 128  # Recordings are made for multiples of so many rows: empty rows cost less than more recordings
MOST_RECORDED = 8000  # Rows above which a CPU replays nothing: launches then take less than 2 % of a substep


class Launcher:
    """Binds kernels to their arguments once, so that a launch is cheap and a GPU can record it.

    Warp's kernels release Python's lock, so that threads can launch slices of the same rows at the same time. Passing a
    slice to another thread takes some 50 us on a virtual machine.
    """

    def __init__(self, device: str, threads: int = 1, lanes: int = 1) -> None:
        """``lanes`` is the number of a GPU's threads per row, for kernels with ``shared`` rows."""
        self.device, self._threads, self.lanes = device, threads, lanes
        self.helpers = [_Helper() for _ in range(threads - 1)]
        self.kernels = 0  # Number of launches so far, without the scans of Warp's own library

    def bind(self, kernel: Any, *inputs: object, shared: bool = False, lanes: int = 1) -> "RowLaunch":
        """Return a launch over rows. The kernel's arguments are the ``Span`` of a slice's rows, then ``inputs``.

        On a CPU one thread takes all rows of a slice, in a loop within the kernel: reading the arguments for each row
        would take up to a third of a kernel's time.

        On a GPU each row has a block of ``lanes`` threads; if the kernel's rows are ``shared``, of ``self.lanes``.

        The arrays among ``inputs`` may be written to later, but not replaced. Arrays of a struct may be replaced until
        a frame is recorded: each launch reads the struct again, but a recorded one does not.
        """
        lanes = self.lanes if shared else self._block(lanes)
        width = lanes if lanes > 1 else None
        commands = [self._record(kernel, [Span(), *inputs], width) for _ in range(self._threads)]
        return RowLaunch(self, commands, inputs, lanes)

    def bind_whole(self, kernel: Any, count: int, *inputs: object, lanes: int | None = None) -> Callable[[], None]:
        """Return a launch in one piece over ``count`` threads, or over ``count`` blocks of ``lanes`` threads.

        It is for kernels without rows. In blocks, ``wp.tid()`` is a block and its thread, and tiles add up. A CPU's
        blocks have one thread each, unless Warp is set to give them more. The module of ``kernel`` is compiled for each
        number of lanes.
        """
        width = None if lanes is None else self._block(lanes)
        return partial(self.bind_first(kernel, *inputs, width=width), count if width is None else (count, width))

    def _block(self, lanes: int) -> int:
        return 1 if self.device == "cpu" and not wp.config.enable_cpu_blocks else lanes

    def bind_first(self, kernel: Any, *inputs: object, width: int | None = None) -> Callable[[Any], None]:
        """Return a launch in one piece over the first points. Its argument is their number, or the launch's shape."""
        command = self._record(kernel, inputs, width)

        # Warp's command has addresses only; the default argument keeps the arrays alive.
        def launch(shape: int | tuple[int, int], _inputs: object = inputs) -> None:
            self.kernels += 1
            command.set_dim(shape)
            command.launch()

        return launch

    def _record(self, kernel: Any, inputs: Sequence[object], width: int | None) -> Any:
        width = width or (1 if self.device == "cpu" else BLOCK)
        return wp.launch(kernel, 1, inputs=list(inputs), device=self.device, record_cmd=True, block_dim=width)


class RowLaunch:
    """A kernel with its arguments, as one recorded command for each slice."""

    def __init__(self, launcher: Launcher, commands: list[Any], inputs: object, lanes: int) -> None:
        self._launcher, self.commands, self._lanes = launcher, commands, lanes
        self._slices = [(0, 0)] * len(commands)
        # Warp's commands have the addresses of arrays; this keeps the arrays alive.
        self._inputs = inputs

    def __call__(self, rows: int, each: float = 1.0, block: int = 1) -> None:
        """Launch over the rows from 0 to ``rows``, in a slice for each thread that do not wait for each other.

        The kernel must not read what it writes in other rows. ``each`` is the work for a row, relative to a particle's.
        Slices are whole blocks of ``block`` rows.
        """
        if not rows:
            return
        self._launcher.kernels += 1
        slices = min(len(self.commands), max(1, int(rows * each) // LEAST_SLICE))
        if slices == 1:
            self.cut(0, 0, rows).launch()
            return
        ends = [*(rows * part // slices // block * block for part in range(slices)), rows]
        with ExitStack() as busy:
            for part, helper in reversed(list(enumerate(self._launcher.helpers[: slices - 1], start=1))):
                helper.begin(self.cut(part, *ends[part : part + 2]))
                busy.callback(helper.finish)
            self.cut(0, *ends[:2]).launch()

    def cut(self, part: int, begin: int, end: int) -> Any:
        """Return the command of a part, for the rows from ``begin`` to ``end``."""
        command = self.commands[part]
        # Setting the slice takes as long as a launch, and most launches have the slice of the last one.
        if self._slices[part] != (begin, end):
            span = Span()
            span.begin, span.end = begin, end
            span.step = 1 if self._launcher.device == "cpu" else end - begin
            command.set_param_at_index(0, span)
            command.set_dim(span.step * self._lanes)
            self._slices[part] = begin, end
        return command


class Recordings:
    """The recordings of a solver. A recording has the addresses of arrays, which must not be replaced."""

    def __init__(self, device: str) -> None:
        self._device = device
        self.frame: Any = None
        """The recording of a frame, if any."""
        self.parts: dict[int, Any] = {}  # Recordings of parts of a substep, by the number of rows
        self.replays_parts = False
        """Set to True if parts of a substep may be replayed: all kernels must have been loaded."""

    def launch(self, rows: int, room: int, *parts: Callable[[int], None]) -> None:
        """Launch the parts of a substep in order, over ``rows`` of at most ``room``. A recording launches all at once.

        It has up to ``ROWS_ALIKE`` more rows; those without a mover end immediately.
        """
        if not self.replays_parts or rows > MOST_RECORDED:
            for part in parts:
                part(rows)
            return
        alike = min(-(-rows // ROWS_ALIKE) * ROWS_ALIKE, room)
        if alike not in self.parts:
            self.parts[alike] = self.record(lambda: [part(alike) for part in parts])
        wp.capture_launch(self.parts[alike])

    def record(self, compute: Callable[[], object]) -> Any:
        # Modules must not be loaded during a recording, least of all those for CPUs; all are loaded before.
        with wp.ScopedCapture(device=self._device, force_module_load=False) as capture:
            compute()
        return capture.graph


class _Helper:
    """A thread that launches commands, and ends with the launcher.

    An executor with futures takes three times as long, for each of forty launches per frame.
    """

    def __init__(self) -> None:
        self._tasks: _Tasks = SimpleQueue()
        self._answer: _Answer = SimpleQueue()
        Thread(target=_help, args=(self._tasks,), daemon=True).start()

    def begin(self, command: Any) -> None:
        """Pass a command to the thread. Its answer has a new queue: after Ctrl-C the old one may not be empty."""
        self._answer = SimpleQueue()
        self._tasks.put((command, self._answer))

    def finish(self) -> None:
        """Wait for the launches. Raises the exception of a launch, if any."""
        if (fault := self._answer.get()) is not None:
            raise fault

    def __del__(self) -> None:
        self._tasks.put(None)


def _help(tasks: _Tasks) -> None:
    while (task := tasks.get()) is not None:
        command, answer = task
        try:
            command.launch()
        except BaseException as fault:  # All kinds, because the caller waits for an answer
            answer.put(fault)
        else:
            answer.put(None)
