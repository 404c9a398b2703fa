"""Compute particle runs along planned paths, in a folder that is built like a sweep's, and describe a finished plan.

Importing this module loads Matplotlib.
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
from sealtwin.study.estimate import checked_size, slowness
from sealtwin.study.runner import StudyOptions, WantedRun, bring_up_to_date, require_done, schedule, write_sample
from sealtwin.trial.job import numbers_up_to
from sealtwin.trial.trial_file import Trial, drafted, refuse_seeds
from simulate.slot.sections import sections_of
from validate.figures.page import FigureColumn, FigureTable, Page, Plot, Section, write_page
from validate.figures.theme import ALONG, LEVEL, MEASURED, MUTED, SIMULATED, draw_curve, label_axes, themed, wide_axes
from validate.units import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOW_MM, SHORTEST_LOW_MM = 1.0, 5.0  # Smallest depth and length in mm of a low stretch that is mentioned
CELLS = 160  # Number of cells along the crack for a misfit. For 80 mm they are 0.5 mm long, finer than readings
AGREES_MM = 0.4  # Mean difference in mm between prediction and particles above which the page mentions it
BASELINES = {"constant flow": "--", "flow by local area": ":"}


@dataclass(frozen=True)
class Misfit:
    """Volume of sealant that is missing below the face, volume above the face, and the highest level."""

    under_mm3: float
    over_mm3: float
    """Volume above the crack's mouth. Sealant on the face beside the mouth is not counted."""
    highest_mm: float

    @property
    def total_mm3(self) -> float:
        return self.under_mm3 + self.over_mm3

    @property
    def cost_mm3(self) -> float:
        """Sum of the volumes, in which the volume above the face has the weight of a search.

        The best plan has the smallest sum.
        """
        return self.under_mm3 + OVER_WEIGHT * self.over_mm3

    @property
    def figures(self) -> dict[str, float]:
        """Volumes and highest level by name, for the JSON file."""
        return {**asdict(self), "total_mm3": self.total_mm3}


def misfit(sample: Sample, level: Profile) -> Misfit:
    """Return the misfit of a level: the volume that is missing below the face, and the volume above the face."""
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
    """A path that was computed with particles, with its level and misfit."""

    name: str
    path: NozzlePath
    level: Profile
    misfit: Misfit
    off_mm: float | None = None  # Mean difference from the expected level. None for a baseline
    plan: Floats = field(default_factory=lambda: np.zeros(0))  # Numbers of the plan. Empty for a baseline


@dataclass(frozen=True)
class WithMore:
    """Volumes above the face, from the fast model, if the pump gives more and the paste is softer than planned."""

    over_mm3: float
    constant_flow_over_mm3: float


@dataclass(frozen=True)
class Planned:
    """A finished plan, with its rounds and baselines.

    Without ``options.accurate``, the rounds, the baselines and the runs with other seeds are drafts.
    """

    options: PlanOptions
    best: Round
    rounds: tuple[Round, ...]
    baselines: tuple[Round, ...]
    trajectory: Trajectory  # Path of the best plan
    level: Profile  # Mean level of the seeds. If the seeds are drafts, the level of the accurate run
    half_width_mm: Floats | None
    """Half-width of the 95 % band for the level of a further run. None for one seed, which does not show a scatter."""
    misfit: Misfit  # Mean misfit of the seeds. If the seeds are drafts, the misfit of the accurate run
    misfits: tuple[Misfit, ...]  # Misfit of each seed
    with_more: WithMore
    of_draft: Misfit | None  # Misfit of the best draft, before the accurate run corrected the plan
    unfilled_mm3: float  # Volume between the face and the level that the plan aims at

    @property
    def verified(self) -> bool:
        """True if a plan was better than both baselines in the particle runs."""
        return self.best.off_mm is not None

    @property
    def band_95_mm(self) -> float | None:
        return None if self.half_width_mm is None else float(self.half_width_mm.mean())

    @property
    def low_stretches(self) -> list[dict[str, float]]:
        """Stretches of the crack where the level is more than ``LOW_MM`` below its target.

        Stretches shorter than ``SHORTEST_LOW_MM`` are left out.
        """
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
"""A path to be computed: a short name, the path, and the seed of the run."""


