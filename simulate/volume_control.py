"""Keeps a bed's volume at what was dispensed: by how much a particle counts for in the density, run by run.

The volume that a bed takes depends on more than one constant can know. Its column is compressed; at a free surface half
of the kernel is empty, so that the layers there lie closer; paste that yields comes to rest before its packing is as
dense as it might be; and new sealant presses into what has frozen. The sum of them is measured on the run's own bed,
between the walls and its surface, and what is missing or too much is made up by what still flows.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from sealtwin.core.records import Bed, Solid
from simulate.device_beds import BedFigures, DeviceBeds
from simulate.fluid.state import State
from simulate.kernels.status import FROZEN, MOVING
from simulate.profile import half_side_mm, half_spacing_mm, settled
from simulate.settings import SampleSlope
from simulate.setup.release_schedule import Schedule
from simulate.vessel import Mask, vessel_of

PERIOD_S = 0.1  # Time between two measurements: a third of what paste needs to come to rest
MEMORY_S = 0.4
"""Time in which a lack of volume is made up: with 0.7 stiff paste is asleep before."""
FLOWS_MM_S = 1.0  # Speed from which paste that yields flows; what creeps more slowly answers late, and then at once
LEAST_FLOWING = 0.3
"""Least share of the bed that is taken to flow: the less does, the more must it make up for. With 0.1, and a
memory of 0.25 s, few particles that make up for much overshoot and wake the bed that sleeps.
"""
STANDS = 0.05
"""Share of the bed up to which paste stands, and is given nothing: its yield stress holds that until it gives way."""
LEAST_SETTLED = 0.05
"""Share of the dispensed volume from which a bed is measured: a smaller one is all surface."""
CELL = 0.5
"""Width over R of the columns that a bed is measured in: those of 4/3 read beds with hollows up to 1 % wrong."""
LEAST_FACTOR, MOST_FACTOR = 0.95, 1.2
"""Bounds of the factor: hollows that a stiff paste bridges are no fault of its density, nor are films on the face."""


class VolumeControl:
    """Changes ``State.swelling`` of each run as if it were alone."""

    def __init__(
        self,
        solid: Solid,
        schedule: Schedule,
        state: State,
        *,
        radius_mm: float,
        factor: float,
        yields: Sequence[bool],
        settings: dict[str, Any],
        on_device: bool | None = None,
    ) -> None:
        """``factor`` is the scheme's volume factor, which ``State.swelling`` multiplies; ``settings`` are a run's.

        ``yields`` says of each run whether its sealant has a yield stress. ``on_device``: the device measures beds, and
        not the host; None asks whether it is a GPU.
        """
        self._solid, self._schedule, self._state = solid, schedule, state
        self._vessel = vessel_of(solid, CELL * radius_mm)
        self._radius_mm, self._factor, self._yields, self._settings = radius_mm, factor, yields, settings
        self.every = max(1, round(PERIOD_S / schedule.frame_s))
        """Frames from one measurement to the next."""
        self._gain = self.every * schedule.frame_s / MEMORY_S
        self._particle_volume_mm3 = schedule.dispensed_mm3 / schedule.particles
        self._beds: DeviceBeds | None = None
        if state.device != "cpu" if on_device is None else on_device:
            self._beds = DeviceBeds(
                solid,
                self._vessel,
                state,
                radius_mm=radius_mm,
                half_mm=half_side_mm(radius_mm, self._particle_volume_mm3),
                flows_mm_s=FLOWS_MM_S,
                down=SampleSlope.model_validate(settings.get("sample", {})).down,
            )

    def after_frame(self, done: int) -> None:
        """Adjust each run's particles, once in a period. ``done`` is the number of finished frames."""
        if done % self.every:
            return
        swelling = self._state.swelling.numpy().copy()
        for run, bed in enumerate(self.figures(done)):
            if self._is_bed(bed.lying, bed.moving):
                swelling[run] = self._changed(float(swelling[run]), bed, yields=self._yields[run])
        self._state.swelling.assign(swelling)

    def figures(self, done: int) -> Iterable[BedFigures]:
        """The figures of each run's bed; its volume need not be measured where it is too small, or nothing moves."""
        return self._by_host(done) if self._beds is None else self._beds.figures()

    def _is_bed(self, lying: int, moving: int) -> bool:
        return moving > 0 and lying * self._particle_volume_mm3 >= LEAST_SETTLED * self._schedule.dispensed_mm3

    def _changed(self, swelling: float, bed: BedFigures, *, yields: bool) -> float:
        lacking = 1 - bed.volume_mm3 / (bed.lying * self._particle_volume_mm3)
        share = (bed.flowing_and_lying if yields else bed.moving_and_lying) / bed.lying
        if yields and share <= STANDS:
            lacking, share = min(0.0, lacking), bed.moving_and_lying / bed.lying
        changed = swelling + self._gain * lacking / max(LEAST_FLOWING, share)
        return min(MOST_FACTOR / self._factor, max(LEAST_FACTOR / self._factor, changed))

    def _by_host(self, done: int) -> Iterator[BedFigures]:
        for run, (bed, moves) in enumerate(self._particles(done)):
            lies = settled(bed, np.full(len(bed.position_mm), self._solid.depth_mm))
            lying, moving = int(lies.sum()), int(moves.sum())
            if not self._is_bed(lying, moving):
                yield BedFigures(lying, moving, 0, 0, np.nan)
                continue
            flows = moves
            if self._yields[run]:
                flows = moves & (np.linalg.norm(bed.velocity_mm_s, axis=1) >= FLOWS_MM_S)
            volume_mm3 = self._vessel.volume_mm3(bed.position_mm[lies], half_spacing_mm(bed))
            yield BedFigures(lying, moving, int((moves & lies).sum()), int((flows & lies).sum()), volume_mm3)

    def _particles(self, done: int) -> Iterator[tuple[Bed, Mask]]:
        """Each run's particles that have left the nozzle and are not lost, and the mask of those that move."""
        state = self._state
        out = state.released(done - 1)
        status, position_mm, velocity_mm_s = state.status_of(), state.position_mm(), state.velocity_mm_s()
        for run in range(state.runs):
            own = slice(state.own(run).start, state.own(run).start + out)
            here = (status[own] <= int(FROZEN)) & np.isfinite(position_mm[own]).all(axis=1)
            yield (
                Bed(
                    position_mm[own][here],
                    velocity_mm_s[own][here],
                    np.zeros(int(here.sum()), dtype=bool),
                    self._radius_mm,
                    self._particle_volume_mm3,
                    self._settings,
                ),
                status[own][here] == int(MOVING),
            )
