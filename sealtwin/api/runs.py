"""Plan the nozzle's path over a crack, write its robot program, compute the fluid run, and measure the level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from digitise.robots.cell import ProgramOptions
from digitise.settings import NozzlePath
from sealtwin.api import FilePath, content_of, of_one_crack, require_kinds, settings_from, shown_progress, warn
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts
from sealtwin.core.records import Origins, Outline, Profile, Run, Sample, Solid, Trajectory
from sealtwin.core.settings import checked, doubts_of
from sealtwin.core.settings_text import keywords_of
from simulate.block import BlockRelease, FluidBlock
from simulate.settings import Fluid, Nozzle, SampleSlope, Solver

SEEDS = 2**31


@dataclass(frozen=True, kw_only=True, repr=False)
class PlannedPath(Trajectory):
    """A timed nozzle path: what ``plan_path`` returns.

    ``t_s``, ``s_mm``, ``speed_mm_s`` and ``flow_mm3_s`` are (n,), and ``position_mm`` is (n, 3). Speed and flow of a
    row are valid until the time of the next row. They are 0 in the last row.
    """

    settings: NozzlePath
    """Settings with which the path was planned."""

    @property
    def doubts(self) -> Facts:
        """Warnings about settings outside their usual ranges."""
        return doubts_of(self.settings)


@keywords_of(NozzlePath, without=("weighed", "plan"))
def plan_path(
    crack: Outline,
    solid: Solid,
    **keywords: Any,
) -> PlannedPath:
    """Plan the nozzle's path, speed and flow. Keywords are settings of [path] in a trial file.

    Parameters
    ----------
    crack, solid
        The traced crack and its solid.

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
    >>> path = st.plan_path(crack, solid, volume_ml=1.4, speed_mm_s=5, trim_mm=5)
    >>> round(path.length_mm), round(path.duration_s)
    (50, 10)
    """
    settings = settings_from(NozzlePath, "plan_path", locals())
    from digitise.trajectory import plan_trajectory

    made_of = of_one_crack("plan_path", crack, solid)[:1]
    trajectory = plan_trajectory(crack, settings, solid.cavity_volume_mm3, solid.sections)
    path = PlannedPath(**content_of(replace(trajectory, made_of=made_of)), settings=settings)
    warn(path.doubts)
    return path


@dataclass(frozen=True, kw_only=True, repr=False)
class SimulatedLevel(Profile):
    """The level of the sealant along the crack after a run: what ``measure_level`` returns.

    ``s_mm`` is the arc length and ``level_mm`` the level relative to the face, negative below it, (n,) each, in mm.
    """

    escaped_particles: int
    """Number of particles that went through a wall. If it is not 0, the level is not valid."""
    dispensed_mm3: float = 0.0
    """Dispensed volume, from which the baseline of a flat level follows. 0 if it is unknown."""
    density_kg_m3: float | None = None
    """Density of the sealant, from which its meniscus follows. None if it is unknown."""
    run: Run
    """Run whose level was measured."""


@keywords_of(SampleSlope)
def inject(
    crack: Outline,
    solid: Solid,
    path: Trajectory,
    fluid: Fluid,
    *,
    solver: Solver | None = None,
    nozzle: Nozzle | None = None,
    seed: int = 0,
    device: str = "cpu",
    threads: int | None = None,
    progress: bool | None = None,
    **keywords: Any,
) -> Run:
    """Inject the sealant along the path and let it settle.

    Parameters
    ----------
    crack, solid, path, fluid
        The crack, its solid, the nozzle's path, and the sealant.
    solver, nozzle
        Settings of the solver and the nozzle. Default: ``Solver(radius_mm="auto", settle_s=2)``, as in
        ``sealtwin init``, and ``Nozzle()``, 2.4 mm wide.
    seed
        Seed of the small random offsets of particles at the nozzle.
    device
        "cpu" (default), "cuda:0", or "auto" for the first GPU, or for the CPU if there is no GPU. A device that does
        not exist is an error.
    threads
        Number of CPU threads, on which the result does not depend. Default: one per core, up to 8.
    progress
        True to show progress on stderr. Default: True in a terminal or a notebook.

    Returns
    -------
    Run
        The particles at the end of the run. ``position_mm``, (n, 3), is in mm. ``health`` contains figures of numerical
        quality. On a CPU, the same input gives bit-identical results.

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
    >>> path = st.plan_path(crack, solid, volume_ml=0.2, speed_mm_s=20, trim_mm=2)
    >>> paste = st.Fluid(viscosity_pa_s=1, yield_stress_pa=5, freeze_after_s="never")
    >>> run = st.inject(crack, solid, path, paste, solver=st.Solver(radius_mm=0.45, settle_s=0.2))
    >>> run.escaped_particles
    0
    """
    slope = settings_from(SampleSlope, "inject", locals())
    made_of = of_one_crack("inject", crack, solid, path)
    from simulate.device import choose_device
    from simulate.injection import ComputeOptions
    from simulate.pour import Pour
    from simulate.run import fill
    from validate.run_facts import run_warnings

    solver = solver or Solver(radius_mm="auto", settle_s=2.0)
    nozzle = nozzle or Nozzle()
    _require_seed("inject", seed)
    require_kinds("inject", fluid=(fluid, Fluid), solver=(solver, Solver), nozzle=(nozzle, Nozzle))
    fluid = fluid.loaded(Path())
    chosen = choose_device(device)
    if threads is not None and (threads < 1 or (threads > 1 and chosen != "cpu")):
        raise InputError(f"inject: threads = {threads}, but it must be at least 1, and exactly 1 on a GPU.")
    with shown_progress(progress) as shown:
        pour = Pour(Sample(crack, solid, path), (fluid,), solver, nozzle, seed, slope)
        run, _ = fill(pour, ComputeOptions(chosen, threads, shown))
    warn((*run.doubts, *run_warnings(run, run.health.volume_ratio or 0.0)))
    return replace(run, made_of=made_of)


@keywords_of(SampleSlope)
def fill_fast(
    crack: Outline,
    solid: Solid,
    path: Trajectory,
    fluid: Fluid,
    *,
    settle_s: float = 2.0,
    nozzle: Nozzle | None = None,
    **keywords: Any,
) -> SimulatedLevel:
    """Fill the crack with the fast model. This takes a tenth of a second instead of minutes.

    The fast model computes a layer of paste that spreads along the crack. ``inject`` computes particles.

    Parameters
    ----------
    crack, solid, path, fluid
        The crack, its solid, the nozzle's path, and the sealant. The ``Fluid`` must have ``viscosity_pa_s`` or a yield
        stress, and must neither freeze nor stiffen.
    settle_s
        Simulated time after the nozzle has stopped, in s.
    nozzle
        Settings of the nozzle. Default: ``Nozzle()``, 2.4 mm wide.

    Returns
    -------
    SimulatedLevel
        Stations every 0.2 mm from s = 0 to the crack's length.

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
    ``crack``, ``solid`` and ``path`` are from the example of ``plan_path``.

    >>> paste = st.Fluid(viscosity_pa_s=1, yield_stress_pa=5, freeze_after_s="never")
    >>> level = st.fill_fast(crack, solid, path, paste)
    >>> level.level_mm.shape
    (301,)
    """
    slope = settings_from(SampleSlope, "fill_fast", locals())
    made_of = of_one_crack("fill_fast", crack, solid, path)
    from simulate.pour import Pour
    from simulate.slot.run import pour

    solver = checked(Solver, Path("fill_fast"), {"model": "slot", "radius_mm": "auto", "settle_s": settle_s})
    nozzle = nozzle or Nozzle()
    require_kinds("fill_fast", fluid=(fluid, Fluid), nozzle=(nozzle, Nozzle))
    run, level = pour(Pour(Sample(crack, solid, path), (fluid.loaded(Path()),), solver, nozzle, slope=slope))
    warn((*run.doubts, *run.unfit))
    return _simulated(level, run, made_of)


@keywords_of(FluidBlock, SampleSlope)
def release_block(
    length_mm: float,
    width_mm: float,
    height_mm: float,
    fluid: Fluid,
    *,
    solver: Solver,
    seed: int = 0,
    device: str = "cpu",
    progress: bool | None = None,
    **keywords: Any,
) -> BlockRelease:
    """Release a block of fluid behind a gate, as in a dam break.

    The fluid sticks to all walls.

    Parameters
    ----------
    fluid
        Settings of the fluid.
    solver
        Settings of the solver, with ``radius_mm``. With 12 to 20 particle diameters across the block's shortest side,
        halving the radius moves the front by about 3 %. ``substeps`` divides the longest possible substep. Default: 1.
    seed
        Seed of the small random offsets of the particles' first positions.
    device
        "cpu" (default), "cuda:0", or "auto" for the first GPU, or for the CPU if there is no GPU.
    progress
        True to show progress on stderr. Default: True in a terminal or a notebook.

    Returns
    -------
    BlockRelease
        Front, height and volume over time, each (n,), and the particles at the end.

    Raises
    ------
    InputError
        A value is out of bounds, the fluid is too viscous for the radius, or the block has too few or too many
        particles.
    NumericalError
        The fluid reaches the edge of the plate, or the computation fails.

    Examples
    --------
    >>> fluid = st.Fluid(viscosity_pa_s=1, yield_stress_pa=20, freeze_after_s="never")
    >>> block = st.release_block(20, 10, 10, fluid, duration_s=0.1, solver=st.Solver(radius_mm=0.8))
    >>> bool(block.front_mm[-1] > 0)
    True
    """
    block = settings_from(FluidBlock, "release_block", locals())
    slope = settings_from(SampleSlope, "release_block", locals())
    from simulate.block_release import release
    from simulate.device import choose_device
    from simulate.injection import ComputeOptions

    _require_seed("release_block", seed)
    require_kinds("release_block", fluid=(fluid, Fluid), solver=(solver, Solver))
    with shown_progress(progress) as shown:
        options = ComputeOptions(choose_device(device), progress=shown)
        return release(block, fluid.loaded(Path()), solver, options=options, slope=slope, seed=seed)


def measure_level(run: Run, crack: Outline, solid: Solid) -> SimulatedLevel:
    """Measure the level of the settled sealant along the crack, as a caliper would measure it.

    Parameters
    ----------
    run, crack, solid
        The run, and its crack and solid.

    Returns
    -------
    SimulatedLevel
        Stations every 0.2 mm from s = 0 to the crack's length. Sealant on the face next to the crack is not counted.

    Raises
    ------
    NumericalError
        The position of a particle is not finite.

    Examples
    --------
    ``crack``, ``solid`` and ``run`` are from the example of ``inject``.

    >>> level = st.measure_level(run, crack, solid)
    >>> level.level_mm.shape
    (76,)
    """
    from simulate.profile import measure_profile

    made_of = of_one_crack("measure_level", run, crack, solid)
    return _simulated(measure_profile(run, crack, solid), run, made_of)


@keywords_of(ProgramOptions)
def write_robot_program(
    folder: FilePath,
    crack: Outline,
    path: Trajectory,
    cell: FilePath | Mapping[str, Any],
    *,
    formats: Sequence[str] | None = None,
    name: str = "",
) -> list[Path]:
    """Write a nozzle path as robot programs in the robot's frame. The path is checked against the limits of the cell.

    Parameters
    ----------
    folder
        Folder for the files. A file that was edited after it was written is not replaced.
    crack, path
        The crack and the nozzle's path.
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
    ``crack`` and ``path`` are from the example of ``plan_path``. 'sealtwin robot --example cell.toml' writes the cell
    file.

    >>> files = st.write_robot_program("robot", crack, path, "cell.toml", formats=["csv"])
    >>> [file.name for file in files]
    ['path.csv', 'robot.json']
    """
    options = settings_from(ProgramOptions, "write_robot_program", locals())
    from sealtwin.trial.exports import REPORT, CellFile, write_programs

    of_one_crack("write_robot_program", crack, path)
    origin = {
        "trial": name or "not named",
        "run": "from Python",
        "path_source": crack.path_source,
        "inputs": {},
        "edited_by_hand": [],
    }
    target = Path(folder)
    read = CellFile.read(cell if isinstance(cell, Mapping) else Path(cell))
    report, _ = write_programs(target, path, read, options, origin)
    return [*(target / file for file in report["files"]), target / REPORT]


def _simulated(profile: Profile, run: Run, made_of: Origins) -> SimulatedLevel:
    profile = replace(profile, doubts=run.doubts, made_of=made_of)
    return SimulatedLevel(
        **content_of(profile),
        escaped_particles=run.escaped_particles,
        dispensed_mm3=run.dispensed_volume_mm3,
        density_kg_m3=run.density_kg_m3,
        run=run,
    )


def _require_seed(function: str, seed: int) -> None:
    if not 0 <= seed < SEEDS:
        raise InputError(f"{function}: seed = {seed}, but it must be 0 to {SEEDS - 1}.")
