"""Small cracks, short pours and particles placed by hand: for the tests of ``simulate``."""

from functools import cache
from typing import Any

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

from benchmarks.loose_fluid import all_at_once
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.records import Floats, Outline, Run, Sample, Solid, Trajectory
from simulate import injection as injections
from simulate.fluid.fault_checks import RunFault
from simulate.fluid.solver import Domain, FluidSolver
from simulate.fluid.state import State
from simulate.injection import ComputeOptions, Injection, prepare
from simulate.kernels.status import FROZEN, RESTS
from simulate.pour import Pour
from simulate.run import fill
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver
from simulate.setup.rheology import Rheology
from simulate.setup.signed_distance import CM
from simulate.setup.wall_particles import Enclosure, enclose
from tests.support.shapes import straight_slot

FRAME_S = 7.23e-3
"""The paper's."""
LIKE_THE_PAPER = Fluid(U=30.0, D_cm=0.3, freeze_after_s=2.58)


@cache
def slot(
    length_mm: float = 6.0,
    width_mm: float = 3.1,
    depth_mm: float = 16.0,
    tilt: str = "vertical",
    angle_deg: float = 5.5,
) -> tuple[Solid, Outline]:
    """A straight crack with a wall across each end."""
    outline = straight_slot(length_mm, width_mm)
    shape = CrackShape.model_validate({"depth_mm": depth_mm, "tilt": tilt, "wall_angle_deg": angle_deg})
    return build_solid(outline, shape), outline


def path(outline: Outline, volume_ml: float, speed_mm_s: float = 4.0, trim_mm: float = 2.0, **more: Any) -> Trajectory:
    plan = {"volume_ml": volume_ml, "speed_mm_s": speed_mm_s, "trim_mm": trim_mm, **more}
    return plan_trajectory(outline, NozzlePath.model_validate(plan), cavity_volume_mm3=1e3)


def pour(
    crack: tuple[Solid, Outline],
    trajectory: Trajectory,
    fluid: Fluid = LIKE_THE_PAPER,
    seed: int = 0,
    slope: SampleSlope = LEVEL,
    nozzle_mm: float = 2.4,
    **solver: Any,
) -> Run:
    settings, nozzle = as_paper(solver), Nozzle(diameter_mm=nozzle_mm)
    return fill(Pour(sample_of(crack, trajectory), (fluid,), settings, nozzle, seed, slope))[0]


def sealant(**table: Any) -> Fluid:
    """It never freezes, unless the table has an age."""
    return Fluid.model_validate({"freeze_after_s": "never"} | table)


