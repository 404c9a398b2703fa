"""Judge paths over one crack with particle runs, in a folder like that of a sweep; show and describe a finished plan.

Importing this loads Matplotlib.
"""

from collections.abc import Sequence
from dataclasses import asdict, astuple, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from digitise.settings import NozzlePath
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile, Sample, Trajectory
from sealtwin.core.run_folder import stage_key
from sealtwin.plan import PlanOptions
from sealtwin.plan.search import OVER_WEIGHT, path_over
from sealtwin.study import study_folder
from sealtwin.study.estimate import Forecast, size_of, timings_of
from sealtwin.study.runner import StudyOptions, WantedRun, bring_up_to_date, require_done, schedule, write_sample
from sealtwin.trial.job import numbers_up_to
from sealtwin.trial.trial_file import Trial, drafted, refuse_seeds
from simulate.slot.sections import sections_of
from validate.figures.page import FigureColumn, FigureTable, Page, Plot, Section, write_page
from validate.figures.theme import ALONG, LEVEL, MEASURED, MUTED, SIMULATED, draw_curve, label_axes, themed, wide_axes
from validate.units import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOW_MM, SHORTEST_LOW_MM = 1.0, 5.0  # Least depth and length of a low stretch that a plan's sentence names
CELLS = 160  # Number of cells along the crack for a misfit: 0.5 mm for 80 mm, finer than readings
AGREES_MM = 0.4  # Mean difference of prediction and particles above which the page mentions it
BASELINES = {"constant flow": "--", "flow by local area": ":"}


@dataclass(frozen=True)
class Misfit:
    """Volume of sealant that is missing below the face, volume above it, and the highest level from the face."""

    under_mm3: float
    over_mm3: float
    """Volume above the crack's mouth. Sealant beside the mouth does not count."""
    highest_mm: float

    @property
    def total_mm3(self) -> float:
        return self.under_mm3 + self.over_mm3

    @property
    def cost_mm3(self) -> float:
        """Total with the weight of a search on the volume above the face. The best plan has the least."""
        return self.under_mm3 + OVER_WEIGHT * self.over_mm3

    @property
    def figures(self) -> dict[str, float]:
        """The volumes and the highest level by name, for JSON."""
        return {**asdict(self), "total_mm3": self.total_mm3}


def misfit(sample: Sample, level: Profile) -> Misfit:
    """Return the volume that a level along a crack lacks below the face, and the volume that it has above the face."""
    sections = sections_of(sample.outline, sample.solid, CELLS, reach_per_mm=0.0)
    level_mm = level.level_at_mm(sections.s_mm)
    filled_mm2, _ = sections.area_mm2(np.minimum(level_mm, 0.0) - sections.bottom_mm)
    under_mm2 = sections.full_mm2 - np.maximum(filled_mm2, 0.0)
    over_mm2 = sections.mouth_mm * np.maximum(level_mm, 0.0)
    return Misfit(
        float(under_mm2.sum()) * sections.step_mm, float(over_mm2.sum()) * sections.step_mm, float(level_mm.max())
    )


def mean_of(misfits: Sequence[Misfit]) -> Misfit:
    return Misfit(*np.mean([astuple(misfit) for misfit in misfits], axis=0).tolist())


@dataclass(frozen=True)
class Round:
    """A path that particles judged, with its level and misfit."""

    name: str
    path: NozzlePath
    level: Profile
    misfit: Misfit
    off_mm: float | None = None  # Mean difference from the expected level; None for a baseline
    plan: Floats = field(default_factory=lambda: np.zeros(0))  # Numbers of the path's plan; none for a baseline


@dataclass(frozen=True)
class WithMore:
    """Volumes over the face if the pump gives more and the paste is softer than planned, by the fast model."""

    over_mm3: float
    constant_flow_over_mm3: float


