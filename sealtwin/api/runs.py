"""The nozzle's path over a crack, the fluid run along it, and the level that the run leaves.

Fluid, solver and nozzle are tables of a trial file, constructed by keywords.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from digitise.settings import NozzlePath
from sealtwin.api.shared import content_of, settings_from, settings_of
from sealtwin.core.errors import InputError
from sealtwin.core.progress import progress_for_stderr
from sealtwin.core.records import Outline, Profile, Run, Sample, Solid, Trajectory
from sealtwin.core.settings import Settings
from simulate import settings as tables

SEEDS = 2**31


@dataclass(frozen=True, kw_only=True)
class PlannedPath(Trajectory):
    """A timed nozzle path: what ``plan_path`` returns.

    ``t_s``, ``s_mm``, ``speed_mm_s`` and ``flow_mm3_s`` are (n,), ``position_mm`` is (n, 3); each row holds until the
    next, and the last one has speed and flow 0.
    """

    settings: NozzlePath
    """The settings that it was planned with."""


def plan_path(
    crack: Outline,
    solid: Solid,
    *,
    speed_mm_s: float = 4.0,
    volume_ml: float | Literal["cavity"] = "cavity",
    fill: float = 1.0,
    flow: Literal["constant", "cross_section"] = "constant",
    trim_mm: float | Sequence[float] = 10.0,
    reverse: bool = False,
    ramp_mm: float = 0.0,
    lead_in_mm: float = 0.0,
    lead_out_mm: float = 0.0,
    spacing_mm: float = 1.0,
    nozzle_height_mm: float = 3.0,
    smoothing_mm: float = 0.1,
) -> PlannedPath:
    """Plan where the nozzle goes, how fast, and how much it gives.

    Parameters
    ----------
    crack, solid
        The traced crack and its solid.
    speed_mm_s
        Speed along the path in mm/s.
    volume_ml, fill
        Sealant in ml; or "cavity" for the share ``fill`` of what the cavity holds.
    flow
        "constant": the same for every mm of path; "cross_section": more where the cavity is wider or deeper.
    trim_mm
        Distance in mm from the crack's ends at which the path starts and ends; one for both, or two.
    reverse
        Start from the crack's second end; s still counts from the first.
    ramp_mm, lead_in_mm, lead_out_mm
        Length over which the nozzle comes to speed and to a stop, and straight approaches before the path and after it,
        without flow, in mm.
    spacing_mm, nozzle_height_mm, smoothing_mm
        Distance between waypoints, height of the tip above the face, and bound of the RMS distance from the centreline,
        in mm.

    Returns
    -------
    PlannedPath
        Waypoints in mm and s.

    Raises
    ------
    InputError
        A value is out of bounds, or the crack is too short for trims or ramps.
    """
    given = locals()
    from digitise.trajectory import plan_trajectory

    settings = settings_from(NozzlePath, "plan_path", given)
    trajectory = plan_trajectory(crack, settings, solid.cavity_volume_mm3, solid.sections)
    return PlannedPath(**content_of(trajectory), settings=settings)


class _ByDefault:
    """A default in a signature, where the docstring has its value."""

    def __repr__(self) -> str:
        return "..."


class _FromKeywords(Settings):
    """A table that is constructed by keywords, which are refused as those of a trial file, by the table's own name."""

    # Checkers read the keywords off the fields.
    if not TYPE_CHECKING:

        def __init__(self, **values: Any) -> None:
            settings = settings_of(type(self).__bases__[1], self.__repr_name__(), values)
            super().__init__(**{key: getattr(settings, key) for key in settings.model_fields_set})

    @classmethod
    def __pydantic_init_subclass__(cls, **options: Any) -> None:
        # help() begins with the signature, and a notebook completes by it; with types and bounds it fills a page.
        names = [Parameter(name, Parameter.KEYWORD_ONLY, default=_ByDefault()) for name in cls.model_fields]
        cls.__signature__ = Signature(names)

    def __repr_name__(self) -> str:
        return type(self).__bases__[1].__name__


