"""A plan for a trial: searched on the fast model, judged by particles, searched again with what they showed."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from digitise.planned_path import COLUMNS, planned_path
from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.number_tables import read_columns
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile, Trajectory
from sealtwin.core.replicates import require_different
from sealtwin.core.run_folder import holding, open_folder, refuse_foreign, require_folder
from sealtwin.core.settings import checked
from sealtwin.plan import search as searching
from sealtwin.plan.search import Case, Goal, discrepancy, target_of
from sealtwin.plan.shape import Knots, limits_of, require_possible
from sealtwin.plan.verify import Misfit, Verifier, misfit, require_plannable
from sealtwin.study.runner import Bench, read_bench
from sealtwin.trial.job import require_sample, shown, start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.robot_files import pump_of, read_cell, write_programs
from sealtwin.trial.stage_numbers import numbers_up_to
from sealtwin.trial.trial_file import SETTINGS, Trial, load_trial, trial_text, with_settings

REPORT, TABLE, PAGE, LEVEL = "plan.json", "plan.csv", "plan.html", "level.csv"
VERIFICATION, SAMPLE = "verification", "sample"
SEARCHED, JUDGED = 4, 24  # Draws of a posterior that a search averages over, and that the chances are counted of
MUCH_OVER_MM3, MUCH_ABOVE_MM = 100.0, 0.8
Z_95 = 1.96
LOW_MM, SHORTEST_LOW_MM = 1.0, 5.0  # Lack of level, and length of it, from which on a plan's sentence names a stretch


@dataclass(frozen=True)
class Options:
    """Options of a plan."""

    knots: int = 8
    rounds: int = 3  # Particle runs of plans, of which each next one is searched with what the last showed
    seeds: int = 3  # Runs of the plan that is kept, with other seeds: they give its band
    margin_mm: float = 0.0  # Level below the face that the plan aims at
    flow_max_mm3_s: float | None = None
    keep_speed: bool = False


@dataclass(frozen=True)
class Round:
    """A plan that particles judged."""

    name: str
    path: NozzlePath
    level: Profile
    misfit: Misfit
    off_mm: float | None = None  # Mean difference from the level that was expected; None of a baseline


@dataclass(frozen=True)
class Planned:
    """A finished plan with all that it was held against."""

    best: Round
    rounds: tuple[Round, ...]
    baselines: tuple[Round, ...]
    trajectory: Trajectory  # Of the best
    s_mm: Floats
    level_mm: Floats  # Mean of the seeds
    half_width_mm: Floats | None
    """Half the 95 % band of a further run; None with one seed, since single runs then show no scatter."""
    misfits: tuple[Misfit, ...]  # Of each seed
    chances: dict[str, float] | None

    @property
    def verified(self) -> bool:
        """True where particles found a plan better than both baselines; level and band are theirs."""
        return self.best.off_mm is not None


def case_of(bench: Bench, trial: Trial, trajectory: Trajectory) -> Case:
    """Return the case of the fast model. Raises InputError for a paste that it does not know."""
    from simulate.slot.run import paste_of

    assert trial.fluid is not None, "checked before"
    solver = trial.solver.for_crack(bench.outline.mean_width_mm)
    paste = paste_of(trial.fluid, solver, trial.nozzle, trajectory, trial.seed)
    return Case(bench.solid, bench.outline, paste, trial.nozzle.diameter_mm, solver.settle_s, trial.sample)


def plan_on(
    verifier: Verifier,
    options: Options,
    draws: Sequence[Trial],
    limits_by: Any = None,
    where: Path = Path("trial.toml"),
) -> Planned:
    """Plan for a digitised crack. ``limits_by`` is the cell and its pump's table, or None.

    Raises InputError where no plan is possible, NumericalError where a particle run fails.
    """
    bench, trial, progress = verifier.bench, verifier.trial, verifier.progress
    cell, pump = limits_by or (None, None)
    own = bench.trajectory
    knots = Knots(own, options.knots)
    limits = limits_of(own, cell, pump, options.flow_max_mm3_s, options.keep_speed)
    nominal = case_of(bench, trial, own)
    cases = [case_of(bench, draw, own) for draw in draws] or [nominal]
    few = cases[:: max(1, len(cases) // SEARCHED)][:SEARCHED]
    sections = nominal.fill(own).sections
    target_mm2 = target_of(sections, options.margin_mm)
    require_possible(limits, target_mm2, sections.s_mm, own, where)
    filled = float(target_mm2.sum() / sections.full_mm2.sum())

    def judged(name: str, path: NozzlePath, level: Profile, predicted_mm: Floats | None = None) -> Round:
        off_mm = None
        if predicted_mm is not None:
            off_mm = float(np.abs(np.interp(sections.s_mm, level.s_mm, level.level_mm) - predicted_mm).mean())
        return Round(name, path, level, misfit(bench.outline, bench.solid, level.s_mm, level.level_mm), off_mm)

    paths = {
        name: trial.path.model_copy(update={"volume_ml": "cavity", "fill": filled, "flow": flow})
        for name, flow in (("constant flow", "constant"), ("flow by local area", "cross_section"))
    }
    levels = verifier.levels("Baselines by particles", [(name, path, trial.seed) for name, path in paths.items()])
    baselines = [judged(name, path, level) for (name, path), level in zip(paths.items(), levels, strict=True)]
    goal = Goal(target_mm2, np.zeros_like(target_mm2))
    plan = knots.first_guess(target_mm2, sections.s_mm, limits)
    rounds = list[Round]()
    for number in range(1, options.rounds + 1):
        progress.start(f"Searching, round {number}", searching.MOST_STEPS)
        plan = searching.search(few, knots, limits, goal, plan, progress.advance)
        path = NozzlePath(plan=planned_path(knots.trajectory(plan)))
        bed = nominal.fill(plan_trajectory(bench.outline, path))
        predicted_mm = sections.bottom_mm + sections.height_mm(bed.read_mm2 + goal.discrepancy_mm2)
        (level,) = verifier.levels(f"Particles, round {number}", [(f"round {number}", path, trial.seed)])
        rounds.append(judged(f"round {number}", path, level, predicted_mm))
        told = rounds[-1].misfit
        progress.note(
            f"round {number}: {told.under_mm3:.0f} mm3 under and {told.over_mm3:.0f} over; prediction and particles "
            f"differ by {rounds[-1].off_mm:.2f} mm"
        )
        goal = Goal(target_mm2, discrepancy(bed, level.s_mm, level.level_mm))
    best = min([*rounds, *baselines], key=lambda one: _cost(one.misfit))
    seeds = [
        (f"{best.name}, seed {seed}", best.path, seed) for seed in range(trial.seed + 1, trial.seed + options.seeds)
    ]
    levels = [best.level, *(verifier.levels("The plan with other seeds", seeds) if seeds else [])]
    s_mm = best.level.s_mm
    levels_mm = np.array([np.interp(s_mm, level.s_mm, level.level_mm) for level in levels])
    names = [f"with seed = {trial.seed + number}" for number in range(len(levels))]
    require_different(levels_mm, names, f"{where}: {best.name}")
    trajectory = plan_trajectory(bench.outline, best.path, bench.solid.cavity_volume_mm3, bench.solid.sections)
    bed = nominal.fill(trajectory)
    apart_mm2 = discrepancy(bed, s_mm, levels_mm.mean(axis=0))
    chances, variance = None, np.zeros(len(s_mm))
    if len(levels) > 1:
        # Of a further run about the mean of these.
        variance += levels_mm.var(axis=0, ddof=1).mean() * (1 + 1 / len(levels))
    if draws:
        drawn_mm = np.array(
            [
                sections.bottom_mm + sections.height_mm(case.fill(trajectory).read_mm2 + apart_mm2)
                for case in cases[:: max(1, len(cases) // JUDGED)][:JUDGED]
            ]
        )
        chances = _chances([misfit(bench.outline, bench.solid, sections.s_mm, level_mm) for level_mm in drawn_mm])
        variance = variance + np.interp(s_mm, sections.s_mm, drawn_mm.var(axis=0, ddof=1))
    return Planned(
        best=best,
        rounds=tuple(rounds),
        baselines=tuple(baselines),
        trajectory=trajectory,
        s_mm=s_mm,
        level_mm=levels_mm.mean(axis=0),
        half_width_mm=Z_95 * np.sqrt(variance) if len(levels) > 1 else None,
        misfits=tuple(misfit(bench.outline, bench.solid, s_mm, level_mm) for level_mm in levels_mm),
        chances=chances,
    )


def _cost(misfit: Misfit) -> float:
    return misfit.under_mm3 + searching.OVER_WEIGHT * misfit.over_mm3


def _chances(found: Sequence[Misfit]) -> dict[str, float]:
    return {
        f"over_above_{MUCH_OVER_MM3:g}_mm3": float(np.mean([one.over_mm3 > MUCH_OVER_MM3 for one in found])),
        f"level_above_{MUCH_ABOVE_MM:g}_mm": float(np.mean([one.highest_mm > MUCH_ABOVE_MM for one in found])),
        "draws": len(found),
    }


def read_draws(path: Path, trial: Trial) -> list[Trial]:
    """Read a posterior, a CSV of settings of the fluid with a draw in each row. Raises InputError."""
    names = [name for name in SETTINGS if name.startswith("fluid.")]
    columns = read_columns(path, dict.fromkeys(names, (-1e9, 1e9)), [], (2, 100_000))
    columns.pop("row")
    draws = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    content = json.loads(trial.model_dump_json(exclude_none=True))
    return [
        checked(Trial, Path(f"{path}, row {number + 2}"), with_settings(content, draws[number]))
        for number in np.linspace(0, len(draws) - 1, min(len(draws), JUDGED)).astype(int).tolist()
    ]


def make_plan(
    file: Path,
    out: Path | None,
    options: Options,
    progress: Progress,
    *,
    device: str = "cpu",
    jobs: int = 1,
    cell_file: Path | None = None,
    posterior: Path | None = None,
    settings: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Plan a trial in a folder of its own, by default reports/NAME-plan; return the content of plan.json.

    ``settings`` by dotted name replace those of the trial file. After a kill the same command searches again, in
    seconds, and keeps the particle runs that are done. Raises InputError if the trial, the cell or the posterior cannot
    be used, and NumericalError if a run fails.
    """
    given = load_trial(file, settings)
    require_sample(given, file.parent)
    trial = require_plannable(given.loaded(file.parent), str(file))
    cell = None if cell_file is None else read_cell(cell_file)
    pump = None if cell is None or cell_file is None else pump_of(cell, cell_file.parent)
    if cell is not None and (steady := cell.steady_settings):
        raise InputError(
            f"{cell_file}: {' and '.join(steady)}: programs of one speed or one flow, and a plan varies both. Give "
            "another, or take that format out of formats."
        )
    draws = [] if posterior is None else read_draws(posterior, trial)
    folder = out or Path("reports", f"{given.folder_name}-plan")
    require_folder(folder)
    if folder.is_dir() and not (folder / SAMPLE).is_dir():
        refuse_foreign(folder, "plan")
    with holding(folder), progress:
        with open_folder(folder / SAMPLE, create=True) as sample:
            run_stages(start_job(trial, file.parent, sample, "cpu", progress), ("digitise",))
        bench = read_bench(folder / SAMPLE, None)
        if cell is not None and bench.outline.path_source == "automatic":
            raise InputError(
                f"{file}: the crack was found automatically and is not confirmed, which a robot's program requires. "
                f"Look at {shown(folder / SAMPLE / 'overlay.png')} and give photo.ends_px, or plan without --cell."
            )
        verifier = Verifier(folder / VERIFICATION, trial, bench, device, progress, jobs)
        planned = plan_on(verifier, options, draws, (cell, pump), file)
        content = _write(folder, planned, trial, options, verifier.fluid_warnings)
        files.write_text(folder / "trial.toml", _trial_beside(given, file.parent, folder))
        # A program that the cell cannot carry is refused below, and the plan stays.
        files.write_json(folder / REPORT, content)
        if cell is not None and cell_file is not None and planned.verified:
            origin = {
                "trial": trial.name,
                "run": folder.resolve().name,
                "path_source": bench.outline.path_source,
                "inputs": {path.name: files.sha256(path) for path in (folder / TABLE, cell_file)},
                "edited_by_hand": [],
            }
            report, _ = write_programs(
                folder / "robot", planned.trajectory, cell, cell_file.name, (), origin, None, pump
            )
            content["robot"] = sorted(report["files"])
            files.write_json(folder / REPORT, content)
        return content


