"""Plan a trial: search for a plan with the fast model, check it with particles, correct the model and search again."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from digitise.planned_path import COLUMNS, PathTable, planned_path
from digitise.robots.cell import ProgramOptions, PumpTable, RobotCell
from digitise.settings import NozzlePath
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_columns
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.records import Floats, Profile, Sample, Trajectory
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
    Misfit,
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
from sealtwin.trial.exports import CellFile, origin_of, require_confirmed, write_programs
from sealtwin.trial.job import numbers_up_to, require_sample, shown, start_job
from sealtwin.trial.trial_file import SETTINGS, SettingValues, Trial, load_trial, seen_from, trial_text
from simulate.slot.run import paste_of
from simulate.slot.sections import Trapezoids
from validate.uncertainty.computed import Z_95, further_run_mm2, require_different

REPORT, TABLE, PAGE = "plan.json", "plan.csv", "plan.html"
VERIFICATION, SAMPLE = "verification", "sample"
SEARCHED, JUDGED = 4, 24  # Numbers of posterior draws: for the search, and for the probabilities of overfilling
MORE_FLOW, LESS_STRESS = 1.10, 0.85
SEARCH_S = 3.0  # Time in s of a search for one draw, on one core of the machine in docs/accuracy.md
MUCH_OVER_MM3, MUCH_ABOVE_MM = 100.0, 0.8  # Volume and level above the face whose probabilities are counted


def aim_of(options: PlanOptions, sections: Trapezoids) -> Floats:
    """Return the area to fill in each section, (cells,). Raises InputError if the plan aims below the crack's floor."""
    aims_mm, shallowest_mm = options.aim_mm, float(sections.depth_mm.min())
    if aims_mm >= shallowest_mm:
        raise InputError(
            f"--margin-mm {options.margin_mm:g} and --reserve-mm {options.reserve_mm:g}: their sum must be less than "
            f"the smallest depth of the crack, {shallowest_mm:.3g} mm. Give smaller values."
        )
    return target_of(sections, aims_mm)


@dataclass(frozen=True)
class MadePlan:
    """Result of planning a trial: the content of plan.json or rest.json, and sentences about the plan."""

    content: dict[str, Any]
    sentences: list[str]


@dataclass(frozen=True)
class PlanInputs:
    """A trial to plan, with the robot's cell and the table of the cell's pump."""

    file: Path
    file_trial: Trial  # Trial as it is in the file
    trial: Trial  # Trial with the content of the files that it names, and without readings
    cell: CellFile | None

    @classmethod
    def read(cls, file: Path, settings: SettingValues | None, cell_file: Path | None) -> "PlanInputs":
        """Read the trial and the cell. Raises InputError if one of them is not suitable for a plan."""
        file_trial = load_trial(file, settings)
        require_sample(file_trial, file.parent)
        trial = require_plannable(file_trial.loaded(file.parent), str(file))
        cell = None if cell_file is None else CellFile.read(cell_file)
        if cell is not None and (steady := cell.settings.steady_settings):
            raise InputError(
                f"{cell_file}: with {' and '.join(steady)}, a program has only one speed or one flow, but a plan "
                "varies both. Change this setting, or remove the format from formats."
            )
        return cls(file, file_trial, trial, cell)

    @contextmanager
    def digitised(self, folder: Path, progress: Progress) -> Iterator[Sample]:
        """Lock the folder of a plan during the block, and digitise the crack in it.

        Raises InputError if the folder or the crack cannot be used.
        """
        require_own(folder, SAMPLE, "plan")
        with holding(folder), progress:
            with open_folder(folder / SAMPLE, create=True) as home:
                run_stages(start_job(self.trial, self.file.parent, home, "cpu", progress), ("digitise",))
            sample = record_files.read_sample(folder / SAMPLE)
            if self.cell is not None:
                require_confirmed(shown(folder / SAMPLE), sample.outline, ProgramOptions())
            yield sample

    def write_programs(self, folder: Path, table: str, sample: Sample, trajectory: Trajectory) -> dict[str, Any]:
        """Write the robot programs for a path. Returns their names for the JSON file. Empty without a cell."""
        if self.cell is None:
            return {}
        origin = origin_of(folder, self.trial.name, sample.outline, [table])
        report, _ = write_programs(folder / "robot", trajectory, self.cell, ProgramOptions(), origin)
        return {"robot": sorted(report["files"])}

    @property
    def limits_by(self) -> tuple[RobotCell | None, PumpTable | None]:
        return (None, None) if self.cell is None else (self.cell.settings, self.cell.pump)


