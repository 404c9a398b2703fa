"""A plan for a trial, and the step that corrects it during the pour."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.api.shared import FilePath, path_or_none, warn
from sealtwin.core import files, record_files
from sealtwin.core.progress import progress_for_stderr, wanted
from sealtwin.core.records import Floats
from sealtwin.plan.loop_model import read_model
from sealtwin.plan.loop_step import LevelFrame, LoopModel, LoopState, RemainingPlan
from sealtwin.plan.loop_step import step as loop_step
from sealtwin.plan.make_loop import TABLES, loop_versions
from sealtwin.plan.make_plan import RESERVE_MM, TABLE, Options, make_plan

__all__ = ["FlowPlan", "LevelFrame", "LoopModel", "LoopState", "RemainingPlan", "loop_step", "plan_flow", "read_loop"]


@dataclass(frozen=True)
class FlowPlan:
    """A plan that was checked by particle runs: what ``plan_flow`` returns.

    ``t_s``, ``speed_mm_s`` and ``flow_mm3_s`` are (n,), ``position_mm`` is (n, 3); each row is valid until the time of
    the next. ``s_mm`` and ``level_mm``, (m,), are the level after the pour. ``half_width_mm`` is the half-width of the
    level's 95 % band; it is None if the plan has only one seed.
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
    """Content of plan.json: under_mm3, over_mm3, baselines, rounds, chances."""


def plan_flow(
    trial: FilePath,
    *,
    out: FilePath | None = None,
    cell: FilePath | None = None,
    posterior: FilePath | None = None,
    flow_max_mm3_s: float | None = None,
    margin_mm: float = 0.0,
    reserve_mm: float = RESERVE_MM,
    knots: int = 8,
    verify: int = 3,
    seeds: int = 3,
    keep_speed: bool = False,
    accurate: bool = False,
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
    cell, posterior
        A robot's cell file, whose limits bound the plan; and a CSV of draws of the sealant's settings.
    flow_max_mm3_s, margin_mm, reserve_mm
        Largest flow in mm3/s if no cell sets it; level to aim at, in mm below the face, and a further distance for a
        pump that gives more and a paste that is softer.
    knots, verify, seeds
        Number of places along the path where flow and speed are free; rounds of search and particle run; particle runs
        of the best plan.
    keep_speed
        True plans only the flow.
    accurate
        True computes all runs with the trial's solver settings; otherwise all but the last are drafts.
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
    from simulate.device import choose_device

    options = Options(knots, verify, seeds, not accurate, margin_mm, flow_max_mm3_s, keep_speed, reserve_mm)
    content = make_plan(
        Path(trial),
        path_or_none(out),
        options,
        progress_for_stderr(quiet=not wanted(progress)),
        device=choose_device(device),
        cell_file=path_or_none(cell),
        posterior=path_or_none(posterior),
    ).content
    warn(content["fluid_warnings"])
    folder = Path(content["folder"])
    path = files.read_table(folder / TABLE, ("t_s", "x_mm", "y_mm", "z_mm", "speed_mm_s", "flow_mm3_s"))
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


def read_loop(folder: FilePath) -> LoopModel:
    """Read the tables that ``sealtwin loop`` wrote into a plan's folder.

    Parameters
    ----------
    folder
        The plan's folder.

    Returns
    -------
    LoopModel
        Tables for ``loop_step``; its first state is ``LoopState.start(model)``.

    Raises
    ------
    InputError
        The folder has no tables, or they are damaged.

    Warns
    -----
    RuntimeWarning
        Another version of digitise or simulate computed the tables, or the plan.
    """
    model = read_model(Path(folder) / TABLES)
    warn(loop_versions(Path(folder)))
    return model
