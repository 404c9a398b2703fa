"""A plan for a trial, and for the rest of a pour."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.api.shared import FilePath, Points, path_or_none, settings_from, warn
from sealtwin.core import files, record_files
from sealtwin.core.progress import progress_for_stderr, wanted
from sealtwin.core.records import Floats
from sealtwin.core.settings_text import keywords_of
from sealtwin.plan import PlanOptions
from sealtwin.plan import make_plan as planning
from sealtwin.plan import rest as resting

__all__ = ["FlowPlan", "plan_flow", "plan_rest"]


@dataclass(frozen=True)
class FlowPlan:
    """A plan: what ``plan_flow`` and ``plan_rest`` return.

    ``t_s``, ``speed_mm_s`` and ``flow_mm3_s`` are (n,), ``position_mm`` is (n, 3); each row is valid until the time of
    the next. ``s_mm`` and ``level_mm``, (m,), are the level after the pour. ``half_width_mm`` is the half-width of the
    level's 95 % band; it is None if the plan has only one seed, or none.
    """

    folder: Path
    t_s: Floats
    position_mm: Floats
    speed_mm_s: Floats
    flow_mm3_s: Floats
    s_mm: Floats
    level_mm: Floats
    half_width_mm: Floats | None
    verified: bool
    """True if in particle runs the plan was better than both baselines."""
    content: dict[str, Any]
    """Content of plan.json or rest.json: under_mm3, over_mm3, baselines, rounds, chances, flow_factor."""


@keywords_of(PlanOptions)
def plan_flow(
    trial: FilePath,
    *,
    out: FilePath | None = None,
    cell: FilePath | None = None,
    posterior: FilePath | None = None,
    flow_max_mm3_s: float | None = None,
    margin_mm: float | None = None,
    reserve_mm: float | None = None,
    knots: int | None = None,
    verify: int | None = None,
    seeds: int | None = None,
    keep_speed: bool | None = None,
    accurate: bool | None = None,
    device: str = "auto",
    progress: bool | None = None,
) -> FlowPlan:
    """Plan flow and speed along a crack, as ``sealtwin plan`` does.

    Parameters
    ----------
    trial
        A trial file with a path, and a sealant that does not age.
    out
        The plan's folder; by default reports/NAME-plan.
    device
        Device of the particle runs.
    progress
        Show progress on stderr; default: if stderr is a terminal, or in a notebook.

    Returns
    -------
    FlowPlan
        The plan that was best in particle runs.

    Raises
    ------
    InputError
        Trial, cell or posterior cannot be used, or no plan is possible within the limits.
    NumericalError
        A particle run failed.

    Warns
    -----
    RuntimeWarning
        The model cannot represent this sealant, or results are unreliable: one warning for each reason.
    """
    options = settings_from(PlanOptions, "plan_flow", locals())
    from simulate.device import choose_device

    shown = progress_for_stderr(quiet=not wanted(progress))
    made = planning.make_plan(Path(trial), path_or_none(out), options, shown, device=choose_device(device))
    warn(made.content["fluid_warnings"])
    return _flow_plan(made.content, planning.TABLE)


@keywords_of(PlanOptions)
def plan_rest(
    trial: FilePath,
    levels: FilePath | Points,
    *,
    out: FilePath | None = None,
    cell: FilePath | None = None,
    flow_max_mm3_s: float | None = None,
    margin_mm: float | None = None,
    reserve_mm: float | None = None,
    knots: int | None = None,
    keep_speed: bool | None = None,
    progress: bool | None = None,
) -> FlowPlan:
    """Plan the rest of a paused pour from the levels so far, as ``sealtwin plan --from`` does.

    The fast model estimates how much of the requested sealant is in the crack, and takes the pump to go on alike. The
    rest begins at the first place that would stay low.

    Parameters
    ----------
    trial
        The trial file of the pour, mostly trial.toml in a plan's folder.
    levels
        Rows of s and the measured level in mm, (n, 2), or a CSV of s_mm and level_mm: from the beginning of the pour up
        to the nozzle. Levels below the face are negative.
    out
        Folder of the rest; by default reports/NAME-rest.
    progress
        As in ``plan_flow``.

    Returns
    -------
    FlowPlan
        The rest of the path, and the level at its end by the fast model, which the measured levels have corrected.

    Raises
    ------
    InputError
        Trial, cell or levels cannot be used.
    """
    options = settings_from(PlanOptions, "plan_rest", locals())
    shown = progress_for_stderr(quiet=not wanted(progress))
    made = resting.plan_rest(Path(trial), levels, path_or_none(out), options, shown)
    return _flow_plan(made.content, resting.TABLE)


def _flow_plan(content: dict[str, Any], table: str) -> FlowPlan:
    folder = Path(content["folder"])
    path = files.read_table(folder / table, ("t_s", "x_mm", "y_mm", "z_mm", "speed_mm_s", "flow_mm3_s"))
    level = files.read_table(folder / record_files.LEVEL, record_files.LEVEL_COLUMNS)
    half_width_mm = np.asarray(level[:, 3] - level[:, 1])
    return FlowPlan(
        folder=folder,
        t_s=path[:, 0],
        position_mm=path[:, 1:4],
        speed_mm_s=path[:, 4],
        flow_mm3_s=path[:, 5],
        s_mm=level[:, 0],
        level_mm=level[:, 1],
        half_width_mm=None if np.isnan(half_width_mm).any() else half_width_mm,
        verified=content["verified"],
        content=content,
    )