class FluidChoice(_FromKeywords, tables.Fluid):
    """The sealant.

    Parameters
    ----------
    U, D_cm
        Weights of the fluid's own viscosity, without a unit (U = 1 is about water), and of the walls' drag, in cm, in
        Eq. 5 of the paper. Give one of U, ``viscosity_pa_s`` and ``curve``.
    viscosity_pa_s, density_kg_m3
        Dynamic viscosity in Pa s; density in kg/m3, by default 1690: cement paste of water-cement ratio 0.67.
    consistency_pa_s_n, flow_index
        K and n of Herschel and Bulkley's stress, yield stress + K gamma^n, in place of a viscosity; n is 0.2 to 2.
    material
        A material.toml of ``sealtwin material``, in place of yield stress, density and, where it has one, viscosity.
    yield_stress_pa, structuration_pa_per_s, yield_stress_most_pa
        Stress in Pa below which the paste stands like a solid (Bingham; cement grouts have 5 to 37), its growth in Pa
        per second, both 0 by default, and the stress at which that growth ends.
    curve, cooling
        In place of viscosity and yield stress: a CSV file, or a mapping of its columns ``viscosity_pa_s``,
        ``yield_stress_pa`` and either ``age_s`` or ``temperature_c``; and with the latter a second one of ``age_s`` and
        ``temperature_c``. Between rows the logarithm of the viscosity and the yield stress are linear.
    freeze_after_s
        Age in s at which a particle is fixed where it lies, or "never". In Python "never" is the default; a trial file
        must say it. The paper's solver froze at 2.58 s and had no yield stress: a fluid with neither levels out.

    Raises
    ------
    InputError
        A keyword is unknown or its value out of bounds; or neither, or both, of U and viscosity_pa_s are given.

    Examples
    --------
    >>> import sealtwin as st
    >>> paste = st.Fluid(U=30, D_cm=0.3, yield_stress_pa=12)
    """

    freeze_after_s: float | Literal["never"] = "never"

    if TYPE_CHECKING:
        # A file's name or columns, as for any keyword.
        curve: Any = None
        cooling: Any = None
    else:

        def __init__(self, **values: Any) -> None:
            super().__init__(**{"freeze_after_s": "never", **values})


class SolverChoice(_FromKeywords, tables.Solver):
    """Resolution and constants of the fluid's computation.

    Parameters
    ----------
    preset
        "accurate" (default) keeps the dispensed volume; "paper" has the constants that the paper built on.
    radius_mm
        Radius of a particle in mm, 0.4 by default, or "auto": four abreast in the crack at hand. Half the radius takes
        about ten times as long.
    settle_s
        Time in s between the last release and the level's measurement; 0 by default.
    substeps, pressure, iterations, volume_factor, relaxation, damping_per_s, viscosity_solve, sleep
        As in the table [solver] of a trial file.

    Raises
    ------
    InputError
        A keyword is unknown or its value out of bounds.
    """


class NozzleChoice(_FromKeywords, tables.Nozzle):
    """The outlet of the sealant.

    Parameters
    ----------
    diameter_mm
        Inner diameter in mm; 2.4 by default, the paper's.

    Raises
    ------
    InputError
        A keyword is unknown or its value out of bounds.
    """


Fluid, Solver, Nozzle = FluidChoice, SolverChoice, NozzleChoice
"""Their public names."""


@dataclass(frozen=True, kw_only=True)
class SimulatedLevel(Profile):
    """The level of the sealant along the crack after a run: what ``measure_level`` returns.

    ``s_mm`` and ``level_mm`` are (n,): arc length, and level from the face, negative below it, in mm.
    """

    escaped_particles: int
    """Particles of the run that went through a wall: with one, the level means nothing."""
    dispensed_mm3: float = 0.0
    """Dispensed volume, whose flat level is a baseline; 0 if it is not known."""


