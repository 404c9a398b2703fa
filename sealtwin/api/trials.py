"""Runs of a whole trial from Python, sweeps and calibrations of its settings, and maps of a sweep."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from sealtwin.api.shared import FilePath, of_one_crack, path_or_none, warn
from sealtwin.core import record_files
from sealtwin.core.errors import InputError, NumericalError, SealtwinError
from sealtwin.core.files import read_table
from sealtwin.core.progress import Progress, progress_for_stderr, wanted
from sealtwin.core.records import DataKind, Floats, Outline, Profile, Run, Solid, Trajectory
from sealtwin.core.settings import as_json, checked
from validate.result import TrialResult

if TYPE_CHECKING:
    from sealtwin.trial.trial_file import Trial

Record = TypeVar("Record", Solid, Trajectory, Run, Profile)


@dataclass(frozen=True)
class TrialRun:
    """A run folder that is complete and up to date: what ``run_trial`` returns."""

    folder: Path
    result: TrialResult
    """Content of run.json: figures by name, with units in the names."""
    redone: tuple[str, ...]
    """Stages that were computed; the others were up to date."""

    @property
    def report(self) -> Path:
        """The report's page."""
        return self.folder / "report.html"

    @property
    def mean_error_mm(self) -> float | None:
        """Mean error against the readings in mm; None if there are no readings."""
        return self.result.comparison and self.result.comparison.mean_error_mm

    @property
    def interval_95_mm(self) -> tuple[float, float] | None:
        """Ends of the 95 % interval of the mean error, in mm; None if there are no readings."""
        return self.result.comparison and self.result.comparison.interval_95_mm

    @property
    def verdict(self) -> str | None:
        """Headline of the report; None if there are no readings."""
        return self.result.comparison and self.result.comparison.verdict

    @property
    def gate_passed(self) -> bool | None:
        """True if the mean error is within the declared gate; None if no gate was declared."""
        return self.result.comparison and self.result.comparison.passed

    @cached_property
    def crack(self) -> Outline:
        """The traced crack."""
        return record_files.read_outline(self.folder)

    @cached_property
    def solid(self) -> Solid:
        """The sample."""
        return replace(record_files.read_solid(self.folder), made_of=of_one_crack("run_trial", self.crack))

    @cached_property
    def path(self) -> Trajectory:
        """The nozzle's path."""
        return replace(record_files.read_trajectory(self.folder), made_of=of_one_crack("run_trial", self.crack))

    @cached_property
    def run(self) -> Run:
        """The particles at the end of the run; of several seeds, in that of the first."""
        return self._of_pour(record_files.read_run(self.folder))

    @cached_property
    def level(self) -> Profile:
        """The simulated level along the crack: of the run, or the mean of the runs in ``result.seeds``."""
        read = record_files.read_profile if self.result.seeds is None else record_files.read_level
        return self._of_pour(read(self.folder))

    def _of_pour(self, record: Record) -> Record:
        return replace(record, made_of=of_one_crack("run_trial", self.crack, self.solid, self.path))