def _write(
    folder: Path, planned: Planned, trial: Trial, options: Options, fluid_warnings: Sequence[str]
) -> dict[str, Any]:
    from sealtwin.plan.plan_page import write_page

    path = planned_path(planned.trajectory)
    rows = np.column_stack([path.t_s, path.place_mm, path.speed_mm_s, path.flow])
    files.write_table(folder / TABLE, COLUMNS, rows)
    half_mm = np.full(len(planned.s_mm), np.nan) if planned.half_width_mm is None else planned.half_width_mm
    low_mm, high_mm = planned.level_mm - half_mm, planned.level_mm + half_mm
    columns = ("s_mm", "level_mm", "low_95_mm", "high_95_mm")
    files.write_table(folder / LEVEL, columns, np.column_stack([planned.s_mm, planned.level_mm, low_mm, high_mm]))
    mean = Misfit(*np.mean([list(asdict(one).values()) for one in planned.misfits], axis=0).tolist())
    content = {
        "version": 1,
        "name": trial.name,
        "folder": shown(folder),
        "stage_numbers": numbers_up_to("simulate"),
        "fluid_warnings": fluid_warnings,
        "kept": planned.best.name,
        "verified": planned.verified,
        "expected_off_mm": planned.best.off_mm,
        "sealant_mm3": float((path.flow[:-1] * np.diff(path.t_s)).sum()),
        "duration_s": path.t_s[-1] - path.t_s[0],
        "margin_mm": options.margin_mm,
        **_said(mean),
        "seeds": [_said(one) for one in planned.misfits],
        "band_95_mm": None if planned.half_width_mm is None else float(planned.half_width_mm.mean()),
        "chances": planned.chances,
        "low_stretches": low_stretches(planned.s_mm, planned.level_mm, options.margin_mm),
        "baselines": {one.name: _said(one.misfit) for one in planned.baselines},
        "rounds": [{**_said(one.misfit), "expected_off_mm": one.off_mm} for one in planned.rounds],
    }
    write_page(folder / PAGE, planned, content)
    return content


