"""Launch kernels with fixed arguments: one by one, in walks on the threads of a CPU, or in a recorded frame.

A walk is a list of launches, which the threads of a CPU process together.
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import warp as wp

from simulate.fluid.walk import Extent, Jump, Launch, Walk
from simulate.fluid.walkers import Walkers, slices_for
from simulate.kernels.status import Span

BLOCK = 64  # Threads of a GPU's block. With 256, the rows of a run would occupy only ten processors.


class Launcher:
    """Binds kernels to their arguments once, so that a launch takes little time and a GPU can record it."""

    def __init__(self, device: str, rows: Extent, threads: int = 1, lanes: int = 1) -> None:
        """Prepare launches on a device.

        ``rows`` is the extent of launches in a walk. ``lanes`` is the number of GPU threads that share a row.
        """
        self.device, self._threads, self.lanes, self._rows = device, threads, lanes, rows
        self._walks: dict[tuple[Any, ...], Walk] = {}
        self._steps: list[Launch | Jump] | None = None  # Steps of the walk that is being listed
        self.kernels = 0  # Number of launches and walks so far, without the scans of Warp's library

    @cached_property
    def _walkers(self) -> Walkers:
        return Walkers(self._threads)

    def bind(
        self, kernel: Any, *inputs: object, shared: bool = False, lanes: int = 1, extent: Extent | None = None
    ) -> "RowLaunch":
        """Return a launch over rows. The kernel's arguments are the ``Span`` of a slice's rows, then ``inputs``.

        On a CPU, one thread processes all rows of a slice in a loop within the kernel. Reading the arguments for each
        row would take up to a third of a kernel's time. In a row, the kernel must not read values that it writes in
        other rows.

        On a GPU, each row has a block of ``lanes`` threads. If ``shared`` is True, the block has ``self.lanes``
        threads.

        In a walk, ``extent`` defines the rows. Default: the launcher's extent.

        The arrays among ``inputs`` may be written to later, but not replaced. Arrays of a struct may be replaced until
        a frame is recorded or a walk is listed, because each launch reads the struct again.
        """
        lanes = self.lanes if shared else self._block(lanes)
        command = self._record(kernel, [Span(), *inputs], lanes if lanes > 1 else None)
        return RowLaunch(self, command, inputs, lanes, extent or self._rows)

    def _block(self, lanes: int) -> int:
        return 1 if self.device == "cpu" and not wp.config.enable_cpu_blocks else lanes

    def bind_first(self, kernel: Any, *inputs: object) -> Callable[[int], None]:
        """Return a launch of a kernel over the first n points. The argument of the launch is n."""
        command = self._record(kernel, inputs, None)

        # Warp's command contains only addresses. The default argument keeps the arrays alive.
        def launch(points: int, _inputs: object = inputs) -> None:
            self.kernels += 1
            command.set_dim(points)
            command.launch()

        return launch

    def _record(self, kernel: Any, inputs: Sequence[object], width: int | None) -> Any:
        width = width or (1 if self.device == "cpu" else BLOCK)
        return wp.launch(kernel, 1, inputs=list(inputs), device=self.device, record_cmd=True, block_dim=width)

    def walk(self, parts: tuple[Callable[[int], object], ...], rows: int) -> None:
        """Launch the kernels of all parts in order, on a CPU on all threads. Each part is called with ``rows``.

        On a CPU, the parts of a tuple are called only once, to list their launches. They must do nothing but launch.
        """
        if self.device != "cpu":
            for part in parts:
                part(rows)
            return
        if parts not in self._walks:
            self._steps = steps = []
            try:
                for part in parts:
                    part(rows)
            finally:
                self._steps = None
            self._walks[parts] = Walk(steps, slices_for(self._threads))
        self.kernels += 1
        self._walkers.take(self._walks[parts], rows)

    def forget_walks(self) -> None:
        """Delete the lists of all walks. Call this if arrays were replaced.

        The launches of a walk are listed again when the walk is next needed.
        """
        self._walks.clear()

    def repeat(self, condition: wp.array[int], launch: Callable[[], object]) -> None:
        """Repeat a launch while ``condition``, an array with one value, is not 0."""
        if (steps := self._steps) is None:
            wp.capture_while(condition, launch)
            return
        begin = len(steps) + 1
        steps.append(Jump(condition, begin, wanted=True))
        launch()
        steps.append(Jump(condition, begin, wanted=True))
        steps[begin - 1] = Jump(condition, len(steps), wanted=False)

    def lists(self, step: "RowLaunch") -> bool:
        """Add a launch to the walk that is being listed. Returns False if no walk is being listed."""
        if self._steps is not None:
            self._steps.append(step)
        return self._steps is not None


class RowLaunch:
    """A kernel with its arguments, as a recorded command."""

    def __init__(self, launcher: Launcher, command: Any, inputs: object, lanes: int, extent: Extent) -> None:
        self._launcher, self.command, self._lanes, self.extent = launcher, command, lanes, extent
        self._rows = 0
        # Warp's command contains only addresses. This keeps the arrays alive.
        self._inputs = inputs

    def __call__(self, rows: int) -> None:
        """Launch over the rows from 0 to ``rows``, or add the launch to the walk that is being listed."""
        if self._launcher.lists(self) or not rows:
            return
        self._launcher.kernels += 1
        # Setting the rows takes as long as a launch. Most launches have the same rows as the launch before.
        if self._rows != rows:
            span = Span()
            span.begin, span.end = 0, rows
            span.step = 1 if self._launcher.device == "cpu" else rows
            self.command.set_param_at_index(0, span)
            self.command.set_dim(span.step * self._lanes)
            self._rows = rows
        self.command.launch()


def record(device: str, compute: Callable[[], object]) -> Any:
    """Return a recording of the launches of ``compute``. ``wp.capture_launch`` replays it.

    The recording contains the addresses of arrays, so these arrays must not be replaced.
    """
    # Modules must not be loaded during a recording. They were all loaded before.
    with wp.ScopedCapture(device=device, force_module_load=False) as capture:
        compute()
    return capture.graph
