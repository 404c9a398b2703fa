"""Run a trial, and plan its pour."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from sealtwin.api import FilePath, of_one_crack, path_or_none, settings_from, shown_progress, warn
from sealtwin.core import record_files
from sealtwin.core.errors import InputError
from sealtwin.core.files import read_table
from sealtwin.core.progress import wanted
from sealtwin.core.records import Floats, Outline, Profile, Run, Solid, Trajectory
from sealtwin.core.settings_text import keywords_of
from sealtwin.plan import PlanOptions
from validate.result import TrialResult

if TYPE_CHECKING:
    from sealtwin.trial.trial_file import Trial

Record = TypeVar("Record", Solid, Trajectory, Run, Profile)


@dataclass(frozen=True)
class TrialRun:
    """Results of a trial, and its run folder: what ``run_trial`` returns."""

    folder: Path
    result: TrialResult
    """Content of run.json: figures by name, with units in the names."""
    redone: tuple[str, ...]
    """Stages that were computed. The other stages were up to date."""

    @property
    def report(self) -> Path:
        """The report's page."""
        return self.folder / "report.html"

    @property
    def mean_error_mm(self) -> float | None:
        """Mean error relative to the readings in mm. None if there are no readings."""
        return self.result.comparison and self.result.comparison.mean_error_mm

    @property
    def interval_95_mm(self) -> tuple[float, float] | None:
        """Ends of the 95 % interval of the mean error, in mm. None if there are no readings."""
        return self.result.comparison and self.result.comparison.interval_95_mm

    @property
    def verdict(self) -> str | None:
        """Headline of the report. None if there are no readings."""
        return self.result.comparison and self.result.comparison.verdict

    @property
    def gate_passed(self) -> bool | None:
        """True if the mean error is within the declared gate. None if no gate was declared."""
        return self.result.comparison and self.result.comparison.passed

    @cached_property
    def crack(self) -> Outline:
        """The traced crack."""
        return record_files.read_outline(self.folder)

    @cached_property
    def solid(self) -> Solid:
        """The solid of the sample."""
        return replace(record_files.read_solid(self.folder), made_of=of_one_crack("run_trial", self.crack))

    @cached_property
    def path(self) -> Trajectory:
        """The nozzle's path."""
        return replace(record_files.read_trajectory(self.folder), made_of=of_one_crack("run_trial", self.crack))

    @cached_property
    def run(self) -> Run:
        """The particles at the end of the run. With several seeds, the particles of the first run."""
        return self._of_pour(record_files.read_run(self.folder))

    @cached_property
    def level(self) -> Profile:
        """The simulated level along the crack. With several seeds, the mean of their levels."""
        read = record_files.read_profile if self.result.seeds is None else record_files.read_level
        return self._of_pour(read(self.folder))

    def _of_pour(self, record: Record) -> Record:
        return replace(record, made_of=of_one_crack("run_trial", self.crack, self.solid, self.path))