def inject(
    crack: Outline,
    solid: Solid,
    path: Trajectory,
    fluid: tables.Fluid,
    *,
    solver: tables.Solver | None = None,
    nozzle: tables.Nozzle | None = None,
    crossfall_deg: float = 0.0,
    gradient_deg: float = 0.0,
    seed: int = 0,
    device: str = "cpu",
    threads: int = 1,
    progress: bool = False,
) -> Run:
    """Inject the sealant along the path and let it settle.

    Parameters
    ----------
    crack, solid, path, fluid
        The crack, its solid, the nozzle's path, and the sealant, a ``Fluid``.
    solver, nozzle
        How finely it is computed, and the outlet; left out, ``Solver(radius_mm="auto", settle_s=2)``, as
        ``sealtwin init`` writes it, and ``Nozzle()``, 2.4 mm wide.
    crossfall_deg, gradient_deg
        Slopes of the sample's face along y and along x in degrees, -45 to 45: above 0 the face rises towards +y and
        +x. Gravity turns; the nozzle gives, and levels are measured, square to the face.
    seed
        Seed of the small disorder with which particles leave the nozzle.
    device
        Where it runs: "cpu" (default), "cuda:0", or "auto" for the first GPU where there is one. It is never changed
        in silence: a device that is not there is an error.
    threads
        Threads of the CPU that share the run; the result is the same.
    progress
        Show progress on stderr.

    Returns
    -------
    Run
        The particles as they lie: ``position_mm`` (n, 3) in mm; ``health`` has the numbers that say whether to trust
        them. On one CPU the same input gives the same bits.

    Raises
    ------
    InputError
        The settings do not fit the crack, or the device is not there.
    NumericalError
        The numbers stopped meaning anything.

    Warns
    -----
    RuntimeWarning
        The run cannot show this sealant, or what it shows is not sound: a sentence each.
    """
    from simulate.device import choose_device
    from simulate.run import fill
    from validate.wording.headline import run_warnings

    solver = solver or SolverChoice(radius_mm="auto", settle_s=2.0)
    nozzle = nozzle or NozzleChoice()
    for value, kind in ((fluid, tables.Fluid), (solver, tables.Solver), (nozzle, tables.Nozzle)):
        if not isinstance(value, kind):
            name = kind.__name__.lower()
            raise InputError(f"inject: {name} is a {type(value).__name__}; give sealtwin.{kind.__name__}(...).")
    slope = settings_of(tables.SampleSlope, "inject", {"crossfall_deg": crossfall_deg, "gradient_deg": gradient_deg})
    if not 0 <= seed < SEEDS:
        raise InputError(f"inject: seed = {seed}: must be 0 to {SEEDS - 1}.")
    fluid = fluid.loaded(Path())
    chosen = choose_device(device)
    if threads < 1 or (threads > 1 and chosen != "cpu"):
        raise InputError(f"inject: threads = {threads}: must be 1 or more, and 1 on a GPU.")
    with progress_for_stderr(quiet=not progress) as shown:
        how = {"seed": seed, "device": chosen, "slope": slope, "threads": threads}
        run, _ = fill(Sample(crack, solid, path), fluid, solver, nozzle, progress=shown, **how)
    for text in run_warnings(run, run.health.volume_ratio or 0.0):
        warnings.warn(text, RuntimeWarning, stacklevel=2)
    return run


def measure_level(run: Run, crack: Outline, solid: Solid) -> SimulatedLevel:
    """Measure the level of the settled sealant along the crack, as a caliper would.

    Parameters
    ----------
    run, crack, solid
        The run, and the crack and solid that it was made in.

    Returns
    -------
    SimulatedLevel
        A station every 0.2 mm from s = 0 to the crack's length. Sealant that rests on the face beside the crack is left
        out.

    Raises
    ------
    NumericalError
        A particle has no finite position.
    """
    from simulate.profile import measure_profile

    profile = measure_profile(run, crack, solid)
    return SimulatedLevel(
        **content_of(profile), escaped_particles=run.escaped_particles, dispensed_mm3=run.dispensed_volume_mm3
    )
