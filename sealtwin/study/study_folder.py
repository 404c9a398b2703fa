"""Read and write the folder of a study: its plan, and a folder for each finished run, named after the run's key.

A key is a hash of everything that a result depends on. ``outcome.json`` is the last file that a run writes, and each
file is either written completely or not at all. If the process is killed, a run is therefore either waiting or
finished.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, ConfigDict, Field, model_validator, with_config

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts, texts
from sealtwin.core.record_files import Amount, Count, Result, as_record, read_profile, read_record
from sealtwin.core.records import FROM_JSON, Profile
from sealtwin.core.run_figures import PARTICLES, Method, RunHealth
from sealtwin.core.run_folder import other_numbers
from sealtwin.trial.job import NUMBERS, StageName, display_path, numbers_up_to
from sealtwin.trial.trial_file import Trial
from validate.comparison import Baseline
from validate.metrics.verdict import kept_volume
from validate.run_facts import facts_of_runs

PLAN, OUTCOME, PROFILE = "plan.json", "outcome.json", "profile.csv"
FILL = "fill.npz"  # File that shows how a run filled its crack, for the pictures of a map
AGAIN = "Give another --out, or delete this file; 'sealtwin sweep STUDY.toml' then computes what is missing."
State = Literal["waiting", "done", "failed"]
STATES: tuple[State, ...] = get_args(State)


class RunErrors(Result):
    """Errors of a run's level relative to the readings, named as in ``Comparison``. None if there are no readings."""

    mean_error_mm: Amount | None = None
    worst_error_mm: Amount | None = None
    worst_at_mm: float | None = None
    flat_level_error_mm: Amount | None = None
    stations_compared: Count | None = None
    baselines: tuple[Baseline, ...] = ()


class RunFigures(RunErrors):
    """Figures of a finished run that are written to its summary.json."""

    particles: Count | None = None
    escaped_particles: Count | None = None
    spilled_particles: Count | None = None
    unfit: Facts = ()
    volume_ratio: Amount
    fluid_warnings: Facts
    health: RunHealth = RunHealth()


class StudyFigures(RunFigures):
    """Figures of a finished run that are written to its outcome.json."""

    profile_sha256: str  # SHA-256 hash of profile.csv, which shows if the file was changed


@with_config(FROM_JSON)
@dataclass(frozen=True)
class Outcome:
    """Content of outcome.json. A run without this file is waiting."""

    state: State = "waiting"
    wall_s: Amount | None = None
    reason: str | None = None  # Sentence that says why the run failed
    trace: str | None = None  # Traceback, if the run failed because of a bug
    figures: StudyFigures | None = None  # Figures of a finished run. All runs of one launch have the same health

    @model_validator(mode="after")
    def _have_figures(self) -> Self:
        if self.state == "done" and self.figures is None:
            raise ValueError("state is done, but figures are missing")
        return self


def _with_tables(trial: dict[str, Any]) -> dict[str, Any]:
    """Check the tables solver and readings. The other tables are not checked: another version may have written them."""
    if not isinstance(trial.get("solver"), dict):
        raise ValueError("solver is missing")
    if not isinstance(trial.get("readings") or {}, dict):
        raise ValueError("readings is not a table")
    return trial


@dataclass(frozen=True)
class ScheduledRun:
    """One run of a study without its outcome, as it is written to plan.json."""

    number: Annotated[int, Field(ge=1)]  # Position in the study, from 1
    key: Annotated[str, Field(pattern="^[0-9a-f]{16,}$")]
    settings: dict[str, Any]  # Varied settings by dotted name, for example {"fluid.U": 30.0, "fluid.D_cm": 0.3}
    trial: Annotated[dict[str, Any], AfterValidator(_with_tables)] = field(repr=False)  # All settings of the trial
    sample: Annotated[str, Field(pattern=r"^[\w-]+$")]  # Name of the folder in samples/ with the digitised crack
    kin: str  # Hash that is equal for runs that one launch can compute: equal substeps, and only the fluid differs
    work_s: Amount  # Expected computing time on the machine for which the model was calibrated


@with_config(FROM_JSON | ConfigDict(extra="forbid"))
@dataclass(frozen=True)
class StudyRun(Outcome, ScheduledRun):
    """One run of a study, with its outcome if it has been computed."""

    @property
    def method(self) -> Method:
        return self.trial["solver"].get("model", PARTICLES)

    @property
    def fast(self) -> bool:
        """True for a run of the fast model."""
        return self.method != PARTICLES

    @property
    def ranked(self) -> bool:
        """False if the run's volume is wrong by over 5 %, or if the fast model is not valid for the case."""
        return self.figures is None or (kept_volume(self.figures.volume_ratio) and not self.figures.unfit)

    @property
    def checked_trial(self) -> Trial:
        return as_record(Trial, json.dumps(self.trial), f"run {self.number} of {PLAN}", AGAIN)


@with_config(FROM_JSON)
@dataclass(frozen=True)
class Plan:
    """The runs of a study."""

    study: str  # Name of the study
    runs: list[StudyRun]
    numbers: Annotated[Mapping[str, int], Field(validation_alias="stage_numbers")] = field(default_factory=dict)
    """Stage numbers that the keys contain. Empty before the first run is planned."""


