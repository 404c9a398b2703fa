"""The states from which ``pbf_step.py`` times a substep: particles in a square tank."""

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import manifold3d
import numpy as np

from benchmarks.hollow import solid_of
from benchmarks.pbf_cpp import CppStep
from sealtwin.core.records import Floats, Outline, Solid
from sealtwin.trial.trial_file import load_trial
from simulate.fluid.solver import FluidSolver, substeps_for
from simulate.setup.signed_distance import CM
from simulate.setup_checks import rheology_of
from tests.support.paths import FIXTURE
from tests.support.shapes import straight_slot
from tests.support.small_fluids import engine_with, lattice

RADIUS_MM = 0.4
STEP_S = 1e-3
SPACING_MM = 0.72  # Of the block before it settles
SIDE_MM = 26.0  # Of the tank's floor, at PARTICLES; other numbers keep the block's shape
PARTICLES = 15_000
TRIAL = FIXTURE / "trial.toml"
PASTE = {"fluid.yield_stress_pa": 12.0, "fluid.freeze_after_s": "never"}  # In place of the paper's freezing
TRIAL_FRAME_S = 7.14e-3  # Frame of a run of TRIAL: ``frame_s`` in its ``simulation.json``
FLOWING, NEARLY_AT_REST = 5, 13
"""Frames after which the paste collapses in the tank, and after which PARTICLES of it take about as many iterations of
the viscosity as the trial does with that paste, on average, 4.65 a substep.
"""
TURNS, STEPS_A_TURN = 12, 4


def size_mm(particles: int) -> tuple[float, float]:
    """Side and depth of the tank for so many particles."""
    scale = (particles / PARTICLES) ** (1 / 3)
    return SIDE_MM * scale, 20 * scale + 2


def tank(particles: int) -> tuple[Solid, Outline]:
    """A square pit for a block of that size."""
    side, depth = size_mm(particles)
    half, rim = side / 2, side / 2 + 5
    body = manifold3d.Manifold.cube((2 * rim, 2 * rim, depth + 5)).translate((-rim, -rim, -depth - 5))
    body -= manifold3d.Manifold.cube((side, side, depth + 1)).translate((-half, -half, -depth))
    return solid_of(body, (-rim, -rim, rim, rim), depth), straight_slot(side, side)


def block_mm(particles: int) -> Floats:
    """Positions of a block that fills the tank from its floor."""
    side, depth = size_mm(particles)
    half = side / 2 - 0.35
    points = lattice(np.array([-half, -half, 0.35 - depth]), np.array([half, half, 0.0]), SPACING_MM)
    block = points[np.argsort(points[:, 2], kind="stable")][:particles]
    if len(block) < particles:
        raise SystemExit(f"--particles {particles}: the tank holds {len(block)} of them.")
    return block


def settled_block(particles: int, steps: int = 200) -> FluidSolver:
    """Liquid that takes five pressure iterations and one explicit pass of viscosity in each step of 1 ms."""
    engine = engine_with(
        block_mm(particles),
        tank(particles),
        frame_s=STEP_S,
        substeps=1,
        iterations=5,
        viscosity_solve="explicit",
        weights=(0.05, 0.0),
        volume_factor=1.0,
        radius_mm=RADIUS_MM,
    )
    # By frames, as in a run: many particles are then renumbered by cells.
    for frame in range(steps):
        engine.advance(frame)
    # As a frame begins: rows in the order of the cells.
    engine.find_movers()
    return engine


def paste_after(frames: int, particles: int) -> FluidSolver:
    """PASTE of the shipped trial, by its solver settings, as its next frame begins; none of it sleeps."""
    trial = load_trial(TRIAL, PASTE)
    if trial.fluid is None:
        raise RuntimeError(f"{TRIAL} has no fluid")
    fluid = rheology_of(trial.fluid, 4 * trial.solver.size_mm * CM, TRIAL_FRAME_S)
    substeps = substeps_for(trial.solver, fluid, TRIAL_FRAME_S)
    settings: dict[str, Any] = trial.solver.model_dump() | {"substeps": substeps, "sleep": False}
    crack = tank(particles)
    engine = engine_with(block_mm(particles), crack, frame_s=TRIAL_FRAME_S, fluid=fluid, **settings)
    for frame in range(frames):
        engine.advance(frame)
    return engine


class PasteFrame:
    """One frame of a paste that always begins at the same state, taken by this package."""

    def __init__(self, engine: FluidSolver, frame: int) -> None:
        self.engine, self._frame = engine, frame
        self._state = {name: array.numpy().copy() for name, array in engine.lasting().items()}
        self.reset()

    def reset(self) -> None:
        for name, array in self.engine.lasting().items():
            array.assign(self._state[name])
        self.engine.resume(self._frame)
        self.engine.begin_frame(self._frame)

    def run(self) -> list[int]:
        """Take all substeps; returns the iterations of the viscosity in each."""
        numbers = []
        for _ in range(self.engine.substeps):
            self.engine.step()
            numbers.append(int(self.engine.viscosity.iterations()[0]))
        return numbers


def in_cpp(engine: FluidSolver) -> CppStep:
    return CppStep(engine, *size_mm(engine.state.count), threads=1)


def take_turns(steps: Sequence[Callable[[], object]]) -> list[float]:
    """Milliseconds of the processor a step, of each, in its quietest turn."""
    least = [np.inf] * len(steps)
    for _ in range(TURNS):
        for which, step in enumerate(steps):
            began = time.process_time()
            for _ in range(STEPS_A_TURN):
                step()
            least[which] = min(least[which], 1e3 * (time.process_time() - began) / STEPS_A_TURN)
    return least


class PasteTimes(NamedTuple):
    """A substep of paste in this package and in C++, which takes as many iterations of the viscosity."""

    ours_ms: float
    cpp_ms: float
    pressure: int
    """Pressure iterations, beside the one that is carried over."""
    viscosity: float
    """Iterations of the viscosity, mean of the substeps."""
    apart_mm: float
    """Median distance between the particles of both after the frame."""
    moved_mm: float
    """Median distance that a particle of this package has moved in it."""


def time_paste(frames: int, particles: int) -> PasteTimes:
    """Time the frame that follows so many; the least of all turns."""
    ours = PasteFrame(paste_after(frames, particles), frames)
    compiled = in_cpp(ours.engine)
    start_mm = ours.engine.state.position_mm()
    iterations = ours.run()
    for number in iterations:
        compiled.step(number)
    ours_mm = ours.engine.state.position_mm()
    least_s = [np.inf, np.inf]
    for _ in range(TURNS):
        ours.reset()
        compiled.reset()
        began = time.process_time()
        ours.run()
        between = time.process_time()
        for number in iterations:
            compiled.step(number)
        took_s = between - began, time.process_time() - between
        least_s = [min(pair) for pair in zip(least_s, took_s, strict=True)]
    ours_ms, cpp_ms = (1e3 * least / len(iterations) for least in least_s)
    return PasteTimes(
        ours_ms,
        cpp_ms,
        ours.engine.iterations[0].number,
        float(np.mean(iterations)),
        float(np.median(np.linalg.norm(compiled.place_mm - ours_mm, axis=1))),
        float(np.median(np.linalg.norm(ours_mm - start_mm, axis=1))),
    )
