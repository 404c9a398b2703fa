"""How long one substep of the fluid takes, against the same substep in numba, and whether both do the same.

    python benchmarks/pbf_step.py [--particles N] [--threads T] [--json]

A block of N particles, settled in a square tank: h = 4 R, five pressure iterations, steps of 1 ms, one explicit pass of
viscosity. Both start from the same state; a figure is the least of many turns. With one thread they take turns, and
time is the processor's, which other work on the machine disturbs least; with several it is the clock's, beside one
thread.
"""

import argparse
import json
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import manifold3d
import numba
import numpy as np

from benchmarks.pbf_numba import NumbaStep
from benchmarks.table import Row, finish
from sealtwin.core.records import Outline, Solid
from simulate.fluid.solver import FluidSolver
from simulate.kernels.distance import AS_PLANE
from tests.fluids import engine_with, hewn, lattice
from tests.shapes import straight_slot

RADIUS_MM = 0.4
STEP_S = 1e-3
SPACING_MM = 0.72
"""Of the block before it settles."""
SIDE_MM = 26.0
"""Of the tank's floor, at PARTICLES; other numbers keep the block's shape."""
PARTICLES = 15_000
SETTLE_STEPS = 200
TURNS, STEPS_A_TURN = 12, 4
MANY_THREADS = 1.6
"""Times one thread, on a quiet machine: two of two cores."""
TOGETHER_MM = 1e-4
"""Between both after one step: 1/4000 of a radius, and ten times what float32 rounds at a centimetre from the origin.
"""
BESIDE = 1e-3
"""The same beside a wall, over the clearance: there numba leaves so much of it, and this package no less than all."""
EDGES = 3.0
"""Supports around the tank's edges that are judged apart: pressure hands on what is done differently there."""
PLANES = (
    f"for {float(AS_PLANE):g} of the clearance this package takes a wall for a plane, and numba asks the rounded grid"
)


def tank(particles: int) -> tuple[Solid, Outline, float]:
    """A square pit for a block of that size, and its depth in mm."""
    side, depth = _size_mm(particles)
    half, rim = side / 2, side / 2 + 5
    body = manifold3d.Manifold.cube((2 * rim, 2 * rim, depth + 5)).translate((-rim, -rim, -depth - 5))
    body -= manifold3d.Manifold.cube((side, side, depth + 1)).translate((-half, -half, -depth))
    return hewn(body, (-rim, -rim, rim, rim), depth), straight_slot(side, side), depth


def _size_mm(particles: int) -> tuple[float, float]:
    scale = (particles / PARTICLES) ** (1 / 3)
    return SIDE_MM * scale, 20 * scale + 2


class Apart(NamedTuple):
    """Largest distance between the particles of both after one step."""

    off_walls_mm: float
    at_walls: float  # Of those within twice the clearance of one, over the clearance
    at_edges: float  # Of those near an edge, over the clearance


class Times(NamedTuple):
    engine: FluidSolver
    apart: Apart
    ours_ms: float
    numba_ms: float
    alone_ms: float
    """Ours on one thread."""


def time_both(particles: int, threads: int) -> Times:
    """A substep of each, in milliseconds of the processor with one thread, of the clock with several."""
    engine = settled_block(particles, threads)
    if threads == 1:
        baseline = NumbaStep.copy_of(engine)
        apart = _apart(engine, baseline)
        ours_ms, numba_ms = take_turns((engine.step, baseline.step), time.process_time)
        return Times(engine, apart, ours_ms, numba_ms, ours_ms)
    # Numba's threads, once there, look for work without end and take half a core from ours: they come last.
    alone = settled_block(particles, 1)
    ours_ms, alone_ms = take_turns((engine.step, alone.step), time.perf_counter)
    numba.set_num_threads(threads)
    baseline = NumbaStep.copy_of(engine)
    apart = _apart(engine, baseline)
    (numba_ms,) = take_turns((baseline.step,), time.perf_counter)
    return Times(engine, apart, ours_ms, numba_ms, alone_ms)


