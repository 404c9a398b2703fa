"""Simulate fluid particles in a hollow, released together or by a schedule. Each frame is one substep."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.hollow import Hollow
from sealtwin.core.errors import NumericalError
from sealtwin.core.records import Floats
from simulate.fluid.fault_checks import SENTENCES
from simulate.fluid.solver import GRAVITY_CM_S2, Domain, FluidSolver
from simulate.fluid.state import State
from simulate.settings import LEVEL, SampleSlope, Solver, particle_volume
from simulate.setup.release_schedule import Schedule
from simulate.setup.resolution import ACCURATE_RESOLUTION
from simulate.setup.rheology import Rheology
from simulate.setup.signed_distance import CLEARANCE, CM
from simulate.setup.wall_particles import enclose
from simulate.vessel import vessel_of
from simulate.volume_control import VolumeControl

CELL_MM = 0.4  # Width in mm of the cells in which a volume is measured
SHORTER = 0.9  # Substep, as a fraction of the longest substep that the solver allows
# Random offset of lattice points, divided by their spacing. Without it, particles would stay stacked in columns
SCATTER = 0.05


def substep_s(radius_mm: float) -> float:
    """Return the substep in s for particles of the radius ``radius_mm``."""
    return SHORTER * math.sqrt(ACCURATE_RESOLUTION.fall * 4 * radius_mm * CM / GRAVITY_CM_S2)


def scattered(points_mm: Floats, spacing_mm: float, seed: int = 0) -> Floats:
    """Return the points of a lattice, (n, 3), each shifted at random by a small fraction of the spacing."""
    return points_mm + np.random.default_rng(seed).uniform(-SCATTER, SCATTER, points_mm.shape) * spacing_mm


def filled_box_mm(
    low_mm: tuple[float, float, float],
    high_mm: tuple[float, float, float],
    radius_mm: float,
    factor: float = Solver().scheme.volume_factor,
    seed: int = 0,
) -> Floats:
    """Return the positions of particles that fill a box, in even layers, (n, 3).

    Together the particles have the volume of the box. The volume of a particle is its volume by Eq. 6 times ``factor``.
    Default: the factor at the beginning of a run.
    """
    side, kept = float(np.cbrt(factor * particle_volume(radius_mm))), CLEARANCE * radius_mm
    size = np.subtract(high_mm, low_mm)
    along, across = (max(1, round(length / side)) for length in size[:2])
    counts = along, across, max(1, round(float(size.prod()) / side**3 / along / across))
    axes = [np.linspace(a + kept, b - kept, count) for a, b, count in zip(low_mm, high_mm, counts, strict=True)]
    return scattered(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3), side, seed)


@dataclass
class LooseFluid:
    """Fluid particles in a hollow whose floor is at z = 0, and their solver."""

    hollow: Hollow
    engine: FluidSolver
    control: VolumeControl
    radius_mm: float
    frames: int = 0

    @classmethod
    def put(
        cls,
        hollow: Hollow,
        schedule: Schedule,
        paste: Rheology,
        solver: Solver,
        *,
        slope: SampleSlope = LEVEL,
        device: str = "cpu",
        threads: int = 1,
    ) -> "LooseFluid":
        """Prepare particles in a hollow that are released by ``schedule``, in whose positions the floor is at z = 0.

        ``solver`` defines the particle radius. Frames have one substep, and there is no damping.
        """
        radius_mm = solver.size_mm
        solver = solver.model_copy(update={"substeps": 1, "damping_per_s": 0.0})
        schedule = replace(schedule, position_mm=schedule.position_mm - [0, 0, hollow.depth_mm])
        state, enclosure = State(schedule, device), enclose(hollow.solid, hollow.outline, radius_mm, device)
        low_mm, high_mm = hollow.reach_mm
        engine = FluidSolver(
            state,
            enclosure.walls,
            enclosure.barrier,
            Domain(low_mm * CM, high_mm * CM),
            solver,
            [paste],
            frame_s=schedule.frame_s,
            substeps=1,
            rows=state.count,
            down=slope.down,
            threads=threads,
        )
        control = VolumeControl(hollow.solid, schedule, state, engine.launcher, solver, [paste], slope.down)
        return cls(hollow, engine, control, radius_mm)

    def run(self, seconds: float, every_s: float) -> Iterator[float]:
        """Compute ``seconds`` of flow, or less if everything comes to rest before.

        Yields the time since the call at steps of ``every_s``, and at the end.

        Raises NumericalError if the run has a numerical fault.
        """
        frame_s, first, moments = self.engine.step_s, self.frames, 0
        last = first + self.frames_in(seconds)
        while self.frames < last:
            self.engine.begin_frame(self.frames)
            if self.engine.rows == 0:
                break
            self.engine.step()
            self.engine.rest()
            self.frames += 1
            self.control.after_frame(self.frames)
            t_s = (self.frames - first) * frame_s
            if t_s >= (moments + 1) * every_s - frame_s / 2 and self.frames < last:
                moments += 1
                self._check()
                yield t_s
        self._check()
        yield (self.frames - first) * frame_s

    def frames_in(self, seconds: float) -> int:
        return round(seconds / self.engine.step_s)

    def _check(self) -> None:
        self.engine.faults.look(self.engine.rows)
        for fault in self.engine.faults.found().values():
            t_s = self.frames * self.engine.step_s
            raise NumericalError(f"{SENTENCES[fault.kind]} t = {t_s:.3f} s. Try a smaller solver.radius_mm.")

    @property
    def place_mm(self) -> Floats:
        """Positions of the released particles, (n, 3), with the floor at z = 0."""
        return self._released_mm + np.array([0.0, 0.0, self.hollow.depth_mm])

    @property
    def _released_mm(self) -> Floats:
        state = self.engine.state
        return state.position_mm()[: state.released(max(0, self.frames - 1))]

    @property
    def escaped(self) -> int:
        """Number of particles that went through a wall into the solid."""
        return int((self.engine.barrier.exact_mm(self._released_mm) < 0).sum())

    @property
    def half_mm(self) -> float:
        """Half the side of a cube with a particle's volume, in mm."""
        return float(np.cbrt(particle_volume(self.radius_mm))) / 2

    @property
    def height_mm(self) -> float:
        """Height of the highest point of the fluid above the floor, in mm."""
        return float(self.place_mm[:, 2].max()) + self.half_mm

    @property
    def volume_mm3(self) -> float:
        """Volume between the walls and the surface of the particles, in mm3."""
        return vessel_of(self.hollow.solid, CELL_MM).volume_mm3(self._released_mm, self.half_mm)


def all_at_once(place_mm: Floats, radius_mm: float, frame_s: float | None = None) -> Schedule:
    """Return a schedule that releases all particles in the first frame, at rest. ``place_mm`` is (n, 3).

    By default, ``frame_s`` is the substep for particles of this radius.
    """
    count = len(place_mm)
    return Schedule(
        position_mm=place_mm,
        velocity_mm_s=np.zeros_like(place_mm),
        frame_of=np.zeros(count, np.int64),
        released=np.array([count]),
        frame_s=frame_s or substep_s(radius_mm),
        release=count,
        dispensed_mm3=count * particle_volume(radius_mm),
    )
