"""Plan a trial: search a plan on the fast model, judge it by particles, and search again with their levels."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from digitise.planned_path import COLUMNS, PathTable, planned_path
from digitise.robots.cell import ProgramOptions, RobotCell
from digitise.robots.pump import PumpTable
from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_columns
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.records import Floats, Profile, Sample, Trajectory
from sealtwin.core.run_folder import holding, open_folder, refuse_foreign, require_folder
from sealtwin.core.settings import checked
from sealtwin.plan import PlanOptions
from sealtwin.plan import search as searching
from sealtwin.plan.search import Case, Goal, Knots, discrepancy, limits_of, require_possible, target_of
from sealtwin.plan.verify import Misfit, Planned, Round, Verifier, WithMore, mean_of, misfit, require_plannable
from sealtwin.study.pipeline import run_stages
from sealtwin.trial.job import numbers_up_to, require_sample, shown, start_job
from sealtwin.trial.robot_files import CellFile, write_programs
from sealtwin.trial.trial_file import SETTINGS, Trial, load_trial, seen_from, trial_text
from simulate.slot.sections import Trapezoids
from validate.uncertainty.computed import Z_95, further_run_mm2, require_different

REPORT, TABLE, PAGE = "plan.json", "plan.csv", "plan.html"
VERIFICATION, SAMPLE = "verification", "sample"
SEARCHED, JUDGED = 4, 24  # Number of draws of a posterior for a search, and for counting chances
MORE_FLOW, LESS_STRESS = 1.10, 0.85
SEARCH_S = 3.0  # Time of a search on one draw, on one core of the machine in docs/accuracy.md
MUCH_OVER_MM3, MUCH_ABOVE_MM = 100.0, 0.8  # Limits of volume and level above the face whose chances are counted


def aim_of(options: PlanOptions, sections: Trapezoids) -> Floats:
    """Return the area to fill in each section. Raises InputError if the plan aims below a floor."""
    aims_mm, shallowest_mm = options.margin_mm + options.reserve_mm, float(sections.depth_mm.min())
    if aims_mm >= shallowest_mm:
        raise InputError(
            f"--margin-mm {options.margin_mm:g} and --reserve-mm {options.reserve_mm:g}: the crack is only "
            f"{shallowest_mm:.3g} mm deep in places; aim less than that below the face."
        )
    return target_of(sections, aims_mm)


@dataclass(frozen=True)
class MadePlan:
    """Result of planning a trial: the content of plan.json or rest.json, and sentences on the plan."""

    content: dict[str, Any]
    sentences: list[str]


@dataclass(frozen=True)
class PlanInputs:
    """A trial to plan, with the robot's cell and its pump's table."""

    file: Path
    given: Trial  # As in the file
    trial: Trial  # With the files that it names, and without readings
    cell: CellFile | None

    @classmethod
    def read(cls, file: Path, settings: Mapping[str, Any] | None, cell_file: Path | None) -> "PlanInputs":
        """Read the files. Raises InputError if the trial has no fluid for a plan, or the cell has a steady flow."""
        given = load_trial(file, settings)
        require_sample(given, file.parent)
        trial = require_plannable(given.loaded(file.parent), str(file))
        cell = None if cell_file is None else CellFile.read(cell_file)
        if cell is not None and (steady := cell.settings.steady_settings):
            raise InputError(
                f"{cell_file}: {' and '.join(steady)}: such a program has only one speed or one flow, but a plan "
                "varies both. Change this setting, or remove the format from formats."
            )
        return cls(file, given, trial, cell)

    @contextmanager
    def digitised(self, folder: Path, progress: Progress) -> Iterator[Sample]:
        """Digitise the crack in the folder of a plan, and hold the folder. Raises InputError if it cannot be used."""
        require_folder(folder)
        if folder.is_dir() and not (folder / SAMPLE).is_dir():
            refuse_foreign(folder, "plan")
        with holding(folder), progress:
            with open_folder(folder / SAMPLE, create=True) as home:
                run_stages(start_job(self.trial, self.file.parent, home, "cpu", progress), ("digitise",))
            sample = record_files.read_sample(folder / SAMPLE)
            if self.cell is not None and sample.outline.path_source == "automatic":
                raise InputError(
                    f"{self.file}: the crack was found automatically, but a robot's program requires a confirmed "
                    f"crack. Look at {shown(folder / SAMPLE / 'overlay.png')} and give photo.ends_px, or plan without "
                    "--cell."
                )
            yield sample

    def write_programs(self, folder: Path, table: str, sample: Sample, trajectory: Trajectory) -> dict[str, Any]:
        """Write the robot's programs for a path. Return their names for JSON, or an empty dict without a cell."""
        if self.cell is None:
            return {}
        origin = {
            "trial": self.trial.name,
            "run": folder.resolve().name,
            "path_source": sample.outline.path_source,
            "inputs": {table: files.sha256(folder / table)},
            "edited_by_hand": [],
        }
        report, _ = write_programs(folder / "robot", trajectory, self.cell, ProgramOptions(), origin)
        return {"robot": sorted(report["files"])}

    @property
    def limits_by(self) -> tuple[RobotCell | None, PumpTable | None]:
        return (None, None) if self.cell is None else (self.cell.settings, self.cell.pump)


