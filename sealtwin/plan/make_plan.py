"""Plan a trial: search for a plan with the fast model, check it with particles, correct the model and search again."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from digitise.planned_path import COLUMNS, planned_path
from digitise.robots.cell import ProgramOptions, PumpTable, RobotCell
from digitise.settings import NozzlePath
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.records import Floats, Profile, Sample
from sealtwin.core.run_folder import holding, open_folder, require_own
from sealtwin.core.settings import checked
from sealtwin.plan import PlanOptions
from sealtwin.plan.search import (
    MAX_STEPS,
    Case,
    Goal,
    Knots,
    corrected_level_mm,
    discrepancy,
    limits_of,
    path_over,
    require_possible,
    search,
    target_of,
)
from sealtwin.plan.verify import (
    Planned,
    Round,
    Verifier,
    WithMore,
    mean_of,
    misfit,
    plan_cautions,
    plan_finding,
    require_plannable,
    write_plan_page,
)
from sealtwin.study.pipeline import run_stages
from sealtwin.trial.exports import CellFile, origin_of, write_programs
from sealtwin.trial.job import display_path, numbers_up_to, require_sample, start_job
from sealtwin.trial.trial_file import SettingValues, Trial, load_trial, seen_from, trial_text
from simulate.slot.run import paste_of
from validate.uncertainty.computed import Z_95, further_run_mm2, require_different

REPORT, TABLE, PAGE = "plan.json", "plan.csv", "plan.html"
VERIFICATION, SAMPLE = "verification", "sample"
MORE_FLOW, LESS_STRESS = 1.10, 0.85
SEARCH_S = 3.0  # Time in s of a search, on one core of the machine in docs/accuracy.md


@dataclass(frozen=True)
class MadePlan:
    """Result of planning a trial: the content of plan.json, and sentences about the plan."""

    content: dict[str, Any]
    sentences: list[str]


def case_of(sample: Sample, trial: Trial) -> Case:
    """Return a trial as a case for the fast model. Raises InputError if the fast model does not support the paste."""
    pour = trial.pour(sample)
    return Case(pour, paste_of(pour))


def plan_on(
    verifier: Verifier,
    options: PlanOptions,
    limits_by: tuple[RobotCell | None, PumpTable | None] = (None, None),
    where: Path = Path("trial.toml"),
) -> Planned:
    """Make a plan for a digitised crack. ``limits_by`` contains the robot's cell and the table of its pump.

    Raises InputError if no plan is possible, and NumericalError if a particle run fails.
    """
    sample, trial, progress, drafts = verifier.sample, verifier.trial, verifier.progress, not options.accurate
    nominal = case_of(sample, trial)
    sections = nominal.fill(sample.trajectory).sections
    if options.aim_mm >= (shallowest_mm := float(sections.depth_mm.min())):
        raise InputError(
            f"--margin-mm {options.margin_mm:g} and --reserve-mm {options.reserve_mm:g}: their sum must be less than "
            f"the smallest depth of the crack, {shallowest_mm:.3g} mm. Give smaller values."
        )
    target_mm2 = target_of(sections, options.aim_mm)
    knots = Knots(sample.trajectory, options.knots)
    limits = limits_of(sample.trajectory, *limits_by, options.flow_max_mm3_s, options.keep_speed)
    require_possible(limits, target_mm2, sections.s_mm, sample.trajectory, where)
    filled = float(target_of(sections, options.margin_mm).sum() / sections.full_mm2.sum())
    paths = [
        (name, trial.path.model_copy(update={"volume_ml": "cavity", "fill": filled, "flow": flow}), trial.seed)
        for name, flow in (("constant flow", "constant"), ("flow by local area", "cross_section"))
    ]
    verifier.ahead_s = (options.verify + drafts) * SEARCH_S + 2 * drafts * verifier.work_s(1, drafts=False)
    for runs in (len(paths), *[1] * options.verify, options.seeds - 1):
        verifier.ahead_s += verifier.work_s(runs, drafts=drafts)
    progress.note(
        f"Two baselines, {options.verify} rounds and {options.seeds} seeds: about "
        f"{in_words(verifier.left_s)} in total. The first runs will correct this."
    )
    rounds, baselines = list[Round](), verifier.judge("Baselines by particles", paths, drafts=drafts)

    def corrected(name: str, start: Floats, apart_mm2: Floats, *, drafts: bool) -> Round:
        """Search a plan and check it with particles.

        The search begins at ``start``. The areas of the fast model are corrected by ``apart_mm2``.
        """
        verifier.ahead_s -= SEARCH_S
        progress.start(f"Searching, {name}", MAX_STEPS)
        progress.later(verifier.left_s)
        # With a reserve, corrections do not add sealant. If the fast model were right, it would rise above the face.
        most = rounds[0].plan if rounds and options.reserve_mm > 0 else None
        goal = Goal(target_mm2, apart_mm2)
        plan = search(nominal, knots, limits, goal, start, progress.advance, most)
        path = NozzlePath(plan=planned_path(knots.trajectory(plan)))
        (judged,) = verifier.judge(f"Particles, {name}", [(name, path, trial.seed)], drafts=drafts)
        expected_mm = corrected_level_mm(nominal.along(path), apart_mm2)
        off_mm = float(np.abs(judged.level.level_at_mm(sections.s_mm) - expected_mm).mean())
        progress.note(
            f"{name}: {judged.misfit.under_mm3:.0f} mm3 are missing below the face, and {judged.misfit.over_mm3:.0f} "
            f"mm3 are above it. The predicted level and the level of the particles differ by {off_mm:.2f} mm."
        )
        return replace(judged, off_mm=off_mm, plan=plan)

    plan, apart_mm2 = knots.first_guess(target_mm2, sections.s_mm, limits), np.zeros_like(target_mm2)
    for number in range(1, options.verify + 1):
        rounds.append(corrected(f"round {number}", plan, apart_mm2, drafts=drafts))
        plan, apart_mm2 = rounds[-1].plan, discrepancy(nominal.along(rounds[-1].path), rounds[-1].level)
    best = draft = min([*rounds, *baselines], key=_cost_mm3)
    others = range(trial.seed + 1, trial.seed + options.seeds)
    seeds = [(f"{draft.name}, seed {seed}", draft.path, seed) for seed in others]
    judged = [draft, *verifier.judge("The plan with other seeds", seeds, drafts=drafts)]
    levels_mm, s_mm = np.array([run.level.level_mm for run in judged]), draft.level.s_mm
    names = [f"with seed = {trial.seed + number}" for number in range(len(judged))]
    require_different(levels_mm, names, f"{where}: {draft.name}")
    misfits = tuple(run.misfit for run in judged)
    level, misfit, runs = replace(draft.level, level_mm=levels_mm.mean(axis=0)), mean_of(misfits), len(judged)
    steady = baselines[0]
    if drafts:
        (run,) = verifier.judge("Accurate run of the plan", [(draft.name, draft.path, trial.seed)])
        best = replace(draft, level=run.level, misfit=run.misfit)
        # For constant flow there is only a draft. Its accurate level is estimated with the change found for the plan.
        accurate_mm = steady.level.level_mm + run.level.level_at_mm(s_mm) - draft.level.level_mm
        steady = replace(steady, level=replace(steady.level, level_mm=accurate_mm))
        if len(draft.plan):
            # The plan was fitted to drafts, whose particles are larger. The accurate run corrects misfit once.
            apart_mm2 = discrepancy(nominal.along(draft.path), run.level)
            again = corrected("corrected by the accurate run", draft.plan, apart_mm2, drafts=False)
            best = min(best, again, key=_cost_mm3)
        level, misfit, runs = best.level, best.misfit, 1
    # This is the variance of a further run about the mean. Drafts scatter at least as much as accurate runs.
    half_mm = Z_95 * np.sqrt(further_run_mm2(levels_mm, runs)) if len(judged) > 1 else None
    trajectory = path_over(sample, best.path)
    alike = (best.path, level), (steady.path, steady.level)
    return Planned(
        options=options,
        best=best,
        rounds=tuple(rounds),
        baselines=tuple(baselines),
        trajectory=trajectory,
        level=level,
        half_width_mm=half_mm,
        misfit=misfit,
        misfits=misfits,
        with_more=WithMore(*(_over_with_more_mm3(nominal, path, bed) for path, bed in alike)),
        of_draft=draft.misfit if drafts else None,
        unfilled_mm3=float((sections.full_mm2 - target_mm2).sum()) * sections.step_mm,
    )


def _cost_mm3(judged: Round) -> float:
    return judged.misfit.cost_mm3


def _over_with_more_mm3(case: Case, path: NozzlePath, level: Profile) -> float:
    """Return the volume above the face if the pump gives more and the paste is softer, by the corrected fast model."""
    soft = replace(case, paste=replace(case.paste, yield_stress_pa=LESS_STRESS * case.paste.yield_stress_pa))
    trajectory = path_over(case.pour.sample, path)
    poured = soft.fill(replace(trajectory, flow_mm3_s=MORE_FLOW * trajectory.flow_mm3_s))
    filled = case.fill(trajectory)
    level_mm = corrected_level_mm(poured, discrepancy(filled, level), filled.sections)
    return misfit(case.pour.sample, Profile(filled.sections.s_mm, level_mm)).over_mm3


def make_plan(
    file: Path,
    out: Path | None,
    options: PlanOptions,
    progress: Progress,
    *,
    device: str = "cpu",
    jobs: int = 1,
    settings: SettingValues | None = None,
) -> MadePlan:
    """Plan a trial, and write the plan to ``out`` (default: reports/NAME-plan).

    ``settings`` by dotted name replace settings of the trial file. If the process is killed, repeat the command: the
    search, which takes seconds, is repeated, but the finished particle runs are not. Raises InputError if the trial,
    or the cell cannot be used, and NumericalError if a run fails.
    """
    file_trial = load_trial(file, settings)
    require_sample(file_trial, file.parent)
    trial = require_plannable(file_trial.loaded(file.parent), str(file))
    if trial.path.plan is not None:
        raise InputError(f"{file}: path.plan already has a plan. Remove it, and give path.speed_mm_s for a new plan.")
    cell = None if options.cell is None else _read_cell(options.cell)
    folder = out or Path("reports", f"{file_trial.folder_name}-plan")
    require_own(folder, SAMPLE, "plan")
    with holding(folder), progress:
        with open_folder(folder / SAMPLE, create=True) as home:
            run_stages(start_job(trial, file.parent, home, "cpu", progress, file), ("digitise",))
        sample = record_files.read_sample(folder / SAMPLE)
        if cell is not None:
            cell.settings.require_frame(sample.outline.has_origin, cell.name)
        verifier = Verifier(folder / VERIFICATION, trial, sample, device, progress, jobs)
        planned = plan_on(verifier, options, (cell.settings, cell.pump) if cell else (None, None), file)
        warned = verifier.fluid_warnings
        content = _write(folder, planned, trial.name, warned)
        write_plan_page(folder / PAGE, trial.name, planned, warned)
        files.write_text(folder / "trial.toml", _trial_beside(file_trial, file.parent, folder))
        # The plan is written before the robot programs, so that it remains if the cell's limits refuse them.
        files.write_json(folder / REPORT, content)
        if planned.verified and cell is not None:
            origin = origin_of(folder, trial.name, sample.outline, [TABLE])
            programs, _ = write_programs(folder / "robot", planned.trajectory, cell, ProgramOptions(), origin)
            content["robot"] = sorted(programs["files"])
            files.write_json(folder / REPORT, content)
        return MadePlan(content, [*plan_cautions(planned, warned), plan_finding(planned)])


def _read_cell(file: Path) -> CellFile:
    """Read a robot's cell. Raises InputError if its programs have only one speed or one flow."""
    cell = CellFile.read(file)
    if steady := cell.settings.steady_settings:
        raise InputError(
            f"{file}: with {' and '.join(steady)}, a program has only one speed or one flow, but a plan "
            "varies both. Change this setting, or remove the format from formats."
        )
    return cell


