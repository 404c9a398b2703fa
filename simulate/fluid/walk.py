"""Launches over rows that are listed once and then made in order, again and again: a walk."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import warp as wp

from simulate.fluid.compiled_calls import CompiledCall, compiled_call


@dataclass(frozen=True)
class Extent:
    """The rows of a launch in a walk."""

    count: wp.array[int]
    """Their number: the only value of an array, which is read when the walk comes to the launch."""
    together: int = 1
    """Slices end at multiples of so many rows."""


def fixed(count: int, device: str, together: int = 1) -> Extent:
    """Return an extent of always so many rows."""
    return Extent(wp.full(1, count, int, device), together)


class Launch(Protocol):
    """A recorded launch of one kernel over rows, as a step of a walk."""

    command: Any
    extent: Extent

    def __call__(self, rows: int) -> None: ...


@dataclass(frozen=True)
class Jump:
    """A jump to another step if ``condition`` is not 0 (``wanted``) or if it is 0 (not ``wanted``)."""

    condition: wp.array[int]
    target: int
    wanted: bool


class KernelTable(NamedTuple):
    """Addresses of a table of compiled kernels, as ``kernels.walk`` reads it, and of the bounds of each launch."""

    lines: int
    length: int
    bounds: int


class Walk:
    """Steps that are made in order. A table of them has the arguments of ``slices`` slices of each launch."""

    def __init__(self, steps: Sequence[Launch | Jump], slices: int) -> None:
        self._steps, self._calls = steps, list[CompiledCall]()  # Calls are kept alive: the table has addresses only
        self.table: KernelTable | None = None
        """The table; None if this version of Warp has other private names."""
        lines: list[list[Any]] = []
        for step in steps:
            if isinstance(step, Jump):
                lines.append([0, step.condition.ptr, step.target, step.wanted, *[0] * slices])
                continue
            call = compiled_call(step.command, slices)
            if call is None:
                return
            self._calls.append(call)
            arguments = map(ctypes.addressof, call.arguments)
            lines.append([call.function, step.extent.count.ptr, step.extent.together, 0, *arguments])
        self._words = np.array(lines, np.uint64)
        self.table = KernelTable(self._words.ctypes.data, len(lines), ctypes.addressof(self._calls[0].bounds))

    def launch_each(self) -> None:
        """Make the launches one by one, on one thread."""
        number = 0
        while number < len(self._steps):
            step = self._steps[number]
            number += 1
            if isinstance(step, Jump):
                number = step.target if bool(step.condition.numpy()[0]) == step.wanted else number
            else:
                step(int(step.extent.count.numpy()[0]))