def case_of(sample: Sample, trial: Trial) -> Case:
    """Return a trial as a case for the fast model. Raises InputError if the fast model does not support the paste."""
    pour = trial.pour(sample)
    return Case(pour, paste_of(pour))


def plan_on(
    verifier: Verifier,
    options: PlanOptions,
    draws: Sequence[Trial],
    limits_by: tuple[RobotCell | None, PumpTable | None] = (None, None),
    where: Path = Path("trial.toml"),
) -> Planned:
    """Make a plan for a digitised crack. ``limits_by`` contains the robot's cell and the table of its pump.

    ``draws`` are trials with settings drawn from a posterior. Without draws, the plan is for the trial's own settings.
    Raises InputError if no plan is possible, and NumericalError if a particle run fails.
    """
    sample, trial, progress, drafts = verifier.sample, verifier.trial, verifier.progress, not options.accurate
    nominal = case_of(sample, trial)
    cases = [case_of(sample, draw) for draw in draws] or [nominal]
    few = cases[:: max(1, len(cases) // SEARCHED)][:SEARCHED]
    sections = nominal.fill(sample.trajectory).sections
    target_mm2 = aim_of(options, sections)
    knots = Knots(sample.trajectory, options.knots)
    limits = limits_of(sample.trajectory, *limits_by, options.flow_max_mm3_s, options.keep_speed)
    require_possible(limits, target_mm2, sections.s_mm, sample.trajectory, where)
    filled = float(target_of(sections, options.margin_mm).sum() / sections.full_mm2.sum())
    paths = [
        (name, trial.path.model_copy(update={"volume_ml": "cavity", "fill": filled, "flow": flow}), trial.seed)
        for name, flow in (("constant flow", "constant"), ("flow by local area", "cross_section"))
    ]
    search_s = len(few) * SEARCH_S
    verifier.ahead_s = (options.verify + drafts) * search_s + 2 * drafts * verifier.work_s(1, drafts=False)
    for runs in (len(paths), *[1] * options.verify, options.seeds - 1):
        verifier.ahead_s += verifier.work_s(runs, drafts=drafts)
    progress.note(
        f"Two baselines, {options.verify} rounds and {options.seeds} seeds: about "
        f"{in_words(verifier.corrected_s(verifier.ahead_s))} in total, from a model, which the first runs will correct."
    )
    rounds, baselines = list[Round](), verifier.judge("Baselines by particles", paths, drafts=drafts)

    def corrected(name: str, start: Floats, apart_mm2: Floats, *, drafts: bool) -> Round:
        """Search a plan and check it with particles.

        The search begins at ``start``. The areas of the fast model are corrected by ``apart_mm2``.
        """
        verifier.ahead_s -= search_s
        progress.start(f"Searching, {name}", MAX_STEPS)
        progress.later(verifier.corrected_s(verifier.ahead_s))
        # With a reserve, corrections do not add sealant. If the fast model were right, it would rise above the face.
        most = rounds[0].plan if rounds and options.reserve_mm > 0 else None
        goal = Goal(target_mm2, apart_mm2)
        plan = search(few, knots, limits, goal, start, progress.advance, most)
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
    level, it, runs = replace(draft.level, level_mm=levels_mm.mean(axis=0)), mean_of(misfits), len(judged)
    steady = baselines[0]
    if drafts:
        (run,) = verifier.judge("Accurate run of the plan", [(draft.name, draft.path, trial.seed)])
        best = replace(draft, level=run.level, misfit=run.misfit)
        # For constant flow there is only a draft. Its accurate level is estimated with the change found for the plan.
        accurate_mm = steady.level.level_mm + run.level.level_at_mm(s_mm) - draft.level.level_mm
        steady = replace(steady, level=replace(steady.level, level_mm=accurate_mm))
        if len(draft.plan):
            # The plan was fitted to drafts, whose particles are larger. The accurate run corrects it once.
            apart_mm2 = discrepancy(nominal.along(draft.path), run.level)
            again = corrected("corrected by the accurate run", draft.plan, apart_mm2, drafts=False)
            best = min(best, again, key=_cost_mm3)
        level, it, runs = best.level, best.misfit, 1
    variance = np.zeros(len(level.s_mm))
    if len(judged) > 1:
        # This is the variance of a further run about the mean. Drafts scatter at least as much as accurate runs.
        variance += further_run_mm2(levels_mm, runs)
    trajectory = path_over(sample, best.path)
    apart_mm2, chances = discrepancy(nominal.along(best.path), level), None
    if draws:
        drawn_mm = np.array([corrected_level_mm(case.fill(trajectory), apart_mm2, sections) for case in cases])
        chances = _chances([misfit(sample, Profile(sections.s_mm, level_mm)) for level_mm in drawn_mm])
        variance += np.interp(level.s_mm, sections.s_mm, drawn_mm.var(axis=0, ddof=1))
    alike = (best.path, level), (steady.path, steady.level)
    return Planned(
        options=options,
        best=best,
        rounds=tuple(rounds),
        baselines=tuple(baselines),
        trajectory=trajectory,
        level=level,
        half_width_mm=Z_95 * np.sqrt(variance) if len(judged) > 1 else None,
        misfit=it,
        misfits=misfits,
        chances=chances,
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


def _chances(misfits: Sequence[Misfit]) -> dict[str, float]:
    return {
        f"over_above_{MUCH_OVER_MM3:g}_mm3": float(np.mean([misfit.over_mm3 > MUCH_OVER_MM3 for misfit in misfits])),
        f"level_above_{MUCH_ABOVE_MM:g}_mm": float(np.mean([misfit.highest_mm > MUCH_ABOVE_MM for misfit in misfits])),
        "draws": len(misfits),
    }


def read_draws(path: Path, trial: Trial) -> list[Trial]:
    """Return trials with settings of the fluid from a posterior, a CSV with one draw in each row.

    At most ``JUDGED`` draws are returned, evenly spaced in the file. Raises InputError if the file cannot be used.
    """
    names = [name for name in SETTINGS if name.startswith("fluid.")]
    columns = read_columns(path, dict.fromkeys(names, (-1e9, 1e9)), [], (2, 100_000))
    columns.pop("row")
    draws = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return [
        trial.changed(draws[number], Path(f"{path}, row {number + 2}"))
        for number in np.linspace(0, len(draws) - 1, min(len(draws), JUDGED)).astype(int).tolist()
    ]


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
    the cell or the posterior cannot be used, and NumericalError if a run fails.
    """
    inputs = PlanInputs.read(file, settings, options.cell)
    file_trial, trial = inputs.file_trial, inputs.trial
    if trial.path.plan is not None:
        raise InputError(f"{file}: path.plan already has a plan. Remove it, and give path.speed_mm_s for a new plan.")
    draws = [] if options.posterior is None else read_draws(options.posterior, trial)
    folder = out or Path("reports", f"{file_trial.folder_name}-plan")
    with inputs.digitised(folder, progress) as sample:
        verifier = Verifier(folder / VERIFICATION, trial, sample, device, progress, jobs)
        planned = plan_on(verifier, options, draws, inputs.limits_by, file)
        warned = verifier.fluid_warnings
        content = _write(folder, planned, trial.name, warned)
        write_plan_page(folder / PAGE, trial.name, planned, warned)
        files.write_text(folder / "trial.toml", _trial_beside(file_trial, file.parent, folder))
        # The plan is written before the robot programs, so that it remains if the cell's limits refuse them.
        files.write_json(folder / REPORT, content)
        if planned.verified:
            content |= inputs.write_programs(folder, TABLE, sample, planned.trajectory)
            files.write_json(folder / REPORT, content)
        return MadePlan(content, [*plan_cautions(planned, warned), plan_finding(planned)])


def write_tables(
    folder: Path, table: str, trajectory: Trajectory, level: Profile, half_mm: Floats | float = np.nan
) -> PathTable:
    """Write the path of a plan, and the level with its band of half-width ``half_mm``, as tables.

    Returns the path as it was written.
    """
    path = planned_path(trajectory)
    rows = np.column_stack([path.t_s, path.place_mm, path.speed_mm_s, path.flow])
    files.write_table(folder / table, COLUMNS, rows)
    rows = np.column_stack([level.s_mm, level.level_mm, level.level_mm - half_mm, level.level_mm + half_mm])
    files.write_table(folder / record_files.LEVEL, record_files.LEVEL_COLUMNS, rows)
    return path


def _write(folder: Path, planned: Planned, name: str, fluid_warnings: Sequence[str]) -> dict[str, Any]:
    """Write the path and the level of a plan as tables, and return the content of plan.json."""
    half_mm = np.nan if planned.half_width_mm is None else planned.half_width_mm
    path = write_tables(folder, TABLE, planned.trajectory, planned.level, half_mm)
    return {
        "version": 1,
        "name": name,
        "folder": shown(folder),
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
        "chances": planned.chances,
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
    content = seen_from(folder, trial.model_dump(exclude_none=True), source)
    content["path"] = {"plan": TABLE}
    content["note"] = f"{trial.note} Planned by 'sealtwin plan'.".strip()[:2000]
    return trial_text(checked(Trial, folder / "trial.toml", content))
