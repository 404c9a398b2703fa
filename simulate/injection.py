"""Advance a run of particles frame by frame, for one fluid or for several in the same crack and trajectory."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.facts import Facts, doubt
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Run, Sample
from sealtwin.core.regime import regime_of
from sealtwin.core.run_figures import RunHealth
from sealtwin.core.settings import without_none
from sealtwin.core.workers import cores
from simulate.device import describe_device, start_warp
from simulate.fluid.fault_checks import SENTENCES
from simulate.fluid.run_statistics import RunStatistics
from simulate.fluid.solver import Domain, FluidSolver
from simulate.fluid.state import State
from simulate.kernels import status
from simulate.pour import Pour
from simulate.remarks import remarks_on
from simulate.setup.release_schedule import ParticleCounts, Schedule, course_of, plan_releases
from simulate.setup.rheology import CM2_IN_M2, Rheology, added_viscosity
from simulate.setup.signed_distance import CM
from simulate.setup.wall_particles import Enclosure, enclose
from simulate.setup_checks import (
    check_fit,
    check_outlet,
    domain_of,
    effective_d_cm,
    resolved,
    solved_as,
)
from simulate.volume_control import VolumeControl

NO_SLIP = "no slip"
"""Recorded origin of D, the walls' drag, if the fluid sticks to walls. If the user gave D, no origin is recorded."""
SUBSTEP_FACTORS = (1, 2, 4, 8)
"""Factors by which the number of substeps is multiplied when a failed run is computed again. With particles of 0.38 mm,
paste of 12 Pa and 4 Pa s collapses under a nozzle with two substeps of 0.0019 s, but not with four."""
SAMPLE_EVERY = 50  # Number of frames between two samples of the density error
MAX_THREADS = 8
"""Largest number of threads by default. With 8 threads and 2,800 moving particles, each thread has 350 particles, which
take about 20 us in a kernel."""