def run_trial(
    trial: "FilePath | Mapping[str, Any] | Trial",
    *,
    out: FilePath | None = None,
    device: str = "cpu",
    threads: int = 1,
    source: FilePath | None = None,
    seeds: int | None = None,
    progress: bool | None = None,
) -> TrialRun:
    """Bring a whole trial up to date in its run folder, as ``sealtwin run`` does.

    Parameters
    ----------
    trial
        A trial file, or its content as a mapping or a ``Trial``.
    out
        The run folder; default: reports/<name of the trial> under the current folder.
    device, threads
        Device of the fluid run: "cpu" (default), "cuda:0" or "auto"; and the number of CPU threads.
    source
        Folder of photo and readings if the trial is not a file; default: the current folder.
    seeds
        Runs with the seeds from the trial's own, 1 to 20, in place of the trial's ``seeds``. The level is their mean,
        and ``result.seeds.band_95_mm`` the half-width of the band of one further run. They run in this process, one
        after the other; ``sealtwin run`` computes them side by side.
    progress
        Show progress on stderr; default: if stderr is a terminal, or in a notebook.

    Returns
    -------
    TrialRun
        Figures, and the records of each stage. A missed gate is not an error: see ``gate_passed``.

    Raises
    ------
    InputError
        The trial has an invalid key or value, or an input cannot be used.
    NumericalError
        The simulation diverged, or a particle went through a wall.
    BusyError
        Another process uses the run folder.

    Warns
    -----
    RuntimeWarning
        The model cannot represent this sealant, or the result is unreliable: one warning for each reason, as in
        ``fluid.warnings``. The photo or the readings are in doubt, or a file was edited; with ``progress`` these are
        printed on stderr instead.
    """
    from sealtwin.study.extra_runs import by_studies
    from sealtwin.trial.job import STAGES
    from sealtwin.trial.pipeline import run_trial
    from sealtwin.trial.trial_file import Trial, load_trial

    if isinstance(trial, Trial | Mapping):
        settings = trial if isinstance(trial, Trial) else checked(Trial, Path("run_trial"), trial)
        home = Path(source) if source is not None else Path()
    else:
        if source is not None:
            raise InputError(
                "run_trial: names in a trial file are relative to its own folder, so source has no effect. Omit source."
            )
        settings, home = load_trial(Path(trial)), Path(trial).parent
    if seeds is not None:
        content = settings.model_dump(mode="json", exclude_none=True)
        settings = checked(Trial, Path("run_trial"), {**content, "seeds": seeds})
    target = Path(out) if out is not None else Path("reports", settings.folder_name)
    silent = Progress()
    with progress_for_stderr(quiet=False) if wanted(progress) else silent as shown:
        outcome = run_trial(settings, home, target, STAGES, device, shown, threads, by_studies())
    texts = [warning.text for warning in silent.warned]
    warn(dict.fromkeys([*texts, *(outcome.result.fluid.warnings if outcome.result.fluid else ())]))
    return TrialRun(target, outcome.result, outcome.redone)


@dataclass(frozen=True)
class SweepResult:
    """A sweep's folder: what ``sweep`` returns."""

    folder: Path
    rows: tuple[dict[str, Any], ...]
    """One row for each run, in the order of the grid: the settings that vary, its state, its figures, and the reason if
    it failed. The file runs.csv has the same rows."""
    best: dict[str, Any] | None
    """Number, settings and mean error in mm of the run nearest to the readings; None if there are no readings."""

    @property
    def failed(self) -> tuple[dict[str, Any], ...]:
        """Rows of failed runs, each with its reason."""
        return tuple(row for row in self.rows if row["state"] == "failed")

    def column(self, name: str) -> Floats:
        """Return a column of numbers, (runs,); NaN for missing values. Raises InputError for an unknown name."""
        if name not in self.rows[0]:
            raise InputError(f"column: there is no column {name!r}; the columns are {', '.join(self.rows[0])}.")
        return np.array([np.nan if row[name] is None else row[name] for row in self.rows], dtype=float)


