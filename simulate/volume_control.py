"""Keep the volume of the sealant equal to the dispensed volume, by adjusting the particles' weight in the density sum.

With a constant weight, the volume would be wrong for four reasons. A column is compressed by its own weight. At a free
surface, half of the kernel is empty, so that layers there are closer together. Paste with a yield stress comes to rest
before it is densely packed. New sealant presses into frozen sealant. The volume between the walls and the surface is
therefore measured in each run, and the weight of the particles is changed so that those that still flow correct the
difference.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from sealtwin.core.records import Solid
from simulate.fluid.launcher import Launcher
from simulate.fluid.state import State
from simulate.fluid.walk import Extent, fixed
from simulate.kernels import beds as device_code
from simulate.profile import fastest_fall_mm_s, half_side_mm
from simulate.settings import LEVEL, Solver
from simulate.setup.release_schedule import Schedule
from simulate.setup.rheology import Rheology
from simulate.setup.signed_distance import CM
from simulate.vessel import TURN, vessel_of

PERIOD_S = 0.1  # Time in s between two measurements, a third of the time after which paste comes to rest
MEMORY_S = 0.4
"""Time in s in which a missing volume is corrected. With 0.7, stiff paste would fall asleep before."""
FLOWS_MM_S = 1.0  # Paste with a yield stress counts as flowing from this speed on. Slower paste responds late.
MIN_FLOWING = 0.3
"""Smallest fraction of the sealant that is assumed to flow. The less sealant flows, the larger is the correction of
each particle. With 0.1, and 0.25 s for ``MEMORY_S``, few particles would overshoot and wake the sleeping sealant."""
STILL_SHARE = 0.05
"""The factor is increased only if more than this fraction of the sealant flows. Otherwise the yield stress would resist
until the paste yields suddenly."""
MIN_SETTLED = 0.05
"""Smallest volume of settled sealant, divided by the dispensed volume, with which the factor is adjusted. Less sealant
is mostly surface."""
CELL = 0.5
"""Width of the cells in which the volume is measured, divided by R. With 4/3, the volume of sealant with hollows would
be wrong by up to 1 %."""
MIN_FACTOR, MAX_FACTOR = 0.95, 1.2
"""Bounds of the volume factor. Without them, hollows under stiff paste and films on the face would change the density
too much."""
MAX_TOPS = 4_000_000
"""Largest number of liquid tops in memory (32 MB), if several runs are measured together. In cells of 0.3 mm, the
paper's sample has 145,510 tops per run, so 27 runs are measured together."""


class BedFigures(NamedTuple):
    """Numbers of a run's particles that are settled (lying), moving and flowing, and volume of the settled sealant."""

    lying: int
    moving: int
    moving_and_lying: int
    flowing_and_lying: int
    """Number of particles in ``moving_and_lying`` that count as flowing."""
    volume_mm3: float


