"""The folder of a study: its plan, and for each finished run a folder that is named by its key.

A key is the hash of all that a result depends on. ``outcome.json`` is the last file that a run writes, and every file
appears whole or not at all: a process that is killed leaves a run waiting or finished, never half of one.
"""

import json
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import require_plain
from sealtwin.core.record_files import Amount, Count, Result, as_record, read_checked
from sealtwin.core.records import RunHealth
from sealtwin.core.stage_keys import other_numbers
from sealtwin.trial.job import shown
from sealtwin.trial.stage_numbers import NUMBERS, StageName, numbers_up_to
from sealtwin.trial.trial_file import Trial
from validate.comparison import Baseline
from validate.metrics.verdict import kept_volume
from validate.wording.of_runs import sentences_of_runs

PLAN, OUTCOME, PROFILE = "plan.json", "outcome.json", "profile.csv"
LEDGER = "ledger.sqlite"  # The database in which earlier versions kept plan and outcomes

AGAIN = "Give another --out, or delete it: 'sealtwin sweep STUDY.toml' computes what is missing."
State = Literal["waiting", "done", "failed"]
STATES: tuple[State, ...] = ("waiting", "done", "failed")
PLANNED = ("number", "key", "settings", "trial", "sample", "kin", "work_s")
"""Fields of a run in the plan; the others are its outcome."""


class StudyFigures(Result):
    """Figures of a finished run in its outcome.json that are read again."""

    profile_sha256: str
    volume_ratio: Amount
    mean_error_mm: Amount | None = None
    worst_error_mm: Amount | None = None
    worst_at_mm: float | None = None
    flat_level_error_mm: Amount | None = None
    stations_compared: Count | None = None
    baselines: tuple[Baseline, ...] = ()
    unfit: tuple[str, ...] = ()
    fluid_warnings: tuple[str, ...] = ()
    spilled_particles: Count | None = None
    particles: Count | None = None
    health: RunHealth = RunHealth()


class OutcomeFile(Result):
    """Content of outcome.json."""

    state: State
    wall_s: Amount | None = None
    finished_unix_s: Amount | None = None
    reason: str | None = None
    trace: str | None = None
    figures: StudyFigures | None = None

    @model_validator(mode="after")
    def _have_figures(self) -> Self:
        if self.state == "done" and self.figures is None:
            raise ValueError("state is done, and figures are missing")
        return self


class TrialSettings(Result):
    """Settings of a planned run that are read without the others, which versions may have otherwise."""

    solver: dict[str, Any]
    readings: dict[str, Any] | None = None


class PlannedFile(Result):
    """One run in plan.json."""

    number: Annotated[int, Field(ge=1)]
    key: Annotated[str, Field(pattern="^[0-9a-f]{16,}$")]
    settings: dict[str, float | str | bool | None]
    trial: TrialSettings
    sample: Annotated[str, Field(pattern=r"^[\w-]+$")]
    kin: str
    work_s: Amount


class PlanFile(Result):
    """Content of plan.json."""

    study: str
    total: Count
    started_unix_s: Amount
    stage_numbers: dict[str, int] = Field(default_factory=dict)
    runs: tuple[PlannedFile, ...]


@dataclass(frozen=True)
class StudyRun:
    """One run of a study, with its outcome once it has one."""

    number: int  # Position in the study, from 1
    key: str
    settings: dict[str, Any]  # Varied settings by dotted name, for example {"fluid.U": 30.0, "fluid.D_cm": 0.3}
    trial: dict[str, Any] = field(repr=False)  # All settings
    sample: str  # Folder below samples/ that holds the digitised crack
    kin: str  # Equal for runs that may share a launch: those that differ in the fluid alone, of as many substeps
    work_s: float  # Expected computing time on the machine that the estimate was calibrated on
    state: State = "waiting"
    wall_s: float | None = None
    finished_unix_s: float | None = None
    reason: str | None = None  # One sentence on why the run failed
    trace: str | None = None  # Traceback, where a bug made it fail
    figures: dict[str, Any] | None = None
    """Results of a finished run: mean_error_mm, worst_error_mm, worst_at_mm, flat_level_error_mm, baselines and
    stations_compared with readings;
    volume_ratio, fluid_warnings, spilled_particles, particles, profile_sha256, and health, which runs of one launch
    share.
    """

    @property
    def fast(self) -> bool:
        """True for a run of the fast model."""
        return self.trial["solver"].get("model") == "slot"

    @property
    def ranked(self) -> bool:
        """True where its result counts: its volume was kept, and the fast model, if that made it, is fit for it."""
        figures = self.figures or {}
        return kept_volume(figures.get("volume_ratio", 1.0)) and not figures.get("unfit")

    @property
    def checked_trial(self) -> Trial:
        return as_record(Trial, json.dumps(self.trial), f"run {self.number} of {PLAN}", AGAIN)