def sweep(
    trial: FilePath,
    grid: Mapping[str, Sequence[Any]],
    *,
    out: FilePath | None = None,
    fixed: Mapping[str, Any] | None = None,
    name: str | None = None,
    device: str = "cpu",
    jobs: int | None = None,
    accurate: bool = False,
    progress: bool | None = None,
) -> SweepResult:
    """Run a trial once for each combination of the given settings.

    Finished runs are kept: after an interruption, repeat the same call to continue. ``sealtwin sweep`` does the work in
    its own process, because worker processes would otherwise run the calling script again.

    Parameters
    ----------
    trial
        The trial file to start from.
    grid
        Values of each setting by its dotted name, for example ``{"fluid.U": [1, 10, 100]}``; the first setting varies
        slowest.
    out
        The sweep's folder; default: reports/<name>. Its study.toml runs the same sweep on the command line.
    fixed
        Settings of all runs that replace the trial's, for example ``{"solver.radius_mm": 0.6}``.
    name
        Name of the study; default: <folder of the trial file>-<name of the trial file>-sweep.
    device, jobs
        Device of the fluid runs, as in ``run_trial``, and number of processes; default: one for each core, or one on a
        GPU.
    accurate
        True computes with the trial's solver settings; otherwise the runs are drafts (solver.preset), unless ``grid``
        or ``fixed`` sets another setting of the solver than model and settle_s.
    progress
        Show progress on stderr; default: if stderr is a terminal, or in a notebook.

    Returns
    -------
    SweepResult
        A row for each run; a failed run does not stop the others.

    Raises
    ------
    InputError
        A run has an invalid setting (all are checked before the first run), or the folder is that of another sweep.

    Warns
    -----
    RuntimeWarning
        The model cannot represent the sealant of a run, or results are unreliable: one warning for each reason, with
        the number of runs.
    """
    import tomlkit

    from sealtwin.study.study_file import Study

    file = Path(trial).resolve()
    content = {"name": name or f"{file.parent.name}-{file.stem}-sweep", "trial": str(file), "grid": grid}
    if fixed:
        content["fixed"] = fixed
    # Checked here already, so that messages name this function.
    settings = checked(Study, Path("sweep"), content)
    target = Path(out) if out is not None else Path("reports", settings.folder_name)
    with tempfile.TemporaryDirectory(prefix="sealtwin-") as temporary:
        study = Path(temporary, "study.toml")
        study.write_text(tomlkit.dumps(json.loads(json.dumps(content, default=as_json))), encoding="utf-8")
        answer = _command(["sweep", study, *_accurate(accurate)], target, device, jobs, progress)
    warn(answer["fluid_warnings"])
    return SweepResult(target, tuple(answer["runs"]), answer["best"])


@dataclass(frozen=True)
class CalibrationResult:
    """A calibration's folder: what ``calibrate`` returns."""

    folder: Path
    content: dict[str, Any]
    """Content of calibration.json: finding, gates, combinations, roles and predictions of the trials."""
    posterior: dict[str, Floats]
    """500 draws of each free setting, (500,), by dotted name; empty if no setting reproduces the readings."""

    @property
    def identified(self) -> dict[str, bool]:
        """True for each setting whose 90 % interval is at most half as wide as before the calibration."""
        return {one["setting"]: one["identified"] for one in self.content["free"] if isinstance(one, dict)}


def calibrate(
    trials: FilePath | Sequence[FilePath],
    free: Mapping[str, tuple[float, float]],
    *,
    hold_out: Sequence[FilePath] = (),
    budget: int = 40,
    out: FilePath | None = None,
    device: str = "cpu",
    jobs: int | None = None,
    accurate: bool = False,
    progress: bool | None = None,
) -> CalibrationResult:
    """Determine settings from the readings of one trial or several, and predict others.

    Finished runs are kept, as in ``sweep``; ``sealtwin calibrate`` does the work in its own process.

    Parameters
    ----------
    trials
        Trial files whose readings have the role "calibrated-on".
    free
        Range of each unknown setting, by dotted name: ``{"fluid.yield_stress_pa": (3, 60)}``.
    hold_out
        Trial files to predict and compare, with readings of the role "held-out".
    budget
        Runs of each trial, 40 or more.
    out
        The calibration's folder; default: reports/<trial>-calibrated.
    device, jobs, accurate, progress
        As in ``sweep``.

    Returns
    -------
    CalibrationResult
        Posterior, which settings it determines, and the predictions. There is no posterior if no setting reproduces the
        readings.

    Raises
    ------
    InputError
        A trial, a setting or a role cannot be used.
    NumericalError
        Over a quarter of the runs failed or have a volume error over 5 %.

    Warns
    -----
    RuntimeWarning
        The model cannot represent the sealant of a run, or results are unreliable: one warning for each reason.
    """
    files = [trials] if isinstance(trials, str | PathLike) else list(trials)
    ranges = [f"--free={name}={low:.12g}:{high:.12g}" for name, (low, high) in free.items()]
    others = [f"--hold-out={Path(file)}" for file in hold_out]
    content = _command(
        ["calibrate", *files, f"--budget={budget}", *ranges, *others, *_accurate(accurate)], out, device, jobs, progress
    )
    warn(content["fluid_warnings"])
    folder = Path(content["page"]).parent
    posterior = {}
    if content["possible"]:
        names = [one["setting"] for one in content["free"]]
        draws = read_table(folder / "posterior.csv", names, finite=True)
        posterior = dict(zip(names, draws.T, strict=True))
    return CalibrationResult(folder, content, posterior)


