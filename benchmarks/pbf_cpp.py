"""The contestant in C++, ``pbf_cpp/step.cpp``: built by g++ for this processor, called by ctypes."""

import ctypes
import shutil
import subprocess
import tempfile
import weakref
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core.records import Floats
from simulate.fluid.pressure import LONGEST_CORRECTION
from simulate.fluid.solver import FluidSolver
from simulate.fluid.viscosity import OF_THE_CHANGE, OF_THE_RIGHT
from simulate.kernels.conjugate_gradients import ROUNDS
from simulate.kernels.pair_sums import ALONG, NEAREST_WALL
from simulate.kernels.pressure import UNDONE, UNDONE_RANGE
from simulate.kernels.viscosity import MIN_MOMENT, WALL_MOMENT
from simulate.shear_law import Law

SOURCE = Path(__file__).with_suffix("") / "step.cpp"
FLAGS = ("-O3", "-march=native", "-ffast-math", "-std=c++17", "-fopenmp", "-fPIC")
FLOATS = np.ctypeslib.ndpointer(np.float32, flags="C")


def has_compiler() -> bool:
    return shutil.which("g++") is not None


def built(source: Path) -> ctypes.CDLL:
    """A library of one source file, for this processor."""
    with tempfile.TemporaryDirectory() as folder:
        compiled, library = f"{folder}/compiled.o", f"{folder}/{source.stem}.so"
        subprocess.run(["g++", *FLAGS, "-c", str(source), "-o", compiled], check=True)
        # -ffast-math here would link code that lets this whole process flush denormal numbers to zero, with which
        # scipy's trees run out of stack.
        subprocess.run(["g++", "-shared", "-fopenmp", compiled, "-o", library], check=True)
        return ctypes.CDLL(library)


@cache
def _library() -> ctypes.CDLL:
    library = built(SOURCE)
    number, whole = ctypes.c_int, np.ctypeslib.ndpointer(np.int32, flags="C")
    library.make_tank.restype = ctypes.c_void_p
    library.make_tank.argtypes = [number, number, FLOATS, FLOATS, whole, number, number, number]
    library.set_tank.argtypes = [ctypes.c_void_p, *[FLOATS] * 4]
    library.step_tank.argtypes = [ctypes.c_void_p, number]
    library.read_tank.argtypes = [ctypes.c_void_p, FLOATS]
    library.free_tank.argtypes = [ctypes.c_void_p]
    library.free_tank.restype = None
    return library


class CppStep:
    """The state of ``engine`` at one time, copied, in a tank of a given floor and side; all of its particles move.

    The engine has one run, whose fluid has a flow index of 1 and does not stiffen by age.
    """

    def __init__(self, engine: FluidSolver, side_mm: float, depth_mm: float, threads: int) -> None:
        cells, clearance = engine.fluid_cells.cells, engine.barrier.clearance
        corner, count = (np.array([*values])[np.argsort([*cells.axis])] for values in (cells.corner, cells.count))
        half, (iterations,) = side_mm / 20 - clearance, engine.iterations
        numbers = (
            *_numbers(engine, iterations.carried),
            *(-half, -half, clearance - depth_mm / 10, half, half, np.inf, *corner),
        )
        state = engine.state
        volume = state.volume_and_viscosity.numpy()[:, :1]
        self._state = (
            state.position.numpy().copy(),
            np.hstack([state.velocity.numpy(), volume]),
            np.pad(state.earlier_velocity.numpy(), ((0, 0), (0, 1))),
            state.pressed.numpy().copy(),
        )
        self._number = state.number.numpy().copy()
        wall = np.ascontiguousarray(engine.walls.position_and_share.numpy())
        self.iterations = 0
        """Of the implicit solve in the last step."""
        self._tank = _library().make_tank(
            *(state.count, len(wall), wall),
            *(np.array(numbers, dtype=np.float32), count.astype(np.int32)),
            *(iterations.number, engine.settings.viscosity_solve == "implicit", threads),
        )
        weakref.finalize(self, _library().free_tank, self._tank)
        self.reset()

    def reset(self) -> None:
        """Return to the state that was copied."""
        _library().set_tank(self._tank, *self._state)

    def step(self, iterations: int = -1) -> None:
        """One substep; with so many iterations of the implicit solve, or with -1 as many as it needs."""
        self.iterations = _library().step_tank(self._tank, iterations)
        if self.iterations < 0:
            raise RuntimeError("a list of neighbours in step.cpp is full")

    @property
    def place_mm(self) -> Floats:
        """Positions in the order of release, (count, 3)."""
        place = np.zeros((len(self._number), 3), dtype=np.float32)
        _library().read_tank(self._tank, place)
        return 10 * place[np.argsort(self._number)].astype(float)


def explicit_weights(engine: FluidSolver) -> tuple[np.float32, np.float32]:
    """U and D of Eq. 5 in a substep, over h sqrt(pi), of the first run's fluid when fresh."""
    paste = engine.paste
    return np.float32(paste.by_age.numpy()[0, 0, 0]), np.float32(paste.drag.numpy()[0])


def _numbers(engine: FluidSolver, carried: float) -> tuple[Any, ...]:
    """Return the first of ``Numbers`` in ``tank.h``; the last three are boxes."""
    s, paste = engine.pressure.smoothing, engine.paste
    by_age = paste.by_age.numpy()[0]
    is_bingham = paste.law.numpy()[0] in (Law.BINGHAM, Law.HERSCHEL_BULKLEY) and paste.flow_index.numpy()[0] == 1
    if len(by_age) > 1 or not is_bingham:
        raise ValueError("step.cpp has the law of Bingham, and no fluid that changes with its age")
    thin, drag = explicit_weights(engine)
    return (
        *(s.support, engine.step_s, engine.settings.damping_per_s, s.mass, s.density, s.slope),
        *(s.wall_density, s.wall_slope, s.relaxation, LONGEST_CORRECTION * s.support, thin, drag),
        *(carried, by_age[0, 1], paste.sticks.numpy()[0] * thin),
        *(paste.per_viscosity, paste.slowest_shear, ALONG, NEAREST_WALL),
        *(WALL_MOMENT, MIN_MOMENT, UNDONE, UNDONE_RANGE, OF_THE_RIGHT, OF_THE_CHANGE, ROUNDS),
    )
