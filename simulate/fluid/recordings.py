"""Launches that are recorded once and then replayed: a GPU's frames, and on one thread of a CPU parts of a substep."""

from collections.abc import Callable
from typing import Any

import warp as wp

ROWS_ALIKE = 128  # Recordings are made for multiples of so many rows: empty rows cost less than more recordings
MOST_RECORDED = 8000  # Rows above which a CPU replays nothing: launches then take less than 2 % of a substep


class Recordings:
    """The recordings of a solver. A recording has the addresses of arrays, which must not be replaced."""

    def __init__(self, device: str) -> None:
        self._device = device
        self._frame: Any = None
        self._parts: dict[int, Any] = {}  # By the number of rows
        self.replays_parts = False
        """Set to True if parts of a substep may be replayed: all kernels must have been loaded."""

    @property
    def has_frame(self) -> bool:
        return self._frame is not None

    def record_frame(self, compute: Callable[[], object]) -> None:
        self._frame = self._record(compute)

    def replay_frame(self) -> None:
        wp.capture_launch(self._frame)

    def launch(self, rows: int, room: int, *parts: Callable[[int], None]) -> None:
        """Launch the parts of a substep in order, over ``rows`` of at most ``room``. A recording launches all at once.

        It has up to ``ROWS_ALIKE`` more rows; those without a mover end immediately.
        """
        if not self.replays_parts or rows > MOST_RECORDED:
            for part in parts:
                part(rows)
            return
        alike = min(-(-rows // ROWS_ALIKE) * ROWS_ALIKE, room)
        if alike not in self._parts:
            self._parts[alike] = self._record(lambda: [part(alike) for part in parts])
        wp.capture_launch(self._parts[alike])

    def forget_parts(self) -> None:
        """Forget recordings of parts, since an array is replaced."""
        self._parts.clear()

    def _record(self, compute: Callable[[], object]) -> Any:
        # Modules must not be loaded during a recording, least of all those for CPUs; all are loaded before.
        with wp.ScopedCapture(device=self._device, force_module_load=False) as capture:
            compute()
        return capture.graph