@dataclass
class Injection:
    """A prepared run, or several runs in one launch, with its progress. ``prepare`` returns it."""

    pour: Pour
    """Inputs of the run. The particle radius is in mm, and the tables of the fluids are loaded."""
    pastes: tuple[Rheology, ...]  # The fluids in the solver's units
    schedule: Schedule
    engine: FluidSolver
    volume_control: VolumeControl | None
    statistics: RunStatistics
    frames: int  # Number of frames to the end of settling
    work: list[int]
    """Expected computing work up to each frame, and up to the end. It is the sum of ``ParticleCounts.work`` over the
    frames. For paste that falls asleep, it is the number of frames, in which a frame up to the last release counts as
    two."""
    setup_s: float
    finer: int = 1
    """Factor by which the number of substeps is multiplied, one of ``SUBSTEP_FACTORS``. It is above 1 if the run failed
    with fewer substeps."""
    done: int = 0  # Number of finished frames
    earlier_mm: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    """Positions of all particles after frame ``looks_back``, (n, 3). Empty before that frame."""
    moving: int = 0  # Moving particles of all runs, counted in each frame on a CPU and in sampled frames on a GPU
    failed: dict[int, NumericalError] = field(default_factory=dict)
    """Errors of the runs that failed, by the number of the run. The other runs continue."""

    @property
    def t_s(self) -> float:
        """Simulated time in s at the end of the last finished frame."""
        return self.done * self.schedule.frame_s

    @property
    def out(self) -> int:
        """Number of a run's particles that have left the nozzle."""
        return self.engine.state.released(self.done - 1) if self.done else 0

    @property
    def at_rest(self) -> bool:
        """True if all particles have been released and none moves."""
        return self.done >= len(self.schedule.released) and self.moving == 0

    @property
    def looks_back(self) -> int:
        """Number of the frame from which the change of the level is measured.

        It is the start of the last tenth of all frames or, if that is later, the middle of the settling. If there is
        almost no settling, it is always the start of the last tenth.
        """
        released, tenth = len(self.schedule.released), int(0.9 * self.frames)
        return tenth if self.frames < released + 2 else max(tenth, (released + self.frames) // 2)

    def advance(self) -> None:
        """Compute one frame, and stop each run that has a fault.

        Raises NumericalError if no run is left. The error states frame, time, particle and position. If frames are
        replayed, faults are checked only when the density is sampled, and the error states that later frame.
        """
        frame, engine = self.done, self.engine
        began = time.perf_counter()
        solves = engine.advance(frame)
        sampled = not self.statistics.density or frame % SAMPLE_EVERY == 0 or frame == self.frames - 1
        if sampled or not engine.uses_recordings:
            self._give_up_faulty()
            self.moving = engine.count_movers()
            if self.moving:
                self.statistics.add(engine, solves, sampled)
        self.done += 1
        if self.volume_control:
            self.volume_control.after_frame(self.done)
        if self.done == self.looks_back:
            self.earlier_mm = self.engine.state.position_mm()
        self.statistics.frames_s += time.perf_counter() - began

    def wait(self) -> None:
        """Wait until the device has finished, so that arrays can be read. The waiting time counts as computing time."""
        began = time.perf_counter()
        wp.synchronize_device(self.engine.state.device)
        self.statistics.frames_s += time.perf_counter() - began

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Return all arrays that later frames depend on, and the statistics so far, by name."""
        self.wait()
        # The arrays are copied, because on a CPU numpy() returns a view of an array that the next frame changes.
        device = {name: array.numpy().copy() for name, array in self.engine.lasting().items()}
        done = {"done": np.array(self.done), "earlier_mm": self.earlier_mm}
        return {**done, **device, **self.statistics.snapshot()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Restore the state of ``snapshot``. On the same CPU, the run then continues with bit-identical results.

        Raises KeyError or ValueError, without any change, if the snapshot is from a different kind of run.
        """
        lasting = self.engine.lasting()
        for name, template in self.snapshot().items():
            array = snapshot[name]
            # The statistics grow during a run.
            alike = array.shape == template.shape if name in lasting else array.ndim == template.ndim
            if array.dtype != template.dtype or not alike:
                raise ValueError(
                    f"the snapshot has {name} as {array.dtype} {array.shape}, but the run needs {template.dtype} "
                    f"{template.shape}"
                )
        if not 0 <= snapshot["done"] <= self.frames:
            raise ValueError(f"the snapshot has {snapshot['done']} finished frames, but the run has only {self.frames}")
        for name, target in lasting.items():
            target.assign(snapshot[name])
        self.done, self.earlier_mm = int(snapshot["done"]), snapshot["earlier_mm"]
        self.statistics.restore(snapshot)
        self.engine.resume(self.done)
        self.moving = self.engine.count_movers()

    def outcomes(self) -> list[Run | NumericalError]:
        """Return, for each fluid, a Run in its current state, or the error with which its run failed."""
        self.wait()
        engine, schedule, solver = self.engine, self.schedule, self.pour.solver
        # The arrays of all runs are copied from a GPU together.
        position_mm, velocity_mm_s = engine.state.position_mm(), engine.state.velocity_mm_s()
        status_of = engine.state.status_of()
        # Escaped particles are found with the exact mesh, and not with the distance grid that stops particles.
        status_of[(status_of <= status.FROZEN) & (engine.barrier.exact_mm(position_mm) < 0)] = status.ESCAPED
        count, swelling = schedule.particles, engine.state.swelling.numpy()
        made: list[Run | NumericalError] = []
        for number in range(len(self.pastes)):
            if number in self.failed:
                made.append(self.failed[number])
                continue
            rows = slice(number * count, (number + 1) * count)
            health = RunHealth(
                **self.statistics.summary(number),
                frames=self.done,
                frame_s=schedule.frame_s,
                substeps=engine.substeps,
                **({} if self.finer == 1 else {"finer": self.finer}),
                setup_s=self.setup_s,
                frames_s=self.statistics.frames_s,
                particles_a_release=schedule.release,
                wall_particles=len(engine.walls.position_and_share),
                particles_across=self.pour.sample.outline.mean_width_mm / (2 * solver.size_mm),
                **self._effects(number),
                volume_factor=engine.scheme.volume_factor * float(swelling[number]),
            )
            made.append(
                Run(
                    position_mm=position_mm[rows],
                    velocity_mm_s=velocity_mm_s[rows],
                    age_s=(self.done - schedule.frame_of).astype(float) * schedule.frame_s,
                    spilled=status_of[rows] == status.SPILLED,
                    radius_mm=solver.size_mm,
                    particle_volume_mm3=schedule.dispensed_mm3 / count,
                    escaped_particles=int((status_of[rows] == status.ESCAPED).sum()),
                    device=describe_device(engine.state.device),
                    settings=self._settings(number),
                    health=health,
                    remarks=self.remarks_on(number),
                )
            )
        return made

    def _settings(self, number: int) -> dict[str, Any]:
        fluid, solver, engine = self.pour.fluids[number], self.pour.solver, self.engine
        steps = {"substeps": engine.substeps, "iterations": engine.iterations[number].number}
        # If D_cm is not given, D is computed from the viscosity.
        drag = {"D_cm": self._d_cm(number), "D_from": NO_SLIP} if fluid.D_cm is None else {}
        # Empty tables and the model "particles" are not recorded, because older runs do not have these keys.
        tables = {} if fluid.curve is not None else {"curve"}
        return {
            "fluid": fluid.model_dump(exclude=tables) | drag,
            "solver": solver.model_dump(exclude={"model"}) | solver.scheme._asdict() | steps,
            "nozzle": self.pour.nozzle.model_dump(),
            "seed": self.pour.seed,
            **self.pour.slope.table,
        }

    def _effects(self, number: int) -> dict[str, Any]:
        """Return the values that the solver uses for a fluid, and the regime of its flow."""
        fluid, paste = self.pour.fluids[number], self.pastes[number]
        # With the paper's U, particles move before viscosity acts, so they behave like water even if U is large.
        viscosity_pa_s = paste.viscosity_pa_s if paste.moves_after_viscosity else None
        viscosity_m2_s = None if viscosity_pa_s is None else viscosity_pa_s / fluid.density_kg_m3
        regime = regime_of(
            viscosity_m2_s=viscosity_m2_s,
            density_kg_m3=fluid.density_kg_m3,
            yield_stress_pa=fluid.fresh.yield_stress_pa,
            speed_mm_s=float(np.linalg.norm(self.schedule.velocity_mm_s, axis=1).mean()),
            nozzle_mm=self.pour.nozzle.size_mm,
            width_mm=self.pour.sample.outline.mean_width_mm,
            flow_index=paste.flow_index,
        )
        return {
            "viscosity_m2_s": viscosity_m2_s,
            "viscosity_pa_s": viscosity_pa_s,
            "viscosity_added_m2_s": added_viscosity(self.pour.solver.size_mm * CM, self.engine.step_s) / CM2_IN_M2,
            "U": paste.viscous_weight,
            "D_cm": self._d_cm(number),
            "yield_stress_pa": fluid.fresh.yield_stress_pa,
            **without_none(regime._asdict()),
        }

    def remarks_on(self, number: int) -> Facts:
        """Return the warnings about a fluid's run that are known before the first frame."""
        remarks = remarks_on(self.pour.each[number], self.schedule, finer=self.finer)
        now = self.engine.substeps
        text = (
            f"solver.substeps: the run failed with {now // 2} substeps per frame, so it was computed again with {now}. "
            f"Its frames take about {self.finer} times as long."
        )
        return *remarks, *([] if self.finer == 1 else [doubt("fluid.computed-anew", text, now)])

    def _d_cm(self, number: int) -> float:
        support = 4 * self.pour.solver.size_mm * CM
        return effective_d_cm(self.pour.fluids[number], self.pastes[number], support, self.schedule.frame_s)

    def _give_up_faulty(self) -> None:
        """Stop the runs that have a fault. If no run is left, raise NumericalError and leave the arrays unchanged."""
        for run, fault in self.engine.faults.found().items():
            sentence = f"{SENTENCES[fault.kind]} Frame {self.done}, t = {self.t_s:.3f} s"
            if fault.particle is not None:
                x, y, z = self.engine.state.position_mm()[run * self.schedule.particles + fault.particle]
                sentence += f", particle {fault.particle} at ({x:.2f}, {y:.2f}, {z:.2f}) mm"
            self.failed[run] = NumericalError(
                f"{sentence}. Try more solver.substeps, a smaller solver.radius_mm or a thinner sealant."
            )
            if len(self.failed) == len(self.pastes):
                raise self.failed[run]
            self.engine.give_up(run)


class Watcher:
    """Object whose methods are called at the start of a run and after every frame.

    If there are several watchers, ``begin`` is called in their order and ``after_frame`` in reverse order. When the
    first watcher writes a checkpoint, the others have therefore already written the frame's files.
    """

    finer = 1
    """``Injection.finer`` of the run that the watcher can restore. 1 if it can restore no run."""

    def begin(self, injection: Injection) -> None:
        """Prepare the watcher before the first frame of this process, and before a failed run is computed again.

        A watcher of checkpoints may restore the injection here.
        """

    def after_frame(self, injection: Injection) -> None:
        """Do the watcher's work after a frame."""


@dataclass(frozen=True)
class ComputeOptions:
    """Options for computing a run: device, threads, display of progress, and watchers.

    On the same CPU, no option changes the results.
    """

    device: str = "cpu"
    threads: int | None = None
    """Number of CPU threads. Default: one for each core, up to ``MAX_THREADS``."""
    progress: Progress = field(default_factory=Progress)
    watchers: Sequence[Watcher] = ()  # Watchers of the first of several runs

    @property
    def cpu_threads(self) -> int:
        return self.threads or min(cores(), MAX_THREADS)


@dataclass(frozen=True)
class SetupCase:
    """A pour whose settings have been checked for its crack, before walls and particles are made."""

    pour: Pour  # Inputs, with the particle radius in mm and loaded tables
    pastes: tuple[Rheology, ...]  # The fluids in the solver's units
    schedule: Schedule
    courses: tuple[ParticleCounts, ...]  # One for each fluid
    domain: Domain
    substeps: int


def case_of(pour: Pour, finer: int = 1) -> SetupCase:
    """Check all settings except the outlet.

    All fluids must need the same number of substeps. This number is multiplied by ``finer``.

    File names of the fluids' tables are relative to the current folder. Raises InputError if the settings do not fit
    the crack, and ValueError if the numbers of substeps differ.
    """
    sample, nozzle = pour.sample, pour.nozzle
    pairs = [resolved(sample, fluid.loaded(Path()), pour.solver, nozzle) for fluid in pour.fluids]
    fluids, (solver, *_) = zip(*pairs, strict=True)
    for fluid in fluids:
        check_fit(sample.outline, sample.solid, fluid, solver, nozzle, pour.slope)
    schedule = schedule_of(sample, solver.size_mm, nozzle.size_mm, pour.seed)
    courses = tuple(course_of(schedule, fluid, solver.settle_s) for fluid in fluids)
    domain = domain_of(sample.solid, sample.outline, sample.trajectory, solver.size_mm)
    solved = [solved_as(fluid, solver, schedule.frame_s, courses[0].frames) for fluid in fluids]
    substeps, *others = {substeps for _, substeps in solved}
    if others:
        raise ValueError(
            "Fluids that need different numbers of substeps cannot be computed together. Compute each by itself."
        )
    step_s = schedule.frame_s / (finer * substeps)
    if solver.damping_per_s * step_s > 1:
        raise InputError(
            f"solver.damping_per_s is {solver.damping_per_s:g}: in a substep of {step_s * 1e3:.3g} ms it would remove "
            f"more than a particle's whole speed. Give at most {1 / step_s:.4g}, or more substeps."
        )
    pour = replace(pour, fluids=fluids, solver=solver)
    return SetupCase(pour, tuple(paste for paste, _ in solved), schedule, courses, domain, finer * substeps)


@lru_cache(maxsize=8)
def schedule_of(sample: Sample, radius_mm: float, diameter_mm: float, seed: int) -> Schedule:
    """Return the release schedule. It is cached for runs that differ only in the fluid."""
    return plan_releases(sample.trajectory, radius_mm, diameter_mm, seed)


@lru_cache(maxsize=1)
def enclosure_of(sample: Sample, radius_mm: float, device: str) -> Enclosure:
    """Return the barrier and the wall particles of a run.

    The result is cached, because computing it takes a fifth of a run's time.
    """
    return enclose(sample.solid, sample.outline, radius_mm, device)


def prepare(pour: Pour, options: ComputeOptions | None = None, finer: int = 1) -> Injection:
    """Prepare the schedule, the walls and the particles for the first frame.

    Several fluids with the same number of substeps are computed together, with the same results as single runs. File
    names of their tables are relative to the current folder. The number of substeps is multiplied by ``finer``. Raises
    InputError if the settings do not fit the crack, and ValueError if the numbers of substeps differ.
    """
    if not pour.solver.has_particles:
        raise InputError(
            'solver.model = "slot": this function computes only particles. Leave solver.model out, or call fill.'
        )
    start_warp()
    began, options = time.perf_counter(), options or ComputeOptions()
    case = case_of(pour, finer)
    pour, schedule, pastes = case.pour, case.schedule, case.pastes
    sample, solver, down = pour.sample, pour.solver, pour.slope.down
    enclosure = enclosure_of(sample, solver.size_mm, options.device)
    nozzle_mm = pour.nozzle.size_mm
    check_outlet(schedule, sample.trajectory, sample.outline, enclosure.barrier, diameter_mm=nozzle_mm)
    engine = FluidSolver(
        State(schedule, options.device, len(pastes)),
        enclosure.walls,
        enclosure.barrier,
        case.domain,
        solver,
        pastes,
        frame_s=schedule.frame_s,
        substeps=case.substeps,
        rows=sum(int(course.moving.max()) for course in case.courses),
        down=down,
        threads=options.cpu_threads,
    )
    control = (
        VolumeControl(sample.solid, schedule, engine.state, engine.launcher, solver, pastes, down)
        if solver.keeps_volume
        else None
    )
    setup_s, frames = time.perf_counter() - began, case.courses[0].frames
    frame_work = np.sum([course.work for course in case.courses], axis=0)
    if engine.can_sleep:
        # The number of awake particles cannot be predicted. A frame is assumed to take twice as long during release.
        frame_work = np.where(np.arange(frames) < len(schedule.released), 2, 1)
    work, statistics = [0, *np.cumsum(frame_work).tolist()], RunStatistics(len(pastes))
    return Injection(pour, pastes, schedule, engine, control, statistics, frames, work, setup_s, finer)
