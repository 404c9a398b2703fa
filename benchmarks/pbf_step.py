"""How long one substep of the fluid takes, against the same substep in numba and in C++, and whether all do the same.

    python benchmarks/pbf_step.py [--particles N] [--threads T] [--peer DIR] [--json]

A block of N particles, settled in a square tank: h = 4 R, five pressure iterations, steps of 1 ms, one explicit pass of
viscosity. Then the shipped trial's paste as a run takes it, of 15,000 particles while it collapses and nearly at rest:
pressure that is carried over and some iterations ("1+3 pressure"), shear, and the implicit solve in so many iterations
("CG"). All contestants of a row start from the same state and take as many passes of each kind; a figure is the least
of many turns. With one thread they take turns, and time is the processor's, which other work on the machine disturbs
least; with several it is the clock's, of the explicit substep in this package and in numba. The C++ needs g++, and is
judged if the processor has AVX-512, which both then use. ``--peer`` compares it with another program
(``pbf_peer.py``).
"""

import json
import time
from pathlib import Path
from typing import Annotated, NamedTuple

import numba
import numpy as np
from typer import BadParameter, Option

from benchmarks.against import flags, processor
from benchmarks.pbf_cpp import CppStep, has_compiler
from benchmarks.pbf_numba import NumbaStep
from benchmarks.pbf_peer import PeerStep
from benchmarks.pbf_tank import (
    FLOWING,
    NEARLY_AT_REST,
    PARTICLES,
    RADIUS_MM,
    PasteTimes,
    in_cpp,
    settled_block,
    size_mm,
    take_turns,
    time_paste,
)
from benchmarks.table import Row, finish, run_benchmark
from simulate.fluid.solver import FluidSolver
from simulate.kernels.distance import AS_PLANE

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
OVER_CPP = 1.7
"""Bar of a substep over the C++ of as many passes. Its walls are a box; those of this package have any shape."""
OVER_PEER = 1.1
"""Largest time of our C++ over that of another program: a slower one is no reference."""
ALIKE = 0.03
"""Median distance to the C++ after a frame of paste that flows, over the way: what its walls, which are planes, do to
particles in corners that a grid of distances rounds off, stiff paste hands on.
"""
LEAST_WAY_MM = 1e-3
"""Median way of a particle in a frame from which positions in float32 show what it did."""
ALIKE_MM = 1e-2
"""Median distance to the C++ after one explicit step."""


class Apart(NamedTuple):
    """Largest distance between the particles of both after one step."""

    off_walls_mm: float
    at_walls: float  # Of those within twice the clearance of one, over the clearance
    at_edges: float  # Of those near an edge, over the clearance


class Compiled(NamedTuple):
    """The same substep in C++."""

    apart_mm: float
    """Median distance to ours after one step."""
    ms: float
    peer_ms: float = 0.0
    """Of the other program, if there is one."""


class Times(NamedTuple):
    engine: FluidSolver
    apart: Apart
    ours_ms: float
    numba_ms: float
    alone_ms: float
    """Ours on one thread."""
    compiled: Compiled | None = None
    peer_near: float = 0.0
    """Neighbours of a particle in the other program, fluid and walls, mean."""


def time_both(particles: int, threads: int, *, with_cpp: bool = False, peer: Path | None = None) -> Times:
    """A substep of each, in milliseconds of the processor with one thread, of the clock with several.

    With one thread the C++ can take part, and the other program in the folder ``peer``.
    """
    engine = settled_block(particles, threads)
    numba.set_num_threads(threads)
    if threads == 1:
        baseline = NumbaStep.copy_of(engine)
        cpp = in_cpp(engine) if with_cpp else None
        other = PeerStep(peer, engine) if peer else None
        apart = _apart(engine, baseline)
        apart_mm = _median_apart_mm(engine, cpp) if cpp else np.inf
        steps = [it.step for it in (engine, baseline, cpp, other) if it]
        ours_ms, numba_ms, *others_ms = take_turns(steps, time.process_time)
        compiled = Compiled(apart_mm, others_ms[0], *others_ms[1:]) if cpp else None
        return Times(engine, apart, ours_ms, numba_ms, ours_ms, compiled, other.neighbours if other else 0.0)
    # Numba's threads, once there, look for work without end and take half a core from ours: they come last.
    alone = settled_block(particles, 1)
    ours_ms, alone_ms = take_turns((engine.step, alone.step), time.perf_counter)
    baseline = NumbaStep.copy_of(engine)
    apart = _apart(engine, baseline)
    (numba_ms,) = take_turns((baseline.step,), time.perf_counter)
    return Times(engine, apart, ours_ms, numba_ms, alone_ms)


