"""An injection that can be followed frame by frame: one fluid, or several in the same crack under the same nozzle."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from sealtwin.errors import NumericalError
from sealtwin.records import Outline, Run, Solid, Trajectory
from sealtwin.regime import regime_of
from simulate import kernels_rest
from simulate.course import course_of
from simulate.device import describe_device
from simulate.distance import CM
from simulate.enclosure import Enclosure, enclose
from simulate.faults import SENTENCES, Fault
from simulate.fit import CM2_IN_M2, check_damping, check_fit, domain_of, effective_u, rheology_of
from simulate.nozzle import Schedule, plan_releases
from simulate.outlet import check_outlet
from simulate.paste import kinematic_viscosity
from simulate.seen import Seen
from simulate.settings import Fluid, Nozzle, Solver
from simulate.solver import FluidSolver, substeps_for
from simulate.state import State

SAMPLE_EVERY = 50
"""Frames between two samples of the density error."""


@dataclass
class Injection:
    """A prepared run: what it was made from, and how far it has come. Made by ``prepare``."""

    outline: Outline
    fluids: tuple[Fluid, ...]
    solver: Solver
    nozzle: Nozzle
    seed: int
    schedule: Schedule
    engine: FluidSolver
    frames: int
    """To the end of settling."""
    setup_s: float
    seen: Seen
    done: int = 0
    """Frames that are finished."""
    moving: int = 0
    """Particles that move, over all runs, when that was last seen: in every frame on a CPU, else at a sample."""
    failed: dict[int, NumericalError] = field(default_factory=dict)
    """Runs that were given up, by their number; the others go on without them."""

    @property
    def t_s(self) -> float:
        """Of the clock, after the frames that are done."""
        return self.done * self.schedule.frame_s

    @property
    def out(self) -> int:
        """Particles of a run that have left the nozzle."""
        return self.engine.state.released(self.done - 1) if self.done else 0

    @property
    def at_rest(self) -> bool:
        """Nothing moves, and nothing is to come."""
        return self.done >= len(self.schedule.released) and self.moving == 0

    def advance(self) -> None:
        """One frame. A run that goes wrong is given up; NumericalError where it was the last one.

        That names frame, time, particle and place. Where frames are replayed, faults are looked for only where the
        density is sampled, and name that later frame.
        """
        frame, engine = self.done, self.engine
        began = time.perf_counter()
        solves = engine.advance(frame)
        sampled = not self.seen.density or frame % SAMPLE_EVERY == 0 or frame == self.frames - 1
        if sampled or not engine.replays:
            self._give_up_faulty()
            self.moving = engine.count_movers()
            if self.moving:
                self.seen.add(engine, solves, sampled)
        self.done += 1
        self.seen.frames_s += time.perf_counter() - began

    def wait(self) -> None:
        """Until the device has finished its frames, whose time this is: before anybody reads what they left."""
        began = time.perf_counter()
        wp.synchronize_device(self.engine.state.device)
        self.seen.frames_s += time.perf_counter() - began

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All that the frames to come depend on, and what was seen so far, by name."""
        self.wait()
        # On the CPU numpy() is a view of what the next frame writes to.
        device = {name: there.numpy().copy() for name, there in self.engine.lasting().items()}
        return {"done": np.array(self.done), **device, **self.seen.snapshot()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go back, or on, to where ``snapshot`` was taken: on one CPU the run then continues to the same bits.

        Raises KeyError or ValueError, with nothing changed, where it is of no run like this one.
        """
        lasting = self.engine.lasting()
        for name, here in self.snapshot().items():
            found = snapshot[name]
            # What was seen grows as the run goes.
            alike = found.shape == here.shape if name in lasting else found.ndim == here.ndim
            if found.dtype != here.dtype or not alike:
                raise ValueError(f"{name} is {found.dtype} {found.shape}, not {here.dtype} {here.shape}")
        if not 0 <= snapshot["done"] <= self.frames:
            raise ValueError(f"{snapshot['done']} of {self.frames} frames are done")
        for name, there in lasting.items():
            there.assign(snapshot[name])
        self.done = int(snapshot["done"])
        self.seen.restore(snapshot)
        self.engine.go_on_from(self.done)
        self.moving = self.engine.count_movers()

    def results(self) -> list[Run]:
        """Where every particle is now, a Run for each fluid. Raises NumericalError where one was given up."""
        made = []
        for outcome in self.outcomes():
            if isinstance(outcome, NumericalError):
                raise outcome
            made.append(outcome)
        return made

    def outcomes(self) -> list[Run | NumericalError]:
        """A Run for each fluid, or why there is none."""
        self.wait()
        engine, schedule = self.engine, self.schedule
        fate = _fates(engine)
        # From a GPU once, and not for every run.
        position_mm, velocity_mm_s = engine.state.position_mm(), engine.state.velocity_mm_s()
        count = schedule.particles
        facts = self._facts()
        made: list[Run | NumericalError] = []
        for number, fluid in enumerate(self.fluids):
            if number in self.failed:
                made.append(self.failed[number])
                continue
            own = slice(number * count, (number + 1) * count)
            made.append(
                Run(
                    position_mm=position_mm[own],
                    velocity_mm_s=velocity_mm_s[own],
                    age_s=(self.done - schedule.frame_of).astype(float) * schedule.frame_s,
                    spilled=fate[own] == int(kernels_rest.SPILLED),
                    radius_mm=self.solver.size_mm,
                    particle_volume_mm3=schedule.dispensed_mm3 / count,
                    escaped_particles=int((fate[own] == int(kernels_rest.ESCAPED)).sum()),
                    device=describe_device(engine.state.device),
                    settings=self._settings(fluid),
                    health=self.seen.summary(number) | facts | self._effects(fluid),
                )
            )
        return made

    def _settings(self, fluid: Fluid) -> dict[str, Any]:
        effective = self.solver.scheme._asdict() | {"substeps": self.engine.substeps}
        return {
            "fluid": fluid.model_dump(),
            "solver": self.solver.model_dump() | effective,
            "nozzle": self.nozzle.model_dump(),
            "seed": self.seed,
        }

    def _effects(self, fluid: Fluid) -> dict[str, Any]:
        """What a fluid's settings amount to, and which forces rule."""
        support, frame_s = 4 * self.solver.size_mm * CM, self.schedule.frame_s
        weight = effective_u(fluid, support, frame_s)
        viscosity_m2_s = kinematic_viscosity(weight, support, frame_s) / CM2_IN_M2
        regime = regime_of(
            viscosity_m2_s=viscosity_m2_s,
            density_kg_m3=fluid.density_kg_m3,
            yield_stress_pa=fluid.yield_stress_pa,
            speed_mm_s=float(np.linalg.norm(self.schedule.velocity_mm_s, axis=1).mean()),
            nozzle_mm=self.nozzle.diameter_mm,
            width_mm=self.outline.mean_width_mm,
        )
        return {
            "viscosity_m2_s": viscosity_m2_s,
            "viscosity_pa_s": viscosity_m2_s * fluid.density_kg_m3,
            "U": weight,
            "yield_stress_pa": fluid.yield_stress_pa,
            **{name: value for name, value in regime._asdict().items() if value is not None},
        }

    def _facts(self) -> dict[str, Any]:
        return {
            "frames": self.done,
            "frame_s": self.schedule.frame_s,
            "substeps": self.engine.substeps,
            "particles_a_release": self.schedule.release,
            "wall_particles": len(self.engine.walls.place),
            "particles_across": self.outline.mean_width_mm / (2 * self.solver.size_mm),
            "kernels_a_frame": self.engine.kernels_a_frame,
            "setup_s": self.setup_s,
            "frames_s": self.seen.frames_s,
        }

    def _give_up_faulty(self) -> None:
        """Raises NumericalError where no run is left, with all as the fault left it."""
        for run, fault in self.engine.watch.found().items():
            self.failed[run] = NumericalError(self._in_words(run, fault))
            if len(self.failed) == len(self.fluids):
                raise self.failed[run]
            self.engine.give_up(run)

    def _in_words(self, run: int, fault: Fault) -> str:
        said = f"{SENTENCES[fault.kind]} Frame {self.done}, t = {self.t_s:.3f} s"
        if fault.particle is not None:
            x, y, z = self.engine.state.position_mm()[run * self.schedule.particles + fault.particle]
            said += f", particle {fault.particle} at ({x:.2f}, {y:.2f}, {z:.2f}) mm"
        return f"{said}. Try more substeps, or a smaller radius."


def prepare(
    solid: Solid,
    outline: Outline,
    trajectory: Trajectory,
    fluids: Sequence[Fluid],
    solver: Solver,
    nozzle: Nozzle,
    *,
    seed: int,
    device: str,
    threads: int = 1,
    enclosure: Enclosure | None = None,
) -> Injection:
    """Schedule, walls and particles, ready for the first frame.

    Several ``fluids`` are computed at once, each as if it were alone. ``enclosure`` is that of an earlier run in this
    crack, with particles of this size on this device; None: build it. Raises InputError where the settings do not fit
    the crack.
    """
    solver = solver.for_crack(outline.mean_width_mm)
    for fluid in fluids:
        check_fit(outline, solid, fluid, solver, nozzle)
    began = time.perf_counter()
    schedule = plan_releases(trajectory, solver.size_mm, nozzle.diameter_mm, seed)
    courses = [course_of(schedule, fluid, solver.settle_s) for fluid in fluids]
    domain = domain_of(solid, outline, trajectory, solver.size_mm)
    enclosure = enclosure or enclose(solid, outline, solver.size_mm, device)
    check_outlet(
        schedule,
        trajectory,
        outline,
        enclosure.barrier,
        radius_mm=solver.size_mm,
        diameter_mm=nozzle.diameter_mm,
        seed=seed,
    )
    substeps = substeps_for(solver, schedule.frame_s)
    check_damping(solver, schedule.frame_s / substeps)
    support = 4 * solver.size_mm * CM
    pastes = [rheology_of(fluid, support, schedule.frame_s) for fluid in fluids]
    engine = FluidSolver(
        State(schedule, device, len(pastes)),
        enclosure.walls,
        enclosure.barrier,
        domain,
        solver,
        pastes,
        frame_s=schedule.frame_s,
        substeps=substeps,
        rows=sum(int(course.moving.max()) for course in courses),
        centreline=outline.centreline_mm * CM,
        threads=threads,
    )
    setup_s = time.perf_counter() - began
    return Injection(
        outline, tuple(fluids), solver, nozzle, seed, schedule, engine, courses[0].frames, setup_s, Seen(len(pastes))
    )


def _fates(engine: FluidSolver) -> NDArray[np.integer]:
    """What became of each particle. The last word on escapes has the mesh itself, not the grid that stopped them."""
    fate = np.array(engine.state.fate.numpy(), dtype=np.int64)
    inside = engine.barrier.exact_mm(engine.state.position_mm()) < 0
    fate[(fate <= int(kernels_rest.FROZEN)) & inside] = int(kernels_rest.ESCAPED)
    return fate
