"""A digital twin of the sealing of a crack: from a photo to a fluid run, a comparison with readings, and a report.

``import sealtwin as st`` gives access to the names below. Each name is loaded when it is first used, so the import is
fast and loads no numerical library. Lengths are in millimetres, times in seconds and stresses in pascals; names contain
the unit. Faults that a user can correct are raised as ``SealtwinError``, usually as its subclass ``InputError``.

Functions take and return frozen records of NumPy arrays::

    read_photo -> trace_crack -> build_solid -> plan_path -> inject -> compare -> write_report

Each result has the result from which it was computed: ``result.level``, ``level.run``, ``run.path``, ``path.solid``,
``solid.crack``.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from sealtwin.api import InputError, NumericalError, SealtwinError
    from sealtwin.api.levels import (
        LevelComparison,
        LevelReadings,
        compare,
        plot_levels,
        read_readings,
        write_report,
    )
    from sealtwin.api.runs import (
        Fluid,
        Nozzle,
        PlannedPath,
        SimulatedLevel,
        SimulatedRun,
        Solver,
        fill_fast,
        inject,
        plan_path,
        write_robot_program,
    )
    from sealtwin.api.samples import (
        CrackOutline,
        SamplePhoto,
        SampleSolid,
        build_solid,
        crack_from_polyline,
        crack_from_walls,
        import_dxf,
        import_mesh,
        read_photo,
        trace_crack,
    )
    from sealtwin.api.studies import CalibrationResult, SweepResult, calibrate, sweep, write_map
    from sealtwin.api.trials import FlowPlan, TrialRun, open_run, plan_flow, run_trial

__all__ = [
    "CalibrationResult",
    "CrackOutline",
    "FlowPlan",
    "Fluid",
    "InputError",
    "LevelComparison",
    "LevelReadings",
    "Nozzle",
    "NumericalError",
    "PlannedPath",
    "SamplePhoto",
    "SampleSolid",
    "SealtwinError",
    "SimulatedLevel",
    "SimulatedRun",
    "Solver",
    "SweepResult",
    "TrialRun",
    "build_solid",
    "calibrate",
    "compare",
    "crack_from_polyline",
    "crack_from_walls",
    "fill_fast",
    "import_dxf",
    "import_mesh",
    "inject",
    "open_run",
    "plan_flow",
    "plan_path",
    "plot_levels",
    "read_photo",
    "read_readings",
    "run_trial",
    "sweep",
    "trace_crack",
    "write_map",
    "write_report",
    "write_robot_program",
]

_MODULES = ("", ".trials", ".studies", ".runs", ".samples", ".levels")
"""Modules of ``sealtwin.api``, fewest loaded libraries first."""


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used (PEP 562)."""
    if name == "__version__":
        from importlib.metadata import version

        return version("sealtwin")
    if name not in __all__:
        raise AttributeError(f"module 'sealtwin' has no attribute {name!r}")
    from importlib import import_module

    modules = (import_module(f"sealtwin.api{module}") for module in _MODULES)
    globals()[name] = value = next(getattr(module, name) for module in modules if hasattr(module, name))
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