def low_stretches(s_mm: Floats, level_mm: Floats, margin_mm: float) -> list[dict[str, float]]:
    """Return the stretches whose level stays more than ``LOW_MM`` under the level that was aimed at."""
    lacks_mm = -margin_mm - level_mm
    found: list[dict[str, float]] = []
    for low, group in groupby(range(len(s_mm)), key=lambda place: bool(lacks_mm[place] > LOW_MM)):
        part = list(group)
        if low and s_mm[part[-1]] - s_mm[part[0]] >= SHORTEST_LOW_MM:
            ends = {"from_mm": float(s_mm[part[0]]), "to_mm": float(s_mm[part[-1]])}
            found.append({**ends, "mean_mm": float(lacks_mm[part].mean())})
    return found


def _said(misfit: Misfit) -> dict[str, float]:
    return {**asdict(misfit), "total_mm3": misfit.total_mm3}


def _trial_beside(trial: Trial, source: Path, folder: Path) -> str:
    """Return the trial with the plan, its files named from ``folder``."""

    def beside(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: beside(one) for key, one in value.items()}
        if isinstance(value, list | tuple):
            return [beside(one) for one in value]
        if isinstance(value, Path) and not value.is_absolute():
            return Path(os.path.relpath(source / value, folder)).as_posix()
        return value

    content = beside(trial.model_dump(exclude_none=True))
    content["path"] = {"plan": TABLE}
    content["note"] = f"{trial.note} Planned by 'sealtwin plan'.".strip()[:2000]
    return trial_text(checked(Trial, folder / "trial.toml", content))