@dataclass(frozen=True)
class Planned:
    """A finished plan, with its rounds and baselines. Without ``options.accurate`` they and the seeds are drafts."""

    options: PlanOptions
    best: Round
    rounds: tuple[Round, ...]
    baselines: tuple[Round, ...]
    trajectory: Trajectory  # Path of the best
    level: Profile  # Mean of the seeds, or that of the accurate run if the seeds are drafts
    half_width_mm: Floats | None
    """Half-width of the 95 % band for a further run's level; None if the plan has one seed, which shows no scatter."""
    misfit: Misfit  # Misfit of the level: the mean of the seeds', or the accurate run's
    misfits: tuple[Misfit, ...]  # Misfit of each seed
    chances: dict[str, float] | None
    with_more: WithMore
    of_draft: Misfit | None  # Misfit of the best plan as a draft, before the accurate run corrected it
    unfilled_mm3: float  # Volume below the face of a crack that is filled up to the level that the plan aims at

    @property
    def verified(self) -> bool:
        """True if a plan is better than both baselines according to the particle runs."""
        return self.best.off_mm is not None

    @property
    def band_95_mm(self) -> float | None:
        return None if self.half_width_mm is None else float(self.half_width_mm.mean())

    @property
    def low_stretches(self) -> list[dict[str, float]]:
        """Stretches of the crack, at least ``SHORTEST_LOW_MM`` long, with a level over ``LOW_MM`` below its target."""
        s_mm, lacks_mm = self.level.s_mm, -self.options.margin_mm - self.level.level_mm
        parts = np.split(np.arange(len(s_mm)), np.flatnonzero(np.diff(lacks_mm > LOW_MM)) + 1)
        return [
            {
                "from_mm": float(s_mm[part[0]]),
                "to_mm": float(s_mm[part[-1]]),
                "mean_mm": float(lacks_mm[part].mean()),
            }
            for part in parts
            if lacks_mm[part[0]] > LOW_MM and s_mm[part[-1]] - s_mm[part[0]] >= SHORTEST_LOW_MM
        ]


NamedPath = tuple[str, NozzlePath, int]
"""A path to judge, with a short name before it and the seed of its run after it."""


