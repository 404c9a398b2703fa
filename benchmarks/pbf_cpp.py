"""The contestant of ``speed_bars.py`` in C++, ``pbf_step.cpp``: built by g++ for this processor, called by ctypes."""

import ctypes
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.pbf_numba import explicit_weights
from sealtwin.core.records import Floats
from simulate.fluid.pressure import LONGEST_CORRECTION
from simulate.fluid.solver import FluidSolver

SOURCE = Path(__file__).with_name("pbf_step.cpp")
# The parts of -ffast-math: the flag itself would link code that lets this whole process flush denormal numbers to zero,
# with which scipy's trees run out of stack.
FAST_MATH = ("-fno-math-errno", "-ffinite-math-only", "-fno-trapping-math", "-fno-signed-zeros")
FAST_MATH += ("-fassociative-math", "-freciprocal-math", "-mrecip=all")
FLAGS = ("-O3", "-march=native", *FAST_MATH, "-std=c++17", "-fopenmp", "-shared", "-fPIC")
FLOATS = np.ctypeslib.ndpointer(np.float32, flags="C")


def has_compiler() -> bool:
    return shutil.which("g++") is not None


@cache
def _library() -> ctypes.CDLL:
    folder = Path(tempfile.mkdtemp())
    subprocess.run(["g++", *FLAGS, str(SOURCE), "-o", str(folder / "pbf_step.so")], check=True)
    library = ctypes.CDLL(str(folder / "pbf_step.so"))
    shutil.rmtree(folder)
    number, whole = ctypes.c_int, np.ctypeslib.ndpointer(np.int32, flags="C")
    library.make_tank.restype = ctypes.c_void_p
    library.make_tank.argtypes = [number, FLOATS, FLOATS, number, FLOATS, FLOATS, whole, number, number]
    library.step_tank.argtypes = [ctypes.c_void_p]
    library.read_tank.argtypes = [ctypes.c_void_p, FLOATS]
    return library


class CppStep:
    """The state of ``engine`` at one time, copied, in a tank of a given floor and side; all of its particles move."""

    def __init__(self, engine: FluidSolver, side_mm: float, depth_mm: float, threads: int) -> None:
        s, cells, clearance = engine.pressure.smoothing, engine.fluid_cells.cells, engine.barrier.clearance
        half = side_mm / 20 - clearance
        thin, drag = explicit_weights(engine)
        numbers = (
            *(
                s.support,
                engine.step_s,
                engine.settings.damping_per_s,
                s.mass,
                s.density,
                s.slope,
            ),
            *(s.wall_density, s.wall_slope, s.relaxation, LONGEST_CORRECTION * s.support, thin, drag),
            *(-half, -half, clearance - depth_mm / 10, half, half, np.inf, *cells.corner),
        )
        place = np.ascontiguousarray(engine.state.position.numpy()[:, :3])
        velocity = np.ascontiguousarray(engine.state.velocity.numpy())
        wall = np.ascontiguousarray(engine.walls.position_and_share.numpy())
        count = np.array([*cells.count], dtype=np.int32)
        self._count = len(place)
        self._tank = _library().make_tank(
            *(len(place), place, velocity, len(wall), wall, np.array(numbers, dtype=np.float32), count),
            *(engine.scheme.iterations, threads),
        )

    def step(self) -> None:
        _library().step_tank(self._tank)

    @property
    def place_mm(self) -> Floats:
        place = np.zeros((self._count, 3), dtype=np.float32)
        _library().read_tank(self._tank, place)
        return 10 * place.astype(float)
