"""Plan the nozzle's path over a crack, write its robot program, compute the fluid run, and measure the level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack

from pydantic import Field

from digitise.robots.cell import ProgramOptions
from digitise.settings import NozzlePath
from sealtwin.api import FilePath, content_of, public, settings_from, shown_progress, warn
from sealtwin.api.samples import SampleSolid
from sealtwin.core import records
from sealtwin.core.errors import InputError
from sealtwin.core.records import Profile, Sample, Trajectory
from sealtwin.core.settings import Settings, checked, doubts_of
from simulate.settings import Fluid, Nozzle, SampleSlope, Solver


class Seeded(Settings):
    """Settings of a particle run that are not in a table of a trial file."""

    seed: int = Field(default=0, ge=0, lt=2**31)
    """Seed of the small random offsets of particles."""
    threads: int | None = Field(default=None, ge=1)
    """Number of CPU threads, on which the result does not depend. Default: one per core, up to 8. On a GPU, it must be
    1."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PlannedPath(Trajectory):
    """A timed nozzle path: what ``plan_path`` returns.

    ``t_s``, ``s_mm``, ``speed_mm_s`` and ``flow_mm3_s`` are (n,), and ``position_mm`` is (n, 3). Speed and flow of a
    row are valid until the time of the next row. They are 0 in the last row.
    """

    solid: SampleSolid
    """Solid with the crack that the path follows."""
    settings: NozzlePath
    """Settings with which the path was planned."""


class PathKeywords(TypedDict, total=False):
    """Settings of [path] that a function accepts."""

    volume_ml: float | Literal["cavity"]
    fill: float
    flow: Literal["constant", "cross_section"]
    reverse: bool
    trim_mm: float | Sequence[float]
    ramp_mm: float
    lead_in_mm: float
    lead_out_mm: float
    speed_mm_s: float
    spacing_mm: float
    nozzle_height_mm: float
    smoothing_mm: float


@public(NozzlePath)
def plan_path(
    solid: SampleSolid,
    **keywords: Unpack[PathKeywords],
) -> PlannedPath:
    """Plan the nozzle's path, speed and flow. Keywords are settings of [path] in a trial file.

    Parameters
    ----------
    solid
        The solid with the crack.

    Returns
    -------
    PlannedPath
        Waypoints in mm and s.

    Raises
    ------
    InputError
        A value is out of bounds, or the crack is too short for the trims or ramps.

    Examples
    --------
    >>> crack = st.crack_from_polyline([(0, 20), (60, 20)], width_mm=3)
    >>> solid = st.build_solid(crack, depth_mm=10, tilt="vertical")
    >>> path = st.plan_path(solid, volume_ml=1.4, speed_mm_s=5, trim_mm=5)
    >>> round(path.length_mm), round(path.duration_s)
    (50, 10)
    """
    settings = settings_from(NozzlePath, "plan_path", keywords)
    from digitise.trajectory import plan_trajectory

    trajectory = plan_trajectory(solid.crack, settings, solid.cavity_volume_mm3, solid.sections)
    warn(doubts_of(settings))
    return PlannedPath(**content_of(trajectory), solid=solid, settings=settings)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SimulatedRun(records.Run):
    """A finished fluid run: what ``inject`` and ``fill_fast`` return.

    ``position_mm``, (n, 3), has the particles at the end. It is empty for the fast model. ``health`` contains figures
    of numerical quality.
    """

    path: PlannedPath
    """Path of the nozzle."""
    fluid: Fluid
    """The sealant."""

    @cached_property
    def level(self) -> "SimulatedLevel":
        """The level of the settled sealant along the crack, as a caliper would measure it.

        Sealant on the face next to the crack is not counted.
        """
        from simulate.profile import measure_profile

        solid = self.path.solid
        return SimulatedLevel(**content_of(measure_profile(self, solid.crack, solid)), run=self)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SimulatedLevel(Profile):
    """The level of the sealant along the crack after a run: the attribute ``level`` of a run.

    ``s_mm`` is the arc length and ``level_mm`` the level relative to the face, negative below it, (n,) each, in mm.
    ``pandas.DataFrame(level)`` has both as columns.
    """

    run: SimulatedRun
    """Run whose level was measured."""


class SlopeKeywords(TypedDict, total=False):
    """Settings of [sample]."""

    crossfall_deg: float
    gradient_deg: float


class RunKeywords(SlopeKeywords, total=False):
    """Settings of a particle run."""

    seed: int
    threads: int | None