@dataclass
class Verifier:
    """Runs one trial along paths that are not its own."""

    folder: Path
    trial: Trial
    sample: Sample
    device: str
    progress: Progress
    jobs: int = 1
    ahead_s: float = 0.0
    """Expected time, by the model of ``sealtwin.study.estimate``, of the work of the command that has not begun."""
    _runs: list[study_folder.StudyRun] = field(default_factory=list)

    def judge(self, title: str, paths: Sequence[NamedPath], *, drafts: bool = False) -> list[Round]:
        """Return a round for each of ``paths``. Arguments and faults are those of ``levels``."""
        self.ahead_s -= self.work_s(len(paths), drafts=drafts)
        levels = self.levels(title, paths, drafts=drafts) if paths else []
        return [
            Round(name, path, level, misfit(self.sample, level))
            for (name, path, _), level in zip(paths, levels, strict=True)
        ]

    def levels(self, title: str, paths: Sequence[NamedPath], *, drafts: bool = False) -> list[Profile]:
        """Return the level by particles for each of ``paths``, by drafts of the trial if ``drafts`` is True.

        Raises InputError if particles do not fit the crack, and NumericalError if a run fails.
        """
        wanted = list[WantedRun]()
        for number, (label, path, seed) in enumerate(paths, start=len(self._runs) + 1):
            trial = self.trial.model_copy(update={"path": path, "seed": seed})
            poured = replace(self.sample, trajectory=path_over(self.sample, path))
            trial = drafted(trial, poured) if drafts else trial
            depends = {"path": path.model_dump(mode="json", exclude_none=True)}
            home = stage_key({}, depends, numbers_up_to("digitise"))[:12]
            run = WantedRun(number, {"path": label, "seed": seed}, trial, poured, home, {}, depends)
            write_sample(self.folder, run)
            digitised = self.folder / "samples" / home
            inputs = {file: files.sha256(digitised / file) for file in ("outline.json", "crack.ply", "trajectory.csv")}
            wanted.append(replace(run, inputs=inputs))
        asked, largest, _ = schedule(wanted, self.device, numbers_up_to("simulate"))
        merged = {run.key: run for run in (*asked, *self._runs)}.values()
        self._runs = sorted(merged, key=lambda run: run.number)
        plan = study_folder.Plan("verification", self._runs, numbers=numbers_up_to("simulate"))
        jobs = self.jobs if min(self.jobs, len(asked)) > 1 else 0
        options = StudyOptions(self.device, jobs, later_s=self.ahead_s, retry=True)
        self._runs = bring_up_to_date(self.folder, plan, largest, options, self.progress, title).runs
        require_done(self.folder, self._runs, "there is no plan")
        return [study_folder.read_level(self.folder, run) for run in asked]

    def corrected_s(self, model_s: float) -> float:
        """Return a time by the model, corrected by the runs that are finished."""
        return Forecast(1, timings_of(self._runs)).scaled_s(model_s)

    def work_s(self, runs: int, *, drafts: bool) -> float:
        """Return the time by the model of particle runs of which ``jobs`` are computed side by side."""
        trial = drafted(self.trial, self.sample) if drafts else self.trial
        return size_of(trial.pour(self.sample)).work_s * -(-runs // max(1, self.jobs))

    @property
    def fluid_warnings(self) -> list[str]:
        """Cautions about the fluid in the runs that are finished so far."""
        return study_folder.fluid_warnings(self._runs)


def require_plannable(trial: Trial, where: str) -> Trial:
    """Return the trial with particles and without readings, for verification. Raises InputError if it is unsuitable."""
    if trial.fluid is None:
        raise InputError(f"{where}: a plan needs a [fluid] table: give viscosity_pa_s and yield_stress_pa in it.")
    refuse_seeds(trial, where)
    if trial.fluid.U is not None:
        raise InputError(
            f"{where}: fluid.U = {trial.fluid.U:g} means a viscosity that changes with the flow, so a plan cannot use "
            "it. Give viscosity_pa_s instead. For a paste with a yield stress, health.viscosity_pa_s in "
            "simulation.json is the value of a run."
        )
    solver = trial.solver.model_copy(update={"model": None})
    return trial.model_copy(update={"solver": solver, "readings": None, "gate": None})


def write_plan_page(path: Path, name: str, planned: Planned, fluid_warnings: Sequence[str]) -> None:
    draft = ", draft" if not planned.options.accurate else ""
    by, others = "accurate" if draft else "mean of its seeds", [*planned.baselines, *planned.rounds]
    columns = [
        FigureColumn("path", [f"the plan, {by}", *(f"{other.name}{draft}" for other in others)]),
        FigureColumn("under (mm3)", "under_mm3", "{:.0f}".format),
        FigureColumn("over (mm3)", "over_mm3", "{:.0f}".format),
        FigureColumn("total (mm3)", "total_mm3", "{:.0f}".format),
        FigureColumn("highest (mm)", "highest_mm", "{:+.2f}".format),
    ]
    judged = FigureTable(
        "Judged by particles", "judged", columns, [planned.misfit, *(other.misfit for other in others)]
    )
    trajectory, chances = planned.trajectory, planned.chances or {}
    key_figures = [
        ("sealant", f"{trajectory.dispensed_mm3 / 1000:.3g} ml"),
        ("duration", f"{trajectory.duration_s:.1f} s"),
        ("aims below the face by", f"{planned.options.aim_mm:.2f} mm"),
    ]
    if (band_mm := planned.band_95_mm) is not None:
        runs = counted(len(planned.misfits), "draft" if draft else "run")
        key_figures.append((f"half-width of the 95 % band of a run, from {runs}", f"{band_mm:.2f} mm"))
    key_figures += [
        (f"draws with {name.replace('_', ' ')}", f"{share * chances['draws']:.0f} of {chances['draws']:.0f}")
        for name, share in chances.items()
        if name != "draws"
    ]
    caption = "Level by particles along the crack; 0 is the face."
    flow = {"s_mm": trajectory.s_mm, "speed_mm_s": trajectory.speed_mm_s, "flow_mm3_s": trajectory.flow_mm3_s}
    page = Page(
        title=f"Plan: {name}",
        lead="Flow and speed along the path, chosen by the fast model and judged by particles. No number is measured.",
        cautions=plan_cautions(planned, fluid_warnings),
        finding=plan_finding(planned),
        key_figures=key_figures,
        sections=[
            Section("Level", [Plot("levels", caption, lambda: _draw_levels(planned)), judged]),
            Section("Path", [Plot("flow", "Flow and speed of the plan.", lambda: _draw_flow(planned), flow)]),
        ],
    )
    write_page(path, page)


def plan_finding(planned: Planned) -> str:
    misfit, better = planned.misfit, min(planned.baselines, key=lambda baseline: baseline.misfit.total_mm3)
    low = "; ".join(
        f"from {part['from_mm']:.0f} to {part['to_mm']:.0f} mm the level is {part['mean_mm']:.1f} mm too low on average"
        for part in planned.low_stretches
    )
    drafts = ""
    if (draft := planned.of_draft) is not None:
        drafts = f"; as drafts, the best round has {draft.under_mm3:.0f} mm3 and {draft.over_mm3:.0f} mm3, and"
    return (
        f"{misfit.under_mm3:.0f} mm3 are missing below the face and {misfit.over_mm3:.0f} mm3 are above it, according "
        f"to particles{drafts or ';'} the better baseline ({better.name}) has {better.misfit.under_mm3:.0f} mm3 and "
        f"{better.misfit.over_mm3:.0f} mm3." + (f" {low[0].upper()}{low[1:]}." if low else "")
    )


def plan_cautions(planned: Planned, fluid_warnings: Sequence[str]) -> list[str]:
    """Return cautions about the fluid and the plan.

    There is one about the plan if it has no band, is worse than a baseline, or differs much from the fast model.
    """
    cautions = [*fluid_warnings]
    if planned.band_95_mm is None:
        cautions.append(
            "Only one seed judged this plan, so the scatter of single runs is unknown and its level has no "
            "band. Use --seeds 3."
        )
    if planned.best.off_mm is None:
        not_verified = f"NOT VERIFIED: no plan was better than {planned.best.name}, which is the result."
        if planned.unfilled_mm3 > planned.best.misfit.cost_mm3:
            not_verified += (
                f" A plan aims {planned.options.aim_mm:.2f} mm below the face, which leaves "
                f"{planned.unfilled_mm3:.0f} mm3 unfilled by itself: give a smaller --margin-mm or --reserve-mm."
            )
        return [f"{not_verified} No robot program is written.", *cautions]
    over_mm3, steady_mm3 = planned.with_more.over_mm3, planned.with_more.constant_flow_over_mm3
    if over_mm3 > steady_mm3:
        cautions.append(
            f"If the pump gives 10 % more and the yield stress is 15 % lower, the plan leaves {over_mm3:.0f} mm3 over "
            f"the face and constant flow {steady_mm3:.0f} mm3, by the fast model: aim lower (--reserve-mm)."
        )
    if planned.best.off_mm > AGREES_MM:
        cautions.append(
            f"Fast model and particles still differ by {planned.best.off_mm:.2f} mm on average. The level is "
            "that of the particles; another round (--verify), or corrections that add sealant (--reserve-mm 0), may be "
            "better."
        )
    return cautions


@themed()
def _draw_levels(planned: Planned) -> "Figure":
    _, axes = wide_axes(3.2, face=True)
    plan = {"color": SIMULATED, "label": "the plan"}
    draw_curve(axes, planned.level.s_mm, planned.level.level_mm, "-", planned.half_width_mm, 0.2, "95 % band", **plan)
    for baseline in planned.baselines:
        level, style = baseline.level, BASELINES[baseline.name]
        draw_curve(axes, level.s_mm, level.level_mm, style, color=MUTED, label=baseline.name)
    axes.legend(fontsize=8, ncols=4)
    return label_axes(axes, ALONG, LEVEL, "")


@themed()
def _draw_flow(planned: Planned) -> "Figure":
    _, axes = wide_axes(2.6)
    trajectory, speed = planned.trajectory, axes.twinx()
    axes.stairs(trajectory.flow_mm3_s[:-1], trajectory.s_mm, color=SIMULATED, baseline=None)
    speed.stairs(trajectory.speed_mm_s[:-1], trajectory.s_mm, color=MEASURED, baseline=None, linestyle="--")
    speed.set_ylabel("speed (mm/s), dashed")
    return label_axes(axes, ALONG, "flow (mm3/s)", "")