def case_of(sample: Sample, trial: Trial) -> Case:
    """Return a trial as a case for the fast model. Raises InputError if the fast model does not support its paste."""
    from simulate.slot.run import paste_of

    pour = trial.pour(sample)
    return Case(pour, paste_of(pour))


def plan_on(
    verifier: Verifier,
    options: PlanOptions,
    draws: Sequence[Trial],
    limits_by: Any = None,
    where: Path = Path("trial.toml"),
) -> Planned:
    """Make a plan for a digitised crack. ``limits_by`` has the robot's cell and its pump's table, or is None.

    ``draws`` are trials with settings drawn from a posterior; the plan is for the trial itself if there are none.
    Raises InputError if no plan is possible, NumericalError if a particle run fails.
    """
    sample, trial, progress, drafts = verifier.sample, verifier.trial, verifier.progress, not options.accurate
    cell, pump = limits_by or (None, None)
    own = sample.trajectory
    knots = Knots(own, options.knots)
    limits = limits_of(own, cell, pump, options.flow_max_mm3_s, options.keep_speed)
    nominal = case_of(sample, trial)
    cases = [case_of(sample, draw) for draw in draws] or [nominal]
    few = cases[:: max(1, len(cases) // SEARCHED)][:SEARCHED]
    sections = nominal.fill(own).sections
    filled = float(target_of(sections, options.margin_mm).sum() / sections.full_mm2.sum())
    target_mm2 = aim_of(options, sections)
    unfilled_mm3 = float((sections.full_mm2 - target_mm2).sum()) * sections.step_mm
    require_possible(limits, target_mm2, sections.s_mm, own, where)

    def missed(s_mm: Floats, level_mm: Floats) -> Misfit:
        return misfit(sample, s_mm, level_mm)

    paths = {
        name: trial.path.model_copy(update={"volume_ml": "cavity", "fill": filled, "flow": flow})
        for name, flow in (("constant flow", "constant"), ("flow by local area", "cross_section"))
    }
    of_baselines = [(name, path, trial.seed) for name, path in paths.items()]

    def later_s(rounds: int, searches: int) -> float:
        """Return the time by the model of what follows ``rounds`` particle runs and ``searches``."""
        launches = options.launches(verifier.jobs, rounds)
        return verifier.model_s(launches) + (options.verify + drafts - searches) * len(few) * SEARCH_S

    whole_s = verifier.model_s([drafts]) + later_s(0, 0)
    progress.note(
        f"Two baselines, {options.verify} rounds and {options.seeds} seeds: about "
        f"{in_words(verifier.corrected_s(whole_s))} in all, from a model; the first runs will correct it."
    )
    levels = verifier.levels("Baselines by particles", of_baselines, drafts=drafts, later_s=later_s(0, 0))
    baselines = [
        Round(name, path, level, missed(level.s_mm, level.level_mm))
        for (name, path), level in zip(paths.items(), levels, strict=True)
    ]
    goal = Goal(target_mm2, np.zeros_like(target_mm2))
    plan = knots.first_guess(target_mm2, sections.s_mm, limits)
    rounds, plans = list[Round](), list[Floats]()

    def searched(name: str, goal: Goal, start: Floats, *, drafts: bool, rest_s: tuple[float, float]) -> Floats:
        """Search a plan, add its round, and return it. ``rest_s``: time that follows the search, and the run."""
        progress.start(f"Searching, {name}", searching.MOST_STEPS)
        progress.later(verifier.corrected_s(rest_s[0]))
        # Corrections keep the reserve: if the fast model is right, sealant that they add is over the face.
        plan = searching.search(few, knots, limits, goal, start, progress.advance, *plans[: options.reserve_mm > 0])
        path = NozzlePath(plan=planned_path(knots.trajectory(plan)))
        bed = nominal.fill(plan_trajectory(sample.outline, path))
        predicted_mm = sections.bottom_mm + sections.height_mm(bed.read_mm2 + goal.discrepancy_mm2)
        title = f"Particles, {name}"
        (level,) = verifier.levels(title, [(name, path, trial.seed)], drafts=drafts, later_s=rest_s[1])
        off_mm = float(np.abs(level.level_at_mm(sections.s_mm) - predicted_mm).mean())
        it = missed(level.s_mm, level.level_mm)
        rounds.append(Round(name, path, level, it, off_mm))
        progress.note(
            f"{name}: {it.under_mm3:.0f} mm3 are missing below the face and {it.over_mm3:.0f} mm3 are above it; "
            f"prediction and particles differ by {off_mm:.2f} mm"
        )
        return plan

    def goal_after(path: NozzlePath, level: Profile) -> Goal:
        bed = nominal.fill(plan_trajectory(sample.outline, path))
        return Goal(target_mm2, discrepancy(bed, level.s_mm, level.level_mm))

    for number in range(1, options.verify + 1):
        rest_s = later_s(number - 1, number), later_s(number, number)
        plan = searched(f"round {number}", goal, plan, drafts=drafts, rest_s=rest_s)
        plans.append(plan)
        goal = goal_after(rounds[-1].path, rounds[-1].level)
    best = min([*rounds, *baselines], key=lambda one: one.misfit.cost_mm3)
    seeds = [
        (f"{best.name}, seed {seed}", best.path, seed) for seed in range(trial.seed + 1, trial.seed + options.seeds)
    ]
    levels = [best.level]
    if seeds:
        last_s = verifier.model_s([False] * options.accurate_runs)
        levels += verifier.levels("The plan with other seeds", seeds, drafts=drafts, later_s=last_s)
    s_mm = best.level.s_mm
    levels_mm = np.array([level.level_at_mm(s_mm) for level in levels])
    names = [f"with seed = {trial.seed + number}" for number in range(len(levels))]
    require_different(levels_mm, names, f"{where}: {best.name}")
    misfits = tuple(missed(s_mm, level_mm) for level_mm in levels_mm)
    level_mm, it, runs = levels_mm.mean(axis=0), mean_of(misfits), len(levels)
    of_draft, off_draft_mm = None, np.zeros(len(s_mm))
    if drafts:
        one_s, of_draft, corrected = verifier.model_s([False]), best.misfit, list[Round]()
        (level,) = verifier.levels("Accurate run of the plan", [(best.name, best.path, trial.seed)], later_s=one_s)
        judged = missed(level.s_mm, level.level_mm)
        off_draft_mm = level.level_at_mm(s_mm) - best.level.level_mm
        if (start := next((plan for plan, one in zip(plans, rounds, strict=True) if one is best), None)) is not None:
            # A draft's particles are larger, and the plan suits them: the accurate run corrects it once.
            goal = goal_after(best.path, level)
            searched("corrected by the accurate run", goal, start, drafts=False, rest_s=(one_s, 0.0))
            corrected = [rounds.pop()]
        best = min([replace(best, level=level, misfit=judged), *corrected], key=lambda one: one.misfit.cost_mm3)
        level_mm, runs = best.level.level_at_mm(s_mm), 1
        it = missed(s_mm, level_mm)
    trajectory = plan_trajectory(sample.outline, best.path, sample.solid.cavity_volume_mm3, sample.solid.sections)
    bed = nominal.fill(trajectory)
    apart_mm2 = discrepancy(bed, s_mm, level_mm)

    def over_with_more_mm3(trajectory: Trajectory, apart_mm2: Floats) -> float:
        soft = replace(
            nominal, paste=replace(nominal.paste, yield_stress_pa=LESS_STRESS * nominal.paste.yield_stress_pa)
        )
        poured = soft.fill(replace(trajectory, flow_mm3_s=MORE_FLOW * trajectory.flow_mm3_s))
        height_mm = sections.height_mm(np.maximum(poured.read_mm2 + apart_mm2, 0.0))
        return missed(sections.s_mm, sections.bottom_mm + height_mm).over_mm3

    # Constant flow has only a draft: an accurate run of it would differ as that of the plan differs from its draft.
    constant = baselines[0]
    steady_mm = constant.level.level_at_mm(s_mm) + off_draft_mm
    steady = plan_trajectory(sample.outline, constant.path, sample.solid.cavity_volume_mm3, sample.solid.sections)
    steady_apart_mm2 = discrepancy(nominal.fill(steady), s_mm, steady_mm)
    with_more = WithMore(over_with_more_mm3(trajectory, apart_mm2), over_with_more_mm3(steady, steady_apart_mm2))
    chances, variance = None, np.zeros(len(s_mm))
    if len(levels) > 1:
        # Variance of a further run about the mean of these. Drafts scatter at least as much as accurate runs.
        variance += further_run_mm2(levels_mm, runs)
    if draws:
        drawn_mm = np.array(
            [sections.bottom_mm + sections.height_mm(case.fill(trajectory).read_mm2 + apart_mm2) for case in cases]
        )
        chances = _chances([missed(sections.s_mm, level_mm) for level_mm in drawn_mm])
        variance = variance + np.interp(s_mm, sections.s_mm, drawn_mm.var(axis=0, ddof=1))
    return Planned(
        best=best,
        rounds=tuple(rounds),
        baselines=tuple(baselines),
        trajectory=trajectory,
        margin_mm=options.margin_mm,
        reserve_mm=options.reserve_mm,
        s_mm=s_mm,
        level_mm=level_mm,
        half_width_mm=Z_95 * np.sqrt(variance) if len(levels) > 1 else None,
        misfit=it,
        misfits=misfits,
        chances=chances,
        with_more=with_more,
        drafts=drafts,
        of_draft=of_draft,
        unfilled_mm3=unfilled_mm3,
    )


def _chances(misfits: Sequence[Misfit]) -> dict[str, float]:
    return {
        f"over_above_{MUCH_OVER_MM3:g}_mm3": float(np.mean([one.over_mm3 > MUCH_OVER_MM3 for one in misfits])),
        f"level_above_{MUCH_ABOVE_MM:g}_mm": float(np.mean([one.highest_mm > MUCH_ABOVE_MM for one in misfits])),
        "draws": len(misfits),
    }


def read_draws(path: Path, trial: Trial) -> list[Trial]:
    """Return trials with settings drawn from a posterior, a CSV of settings of the fluid with a draw in each row.

    At most ``JUDGED`` draws are returned, evenly spaced in the file. Raises InputError if it cannot be used.
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
    settings: Mapping[str, Any] | None = None,
) -> MadePlan:
    """Plan a trial in a folder of its own, by default reports/NAME-plan.

    ``settings`` by dotted name replace those of the trial file. If the process is killed, the same command repeats the
    search, which takes seconds, but not the finished particle runs. Raises InputError if the trial, the cell or the
    posterior cannot be used, and NumericalError if a run fails.
    """
    inputs = PlanInputs.read(file, settings, options.cell)
    given, trial = inputs.given, inputs.trial
    if trial.path.plan is not None:
        raise InputError(f"{file}: path.plan is already a plan. Remove it, and give path.speed_mm_s for a new plan.")
    draws = [] if options.posterior is None else read_draws(options.posterior, trial)
    folder = out or Path("reports", f"{given.folder_name}-plan")
    with inputs.digitised(folder, progress) as sample:
        verifier = Verifier(folder / VERIFICATION, trial, sample, device, progress, jobs)
        planned = plan_on(verifier, options, draws, inputs.limits_by, file)
        from sealtwin.plan.pages import plan_cautions, plan_finding, write_plan_page

        warned = verifier.fluid_warnings
        content = _write(folder, planned, trial.name, warned)
        write_plan_page(folder / PAGE, trial.name, planned, warned)
        files.write_text(folder / "trial.toml", _trial_beside(given, file.parent, folder))
        # Before the program: if the cell refuses that, the plan stays.
        files.write_json(folder / REPORT, content)
        if planned.verified:
            content |= inputs.write_programs(folder, TABLE, sample, planned.trajectory)
            files.write_json(folder / REPORT, content)
        return MadePlan(content, [*plan_cautions(planned, warned), plan_finding(planned)])


def write_tables(
    folder: Path, table: str, trajectory: Trajectory, s_mm: Floats, level_mm: Floats, half_mm: Floats | float
) -> PathTable:
    """Write a plan's path, and its level with the half-width of its band, as tables. Return the path as written."""
    path = planned_path(trajectory)
    rows = np.column_stack([path.t_s, path.place_mm, path.speed_mm_s, path.flow])
    files.write_table(folder / table, COLUMNS, rows)
    rows = np.column_stack([s_mm, level_mm, level_mm - half_mm, level_mm + half_mm])
    files.write_table(folder / record_files.LEVEL, record_files.LEVEL_COLUMNS, rows)
    return path


def _write(folder: Path, planned: Planned, name: str, fluid_warnings: Sequence[str]) -> dict[str, Any]:
    """Write the plan's path and level as tables, and return the content of plan.json."""
    half_mm = np.nan if planned.half_width_mm is None else planned.half_width_mm
    path = write_tables(folder, TABLE, planned.trajectory, planned.s_mm, planned.level_mm, half_mm)
    return {
        "version": 1,
        "name": name,
        "folder": shown(folder),
        "stage_numbers": numbers_up_to("simulate"),
        "fluid_warnings": fluid_warnings,
        "kept": planned.best.name,
        "drafts": planned.drafts,
        "verified": planned.verified,
        "expected_off_mm": planned.best.off_mm,
        "sealant_mm3": float((path.flow[:-1] * np.diff(path.t_s)).sum()),
        "duration_s": path.t_s[-1] - path.t_s[0],
        "margin_mm": planned.margin_mm,
        "reserve_mm": planned.reserve_mm,
        **planned.misfit.figures,
        "seeds": [one.figures for one in planned.misfits],
        "band_95_mm": planned.band_95_mm,
        "chances": planned.chances,
        "with_more": {
            "flow_factor": MORE_FLOW,
            "yield_stress_factor": LESS_STRESS,
            **vars(planned.with_more),
        },
        "low_stretches": planned.low_stretches,
        "baselines": {one.name: one.misfit.figures for one in planned.baselines},
        "rounds": [{**one.misfit.figures, "expected_off_mm": one.off_mm} for one in planned.rounds],
    }


def _trial_beside(trial: Trial, source: Path, folder: Path) -> str:
    """Return the text of a trial file with the plan as its path. The file names in it are relative to ``folder``."""
    content = seen_from(folder, trial.model_dump(exclude_none=True), source)
    content["path"] = {"plan": TABLE}
    content["note"] = f"{trial.note} Planned by 'sealtwin plan'.".strip()[:2000]
    return trial_text(checked(Trial, folder / "trial.toml", content))
