"""Collect statistics while runs are computed: density errors, moving particles, iterations of the viscosity solve."""

from array import array
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.records import Integers
from simulate.fluid.solver import FluidSolver


class RunStatistics:
    """Statistics of each run, from the frames in which particles move."""

    def __init__(self, runs: int) -> None:
        self._runs = runs
        self.density: list[NDArray[np.floating]] = []  # Density errors of the moving particles in sampled frames
        self.owner: list[NDArray[np.integer]] = []  # Run of each of these particles, ascending within a sample
        self.solves = array("q")  # Number of iterations by substep and run. Empty if frames are replayed.
        self.moving = array("q")  # Number of moving particles by frame and run
        self.neighbours = np.zeros(runs, np.int64)  # Length of the longest neighbour list, by run
        self.frames_s = 0.0

    def add(self, engine: FluidSolver, solves: Sequence[Integers], sampled: bool) -> None:
        for iterations in solves:
            self.solves.extend(iterations.tolist())
        moving = np.diff(engine.state.particles.first_row.numpy())
        self.moving.extend(moving.tolist())
        if sampled:
            mover = engine.state.particles.mover.numpy()[: moving.sum()]
            owner = mover // engine.state.particles_per_run
            self.owner.append(owner)
            self.density.append(np.maximum(engine.state.density.numpy()[mover] - 1.0, 0.0))
            np.maximum.at(self.neighbours, owner, engine.lists.fluid_count.numpy()[: len(mover)])

    def snapshot(self) -> dict[str, NDArray[Any]]:
        return {
            "seen_density": np.concatenate([np.zeros(0, np.float32), *self.density]),
            "seen_owner": np.concatenate([np.zeros(0, np.int32), *self.owner]),
            "seen_solves": np.array(self.solves, np.int64),
            "seen_moving": np.array(self.moving, np.int64),
            "seen_neighbours": self.neighbours.copy(),
            "seen_frames_s": np.array(self.frames_s),
        }

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        sampled, owner = len(snapshot["seen_density"]) > 0, snapshot["seen_owner"]
        # A new sample begins where the number of the run decreases.
        begins = np.flatnonzero(np.diff(owner) < 0) + 1
        self.density = np.split(snapshot["seen_density"], begins) if sampled else []
        self.owner = np.split(owner, begins) if sampled else []
        self.solves, self.moving = (array("q", snapshot[name].tolist()) for name in ("seen_solves", "seen_moving"))
        self.neighbours, self.frames_s = snapshot["seen_neighbours"].copy(), float(snapshot["seen_frames_s"])

    def summary(self, run: int) -> dict[str, Any]:
        """Return the statistics of one run."""
        slices = [slice(*np.searchsorted(owner, [run, run + 1])) for owner in self.owner]
        # Sorted, because the order of movers depends on the other runs of a launch.
        error = np.sort(np.concatenate([density[rows] for density, rows in zip(self.density, slices, strict=True)]))
        moving = np.array(self.moving).reshape(-1, self._runs)[:, run]
        iterations: dict[str, Any] = {}
        if self.solves:
            solves = np.array(self.solves).reshape(len(moving), -1, self._runs)[moving > 0, :, run]
            iterations["viscosity_iterations_mean"] = float(solves.mean())
            iterations["viscosity_iterations_most"] = int(solves.max())
        return {
            "density_error_mean": float(error.mean()),
            "density_error_p95": float(np.quantile(error, 0.95)),
            "density_error_max": float(error.max()),
            "most_neighbours": int(self.neighbours[run]),
            "moving_mean": float(moving[moving > 0].mean()),
            "moving_most": int(moving.max()),
            **iterations,
        }
