"""The explicit substep of ``pbf_step.py`` in a C++ program that is not part of this repository: a check on our own C++.

A folder contains ``pbf.cpp``, of which these functions are called::

    void* pbf_new(int particles, const float* place, int walls, const float* wall_place, const float* low,
                  const float* high, float diameter, float mass, float step, float viscosity, float drag,
                  float relaxation, int iterations, int passes, int slots, int mode, float gravity);
    void pbf_threads(int);
    void pbf_step(void*, int steps);
    void pbf_times(void*, double* nine);  // the last two: fluid and wall neighbours of a particle, mean

``mode`` 2 is the fastest. The box from ``low`` to ``high`` stops particles; wall particles count as much as fluid.
"""

import ctypes
from pathlib import Path

import numpy as np

from benchmarks.pbf_cpp import FLOATS, built
from benchmarks.pbf_tank import RADIUS_MM, size_mm
from simulate.fluid.solver import GRAVITY_CM_S2, FluidSolver

FASTEST = 2
SLOTS = 144


class PeerStep:
    """The state of ``engine`` at one time, copied, in the other program, on one thread."""

    def __init__(self, folder: Path, engine: FluidSolver) -> None:
        self._library = library = built(folder / "pbf.cpp")
        whole, real, pointer = ctypes.c_int, ctypes.c_float, ctypes.c_void_p
        library.pbf_new.restype = pointer
        library.pbf_new.argtypes = [whole, FLOATS, whole, *[FLOATS] * 3, *[real] * 6, *[whole] * 4, real]
        library.pbf_step.argtypes = [pointer, whole]
        library.pbf_times.argtypes = [pointer, np.ctypeslib.ndpointer(np.float64, flags="C")]
        library.pbf_threads(1)
        smoothing, clearance = engine.pressure.smoothing, engine.barrier.clearance
        side, depth = size_mm(engine.state.count)
        half, floor = side / 20 - clearance, clearance - depth / 10
        place, wall = engine.state.position.numpy(), engine.walls.position_and_share.numpy()
        self._peer = library.pbf_new(
            *(len(place), np.ascontiguousarray(place[:, :3]), len(wall), np.ascontiguousarray(wall[:, :3])),
            *(np.array([-half, -half, floor], dtype=np.float32), np.array([half, half, 5], dtype=np.float32)),
            *(2 * RADIUS_MM / 10, smoothing.mass, engine.step_s, 0.05, 0.0, smoothing.relaxation),
            *(engine.scheme.iterations, 1, SLOTS, FASTEST, GRAVITY_CM_S2),
        )

    def step(self) -> None:
        self._library.pbf_step(self._peer, 1)

    @property
    def neighbours(self) -> float:
        """Of a particle in the last step, fluid and walls, mean."""
        figures = np.zeros(9)
        self._library.pbf_times(self._peer, figures)
        return float(figures[-2:].sum())