def profile_path(folder: Path, run: ScheduledRun) -> Path:
    """Return the path of a run's profile, which is the level along the crack."""
    return run_path(folder, run) / PROFILE


def run_path(folder: Path, run: ScheduledRun) -> Path:
    return folder / "runs" / run.key[:16]


def read_level(folder: Path, run: StudyRun) -> Profile:
    """Read the level of a finished run."""
    return read_profile(run_path(folder, run))


def holds_study(folder: Path) -> bool:
    return (folder / PLAN).is_file()


def read_plan(folder: Path) -> Plan:
    """Read the plan with the outcomes so far. Raises InputError if the plan is missing or a file is damaged."""
    if not holds_study(folder):
        raise InputError(f"{folder}: is not a study, since it has no {PLAN}. 'sealtwin sweep STUDY.toml' makes one.")
    plan = read_record(Plan, folder / PLAN, AGAIN)
    return replace(plan, runs=[with_outcome(folder, run) for run in plan.runs])


def other_versions(folder: Path, plan: Plan, stage: StageName = "validate") -> list[str]:
    """Return a sentence if a version with other stage numbers, up to ``stage``, computed finished runs.

    A study without readings does not depend on the stage validate, and does not record its number.
    """
    numbers = {name: number for name, number in numbers_up_to(stage).items() if name in (plan.numbers or NUMBERS)}
    others = _computed_by_others(plan, numbers)
    return [f"{display_path(folder)}: {others}. 'sealtwin sweep' with its study computes them again."] if others else []


def _computed_by_others(plan: Plan, numbers: Mapping[str, int]) -> str:
    """Return a text about finished runs that were computed with other stage numbers than ``numbers``, or ""."""
    done = sum(run.state == "done" for run in plan.runs)
    runs = "one finished run was" if done == 1 else f"{done} finished runs were"
    other = other_numbers(plan.numbers, numbers)
    return f"{runs} computed by {other}" if done and other else ""


def fluid_warnings(runs: Sequence[StudyRun]) -> list[str]:
    """Return the warnings about the fluid of finished runs. Each warning states the number of its runs."""
    warnings = {run.number: run.figures.fluid_warnings for run in runs if run.figures is not None}
    return [*texts(facts_of_runs(warnings, len(warnings)))]


def write_plan(folder: Path, plan: Plan) -> None:
    """Write the plan. Outcomes are in separate files, so the plan is not written again when a run ends."""
    runs = [_part(ScheduledRun, run) for run in plan.runs]
    content = {"version": 1, "study": plan.study}
    content |= {"stage_numbers": plan.numbers, "runs": runs}
    files.write_text(folder / PLAN, json.dumps(content, ensure_ascii=False, allow_nan=False))


def with_outcome(folder: Path, run: StudyRun) -> StudyRun:
    """Return a run with the outcome in its folder. A run without an outcome is returned unchanged."""
    path = run_path(folder, run) / OUTCOME
    if not path.is_file():
        return run
    return replace(run, **vars(read_record(Outcome, path, AGAIN)))


def write_outcome(folder: Path, run: StudyRun) -> None:
    """Mark a run as finished. All other files of the run must be written before."""
    outcome = _part(Outcome, run)
    if run.figures is not None:
        outcome["figures"] = run.figures.model_dump(exclude_unset=True)
    files.write_json(run_path(folder, run) / OUTCOME, {"version": 1, **outcome})


def forget_outcome(folder: Path, run: StudyRun) -> StudyRun:
    """Remove the outcome of a run, and return the run as waiting."""
    (run_path(folder, run) / OUTCOME).unlink(missing_ok=True)
    return StudyRun(**_part(ScheduledRun, run))


def _part(record_type: type[ScheduledRun | Outcome], run: StudyRun) -> dict[str, Any]:
    return {field.name: getattr(run, field.name) for field in fields(record_type)}


def resume(folder: Path, plan: Plan, note: Callable[[str], None], *, retry: bool) -> list[StudyRun]:
    """Write a plan, and return its runs with their outcomes so far.

    A run is waiting again if its files were changed, or if it failed and ``retry`` is True. ``note`` is called with a
    sentence about runs that are computed again because another version computed them.
    """
    if holds_study(folder) and (others := _computed_by_others(read_plan(folder), plan.numbers)):
        note(f"{folder}: {others}, so they are computed again.")
    runs = []
    for run in (with_outcome(folder, run) for run in plan.runs):
        lost = run.state == "done" and not is_intact(folder, run)
        runs.append(forget_outcome(folder, run) if lost or (run.state == "failed" and retry) else run)
    write_plan(folder, plan)
    return runs


def is_intact(folder: Path, run: StudyRun) -> bool:
    """Return True if the run is done and its profile is unchanged."""
    profile = profile_path(folder, run)
    if run.figures is None or not profile.is_file():
        return False
    return files.sha256(profile) == run.figures.profile_sha256