@dataclass(frozen=True)
class Plan:
    """The runs that a study, or one shard of it, consists of."""

    study: str  # Name of the study
    runs: Sequence[StudyRun]
    total: int  # Number of runs of the whole study; a shard has fewer
    started_unix_s: float = 0.0  # Time of the latest start
    numbers: Mapping[str, int] = field(default_factory=dict)  # Stage numbers in the keys; empty if not recorded


def profile_path(folder: Path, key: str) -> Path:
    """Return the path of a run's level along the crack."""
    return run_path(folder, key) / PROFILE


def run_path(folder: Path, key: str) -> Path:
    return folder / "runs" / key[:16]


def holds_study(folder: Path) -> bool:
    return (folder / PLAN).is_file() or (folder / LEDGER).is_file()


def read_plan(folder: Path) -> Plan:
    """Read the plan with the outcomes so far. Raises InputError if the folder holds no study, or a damaged one."""
    if not holds_study(folder):
        raise InputError(f"{folder}: no study (it has no {PLAN}). 'sealtwin sweep STUDY.toml' makes one.")
    if not (folder / PLAN).is_file():
        _import_ledger(folder)
    content = read_checked(PlanFile, folder / PLAN, AGAIN)
    with files.understood(folder / PLAN):
        runs = [with_outcome(folder, StudyRun(**run)) for run in content["runs"]]
        numbers = content.get("stage_numbers", {})
        return Plan(content["study"], runs, content["total"], content["started_unix_s"], numbers)


def other_versions(folder: Path, plan: Plan, stage: StageName = "validate") -> list[str]:
    """Return a sentence if finished runs were computed by other stage numbers, up to ``stage``, than this version's.

    A study without readings does not depend on validate, and records no number of it.
    """
    own = {name: number for name, number in numbers_up_to(stage).items() if name in (plan.numbers or NUMBERS)}
    done = sum(run.state == "done" for run in plan.runs)
    if not (done and (other := other_numbers(plan.numbers, own))):
        return []
    runs = "one finished run was" if done == 1 else f"{done} finished runs were"
    return [f"{shown(folder)}: {runs} computed by {other}. 'sealtwin sweep' with its study computes them anew."]


def fluid_warnings(runs: Sequence[StudyRun]) -> list[str]:
    """Return what is not sound of the fluids of finished runs, each sentence once, with the number of its runs."""
    done = {run.number: run.figures for run in runs if run.state == "done" and run.figures is not None}
    known = {number: figures["fluid_warnings"] for number, figures in done.items() if "fluid_warnings" in figures}
    told = sentences_of_runs(known, len(done))
    if earlier := len(done) - len(known):
        told.append(
            f"{earlier} of {len(done)} runs: an earlier version made them, which kept no remarks on their fluids."
        )
    return told


def write_plan(folder: Path, plan: Plan) -> None:
    """Write the plan. Outcomes are files of their own, so that nothing else has to be locked or updated."""
    runs = [{name: getattr(run, name) for name in PLANNED} for run in plan.runs]
    content = {"version": 1, "study": plan.study, "total": plan.total, "started_unix_s": plan.started_unix_s}
    content |= {"stage_numbers": dict(plan.numbers), "runs": runs}
    files.write_text(folder / PLAN, json.dumps(content, ensure_ascii=False, allow_nan=False))


