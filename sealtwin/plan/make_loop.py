"""Run the loop of a finished plan: make its tables, emulate a pour with faults, write its log, and replay a log."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from digitise.trajectory import plan_trajectory
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError, NumericalError, present
from sealtwin.core.progress import Progress
from sealtwin.core.record_files import Result, as_record
from sealtwin.core.records import Sample
from sealtwin.core.run_folder import holding
from sealtwin.core.settings import read_settings
from sealtwin.core.stage_keys import other_numbers, stage_key
from sealtwin.plan.emulation import Emulated, Faults, emulate
from sealtwin.plan.loop_model import (
    VERSION,
    TwoPasses,
    by_particles,
    make_model,
    read_model,
    two_passes,
    write_model,
)
from sealtwin.plan.loop_step import LoggedStep, LoopModel, LoopState, StepInput, step
from sealtwin.plan.make_plan import REPORT, SAMPLE, TABLE, VERIFICATION, case_of
from sealtwin.plan.shape import FASTER
from sealtwin.study.study_folder import fluid_warnings, holds_study, read_plan
from sealtwin.trial.job import shown
from sealtwin.trial.stage_numbers import numbers_up_to
from sealtwin.trial.trial_file import Trial, load_trial

TABLES, PAGE = "loop.json", "loop.html"
SAME = 1e-6  # Relative difference of numbers that counts as rounding on another machine
ANOTHER_LOG = "Give the unchanged log of 'sealtwin loop PLAN --emulate FAULTS' or of your controller."
REFERENCE_SEED = 100  # Added to the trial's seed for the particles of the tables


class LogHead(Result):
    """First line of a log."""

    tables_sha256: str = ""


def run_loop(
    folder: Path, faults_file: Path, progress: Progress, *, seed: int, corrects: bool = True
) -> dict[str, Any]:
    """Emulate a plan's pour with the faults of a file, write its log and page, and return the JSON output.

    The tables are made first if the plan has none or has changed. Raises InputError if the folder has no plan.
    """
    starter = "It has keys such as flow_factor = 1.2, noise_mm = 0.15"
    faults = read_settings(Faults, faults_file, name="file of faults", starter=starter)
    trial, sample = _plan_in(folder)
    if trial.crack is None:
        raise InputError(
            f"{folder}: the sample is a mesh, and its width cannot be changed; give the plan of a sample with a photo."
        )
    with holding(folder), progress:
        passes = passes_of(sample, trial)
        physics = trial.given_fluid, trial.solver.model_copy(update=as_verified(folder)), trial.nozzle
        model = _model(folder, sample, trial, passes, physics, progress)
        progress.start("Pouring, EMULATED", round(passes.motion.t_s[-1]))
        how: dict[str, Any] = {"slope": trial.sample, "corrects": corrects, "report": progress.advance}
        poured = emulate(model, passes, sample.outline, trial.crack, physics, faults, seed=seed, **how)
        log = folder / f"loop-{seed}.jsonl"
        tables_sha256 = files.sha256(folder / TABLES)
        head = {"version": 1, "tables_sha256": tables_sha256, "emulated": faults.model_dump(), "seed": seed}
        files.write_text(log, "".join(f"{json.dumps(line)}\n" for line in (head, *map(asdict, poured.lines))))
        content = {
            **_content(folder, log, poured, model),
            "other_versions": _plan_versions(folder),
            "fluid_warnings": fluid_warnings(read_plan(folder / VERIFICATION).runs),
        }
        from sealtwin.plan.pages import write_loop_page

        write_loop_page(folder / PAGE, poured, content)
        return content


def replay(folder: Path, log: Path) -> int:
    """Call ``step`` again with each input of a log, and return the number of steps in the log.

    Raises InputError if the log cannot be read or belongs to other tables, and NumericalError if a result differs from
    that in the log.
    """
    model, (head, *lines) = read_model(folder / TABLES), _lines(log)
    if as_record(LogHead, head, f"{log}, line 1", ANOTHER_LOG).tables_sha256 != files.sha256(folder / TABLES):
        raise InputError(
            f"{log}: this log was not written with the tables {folder / TABLES}; replay it in the folder of its plan."
        )
    state, latest_s = LoopState.start(model), -np.inf
    for number, text in enumerate(lines, start=2):
        line = as_record(StepInput, text, f"{log}, line {number}", ANOTHER_LOG)
        if line.t_s <= latest_s:
            raise InputError(
                f"{log}, line {number}: t_s = {line.t_s:g} is not after the {latest_s:g} s of the line before: a line "
                f"is repeated, or two lines are swapped. {ANOTHER_LOG}"
            )
        latest_s = line.t_s
        state, plan = step(model, state, line.t_s, line.level)
        answer = asdict(LoggedStep(line.t_s, line.level, state, plan))
        if not _alike(json.loads(json.dumps(answer)), json.loads(text)):
            raise NumericalError(f"{log}, line {number}: the replayed step at {line.t_s:g} s differs from the log.")
    return len(lines)


def loop_versions(folder: Path) -> list[str]:
    """Return a sentence about a loop's tables, and one about its plan, if other stage numbers computed them."""
    tables, own, sentences = read_model(folder / TABLES), numbers_up_to("simulate"), list[str]()
    if other := other_numbers(tables.stage_numbers, own):
        again = f"'sealtwin loop {shown(folder)} --emulate FAULTS' computes them again."
        sentences.append(f"{shown(folder)}: the tables of its loop were computed by {other}. {again}")
    return [*sentences, *(_plan_versions(folder) if holds_study(folder / VERIFICATION) else [])]