@dataclass
class Verifier:
    """Runs a trial along other paths."""

    folder: Path
    trial: Trial
    sample: Sample
    device: str
    progress: Progress
    jobs: int = 1
    ahead_s: float = 0.0
    """Estimated time in s of the command's remaining work."""
    _runs: list[study_folder.StudyRun] = field(default_factory=list)

    def judge(self, title: str, paths: Sequence[NamedPath], *, drafts: bool = False) -> list[Round]:
        """Return a round for each of ``paths``. Has the same arguments and errors as ``levels``."""
        self.ahead_s -= self.work_s(len(paths), drafts=drafts)
        levels = self.levels(title, paths, drafts=drafts) if paths else []
        return [
            Round(name, path, level, misfit(self.sample, level))
            for (name, path, _), level in zip(paths, levels, strict=True)
        ]

    def levels(self, title: str, paths: Sequence[NamedPath], *, drafts: bool = False) -> list[Profile]:
        """Return the level of a particle run along each of ``paths``. If ``drafts`` is True, the runs are drafts.

        Raises InputError if the particles are too large or too small for the crack, and NumericalError if a run fails.
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
            inputs = files.hashes(digitised, ("outline.json", "crack.ply", "trajectory.csv"))
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

    @property
    def left_s(self) -> float:
        """Estimated time of the work ahead in s, corrected by the finished runs."""
        return slowness(self._runs) * self.ahead_s

    def work_s(self, runs: int, *, drafts: bool) -> float:
        """Return the estimated time in s of a number of particle runs, with ``jobs`` at the same time."""
        trial = drafted(self.trial, self.sample) if drafts else self.trial
        return checked_size(trial.pour(self.sample))[0].work_s * -(-runs // max(1, self.jobs))

    @property
    def fluid_warnings(self) -> list[str]:
        """Warnings about the fluid in the finished runs."""
        return study_folder.fluid_warnings(self._runs)


def require_plannable(trial: Trial, where: str) -> Trial:
    """Return the trial with particles and without readings, for verification.

    Raises InputError if the trial is not suitable for a plan.
    """
    if trial.fluid is None:
        raise InputError(f"{where}: a plan requires a table [fluid]. Give viscosity_pa_s and yield_stress_pa in it.")
    refuse_seeds(trial, where)
    if trial.fluid.U is not None:
        raise InputError(
            f"{where}: fluid.U = {trial.fluid.U:g} cannot be used for a plan, since its viscosity changes with the "
            "flow. Give viscosity_pa_s instead. For a paste with a yield stress, use health.viscosity_pa_s in "
            "simulation.json of a run."
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
    trajectory = planned.trajectory
    key_figures = [
        ("sealant", f"{trajectory.dispensed_mm3 / 1000:.3g} ml"),
        ("duration", f"{trajectory.duration_s:.1f} s"),
        ("aims below the face by", f"{planned.options.aim_mm:.2f} mm"),
    ]
    if (band_mm := planned.band_95_mm) is not None:
        runs = counted(len(planned.misfits), "draft" if draft else "run")
        key_figures.append((f"half-width of the 95 % band of a run, from {runs}", f"{band_mm:.2f} mm"))
    caption = "Level along the crack, computed with particles. 0 is the face."
    flow = {"s_mm": trajectory.s_mm, "speed_mm_s": trajectory.speed_mm_s, "flow_mm3_s": trajectory.flow_mm3_s}
    page = Page(
        title=f"Plan: {name}",
        lead="Flow and speed along the path, chosen with the fast model and checked with particles. No number is "
        "measured.",
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
        drafts = f". As drafts, the best round leaves {draft.under_mm3:.0f} mm3 and {draft.over_mm3:.0f} mm3, and the"
    return (
        f"{misfit.under_mm3:.0f} mm3 are missing below the face and {misfit.over_mm3:.0f} mm3 are above it, according "
        f"to the particles{drafts or '. The'} better baseline ({better.name}) leaves {better.misfit.under_mm3:.0f} mm3 "
        f"and {better.misfit.over_mm3:.0f} mm3." + (f" {low[0].upper()}{low[1:]}." if low else "")
    )


def plan_cautions(planned: Planned, fluid_warnings: Sequence[str]) -> list[str]:
    """Return cautions about the fluid and the plan.

    There is a caution if the plan has no band, is worse than a baseline, may overfill the crack, or differs much from
    the fast model.
    """
    cautions = [*fluid_warnings]
    if planned.band_95_mm is None:
        cautions.append(
            "This plan was computed with only one seed, so the scatter between runs is unknown and the level has no "
            "band. Use --seeds 3."
        )
    if planned.best.off_mm is None:
        not_verified = f"NOT VERIFIED: no plan was better than {planned.best.name}, which is used as the result."
        if planned.unfilled_mm3 > planned.best.misfit.cost_mm3:
            not_verified += (
                f" A plan aims {planned.options.aim_mm:.2f} mm below the face, and this alone leaves "
                f"{planned.unfilled_mm3:.0f} mm3 unfilled. Give a smaller --margin-mm or --reserve-mm."
            )
        return [f"{not_verified} No robot program is written.", *cautions]
    over_mm3, steady_mm3 = planned.with_more.over_mm3, planned.with_more.constant_flow_over_mm3
    if over_mm3 > steady_mm3:
        cautions.append(
            "According to the fast model, if the pump gives 10 % more and the yield stress is 15 % lower, the plan has "
            f"{over_mm3:.0f} mm3 above the face, and constant flow has {steady_mm3:.0f} mm3. Give a larger "
            "--reserve-mm."
        )
    if planned.best.off_mm > AGREES_MM:
        cautions.append(
            f"The fast model and the particles still differ by {planned.best.off_mm:.2f} mm on average. The level is "
            "from the particles. Another round (--verify), or corrections that add sealant (--reserve-mm 0), may "
            "improve the plan."
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
