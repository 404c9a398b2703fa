"""Judge paths over one crack with particle runs, in a folder like that of a sweep, and compute a level's misfit."""

from collections.abc import Sequence
from dataclasses import asdict, astuple, dataclass, field, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile, Sample, Trajectory
from sealtwin.core.run_folder import stage_key
from sealtwin.plan.search import OVER_WEIGHT
from sealtwin.study import study_folder
from sealtwin.study.estimate import Forecast, size_of, timings_of
from sealtwin.study.runner import StudyOptions, WantedRun, bring_up_to_date, require_done, schedule, write_sample
from sealtwin.trial.job import numbers_up_to
from sealtwin.trial.trial_file import Trial, drafted, refuse_seeds
from simulate.slot.sections import sections_of

LOW_MM, SHORTEST_LOW_MM = 1.0, 5.0  # Least depth and length of a low stretch that a plan's sentence names
CELLS = 160  # Number of cells along the crack for a misfit: 0.5 mm for 80 mm, finer than readings


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


def misfit(sample: Sample, s_mm: Floats, level_mm: Floats) -> Misfit:
    """Return the volume that a level along a crack lacks below the face, and the volume that it has above the face."""
    it = sections_of(sample.outline, sample.solid, CELLS, reach_per_mm=0.0)
    level_mm = np.interp(it.s_mm, s_mm, level_mm)
    filled_mm2, _ = it.area_mm2(np.minimum(level_mm, 0.0) - it.bottom_mm)
    under_mm2 = it.full_mm2 - np.maximum(filled_mm2, 0.0)
    over_mm2 = it.mouth_mm * np.maximum(level_mm, 0.0)
    return Misfit(float(under_mm2.sum()) * it.step_mm, float(over_mm2.sum()) * it.step_mm, float(level_mm.max()))


def mean_of(misfits: Sequence[Misfit]) -> Misfit:
    return Misfit(*np.mean([astuple(one) for one in misfits], axis=0).tolist())


@dataclass(frozen=True)
class Round:
    """A path that particles judged, with its level and misfit."""

    name: str
    path: NozzlePath
    level: Profile
    misfit: Misfit
    off_mm: float | None = None  # Mean difference from the expected level; None for a baseline


@dataclass(frozen=True)
class WithMore:
    """Volumes over the face if the pump gives more and the paste is softer than planned, by the fast model."""

    over_mm3: float
    constant_flow_over_mm3: float


@dataclass(frozen=True)
class Planned:
    """A finished plan, with its rounds and baselines."""

    best: Round
    rounds: tuple[Round, ...]
    baselines: tuple[Round, ...]
    trajectory: Trajectory  # Path of the best
    margin_mm: float  # Level below the face that it aims at
    s_mm: Floats
    level_mm: Floats  # Mean of the seeds, or that of the accurate run if the seeds are drafts
    half_width_mm: Floats | None
    """Half-width of the 95 % band for a further run's level; None if the plan has one seed, which shows no scatter."""
    misfit: Misfit  # Misfit of the level: the mean of the seeds', or the accurate run's
    misfits: tuple[Misfit, ...]  # Misfit of each seed
    chances: dict[str, float] | None
    with_more: WithMore = WithMore(0.0, 0.0)
    of_draft: Misfit | None = None  # Misfit of the best plan as a draft, before the accurate run corrected it
    reserve_mm: float = 0.0  # Further depth below the face that it aims at
    drafts: bool = False  # True if all rounds, baselines and seeds are drafts
    unfilled_mm3: float = 0.0  # Volume below the face of a crack that is filled up to the level that it aims at

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
        lacks_mm, stretches = -self.margin_mm - self.level_mm, list[dict[str, float]]()
        for low, group in groupby(range(len(self.s_mm)), key=lambda place: bool(lacks_mm[place] > LOW_MM)):
            part = list(group)
            if low and self.s_mm[part[-1]] - self.s_mm[part[0]] >= SHORTEST_LOW_MM:
                ends = {"from_mm": float(self.s_mm[part[0]]), "to_mm": float(self.s_mm[part[-1]])}
                stretches.append({**ends, "mean_mm": float(lacks_mm[part].mean())})
        return stretches


@dataclass
class Verifier:
    """Runs one trial along paths that are not its own."""

    folder: Path
    trial: Trial
    sample: Sample
    device: str
    progress: Progress
    jobs: int = 1
    _runs: list[study_folder.StudyRun] = field(default_factory=list)

    def levels(
        self,
        title: str,
        paths: Sequence[tuple[str, NozzlePath, int]],
        *,
        drafts: bool = False,
        later_s: float = 0.0,
    ) -> list[Profile]:
        """Return the level by particles for each of ``paths``, which has a short name, a path and a seed.

        ``drafts``: by drafts of the trial. ``later_s`` is the expected time of what follows, by the model of
        ``sealtwin.study.estimate``.
        Raises InputError if particles do not fit the crack, and NumericalError if a run fails.
        """
        sample, wanted = self.sample, list[WantedRun]()
        for number, (label, path, seed) in enumerate(paths, start=len(self._runs) + 1):
            trial = self.trial.model_copy(update={"path": path, "seed": seed})
            trajectory = plan_trajectory(sample.outline, path, sample.solid.cavity_volume_mm3, sample.solid.sections)
            poured = replace(sample, trajectory=trajectory)
            if drafts:
                trial = drafted(trial, poured)
            depends = {"path": path.model_dump(mode="json", exclude_none=True)}
            home = stage_key({}, depends, numbers_up_to("digitise"))[:12]
            wanted.append(WantedRun(number, {"path": label, "seed": seed}, trial, poured, home, {}, depends))
            write_sample(self.folder, wanted[-1])
            digitised = self.folder / "samples" / home
            inputs = {file: files.sha256(digitised / file) for file in ("outline.json", "crack.ply", "trajectory.csv")}
            wanted[-1] = replace(wanted[-1], inputs=inputs)
        asked, largest, _ = schedule(wanted, self.device, numbers_up_to("simulate"))
        earlier = {run.key for run in self._runs}
        self._runs += {run.key: run for run in asked if run.key not in earlier}.values()
        plan = study_folder.Plan("verification", self._runs, numbers=numbers_up_to("simulate"))
        jobs = min(self.jobs, len(asked)) if self.jobs > 1 else 0
        options = StudyOptions(self.device, jobs, later_s=later_s, retry=True)
        self._runs = bring_up_to_date(self.folder, plan, largest, options, self.progress, title).runs
        require_done(self.folder, self._runs, "there is no plan")
        return [study_folder.read_level(self.folder, run) for run in asked]

    def corrected_s(self, model_s: float) -> float:
        """Return a time by the model, corrected by the runs that are finished."""
        return Forecast(1, timings_of(self._runs)).scaled_s(model_s)

    def model_s(self, launches: Sequence[bool]) -> float:
        """Return the time by the model of launches, whose values are the ``drafts`` of ``levels``."""
        trials = {True: drafted(self.trial, self.sample), False: self.trial}
        return sum(size_of(trials[drafts].pour(self.sample)).work_s for drafts in launches)

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