def write_map(
    swept: SweepResult | FilePath,
    *,
    out: FilePath | None = None,
    readings: FilePath | None = None,
    data: DataKind | None = None,
    any_volume: bool = False,
    fills: bool = False,
    device: str = "cpu",
    progress: bool | None = None,
) -> Path:
    """Draw a sweep of two settings as a page: levels, map of the error, influences, cost.

    Parameters
    ----------
    swept
        The sweep, or its folder. It needs at least four finished runs whose volume error is 5 % at most.
    out
        Folder for the page; default: map/ in the sweep's folder.
    readings, data
        A sheet of readings other than the trial's, and its origin.
    any_volume
        True includes runs whose volume error is over 5 %.
    fills, device, progress
        ``fills=True`` draws how about nine runs fill; those whose fill was not kept are computed again on ``device``.
        ``progress`` as in ``run_trial``.

    Returns
    -------
    Path
        The page, map.html; its figures are in the same folder as SVG and CSV.

    Raises
    ------
    InputError
        The sweep cannot be mapped, or the readings cannot be read.

    Warns
    -----
    RuntimeWarning
        Another version of digitise or simulate computed the runs, the model cannot represent the sealant of a run, or
        results are unreliable.
    """
    from sealtwin.study.study_map import PAGE, map_study

    folder = swept.folder if isinstance(swept, SweepResult) else Path(swept)
    target, caliper = path_or_none(out), path_or_none(readings)
    shown = progress_for_stderr(quiet=not wanted(progress))
    mapped = map_study(folder, target, caliper, data, device if fills else None, shown, any_volume=any_volume)
    warn([*mapped.content["other_versions"], *mapped.content["fluid_warnings"]])
    return mapped.folder / PAGE


def _accurate(accurate: bool) -> list[str]:
    return ["--accurate"] if accurate else []


def _command(
    words: Sequence[FilePath], out: FilePath | None, device: str, jobs: int | None, progress: bool | None
) -> dict[str, Any]:
    """Run a command of sealtwin with this interpreter; return its JSON output.

    Raises the kind of SealtwinError that its exit code means.
    """
    # -P: folders named 'validate' or 'simulate' in the current folder must not be imported.
    line = [sys.executable, "-P", "-m", "sealtwin", *map(str, words), "--device", device, "--json"]
    line += [] if out is None else ["--out", str(out)]
    line += [] if jobs is None else ["--jobs", str(jobs)]
    shows = wanted(progress)
    line += [] if shows else ["--quiet"]
    done = subprocess.run(line, stdout=subprocess.PIPE, stderr=None if shows else subprocess.PIPE, check=False)
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        errors = (done.stderr or b"").decode(errors="replace")
        raise RuntimeError(f"'sealtwin {words[0]}' ended with code {done.returncode}.\n{errors}") from None
    if "error" not in answer:
        return answer
    kinds: dict[int, type[SealtwinError]] = {InputError.exit_code: InputError, NumericalError.exit_code: NumericalError}
    raise kinds.get(answer["exit_code"], SealtwinError)(answer["error"])