def injected(
    crack: tuple[Solid, Outline],
    trajectory: Trajectory,
    *fluids: Fluid,
    seed: int = 0,
    device: str = "cpu",
    threads: int = 1,
    replays: bool = False,
    **solver: Any,
) -> Injection:
    """A run before its first frame. ``replays``: what a GPU does, done on the CPU."""
    inputs = Pour(sample_of(crack, trajectory), fluids, as_paper(solver), seed=seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(injections, "enclosure_of", lambda sample, *more: enclosed(sample.solid, sample.outline, *more))
        injection = prepare(inputs, ComputeOptions(device, threads))
    if replays:
        injection.engine.uses_recordings = True
    return injection


def results(injection: Injection) -> list[Run]:
    """The runs of a launch in which none was given up."""
    return [run for run in injection.outcomes() if isinstance(run, Run) or pytest.fail(str(run))]


def as_paper(solver: dict[str, Any]) -> Solver:
    """Solver of the paper's size, whose level is taken as the nozzle stops, unless the settings say otherwise."""
    return Solver.model_validate({"radius_mm": 0.4, "settle_s": 0.0} | solver)


def sample_of(crack: tuple[Solid, Outline], trajectory: Trajectory) -> Sample:
    return Sample(crack[1], crack[0], trajectory)


def lattice(low_mm: Floats, high_mm: Floats, spacing_mm: float, seed: int = 0) -> Floats:
    """Points of a cubic lattice between two corners, each out of line by up to a tenth of the spacing."""
    axes = [np.arange(a + spacing_mm / 2, b, spacing_mm) for a, b in zip(low_mm, high_mm, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return points + np.random.default_rng(seed).uniform(-0.1, 0.1, points.shape) * spacing_mm


def engine_with(
    position_mm: Floats,
    crack: tuple[Solid, Outline],
    *,
    frame_s: float = FRAME_S,
    weights: tuple[float, float] = (0.0, 0.0),
    fluid: Rheology | None = None,
    slope: SampleSlope = LEVEL,
    threads: int = 1,
    native: bool = True,
    reach_mm: tuple[Floats, Floats] | None = None,
    **solver: Any,
) -> FluidSolver:
    """A solver whose particles all move from where they are put. ``weights`` are U and D of a whole frame.

    ``reach_mm`` is the box of the neighbour search, where particles go farther than 5 mm from where they start.
    """
    settings = as_paper(solver)
    state = State(all_at_once(position_mm, settings.size_mm, frame_s), "cpu")
    enclosure = enclosed(*crack, settings.size_mm)
    substeps = settings.substeps or 4
    low, high = reach_mm or (position_mm.min(axis=0) - 5, position_mm.max(axis=0) + 5)
    engine = FluidSolver(
        state,
        enclosure.walls,
        enclosure.barrier,
        Domain(low * CM, high * CM),
        settings,
        [fluid or Rheology(*weights)],
        frame_s=frame_s,
        substeps=substeps,
        rows=state.count,
        down=slope.down,
        threads=threads,
        native=native,
    )
    engine.begin_frame(0)
    return engine


def prepared(engine: FluidSolver) -> FluidSolver:
    """The same, with neighbours listed and densities measured."""
    engine.find_neighbours()
    engine.pressure.measure_density(engine.rows)
    return engine


def corrected(engine: FluidSolver) -> FluidSolver:
    """The same, after one correction of the pressure."""
    prepared(engine).pressure.correct(engine.rows)
    return engine


def check(engine: FluidSolver) -> dict[int, RunFault]:
    """The faults of the particles as they are now, by run."""
    engine.faults.look(engine.rows)
    return engine.faults.found()


def in_rows(engine: FluidSolver) -> NDArray[np.intp]:
    """Number of the particle in each row, (rows,), once the neighbours were listed."""
    return engine.state.particles.mover.numpy()[: engine.rows].astype(np.intp)


def listed_fluid(engine: FluidSolver) -> list[NDArray[np.intp]]:
    """The fluid particles in each row's list."""
    lists = engine.lists
    return _cut(lists.fluid, lists.fluid_at, lists.fluid_count, engine.rows)


def listed_walls(engine: FluidSolver) -> list[NDArray[np.intp]]:
    """The wall particles in each row's list."""
    lists = engine.lists
    return _cut(lists.wall, lists.wall_at, lists.wall_count, engine.rows)


def _cut(listed: wp.array, at: wp.array, count: wp.array, rows: int) -> list[NDArray[np.intp]]:
    whole, where, many = listed.numpy(), at.numpy(), count.numpy()
    return [whole[where[row], : many[row]].astype(np.intp) for row in range(rows)]


def positions_mm(engine: FluidSolver) -> Floats:
    return engine.state.position_mm()


def lay_down(engine: FluidSolver, rests: NDArray[np.bool_]) -> None:
    """Put those particles to rest."""
    position, status = engine.state.position.numpy().copy(), engine.state.status.numpy().copy()
    position[rests, 3], status[rests] = RESTS, FROZEN
    engine.state.position.assign(position)
    engine.state.status.assign(status)
    engine.find_movers()


_enclosures: dict[tuple[Solid, float, str], Enclosure] = {}


def enclosed(solid: Solid, outline: Outline, radius_mm: float, device: str = "cpu") -> Enclosure:
    """Barrier and walls, built once for each solid: runs only read them."""
    key = solid, radius_mm, device
    if key not in _enclosures:
        _enclosures[key] = enclose(solid, outline, radius_mm, device)
    return _enclosures[key]