def with_outcome(folder: Path, run: StudyRun) -> StudyRun:
    """Return a run with the outcome that its folder holds."""
    path = run_path(folder, run.key) / OUTCOME
    if not path.is_file():
        return run
    content = read_checked(OutcomeFile, path, AGAIN)
    with files.understood(path):
        return replace(run, **{name: value for name, value in content.items() if name != "version"})


def write_outcome(folder: Path, run: StudyRun) -> None:
    """Mark a run as finished, after all its other files are written."""
    outcome = {name: value for name, value in asdict(run).items() if name not in PLANNED}
    files.write_json(run_path(folder, run.key) / OUTCOME, {"version": 1, **outcome})


def forget_outcome(folder: Path, run: StudyRun) -> StudyRun:
    """Return the run as waiting, and remove its outcome."""
    (run_path(folder, run.key) / OUTCOME).unlink(missing_ok=True)
    return StudyRun(**{name: getattr(run, name) for name in PLANNED})


def resume(
    folder: Path, plan: Plan, note: Callable[[str], None], *, retry: bool, keep_runs: bool = False
) -> list[StudyRun]:
    """Write a plan, and return its runs with their outcomes so far; ``note`` receives what is made anew, and why.

    A run is waiting again if its files are not as they were written, or its particles are missing and to be kept; with
    ``retry`` also if it failed.
    """
    _note_other_numbers(folder, plan, note)
    runs = []
    for run in (with_outcome(folder, run) for run in plan.runs):
        kept = not keep_runs or (run_path(folder, run.key) / "particles.csv").is_file()
        lost = run.state == "done" and not (kept and is_intact(folder, run))
        runs.append(forget_outcome(folder, run) if lost or (run.state == "failed" and retry) else run)
    write_plan(folder, plan)
    return runs


def _note_other_numbers(folder: Path, plan: Plan, note: Callable[[str], None]) -> None:
    """Note how many finished runs of the folder's plan were computed by other stage numbers than the new plan's."""
    if not holds_study(folder):
        return
    before = read_plan(folder)
    done = sum(run.state == "done" for run in before.runs)
    if done and (other := other_numbers(before.numbers, plan.numbers)):
        note(f"{folder}: {done} finished runs were computed by {other}: they are made anew.")


def is_intact(folder: Path, run: StudyRun) -> bool:
    """Return True for a finished run whose profile is as it was written."""
    profile = profile_path(folder, run.key)
    if run.state != "done" or run.figures is None or not profile.is_file():
        return False
    return files.sha256(profile) == run.figures["profile_sha256"]


def remove_temporary_files(folder: Path) -> None:
    """Remove what a killed process was writing. Only the process that holds the folder may call this."""
    for path in folder.rglob(".*"):
        if files.is_temporary(path):
            path.unlink()


def _import_ledger(folder: Path) -> None:
    """Write plan and outcomes of a study that an earlier version kept in a database."""
    path = folder / LEDGER
    columns = [*PLANNED, "state", "wall_s", "finished_unix_s", "reason", "trace", "figures"]
    require_plain(path)
    try:
        with closing(sqlite3.connect(path)) as base:
            facts = dict(base.execute("SELECT name, value FROM facts"))
            rows = base.execute(f"SELECT {', '.join(columns)} FROM runs WHERE number > 0 ORDER BY number").fetchall()
    except sqlite3.DatabaseError as fault:
        raise InputError(f"{path}: no ledger that can be read ({fault}). {AGAIN}") from None
    if facts.get("version") != "1":
        raise InputError(f"{path}: version {facts.get('version')} of a ledger; only 1 can be read. {AGAIN}")
    runs = []
    for row in rows:
        values = dict(zip(columns, row, strict=True))
        with files.understood(path):
            for name in ("settings", "trial", "figures"):
                values[name] = values[name] and files.parse_json(values[name])
        run = StudyRun(**values)
        if run.state in ("done", "failed"):
            write_outcome(folder, run)
        runs.append(run)
    write_plan(folder, Plan(facts.get("study", folder.name), runs, len(runs)))