@public(Seeded, SampleSlope)
def inject(
    path: PlannedPath,
    fluid: Fluid,
    *,
    solver: Solver | None = None,
    nozzle: Nozzle | None = None,
    device: str = "cpu",
    progress: bool | None = None,
    **keywords: Unpack[RunKeywords],
) -> SimulatedRun:
    """Inject the sealant along the path and let it settle.

    Parameters
    ----------
    path, fluid
        The nozzle's path and the sealant.
    solver, nozzle
        Settings of the solver and the nozzle. Default: ``Solver()`` and ``Nozzle()``, as in ``sealtwin init``.
    device
        "cpu" (default), "cuda:0", or "auto" for the first GPU, or for the CPU if there is no GPU. A device that does
        not exist is an error.
    progress
        True to show progress on stderr. Default: True in a terminal or a notebook.

    Returns
    -------
    SimulatedRun
        The particles at the end of the run, with their ``level``. On one CPU, the same input gives bit-identical
        results.

    Raises
    ------
    InputError
        The settings cannot be used for this crack, or the device does not exist.
    NumericalError
        The simulation diverged.

    Warns
    -----
    RuntimeWarning
        The model cannot represent this sealant, or the result is unreliable. There is one warning for each reason.

    Examples
    --------
    >>> crack = st.crack_from_polyline([(0, 20), (15, 20)], width_mm=3)
    >>> solid = st.build_solid(crack, depth_mm=8, tilt="vertical")
    >>> path = st.plan_path(solid, volume_ml=0.2, speed_mm_s=20, trim_mm=2)
    >>> paste = st.Fluid(viscosity_pa_s=1, yield_stress_pa=5, freeze_after_s="never")
    >>> run = st.inject(path, paste, solver=st.Solver(radius_mm=0.45, settle_s=0.2))
    >>> run.escaped_particles, run.level.level_mm.shape
    (0, (76,))
    """
    slope, run = settings_from(SampleSlope, "inject", keywords), settings_from(Seeded, "inject", keywords)
    from simulate.device import choose_device
    from simulate.injection import ComputeOptions
    from simulate.pour import Pour
    from simulate.run import fill
    from validate.run_facts import run_warnings

    solver, nozzle = solver or Solver(), nozzle or Nozzle()
    fluid, chosen = fluid.loaded(Path()), choose_device(device)
    if (run.threads or 1) > 1 and chosen != "cpu":
        raise InputError(f"inject: threads = {run.threads}: should be 1 on a GPU.")
    with shown_progress(progress) as shown:
        pour = Pour(_sample_of(path), (fluid,), solver, nozzle, run.seed, slope)
        filled, _ = fill(pour, ComputeOptions(chosen, run.threads, shown))
    warn((*filled.doubts, *run_warnings(filled, filled.health.volume_ratio or 0.0)))
    return SimulatedRun(**content_of(filled), path=path, fluid=fluid)


@public(SampleSlope)
def fill_fast(
    path: PlannedPath,
    fluid: Fluid,
    *,
    settle_s: float = 2.0,
    nozzle: Nozzle | None = None,
    **keywords: Unpack[SlopeKeywords],
) -> SimulatedRun:
    """Fill the crack with the fast model. This takes a tenth of a second instead of minutes.

    The fast model computes a layer of paste that spreads along the crack. ``inject`` computes particles.

    Parameters
    ----------
    path, fluid
        The nozzle's path and the sealant. The ``Fluid`` must have ``viscosity_pa_s`` or a yield stress, and must
        neither freeze nor stiffen.
    settle_s
        Simulated time after the nozzle has stopped, in s.
    nozzle
        Settings of the nozzle. Default: ``Nozzle()``, 2.4 mm wide, or as wide as a narrower crack.

    Returns
    -------
    SimulatedRun
        A run without particles. Its ``level`` has stations every 0.2 mm from s = 0 to the crack's length.

    Raises
    ------
    InputError
        The model cannot compute this sealant, a value is out of bounds, or the path dispenses no sealant.

    Warns
    -----
    RuntimeWarning
        The model is not valid for this crack, path or sealant. There is one warning for each reason.

    Examples
    --------
    ``path`` is from the example of ``plan_path``.

    >>> paste = st.Fluid(viscosity_pa_s=1, yield_stress_pa=5, freeze_after_s="never")
    >>> run = st.fill_fast(path, paste)
    >>> run.level.level_mm.shape
    (301,)
    """
    slope = settings_from(SampleSlope, "fill_fast", keywords)
    from simulate.pour import Pour
    from simulate.slot.run import pour

    solver = checked(Solver, Path("fill_fast"), {"model": "slot", "radius_mm": "auto", "settle_s": settle_s})
    nozzle, fluid = nozzle or Nozzle(), fluid.loaded(Path())
    filled, _ = pour(Pour(_sample_of(path), (fluid,), solver, nozzle, slope=slope))
    warn((*filled.doubts, *filled.unfit))
    return SimulatedRun(**content_of(filled), path=path, fluid=fluid)


def _sample_of(path: PlannedPath) -> Sample:
    return Sample(path.solid.crack, path.solid, path)


@public(ProgramOptions)
def write_robot_program(
    folder: FilePath,
    path: PlannedPath,
    cell: FilePath | Mapping[str, Any],
    *,
    formats: Sequence[str] = (),
    name: str = "",
) -> list[Path]:
    """Write a nozzle path as robot programs in the robot's frame. The path is checked against the limits of the cell.

    Parameters
    ----------
    folder
        Folder for the files. A file that was edited after it was written is not replaced.
    path
        The nozzle's path.
    cell
        A cell file, or its content as a mapping: taught points, limits, languages. ``sealtwin robot --example FILE``
        writes an example.
    name
        Name of the trial in the header of each program.

    Returns
    -------
    list of Path
        The written files. The last one, robot.json, states the frame, the limits and the hashes.

    Raises
    ------
    InputError
        The cell is not valid or has no table for a format, or the path exceeds a limit of the cell.

    Examples
    --------
    ``path`` is from the example of ``plan_path``. 'sealtwin robot --example cell.toml' writes the cell file.

    >>> files = st.write_robot_program("robot", path, "cell.toml", formats=["csv"])
    >>> [file.name for file in files]
    ['path.csv', 'robot.json']
    """
    options = settings_from(ProgramOptions, "write_robot_program", {"formats": formats})
    from sealtwin.trial.exports import REPORT, CellFile, write_programs

    origin = {
        "trial": name or "not named",
        "run": "from Python",
        "path_source": path.solid.crack.path_source,
        "inputs": {},
        "edited_by_hand": [],
    }
    target = Path(folder)
    read = CellFile.read(cell if isinstance(cell, Mapping) else Path(cell))
    report, _ = write_programs(target, path, read, options, origin)
    return [*(target / file for file in report["files"]), target / REPORT]