def _write(folder: Path, planned: Planned, name: str, fluid_warnings: Sequence[str]) -> dict[str, Any]:
    """Write the path and the level of a plan as tables, and return the content of plan.json."""
    path = planned_path(planned.trajectory)
    rows = np.column_stack([path.t_s, path.place_mm, path.speed_mm_s, path.flow])
    files.write_table(folder / TABLE, COLUMNS, rows)
    level, half_mm = planned.level, np.nan if planned.half_width_mm is None else planned.half_width_mm
    rows = np.column_stack([level.s_mm, level.level_mm, level.level_mm - half_mm, level.level_mm + half_mm])
    files.write_table(folder / record_files.LEVEL, record_files.LEVEL_COLUMNS, rows)
    return {
        "version": 1,
        "name": name,
        "folder": display_path(folder),
        "stage_numbers": numbers_up_to("simulate"),
        "fluid_warnings": fluid_warnings,
        "kept": planned.best.name,
        "drafts": not planned.options.accurate,
        "verified": planned.verified,
        "expected_off_mm": planned.best.off_mm,
        "sealant_mm3": float((path.flow[:-1] * np.diff(path.t_s)).sum()),
        "duration_s": path.t_s[-1] - path.t_s[0],
        **planned.options.model_dump(include={"margin_mm", "reserve_mm"}),
        **planned.misfit.figures,
        "seeds": [misfit.figures for misfit in planned.misfits],
        "band_95_mm": planned.band_95_mm,
        "with_more": {
            "flow_factor": MORE_FLOW,
            "yield_stress_factor": LESS_STRESS,
            **vars(planned.with_more),
        },
        "low_stretches": planned.low_stretches,
        "baselines": {run.name: run.misfit.figures for run in planned.baselines},
        "rounds": [{**run.misfit.figures, "expected_off_mm": run.off_mm} for run in planned.rounds],
    }


def _trial_beside(trial: Trial, source: Path, folder: Path) -> str:
    """Return the text of a trial file whose path is the plan. File names in the text are relative to ``folder``."""
    content = seen_from(folder, trial.model_dump(exclude_none=True) | {"assumed": [*trial.content["assumed"]]}, source)
    content["path"] = {"plan": TABLE}
    content["note"] = f"{trial.note} Planned by 'sealtwin plan'.".strip()[:2000]
    return trial_text(checked(Trial, folder / "trial.toml", content).content)