def main(
    particles: int = PARTICLES,
    threads: int = 1,
    peer: Annotated[Path | None, Option(help="folder of another program in C++, pbf.cpp")] = None,
    as_json: Annotated[bool, Option("--json", help="the last line is an object of the figures")] = False,
) -> None:
    if peer and (threads > 1 or not has_compiler() or not (peer / "pbf.cpp").is_file()):
        raise BadParameter("--peer needs one thread, g++, and a folder with pbf.cpp")
    print(processor())
    compiles = threads == 1 and has_compiler()
    times = time_both(particles, threads, with_cpp=compiles, peer=peer)
    engine, apart, ours_ms, theirs_ms = times[:4]
    rows = [
        Row("both, one step on, farthest apart, away from walls", apart.off_walls_mm, "mm", 0, TOGETHER_MM),
        Row("the same beside them, over the clearance", apart.at_walls, "", 0, BESIDE),
        Row(f"the same within {EDGES:g} supports of an edge", apart.at_edges, "", 0, BESIDE, because=PLANES),
        Row("density, mean of the settled block", float(engine.state.density.numpy().mean()), "", 0.9, 1.1),
        Row("neighbours of a particle, mean", float(engine.lists.fluid_count.numpy().mean()), "", 30, 70),
        Row("this package, 5 pressure iterations, 1 explicit pass", ours_ms, "ms", 0, np.inf),
        Row("numba, the same passes", theirs_ms, "ms", 0, np.inf),
        Row("this package over numba", ours_ms / theirs_ms, "", 0, 0.7, "<= 0.4"),
    ]
    if threads > 1:
        rows.append(Row(f"one thread over {threads}", times.alone_ms / ours_ms, "x", MANY_THREADS, np.inf))
    if times.compiled:
        rows += explicit_rows(times, times.compiled)
        for frames in (FLOWING, NEARLY_AT_REST):
            rows += paste_rows(frames, time_paste(frames, particles))
    figures = {
        "particles": particles,
        "threads": threads,
        "ms_per_step": ours_ms,
        "numba_ms_per_step": theirs_ms,
        "ratio": ours_ms / theirs_ms,
        "apart_mm": apart.off_walls_mm,
    }
    finish(rows, last_line=json.dumps(figures) if as_json else "")


def explicit_rows(times: Times, compiled: Compiled) -> list[Row]:
    """Rows of the explicit substep in C++, and in the other program."""
    rows = [
        Row("C++, one step on, apart, median", compiled.apart_mm, "mm", 0, ALIKE_MM),
        Row("C++, the same passes", compiled.ms, "ms", 0, np.inf),
        Row("this package over C++, explicit", times.ours_ms / compiled.ms, "", 0, cpp_bar(), "<= 1.3"),
    ]
    if compiled.peer_ms:
        engine = times.engine
        near = float(engine.lists.fluid_count.numpy().mean() + engine.lists.wall_count.numpy().mean())
        # Lists, density and correction in each iteration, and viscosity.
        passes = 2 + 2 * engine.scheme.iterations
        each = 1e6 / engine.state.count / passes
        peer_ns, cpp_ns = each * compiled.peer_ms / times.peer_near, each * compiled.ms / near
        rows += [
            Row("peer: neighbours of a particle over ours", times.peer_near / near, "", 0.95, 1.05),
            Row(f"peer, a pair in each of {passes} passes", peer_ns, "ns", 0, np.inf),
            Row("C++, the same", cpp_ns, "ns", 0, np.inf),
            Row("this package, the same", each * times.ours_ms / near, "ns", 0, np.inf),
            Row("C++ over peer, a pair", cpp_ns / peer_ns, "", 0, OVER_PEER),
        ]
    return rows


def paste_rows(frames: int, times: PasteTimes) -> list[Row]:
    """Rows of a substep of paste in this package and in C++; a name lists the passes."""
    paste = f"paste, frame {frames + 1}"
    passes = f"1+{times.pressure} pressure, shear, {times.viscosity:.1f} CG"
    rows = [
        Row(f"{paste}: {passes}", times.ours_ms, "ms", 0, np.inf),
        Row("C++, the same passes", times.cpp_ms, "ms", 0, np.inf),
        Row(f"this package over C++, {paste}", times.ours_ms / times.cpp_ms, "", 0, cpp_bar(), "<= 1.3"),
    ]
    if times.moved_mm > LEAST_WAY_MM:
        rows.append(Row("C++, a frame on, apart over the way, median", times.apart_mm / times.moved_mm, "", 0, ALIKE))
    return rows


def cpp_bar() -> float:
    return OVER_CPP if "avx512f" in flags() else np.inf


def _median_apart_mm(engine: FluidSolver, other: CppStep) -> float:
    """Median distance once the other has taken the step that the engine has."""
    other.step()
    return float(np.median(np.linalg.norm(other.place_mm - engine.state.position_mm(), axis=1)))


def _apart(engine: FluidSolver, baseline: NumbaStep) -> Apart:
    engine.step()
    baseline.step()
    # In the order of memory, which numba's copy has.
    ours_mm = 10 * engine.state.position.numpy()[:, :3].astype(float)
    theirs_mm = 10 * np.column_stack([baseline.x, baseline.y, baseline.z])
    apart_mm = np.abs(ours_mm - theirs_mm).max(axis=1)
    clearance_mm = 10 * engine.barrier.clearance
    side_mm, depth_mm = size_mm(len(ours_mm))
    from_sides_mm = side_mm / 2 - np.abs(ours_mm[:, :2])
    nearest_mm, second_mm, _ = np.sort(np.column_stack([from_sides_mm, depth_mm + ours_mm[:, 2]]), axis=1).T
    beside = nearest_mm < 2 * clearance_mm
    at_edge = np.hypot(nearest_mm, second_mm) < EDGES * 4 * RADIUS_MM
    return Apart(
        float(apart_mm[~beside & ~at_edge].max()),
        float(apart_mm[beside & ~at_edge].max()) / clearance_mm,
        float(apart_mm[at_edge].max()) / clearance_mm,
    )


if __name__ == "__main__":
    run_benchmark(main)
