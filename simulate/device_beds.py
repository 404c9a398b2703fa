"""Figures of the beds of all runs, measured on the device: a GPU's host reads some numbers a run, and no particles."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import warp as wp

from sealtwin.core.records import Solid
from simulate.fluid.launcher import Launcher
from simulate.fluid.state import State
from simulate.kernels import beds as device_code
from simulate.profile import fastest_fall_mm_s
from simulate.setup.signed_distance import CM
from simulate.vessel import TURN, Vessel

MOST_TOPS = 4_000_000
"""Tops of liquid that are kept at one time, 32 MB: those of as many runs as fit, and of one at least. The paper's
sample has 145,510 of them a run in columns of 0.3 mm, so that 27 runs are measured at once.
"""


class BedFigures(NamedTuple):
    """Numbers of particles of a run, and the volume that its bed takes."""

    lying: int
    moving: int
    moving_and_lying: int
    flowing_and_lying: int
    """The part of ``moving_and_lying`` that counts as flowing."""
    volume_mm3: float


class DeviceBeds:
    """The particles of ``state`` as beds between the walls of a vessel."""

    def __init__(
        self,
        solid: Solid,
        vessel: Vessel,
        state: State,
        *,
        radius_mm: float,
        half_mm: float,
        flows_mm_s: float,
        down: Sequence[float],
    ) -> None:
        """``half_mm`` is the liquid's height above its topmost centres, ``down`` the direction of gravity."""
        self._state, self._cell_mm2 = state, vessel.cell_mm2
        sizes = device_code.Sizes()
        sizes.mm, sizes.radius_mm, sizes.floor_mm, sizes.half_mm = CM, radius_mm, -solid.depth_mm, half_mm
        sizes.reach_mm, sizes.turn, sizes.down = np.sqrt(2) * half_mm, wp.vec2d(*TURN), wp.vec3d(*down)
        sizes.falls_mm_s, sizes.flows_mm_s = fastest_fall_mm_s(radius_mm), flows_mm_s
        device, runs, parts = state.device, state.runs, int(device_code.PARTS)
        lines, ceiling_mm = vessel.lines_on(device)
        crossings = len(ceiling_mm)
        at_once = min(runs, max(1, MOST_TOPS // max(1, crossings)))
        self._beds = beds = device_code.Beds()
        beds.lies = wp.zeros(state.count, dtype=int, device=device)
        beds.count = wp.zeros((runs, parts), dtype=wp.vec4i, device=device)
        beds.length_mm = wp.zeros((runs, parts), dtype=wp.float64, device=device)
        beds.ceiling_mm = ceiling_mm
        beds.liquid.top_mm = wp.zeros(at_once * crossings, dtype=wp.float64, device=device)
        launcher = Launcher(device)
        moving, lanes = (state.particles, sizes), device_code.LANES
        self._find_lying = launcher.bind_blocks(device_code.find_lying, state.count, lanes, *moving, beds)
        self._count = launcher.bind_blocks(device_code.count_particles, runs * parts, lanes, *moving, beds)
        self._batches = []
        for first in range(0, runs, at_once):
            batch = min(at_once, runs - first)
            own = (lines, first, beds)
            self._batches.append(
                (
                    launcher.bind_whole(device_code.raise_surfaces, batch * state.particles_per_run, *moving, *own),
                    launcher.bind_blocks(device_code.sum_lines, batch * parts, lanes, *own),
                )
            )

    def figures(self) -> Iterator[BedFigures]:
        """The figures of each run, as its particles are now."""
        self._find_lying()
        self._count()
        for raise_surfaces, sum_lines in self._batches:
            self._beds.liquid.top_mm.fill_(-np.inf)
            raise_surfaces()
            sum_lines()
        counts = self._beds.count.numpy().sum(axis=1, dtype=np.int64)
        volumes_mm3 = self._beds.length_mm.numpy().sum(axis=1) * self._cell_mm2
        for (lying, moving, both, flowing), volume_mm3 in zip(counts.tolist(), volumes_mm3.tolist(), strict=True):
            yield BedFigures(lying, moving, both, flowing, volume_mm3)