class VolumeControl:
    """Measures the settled volume of each run on the device, and changes the run's ``State.swelling``."""

    def __init__(
        self,
        solid: Solid,
        schedule: Schedule,
        state: State,
        launcher: Launcher,
        solver: Solver,
        pastes: Sequence[Rheology],
        down: Sequence[float] = LEVEL.down,
    ) -> None:
        """Bind the kernels. ``pastes`` are the pastes of the runs, and ``down`` is the direction of gravity."""
        radius_mm = solver.size_mm
        self._schedule, self._state, self._factor = schedule, state, solver.scheme.volume_factor
        self._yields = [paste.yields for paste in pastes]
        self._vessel = vessel = vessel_of(solid, CELL * radius_mm)
        self.every = max(1, round(PERIOD_S / schedule.frame_s))
        """Number of frames from one measurement to the next."""
        self._gain = self.every * schedule.frame_s / MEMORY_S
        self._particle_volume_mm3 = schedule.dispensed_mm3 / schedule.particles
        half_mm = half_side_mm(radius_mm, self._particle_volume_mm3)
        sizes = device_code.Sizes()
        sizes.mm, sizes.radius_mm, sizes.floor_mm = CM, radius_mm, -solid.depth_mm
        sizes.turn, sizes.down = wp.vec2d(*TURN), wp.vec3d(*down)
        sizes.falls_mm_s, sizes.flows_mm_s = fastest_fall_mm_s(radius_mm), FLOWS_MM_S
        device, runs, parts, per_run = state.device, state.runs, device_code.PARTS, state.particles_per_run
        lines = vessel.lines_on(device)
        crossings = len(lines.z_mm)
        at_once = min(runs, max(1, MAX_TOPS // max(1, crossings)))
        self._beds = beds = device_code.Beds()
        beds.count = wp.zeros((runs, parts), wp.vec4i, device)
        beds.length_mm = wp.zeros((runs, parts), wp.float64, device)
        beds.liquid.position_mm = wp.zeros(state.count, wp.vec3d, device)
        beds.liquid.top_mm = wp.zeros(at_once * crossings, wp.float64, device)
        self._launcher = launcher

        def bind(kernel: Any, rows: int, *inputs: object, extent: Extent, lanes: int) -> Callable[[int], None]:
            launch = launcher.bind(kernel, *inputs, extent=extent, lanes=lanes)
            return lambda _rows: launch(rows)

        def by_block(kernel: Any, rows: int, *inputs: object) -> Callable[[int], None]:
            return bind(kernel, rows, *inputs, extent=fixed(rows, device), lanes=device_code.LANES)

        self._count = (
            by_block(device_code.find_lying, state.count, state.particles, sizes, beds),
            by_block(device_code.count_particles, runs * parts, state.particles, sizes, beds),
        )
        self._batches = []
        for first in range(0, runs, at_once):
            batch = min(at_once, runs - first)
            inputs = first * per_run, per_run, half_mm, np.sqrt(2) * half_mm, lines, beds.liquid
            rows = batch * per_run
            raise_surfaces = bind(device_code.raise_surface, rows, *inputs, extent=fixed(rows, device), lanes=1)
            self._batches.append((raise_surfaces, by_block(device_code.sum_lines, batch * parts, lines, first, beds)))

    def after_frame(self, done: int) -> None:
        """Adjust the particles' weight in each run, once in ``every`` frames. ``done`` frames are finished."""
        if done % self.every:
            return
        swelling = self._state.swelling.numpy().copy()
        for run, bed in enumerate(self.figures()):
            if bed.moving and bed.lying * self._particle_volume_mm3 >= MIN_SETTLED * self._schedule.dispensed_mm3:
                swelling[run] = self._changed(float(swelling[run]), bed, yields=self._yields[run])
        self._state.swelling.assign(swelling)

    def _changed(self, swelling: float, bed: BedFigures, *, yields: bool) -> float:
        lacking = 1 - bed.volume_mm3 / (bed.lying * self._particle_volume_mm3)
        share = (bed.flowing_and_lying if yields else bed.moving_and_lying) / bed.lying
        if yields and share <= STILL_SHARE:
            lacking, share = min(0.0, lacking), bed.moving_and_lying / bed.lying
        changed = swelling + self._gain * lacking / max(MIN_FLOWING, share)
        return min(MAX_FACTOR / self._factor, max(MIN_FACTOR / self._factor, changed))

    def figures(self) -> Iterator[BedFigures]:
        """Yield the figures of each run's settled sealant, for the current state of the particles."""
        self._launcher.walk(self._count, self._state.count)
        for batch in self._batches:
            self._beds.liquid.top_mm.fill_(-np.inf)
            self._launcher.walk(batch, self._state.count)
        counts = self._beds.count.numpy().sum(axis=1, dtype=np.int64)
        volumes_mm3 = self._beds.length_mm.numpy().sum(axis=1) * self._vessel.cell_mm2
        for (lying, moving, both, flowing), volume_mm3 in zip(counts.tolist(), volumes_mm3.tolist(), strict=True):
            yield BedFigures(lying, moving, both, flowing, volume_mm3)