def _plan_versions(folder: Path) -> list[str]:
    other = other_numbers(read_plan(folder / VERIFICATION).numbers, numbers_up_to("simulate"))
    return (
        [f"{shown(folder)}: its plan was computed by {other}. 'sealtwin plan TRIAL' makes a new plan."] if other else []
    )


def passes_of(sample: Sample, trial: Trial) -> TwoPasses:
    """Return the two passes of a plan: its own path, and the top-up on the way back."""
    own = plan_trajectory(sample.outline, trial.path, sample.solid.cavity_volume_mm3, sample.solid.sections)
    return two_passes(case_of(sample, trial, own), own, FASTER * float(np.median(own.speed_mm_s[own.giving])))


def _plan_in(folder: Path) -> tuple[Trial, Sample]:
    if not (folder / REPORT).is_file():
        raise InputError(
            f"{folder}: not the folder of a finished plan (it has no {REPORT}). 'sealtwin plan TRIAL' makes one."
        )
    trial = load_trial(folder / "trial.toml").loaded(folder)
    return trial.model_copy(update={"readings": None, "gate": None}), record_files.read_sample(folder / SAMPLE)


def as_verified(folder: Path) -> dict[str, Any]:
    """Return settings of the solver as in the plan's runs: the mean volume factor at their ends.

    If one of them failed and was computed anew, the largest number of substeps is another. Runs in the same folder that
    other stage numbers computed do not count.
    """
    verification = read_plan(folder / VERIFICATION)
    with files.understood(folder / VERIFICATION):
        healths = [run.figures.health for run in verification.runs if run.figures]
        factors = [present(health.volume_factor, "volume_factor") for health in healths]
        substeps = [present(health.substeps, "substeps") for health in healths if health.finer]
    if not factors:
        raise InputError(
            f"{folder / VERIFICATION}: contains no finished run. Repeat the runs with 'sealtwin plan TRIAL'."
        )
    return {"volume_factor": float(np.mean(factors))} | ({"substeps": max(substeps)} if substeps else {})


def _model(
    folder: Path, sample: Sample, trial: Trial, passes: TwoPasses, physics: Any, progress: Progress
) -> LoopModel:
    """Return the tables of the present plan. They are made and written if the folder has none for it."""
    key, path = _key(folder), folder / TABLES
    if path.is_file() and (tables := read_model(path)).key == key:
        return tables
    most_mm3_s = 2 * float(passes.base_mm3_s.max())
    case = case_of(sample, trial, sample.trajectory)
    how: dict[str, Any] = {"most_mm3_s": most_mm3_s, "progress": progress}
    reference = by_particles(case, passes, physics, seed=trial.seed + REFERENCE_SEED, **how)
    write_model(path, make_model(case, passes, reference, **how), key, numbers_up_to("simulate"))
    return read_model(path)


def _key(folder: Path) -> str:
    """Return the key of the tables that this version makes from the present plan."""
    return stage_key({TABLE: files.sha256(folder / TABLE)}, {"tables": VERSION}, numbers_up_to("simulate"))


def _content(folder: Path, log: Path, poured: Emulated, model: LoopModel) -> dict[str, Any]:
    last = poured.lines[-1].state if poured.lines else None
    return {
        "version": 1,
        "data": "EMULATED",
        "folder": shown(folder),
        "log": log.name,
        **poured.misfit.figures,
        "after_first_pass_mm3": poured.after_first.total_mm3,
        "given_mm3": poured.given_mm3,
        "updates": len(poured.lines),
        "flow_estimate": last and last.flow,
        "material_estimate": last and last.material_factor,
        "stopped": last.stopped if last else "",
        "tables_off_mm": model.linear_off_mm,
    }


def _lines(log: Path) -> list[str]:
    if not log.is_file():
        raise InputError(f"{log}: no such file; 'sealtwin loop PLAN --emulate FAULTS' writes one.")
    lines = files.read_text(log).splitlines()
    if not lines:
        raise InputError(f"{log}: empty; each line of a log is a JSON object. {ANOTHER_LOG}")
    return lines


def _alike(one: Any, other: Any) -> bool:
    """Return True if two JSON values are equal. Numbers may differ by rounding."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_alike(value, other[key]) for key, value in one.items())
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_alike, one, other))
    if isinstance(one, int | float) and isinstance(other, int | float):
        return abs(one - other) <= SAME * (1 + abs(one))
    return one == other
