"""The stages of the reproduction, which go on where they were killed: what is computed, where, and in which order."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from reports.reproduction.derived import (
    KINDS,
    NARROWER,
    TIMED,
    TIMED_SEEDS,
    Kind,
    seeded_rows,
    straight_crack,
    write_study,
)
from reports.reproduction.pace import take_pace
from sealtwin.core.cluster import cores
from sealtwin.core.progress import Progress
from sealtwin.core.stage_keys import other_numbers
from sealtwin.study.runner import Bench, read_bench
from sealtwin.study.study_file import load_study
from sealtwin.study.study_folder import Plan, StudyRun, holds_study, read_plan, run_path
from sealtwin.study.study_map import chart_of
from sealtwin.study.sweep import SweepOptions, sweep
from sealtwin.trial.stage_numbers import NUMBERS
from sealtwin.trial.trial_file import Trial, load_trial
from validate.figures.chart import Chart

PACE = "pace.json"
SLOTS = "straight-cracks"
SLOT_RUNS = (*((f"wide-{seed}", 1, seed) for seed in TIMED_SEEDS), ("narrow", NARROWER, 0))
"""Name, how many times narrower than the paper's crack, seed. The narrow one takes minutes."""


@dataclass(frozen=True)
class Part:
    """A reading of the paper's geometry, and its study of all pairs."""

    name: str
    title: str
    study: Path
    fine: Path | None
    """The pairs that the paper names with particles of its size, where those of the study are coarser."""
    fills: bool
    """Whether some of its runs are drawn as they fill the crack."""

    def folder(self, work: Path, kind: Kind | None = None) -> Path:
        name = load_study(self.study).folder_name
        return work / (name if kind is None else f"{name}-{kind.name}")


@dataclass(frozen=True)
class Stage:
    """What is computed in one go."""

    part: Part | None
    """None: the straight cracks, which are of no part."""
    kind: Kind | None = None
    """None: the study of all pairs, and the finer ones."""

    @property
    def name(self) -> str:
        """What the command takes."""
        if self.part is None:
            return SLOTS
        return self.part.name if self.kind is None else f"{self.part.name}-{self.kind.name}"


def parts(home: Path) -> tuple[Part, ...]:
    """``home`` is reports/reproduction in a checkout."""
    fixture = home.parents[1] / "fixtures" / "paper-trial"
    fine = home / "study-flare-fine.toml"
    return (
        Part("flare", "walls flared, preset accurate", fixture / "study-paper.toml", fine, fills=True),
        Part("lean", "walls leaning, preset paper", home / "study-lean.toml", fine=None, fills=False),
    )


def stages(wanted: Sequence[Part]) -> list[Stage]:
    """All stages, in their order. Times come last and one run at a time, so that nothing of ours runs beside them."""
    kinds = [None, *(kind for kind in KINDS if kind is not TIMED)]
    computed = [Stage(part, kind) for part in wanted for kind in kinds]
    return [*computed, *(Stage(part, TIMED) for part in wanted), Stage(None)]


def compute(stage: Stage, wanted: Sequence[Part], work: Path, progress: Progress) -> list[str]:
    """Bring the folders of a stage up to date; the lines to say if it has to be left out."""
    part, kind = stage.part, stage.kind
    if part is None:
        for name, narrower, seed in SLOT_RUNS:
            take_pace(slot_path(work, name), *_slot(wanted, narrower, seed))
            progress.note(f"Timed: {name}.")
    elif kind is None:
        for study in (part.study, part.fine):
            if study is not None:
                _swept(study, work / load_study(study).folder_name, progress)
    elif kind is not TIMED and (missing := missing_pairs(part, work)) is not None:
        return [f"{stage.name}: left out, since {missing}."]
    else:
        _compute_small(part, kind, work, progress)
    return []


def missing_pairs(part: Part, work: Path) -> str | None:
    """Tell how many pairs are computed; None where all are done, or failed for a reason."""
    folder, runs, done = part.folder(work), load_study(part.study).runs, 0
    if holds_study(folder):
        plan = read_plan(folder)
        if other := _other_numbers(plan):
            return f"its pairs were computed by {other}"
        done = sum(run.state != "waiting" for run in plan.runs) if plan.total == runs else 0
    return None if done == runs else f"{done} of its {runs} pairs are computed"


def read_chart(part: Part, work: Path) -> Chart:
    folder = part.folder(work)
    return chart_of(folder, done_runs(folder), read_plan(folder))


def done_runs(folder: Path) -> list[StudyRun]:
    """Return the runs with a result, in the study's order; none while any waits, or of other stage numbers."""
    if not holds_study(folder):
        return []
    plan = read_plan(folder)
    if _other_numbers(plan) or any(run.state == "waiting" for run in plan.runs):
        return []
    return [run for run in plan.runs if run.state == "done"]


def _other_numbers(plan: Plan) -> str:
    """Return how a plan's stage numbers differ from this version's, or nothing: what is judged together is of one."""
    return other_numbers(plan.numbers, {stage: NUMBERS[stage] for stage in plan.numbers or NUMBERS})


def slot_path(work: Path, name: str) -> Path:
    return work / SLOTS / f"{name}.json"


def _compute_small(part: Part, kind: Kind, work: Path, progress: Progress) -> None:
    folder = part.folder(work, kind)
    definition = folder.with_suffix(".toml")
    rows = seeded_rows(read_chart(part, work)) if kind.rows is None else kind.rows
    write_study(definition, load_study(part.study), part.study.parent, kind, rows)
    _swept(definition, folder, progress, planned_only=kind is TIMED)
    if kind is not TIMED:
        return
    runs = read_plan(folder).runs
    progress.note(f"{folder}: {len(runs)} runs are timed one after another; leave the machine alone meanwhile.")
    for done, run in enumerate(runs, start=1):
        trial = run.checked_trial
        take_pace(run_path(folder, run.key) / PACE, read_bench(folder / "samples" / run.sample, None), trial)
        progress.note(f"{done} of {len(runs)} are timed.")


def _swept(study: Path, folder: Path, progress: Progress, *, planned_only: bool = False) -> None:
    """Bring a folder to where all runs of a study are done, or failed for a reason."""
    options = SweepOptions(device="cpu", jobs=cores(), dry_run=planned_only)
    states = sweep(study, folder, options, progress)["states"]
    if not planned_only:
        progress.note(f"{folder}: {states['done']} runs done, {states['failed']} failed.")


def _slot(wanted: Sequence[Part], narrower: int, seed: int) -> tuple[Bench, Trial]:
    """The straight crack with the fluid of the last part's trial."""
    study = wanted[-1].study
    trial = load_trial(study.parent / load_study(study).trial).model_copy(update={"seed": seed})
    return straight_crack(trial, narrower)
