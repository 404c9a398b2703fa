"""How long one substep of the fluid takes, against the same substep in C++, and whether both do the same.

    python -m benchmarks.pbf_step [--only explicit|paste]

A block of particles, settled in a square tank: h = 4 R, five pressure iterations, steps of 1 ms, one explicit pass of
viscosity. Then the shipped trial's paste as a run takes it, of 15,000 particles while it
collapses and nearly at rest: pressure that is carried over and some iterations ("1+3 pressure"), shear, and the
implicit solve in so many iterations ("CG"). Both programs start from the same state and take as many passes of each
kind, on one thread, in turns; a figure is the least processor time of many turns. The C++ is
``pbf_cpp/step.cpp``, built by g++; figures alone are judged, if the processor has AVX-512, which both then use.
"""

import os
from collections.abc import Callable, Iterator
from typing import Annotated

import numpy as np

from benchmarks.machine import flags, processor
from benchmarks.pbf_cpp import has_compiler
from benchmarks.pbf_tank import (
    FLOWING,
    NEARLY_AT_REST,
    PARTICLES,
    in_cpp,
    settled_block,
    take_turns,
    time_paste,
)
from benchmarks.table import Row, one_of, run_benchmark

MANY = 50_000
OVER_CPP = 1.5
"""Bar of a substep over the C++ of as many passes. Its walls are a box; those of this package have any shape."""
ALIKE = 0.03
"""Median distance to the C++ after a frame of paste that flows, over the way: what its walls, which are planes, do to
particles in corners that a grid of distances rounds off, stiff paste hands on.
"""
MIN_WAY_MM = 1e-3
"""Median way of a particle in a frame from which positions in float32 show what it did."""
ALIKE_MM = 1e-2
"""Median distance to the C++ after one explicit step."""


def explicit() -> Iterator[Row]:
    for particles in (PARTICLES, MANY):
        engine = settled_block(particles)
        compiled = in_cpp(engine)
        engine.step()
        compiled.step()
        apart_mm = np.linalg.norm(compiled.place_mm - engine.state.position_mm(), axis=1)
        name = f"{particles} particles"
        yield Row(f"{name}: C++ a step on, apart, median", float(np.median(apart_mm)), "mm", 0, ALIKE_MM)
        ours_ms, cpp_ms = take_turns((engine.step, compiled.step))
        yield Row(f"{name}: 5 + 1 passes", ours_ms, "ms")
        yield Row(f"{name}: C++", cpp_ms, "ms")
        yield Row(f"{name}: over C++, explicit", ours_ms / cpp_ms, "", 0, cpp_bar(), "<= 1.3")


def paste() -> Iterator[Row]:
    for frames in (FLOWING, NEARLY_AT_REST):
        times, name = time_paste(frames, PARTICLES), f"paste, frame {frames + 1}"
        passes = f"1+{times.pressure} pressure, shear, {times.viscosity:.1f} CG"
        yield Row(f"{name}: {passes}", times.ours_ms, "ms")
        yield Row(f"{name}: C++, the same passes", times.cpp_ms, "ms")
        yield Row(f"{name}: over C++", times.ours_ms / times.cpp_ms, "", 0, cpp_bar(), "<= 1.3")
        if times.moved_mm > MIN_WAY_MM:
            off = times.apart_mm / times.moved_mm
            yield Row(f"{name}: C++, a frame on, apart over the way, median", off, "", 0, ALIKE)


def cpp_bar() -> float:
    return OVER_CPP if "avx512f" in flags() else np.inf


CASES: dict[str, Callable[[], Iterator[Row]]] = {case.__name__: case for case in (explicit, paste)}


def main(only: Annotated[list[str] | None, one_of(CASES)] = None) -> list[Row]:
    print(f"{processor()}, load {os.getloadavg()[0]:.1f}")
    if not has_compiler():
        raise SystemExit("no g++ on the PATH, which builds the contestant in C++")
    return [row for name in only or CASES for row in CASES[name]()]


if __name__ == "__main__":
    run_benchmark(main)