def settled_block(particles: int, threads: int, steps: int = SETTLE_STEPS) -> FluidSolver:
    solid, outline, depth_mm = tank(particles)
    half = SIDE_MM * (particles / PARTICLES) ** (1 / 3) / 2 - 0.35
    points = lattice(np.array([-half, -half, 0.35 - depth_mm]), np.array([half, half, 0.0]), SPACING_MM)
    block = points[np.argsort(points[:, 2], kind="stable")][:particles]
    if len(block) < particles:
        raise SystemExit(f"--particles {particles}: the tank holds {len(block)} of them.")
    engine = engine_with(
        block,
        (solid, outline),
        frame_s=STEP_S,
        substeps=1,
        iterations=5,
        viscosity_solve="explicit",
        weights=(0.05, 0.0),
        volume_factor=1.0,
        radius_mm=RADIUS_MM,
        threads=threads,
    )
    for _ in range(steps):
        engine.step()
    # As a frame begins: rows in the order of the cells.
    engine.find_movers()
    return engine


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=PARTICLES)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--json", action="store_true", help="the last line is an object of the figures")
    asked = parser.parse_args()
    engine, apart, ours_ms, theirs_ms, alone_ms = time_both(asked.particles, asked.threads)
    near = float(engine.lists.fluid_count.numpy().mean())
    rows = [
        Row("both, one step on, farthest apart, away from walls", apart.off_walls_mm, "mm", 0, TOGETHER_MM),
        Row("the same beside them, over the clearance", apart.at_walls, "", 0, BESIDE),
        Row(f"the same within {EDGES:g} supports of an edge", apart.at_edges, "", 0, BESIDE, because=PLANES),
        Row("density, mean of the settled block", float(engine.state.density.numpy().mean()), "", 0.9, 1.1),
        Row("neighbours of a particle, mean", near, "", 30, 70),
        Row("this package, a substep", ours_ms, "ms", 0, np.inf),
        Row("numba, a substep", theirs_ms, "ms", 0, np.inf),
        Row("this package over numba", ours_ms / theirs_ms, "", 0, 0.7, "<= 0.4"),
    ]
    if asked.threads > 1:
        rows.append(Row(f"one thread over {asked.threads}", alone_ms / ours_ms, "x", MANY_THREADS, np.inf))
    figures = {
        "particles": asked.particles,
        "threads": asked.threads,
        "ms_per_step": ours_ms,
        "numba_ms_per_step": theirs_ms,
        "ratio": ours_ms / theirs_ms,
        "apart_mm": apart.off_walls_mm,
    }
    finish(rows, last_line=json.dumps(figures) if asked.json else "")


def _apart(engine: FluidSolver, baseline: NumbaStep) -> Apart:
    engine.step()
    baseline.step()
    ours_mm, theirs_mm = engine.state.position_mm(), 10 * np.column_stack([baseline.x, baseline.y, baseline.z])
    apart_mm = np.abs(ours_mm - theirs_mm).max(axis=1)
    clearance_mm = 10 * engine.barrier.clearance
    side_mm, depth_mm = _size_mm(len(ours_mm))
    from_sides_mm = side_mm / 2 - np.abs(ours_mm[:, :2])
    nearest_mm, second_mm, _ = np.sort(np.column_stack([from_sides_mm, depth_mm + ours_mm[:, 2]]), axis=1).T
    beside = nearest_mm < 2 * clearance_mm
    at_edge = np.hypot(nearest_mm, second_mm) < EDGES * 4 * RADIUS_MM
    return Apart(
        float(apart_mm[~beside & ~at_edge].max()),
        float(apart_mm[beside & ~at_edge].max()) / clearance_mm,
        float(apart_mm[at_edge].max()) / clearance_mm,
    )


def take_turns(steps: Sequence[Callable[[], object]], clock: Callable[[], float]) -> list[float]:
    """Milliseconds a step, of each, in its quietest turn."""
    least = [np.inf] * len(steps)
    for _ in range(TURNS):
        for which, step in enumerate(steps):
            began = clock()
            for _ in range(STEPS_A_TURN):
                step()
            least[which] = min(least[which], 1e3 * (clock() - began) / STEPS_A_TURN)
    return least


if __name__ == "__main__":
    main()
