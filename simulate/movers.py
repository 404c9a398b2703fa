"""Who moves: the rows of every launch over particles, kept in the order of release."""

import warp as wp
from warp.utils import array_scan

from simulate import kernels_rest as device_code
from simulate.launch import Launcher
from simulate.state import State


class MoversList:
    """The particles that move, found anew whenever some were released, froze, fell asleep or woke."""

    def __init__(self, state: State, launcher: Launcher) -> None:
        self._state, self._launch = state, launcher
        self._moves = wp.zeros(state.count, dtype=int, device=state.device)
        self._row = wp.zeros(state.count, dtype=int, device=state.device)
        self.movers = device_code.Movers()
        self.movers.who = wp.zeros(state.count, dtype=int, device=state.device)
        self.movers.count = wp.zeros(1, dtype=int, device=state.device)
        self.movers.first_row = wp.zeros(state.runs + 1, dtype=int, device=state.device)

    def find(self) -> None:
        state = self._state
        self._launch.all("mark movers", device_code.mark_movers, state.count, state.fate, self._moves)
        array_scan(self._moves, self._row, inclusive=False)
        self._launch.all(
            "number movers",
            device_code.number_movers,
            state.count,
            state.points_a_run,
            state.fate,
            self._row,
            self.movers,
        )

    def number(self) -> int:
        """How many move, over all runs."""
        return int(self.movers.count.numpy()[0])
