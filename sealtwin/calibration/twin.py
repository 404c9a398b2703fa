"""A trial with readings in a calibration. It is run with other settings, in a folder like a study's."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.calibration.search import Setting
from sealtwin.core import record_files
from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress
from sealtwin.core.records import DataKind, Floats
from sealtwin.core.run_figures import RunHealth
from sealtwin.core.settings import checked
from sealtwin.study import study_folder
from sealtwin.study.runner import StudyOptions
from sealtwin.study.study_file import PlannedRun
from sealtwin.study.sweep import adopt, brought_up_to_date
from sealtwin.trial.job import check_sheet, require_sample
from sealtwin.trial.trial_file import SETTINGS, Trial, as_run, load_trial, refuse_seeds, with_settings
from simulate.settings import VISCOSITIES_PA_S
from validate.calibration.free import Free
from validate.calibration.posterior import ReadLevels, smooth_errors_mm2
from validate.metrics.baselines import are_compared
from validate.metrics.verdict import kept_volume
from validate.settings import Readings, Uncertainty

MEASURED = {name: key for name in SETTINGS if (key := name.rpartition(".")[2]) in Uncertainty.model_fields} | {
    "path.trim_mm": "start_mm"
}
"""Key in [uncertainty] of each setting that can have an uncertainty. The trial's material or weighed fill may give its
value too."""
JITTER_MM2 = 1e-6  # Makes the covariance of readings invertible if they have no stated error
SEEDS = 2**31


class Twin:
    """A digitised trial with its readings and its runs so far."""

    def __init__(
        self,
        file: Path,
        library: Path,
        options: StudyOptions,
        progress: Progress,
        settings: Mapping[str, Any] | None = None,
    ) -> None:
        """Digitise the crack and read the sheet. Raises InputError as a sweep does, and without readings."""
        from validate.readings.read_readings import read_readings
        from validate.uncertainty.meniscus import Mouth
        from validate.uncertainty.reading_errors import budget_of

        self.file, self._options, self._progress = file, options, progress
        trial = load_trial(file, settings)
        sheet_settings = fit_to_calibrate(file, trial)
        self.trial = trial.loaded(file.parent)
        self.data: DataKind = sheet_settings.data
        self._content = self.trial.model_dump(mode="json", exclude_none=True, exclude={"readings", "gate"})
        self._content["fluid"].pop("material", None)
        self.folder = library / self.trial.folder_name
        adopt(self.folder, self.trial.name)
        kinds = [self._planned(number, {}, 0, accurate=accurate) for number, accurate in ((1, False), (2, True))]
        self.plan = self._plan(kinds, dry_run=True)
        self._work_s = [run.work_s for run in self.plan.runs]
        draft, accurate = self.plan.runs
        self.drafts = draft.key != accurate.key
        """False if its runs are accurate, or of a preset of its own."""
        self._sample = record_files.read_sample(self.folder / "samples" / draft.sample)
        self.outline, self.solid = self._sample.outline, self._sample.solid
        self.sheet = file.parent / sheet_settings.file
        self.readings = read_readings(self.sheet, sheet_settings, self.outline.length_mm, self.solid.depth_mm)
        s_mm = self.readings.s_mm
        mouth = Mouth.of(self.outline, self.solid, self.trial.given_fluid.density_kg_m3)
        budget = budget_of(self.readings, sheet_settings, self.trial.uncertainty, mouth)
        self._unused = budget.unused
        errors_mm = budget.at_stations_mm
        covariance_mm2 = np.cov(errors_mm.T) + JITTER_MM2 * np.eye(len(s_mm))
        # A reading is the level plus an error, whose mean may differ from 0.
        level_mm, path = self.readings.level_mm - errors_mm.mean(axis=0), self._sample.trajectory
        path_mm = float(path.s_mm[path.giving].min()), float(path.s_mm[path.giving].max())
        self.evidence = ReadLevels(s_mm, level_mm, covariance_mm2, smooth_errors_mm2(s_mm, path_mm))

    @property
    def name(self) -> str:
        return self.trial.name

    @property
    def radius_mm(self) -> float:
        """Radius of the particles of the runs that confirm a result, which are drafts if its trial is a draft."""
        return as_run(self._planned(1, {}, 0).trial, self._sample).solver.size_mm

    def measured(self, name: str) -> tuple[float, float] | None:
        """Return a setting's value and standard uncertainty; None unless the trial has both."""
        declared = self.trial.uncertainty.with_sample(self.outline.width_doubt_mm, self.solid.figures.weighed)
        table, _, key = name.rpartition(".")
        value = self._content.get(table, {}).get(key)
        if isinstance(value, list) and name == "path.trim_mm":
            value = value[self.trial.path.reverse]
        if not isinstance(value, int | float) or isinstance(value, bool):
            return None
        if table == "fluid" and key in VISCOSITIES_PA_S and declared.viscosity_percent is not None:
            return value, value * declared.viscosity_percent / 100
        standard = getattr(declared, MEASURED[name]) if name in MEASURED else None
        return None if standard is None else (float(value), standard)

    def require(self, frees: Sequence[Free]) -> None:
        """Raise InputError if an end of a range is out of bounds for this trial."""
        for free in frees:
            for end in (free.low, free.high):
                self._planned(1, {free.name: end}, 0)

    def work_s(self, *, accurate: bool) -> float:
        """Expected computing time of one run, by the model of ``sealtwin.study.estimate``."""
        return self._work_s[accurate]

    def run(
        self, wanted: Sequence[tuple[Setting, int]], later_s: float = 0.0, *, drafts: int = 0
    ) -> Sequence[Floats | None]:
        """Compute the runs that are not done. Return each run's levels at the stations, or None if it is not used.

        ``wanted`` begins with those of the last call. The first ``drafts`` of them may be drafts. ``later_s`` is the
        expected time of the runs of the calibration after these.
        """
        self._options = replace(self._options, later_s=later_s)
        planned = [
            self._planned(number, setting, seed, accurate=number > drafts)
            for number, (setting, seed) in enumerate(wanted, start=1)
        ]
        self.plan = self._plan(planned)
        runs = {run.number: run for run in self.plan.runs}
        return [self._level_mm(runs[run.number]) for run in planned]

    def unused(self) -> list[tuple[int, str]]:
        """Return number and reason of each run that is not used."""
        reasons = []
        for run in self.plan.runs:
            if run.state == "failed":
                reasons.append((run.number, run.reason or "failed"))
            elif run.figures is not None and not kept_volume(run.figures.volume_ratio):
                reasons.append((run.number, f"its volume is off by over 5 % (ratio {run.figures.volume_ratio:.3f})"))
        return reasons

    @property
    def stations(self) -> int:
        """Number of stations within the length of the crack."""
        return int(are_compared(self.readings, 0.0, self.outline.length_mm).sum())

    @property
    def fluid_warnings(self) -> list[str]:
        """Warnings about the fluid in the runs of this trial."""
        return [f"{self.name}: {sentence}" for sentence in study_folder.fluid_warnings(self.plan.runs)]

    @property
    def warnings(self) -> list[str]:
        """All warnings: about the fluid, and about declared errors that the readings contradict."""
        return [*self.fluid_warnings, *(f"{self.name}: {sentence}" for sentence in self._unused)]

    @property
    def health(self) -> RunHealth:
        """Numerical quality of its last run, or of another seed of that setting if it failed; empty if all failed."""
        last = max(self.plan.runs, key=lambda run: run.number)
        alike = [run for run in self.plan.runs if run.settings | {"seed": 0} == last.settings | {"seed": 0}]
        figures = [run.figures for run in sorted(alike, key=lambda run: run.number) if run.figures is not None]
        return figures[-1].health if figures else RunHealth()

    def _plan(self, planned: Sequence[PlannedRun], *, dry_run: bool = False) -> study_folder.Plan:
        options = replace(self._options, dry_run=dry_run)
        return brought_up_to_date(self.name, planned, self.file.parent, self.folder, options, self._progress, part=True)

    def _planned(self, number: int, settings: Setting, seed: int, *, accurate: bool = False) -> PlannedRun:
        changes: dict[str, Any] = dict(settings)
        if (start_mm := changes.get("path.trim_mm")) is not None:
            near_mm, far_mm = self.trial.path.trims_mm
            changes["path.trim_mm"] = [near_mm, start_mm] if self.trial.path.reverse else [start_mm, far_mm]
        changes["seed"] = (self.trial.seed + seed) % SEEDS
        trial = checked(Trial, self.file, with_settings(self._content, changes))
        return PlannedRun(number, changes, trial, accurate)

    def _level_mm(self, run: study_folder.StudyRun) -> Floats | None:
        if run.figures is None or not kept_volume(run.figures.volume_ratio):
            return None
        profile = study_folder.read_level(self.folder, run)
        return profile.level_at_mm(self.evidence.s_mm)


def fit_to_calibrate(file: Path, trial: Trial) -> Readings:
    """Return the settings of a trial's readings. Raises InputError if a calibration cannot use the trial."""
    refuse_seeds(trial, file)
    if trial.fluid is None:
        raise InputError(f"{file}: no [fluid] table; give viscosity_pa_s, or U and D_cm.")
    if trial.readings is None:
        raise InputError(f"{file}: no [readings] table; a calibration and its held-out trials need readings: add it.")
    if not trial.solver.has_particles:
        raise InputError(
            f'{file}: solver.model is "{trial.solver.model}"; a calibration needs particles. Set it to "particles".'
        )
    require_sample(trial, file.parent)
    check_sheet(file.parent / trial.readings.file)
    return trial.readings
