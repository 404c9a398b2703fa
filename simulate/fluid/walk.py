"""Walks: lists of launches over rows, which are made once and then run in order as often as needed."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import warp as wp

from simulate.fluid.compiled_calls import CompiledCall, compiled_call


@dataclass(frozen=True)
class Extent:
    """Rows of a launch in a walk."""

    count: wp.array[int]
    """Number of rows, as an array with one value. It is read when the walk reaches the launch."""
    together: int = 1
    """Slices end at multiples of this number of rows."""


def fixed(count: int, device: str, together: int = 1) -> Extent:
    """Return an extent with a constant number of rows."""
    return Extent(wp.full(1, count, int, device), together)


class Launch(Protocol):
    """A recorded launch of one kernel over rows, as a step of a walk."""

    command: Any
    extent: Extent

    def __call__(self, rows: int) -> None: ...


@dataclass(frozen=True)
class Jump:
    """Jump to step ``target`` if ``condition`` is not 0 (for ``wanted`` True) or if it is 0 (for ``wanted`` False)."""

    condition: wp.array[int]
    target: int
    wanted: bool


class KernelTable(NamedTuple):
    """Address and length of a table of compiled kernels for ``kernels.walk``, and address of the launches' bounds."""

    lines: int
    length: int
    bounds: int


class Walk:
    """Steps that are made in order. Their table contains arguments for each of the ``slices`` parts of a launch."""

    def __init__(self, steps: Sequence[Launch | Jump], slices: int) -> None:
        self._steps, self._calls = steps, list[CompiledCall]()  # Kept alive, as the table has only addresses
        self.table: KernelTable | None = None
        """Table of the steps. None if this version of Warp uses other private names."""
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