def run_trial(
    trial: "FilePath | Mapping[str, Any] | Trial",
    *,
    out: FilePath | None = None,
    device: str = "cpu",
    threads: int | None = None,
    source: FilePath | None = None,
    seeds: int | None = None,
    progress: bool | None = None,
) -> TrialRun:
    """Run all stages of a trial that are not up to date in its run folder, as ``sealtwin run`` does.

    Parameters
    ----------
    trial
        A trial file, or its content as a mapping or a ``Trial``.
    out
        Run folder. Default: reports/<name of the trial> in the current folder.
    device, threads
        Device of the fluid run: "cpu" (default), "cuda:0" or "auto". Number of CPU threads. Default: one per core, up
        to 8.
    source
        Folder of the photo and the readings, if the trial is not a file. Default: the current folder.
    seeds
        Number of runs with different seeds, 1 to 20, which replaces the trial's ``seeds``. The first seed is the
        trial's ``seed``. The level is the mean of the runs, and ``result.seeds.band_95_mm`` is the half-width of the
        band for one further run. The runs are computed in this process, one after the other; ``sealtwin run`` computes
        them at the same time.
    progress
        True to show progress on stderr. Default: True in a terminal or a notebook.

    Returns
    -------
    TrialRun
        Figures, and the records of each stage. If the gate is missed, there is no error; see ``gate_passed``.

    Raises
    ------
    InputError
        The trial has an invalid key or value, or an input cannot be used.
    NumericalError
        The simulation diverged, or a particle went through a wall.
    BusyError
        Another process uses the run folder.

    Warns
    -----
    RuntimeWarning
        The model cannot represent this sealant, or the result is unreliable. There is one warning for each reason, as
        in ``fluid.warnings``. Also, the photo or the readings are doubtful, or a file was edited. With ``progress``,
        these warnings are printed on stderr instead.

    Examples
    --------
    >>> trial = st.run_trial("trial.toml", out="run")
    >>> trial.redone
    ('digitise', 'simulate', 'validate')
    """
    from sealtwin.study.pipeline import run_trial
    from sealtwin.trial.job import STAGES, run_folder_of
    from sealtwin.trial.trial_file import Trial, checked_trial, load_trial

    home, file = path_or_none(source), None
    if isinstance(trial, Trial):
        settings = trial
    elif isinstance(trial, Mapping):
        settings = checked_trial(Path("run_trial"), trial)
    elif source is None:
        settings, file = load_trial(Path(trial)), Path(trial)
    else:
        raise InputError(
            "run_trial: paths in a trial file are relative to the file's folder, so source has no effect. Omit source."
        )
    if seeds is not None:
        settings = settings.changed({"seeds": seeds}, Path("run_trial"))
    if file is None:
        home = home or Path()
        file = home / settings.shown_by.file
    target = path_or_none(out) or run_folder_of(file, settings)
    with shown_progress(progress) as shown:
        outcome = run_trial(settings, file, target, STAGES, device, shown, threads, source=home)
    facts = [] if wanted(progress) else shown.warned
    warn(dict.fromkeys([*facts, *(outcome.result.fluid.warnings if outcome.result.fluid else ())]))
    return TrialRun(target, outcome.result, outcome.redone)


@dataclass(frozen=True)
class FlowPlan:
    """A plan of flow and speed, and its folder: what ``plan_flow`` returns.

    ``t_s``, ``speed_mm_s`` and ``flow_mm3_s`` are (n,), and ``position_mm`` is (n, 3). Speed and flow of a row are
    valid until the time of the next row. ``s_mm`` and ``level_mm``, (m,), are the level after the pour.
    ``half_width_mm`` is the half-width of the level's 95 % band. It is None if the plan was computed with fewer than
    two seeds.
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
    """True if the plan was better than both baselines in particle runs."""
    content: dict[str, Any]
    """Content of plan.json: under_mm3, over_mm3, baselines, rounds."""


@keywords_of(PlanOptions)
def plan_flow(
    trial: FilePath,
    *,
    out: FilePath | None = None,
    device: str = "auto",
    progress: bool | None = None,
    **keywords: Any,
) -> FlowPlan:
    """Plan flow and speed along a crack, as ``sealtwin plan`` does.

    Parameters
    ----------
    trial
        A trial file with a path, and a sealant whose properties do not change with its age.
    out
        Folder for the plan. Default: reports/NAME-plan.
    device
        Device of the particle runs.
    progress
        True to show progress on stderr. Default: True in a terminal or a notebook.

    Returns
    -------
    FlowPlan
        The plan that was best in particle runs.

    Raises
    ------
    InputError
        The trial or the cell cannot be used, or no plan is possible within the limits.
    NumericalError
        A particle run failed.

    Warns
    -----
    RuntimeWarning
        The model cannot represent this sealant, or results are unreliable. There is one warning for each reason.

    Examples
    --------
    >>> plan = st.plan_flow("planned.toml", out="plan", knots=3, verify=1, seeds=1, device="cpu")
    >>> len(plan.t_s) == len(plan.flow_mm3_s)
    True
    """
    options = settings_from(PlanOptions, "plan_flow", locals())
    from sealtwin.plan.make_plan import TABLE, make_plan
    from simulate.device import choose_device

    shown = shown_progress(progress)
    made = make_plan(Path(trial), path_or_none(out), options, shown, device=choose_device(device))
    warn(made.content["fluid_warnings"])
    folder = Path(made.content["folder"])
    path = read_table(folder / TABLE, ("t_s", "x_mm", "y_mm", "z_mm", "speed_mm_s", "flow_mm3_s"))
    s_mm, level_mm, _, high_mm = read_table(folder / record_files.LEVEL, record_files.LEVEL_COLUMNS).T
    half_width_mm = None if np.isnan(high_mm).any() else high_mm - level_mm
    after = s_mm, level_mm, half_width_mm, made.content["verified"], made.content
    return FlowPlan(folder, path[:, 0], path[:, 1:4], path[:, 4], path[:, 5], *after)
