"""Make the schedule of a run before it starts: position, velocity and frame of the release of each particle."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sealtwin.core.arc_length import at_arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Integers, Trajectory
from simulate.settings import Fluid, Nozzle, particle_volume
from simulate.setup.rheology import NEVER

PARTICLES_AT_MOST = 1_000_000  # Largest number of particles. If none of them freezes, neighbour lists take 3 GB.
RELEASED_AT_MOST = 100_000
"""Largest number of particles in a release. In the paper there are seven. To pack a release, a lattice of four times as
many points is made."""
MIN_SHIFT = 0.25
"""Range in which a lone particle is shifted at its release, divided by its radius. It is used if the bore of the nozzle
leaves less space."""
ROUNDING = 1e-9  # Tolerance that keeps a whole number of frames from being rounded up
PARTICLE_S = 2e-6  # Computing time of a moving particle in a substep, on one core of the machine in docs/accuracy.md


def places_of_releases(disc_mm: Floats, radius_mm: float, diameter_mm: float, seed: int, releases: int) -> Floats:
    """Return random positions of the particles of each release, relative to the nozzle's axis, (releases, release, 2).

    ``disc_mm`` is the positions of a full release, (release, 2). Equal discs would stack up like coins. A disc of
    several particles is therefore rotated at each release, and a lone particle is shifted within the bore.
    """
    random = np.random.default_rng(seed)
    turn = random.uniform(0, 2 * np.pi, releases)
    if len(disc_mm) == 1:
        room_mm = max(diameter_mm / 2 - radius_mm, MIN_SHIFT * radius_mm)
        shift_mm = room_mm * np.sqrt(random.uniform(0, 1, releases))
        return (shift_mm * [np.cos(turn), np.sin(turn)]).T[:, np.newaxis]
    (x, y), turn = disc_mm.T, turn[:, np.newaxis]
    return np.stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)], axis=-1)


@dataclass(frozen=True)
class Schedule:
    """All particles of a run, in the order of release. Units are mm and s."""

    position_mm: Floats  # (n, 3), at the release
    velocity_mm_s: Floats  # (n, 3)
    frame_of: Integers  # (n,): frame in which each particle is released
    released: Integers  # (frames,): number of released particles, including the release of the frame
    frame_s: float
    """Time in which the largest flow delivers the volume of a full release (Eq. 6). It is shortened so that the path's
    duration is a whole number of frames."""
    release: int  # Number of particles in a full release
    dispensed_mm3: float

    @property
    def particles(self) -> int:
        return len(self.position_mm)


def plan_releases(trajectory: Trajectory, radius_mm: float, diameter_mm: float, seed: int) -> Schedule:
    """Plan the releases of all particles in full discs. The number of particles follows from Eq. 6.

    A release takes place once the path has given more sealant than all releases before. Raises InputError if the path
    gives no sealant, or if there would be too many particles or frames.
    """
    volume_mm3 = particle_volume(radius_mm)
    flow_mm3_s = trajectory.flow_mm3_s[:-1]
    asked_mm3 = np.cumulative_sum(trajectory.given_mm3, include_initial=True)
    if not (np.isfinite(asked_mm3).all() and (flow_mm3_s >= 0).all() and asked_mm3[-1] >= volume_mm3):
        raise InputError(
            f"trajectory: its flow gives {asked_mm3[-1]:g} mm3 of sealant. At least {volume_mm3:.3f} mm3 is needed, "
            f"the volume of one particle of radius {radius_mm:g} mm, and no flow may be negative. Check flow_mm3_s "
            "and t_s."
        )
    particles = round(asked_mm3[-1] / volume_mm3)
    if particles > PARTICLES_AT_MOST:
        raise InputError(
            f"solver.radius_mm is {radius_mm:g}: {asked_mm3[-1]:g} mm3 of sealant need {particles} particles, but at "
            f"most {PARTICLES_AT_MOST} are allowed. Give a larger radius."
        )
    if (diameter_mm / 2 / radius_mm) ** 2 > RELEASED_AT_MOST:
        raise InputError(
            f"nozzle.diameter_mm is {diameter_mm:g} and solver.radius_mm is {radius_mm:g}: more than "
            f"{RELEASED_AT_MOST} particles would leave at once. Give a diameter of at most "
            f"{2 * radius_mm * math.sqrt(RELEASED_AT_MOST):.3g} mm, or a larger radius."
        )
    disc_mm = pack_disc(diameter_mm / 2, radius_mm)
    release = len(disc_mm)
    frames = math.ceil(trajectory.duration_s * flow_mm3_s.max() / (release * volume_mm3))
    if frames > PARTICLES_AT_MOST:
        raise InputError(
            f"trajectory: its largest flow, {flow_mm3_s.max():g} mm3/s over {trajectory.duration_s:g} s, needs "
            f"{frames} frames, but at most {PARTICLES_AT_MOST} are allowed. Give a steadier flow or a larger radius."
        )
    frame_s = trajectory.duration_s / frames
    ends_s = trajectory.t_s[0] + frame_s * np.arange(1, frames + 1)
    wanted = np.interp(ends_s, trajectory.t_s, asked_mm3) / asked_mm3[-1] * particles
    released = np.zeros(frames, np.int64)
    out = 0
    for frame in range(frames):
        # Because of the tolerance, rounding errors do not start a release.
        if wanted[frame] > out + 1e-6:
            out = min(out + release, particles)
        released[frame] = out
    released[-1] = particles
    frame_of = np.searchsorted(released, np.arange(particles), side="right")
    batch_start = np.concatenate([[0], released[:-1]])[frame_of]
    at_s = ends_s[frame_of] - frame_s
    tip_mm = at_arc_length(trajectory.position_mm, trajectory.t_s, at_s)
    flow = _flow_as_it_leaves(trajectory, ends_s, frame_s)[frame_of]
    places_mm = places_of_releases(disc_mm, radius_mm, diameter_mm, seed, frames)
    x, y = places_mm[frame_of, np.arange(particles) - batch_start].T
    down_mm_s = flow / (np.pi * (diameter_mm / 2) ** 2)
    return Schedule(
        position_mm=tip_mm + np.column_stack([x, y, 0 * x]),
        velocity_mm_s=np.outer(down_mm_s, [0.0, 0.0, -1.0]),
        frame_of=frame_of,
        released=released,
        frame_s=frame_s,
        release=release,
        dispensed_mm3=float(asked_mm3[-1]),
    )


def same_fluid(fluid: Fluid, nozzle: Nozzle, *releases: tuple[float, Trajectory]) -> Fluid:
    """Return the fluid with U and D converted from the first to the second of two ``releases``.

    Viscosity, and drag per time, are then the same in both. A release is a particle radius in mm and a path. They
    determine the duration of a frame, on which U and D depend.
    """
    if fluid.D_cm is None:
        return fluid
    frames_s = [plan_releases(path, radius_mm, nozzle.size_mm, 0).frame_s for radius_mm, path in releases]
    longer, finer = frames_s[1] / frames_s[0], releases[0][0] / releases[1][0]
    u = None if fluid.U is None else fluid.U * finer**4 * longer
    return fluid.model_copy(update={"U": u, "D_cm": fluid.D_cm * longer})


def _flow_as_it_leaves(trajectory: Trajectory, ends_s: Floats, frame_s: float) -> Floats:
    """Return the mean flow of each frame in mm3/s, weighted by volume, (frames,). NaN for a frame without sealant.

    The mean over time would be too small for a frame in which the flow begins.
    """
    flow_mm3_s, lasts_s = trajectory.flow_mm3_s[:-1], np.diff(trajectory.t_s)
    volume, weighted = (np.cumulative_sum(flow_mm3_s**power * lasts_s, include_initial=True) for power in (1, 2))
    volume_mm3, weight = (
        np.interp(ends_s, trajectory.t_s, so_far) - np.interp(ends_s - frame_s, trajectory.t_s, so_far)
        for so_far in (volume, weighted)
    )
    return np.divide(weight, volume_mm3, out=np.full(len(volume_mm3), np.nan), where=volume_mm3 > 0)


def pack_disc(disc_radius: float, radius: float) -> Floats:
    """Return the centres of circles in a hexagonal lattice that fit into a disc, (n, 2). There is at least one.

    Three lattices are tried: with the centre of the disc at the centre of a circle, between two circles, and between
    three circles. The result is the lattice with the most circles in the disc.
    """
    reach = math.ceil(disc_radius / radius) + 1
    a, b = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    lattice = 2 * radius * np.column_stack([a.ravel() + b.ravel() / 2, b.ravel() * math.sqrt(3) / 2])
    middles = 2 * radius * np.array([[0.0, 0.0], [0.5, 0.0], [0.5, math.sqrt(3) / 6]])
    packings = [lattice - middle for middle in middles]
    fitting = [p[np.hypot(*p.T) + radius <= disc_radius * (1 + 1e-9)] for p in packings]
    best = max(fitting, key=len)
    return best if len(best) else np.zeros((1, 2))


LAUNCHES = 250  # Time of the launches of a substep, as a number of moving particles, on the README's machine


class ParticleCounts(NamedTuple):
    """Numbers of particles of one run in each frame."""

    out: Integers  # (frames,): number of released particles
    moving: Integers  # (frames,): largest possible number of moving particles: released and not frozen by age

    @property
    def frames(self) -> int:
        """Number of frames up to the end of settling."""
        return len(self.out)

    @property
    def work(self) -> Integers:
        """Expected computing work of each frame, (frames,). The unit is one moving particle."""
        return LAUNCHES + self.moving


def course_of(schedule: Schedule, fluid: Fluid, settle_s: float) -> ParticleCounts:
    """Return the numbers of particles in each frame. Particles freeze in the order of release."""
    settling = math.ceil(settle_s / schedule.frame_s - ROUNDING)
    out = np.pad(schedule.released, (0, settling), mode="edge")
    ages = frames_to_freeze(fluid, schedule.frame_s)
    frozen = np.zeros_like(out)
    if ages < len(out):
        frozen[ages:] = out[:-ages]
    return ParticleCounts(out, out - frozen)


def frames_to_freeze(fluid: Fluid, frame_s: float) -> int:
    """Return the age in frames at which particles freeze, or NEVER if they do not freeze."""
    if fluid.freeze_after_s == "never":
        return NEVER
    return math.ceil(min(fluid.freeze_after_s / frame_s, NEVER - 1) - ROUNDING)
