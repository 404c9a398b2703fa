"""A whole trial file run from Python, sweeps over its settings, and their map."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sealtwin.api.shared import FilePath, WarnedProgress, path_or_none, warn
from sealtwin.core import record_files
from sealtwin.core.errors import InputError, NumericalError, SealtwinError
from sealtwin.core.files import read_table
from sealtwin.core.progress import progress_for_stderr
from sealtwin.core.records import DataKind, Floats, Outline, Profile, Run, Solid, Trajectory
from sealtwin.core.settings import as_json, checked
from validate.result import TrialResult

if TYPE_CHECKING:
    from sealtwin.trial.trial_file import Trial


@dataclass(frozen=True)
class TrialRun:
    """A run folder that is complete and up to date: what ``run_trial`` returns."""

    folder: Path
    result: TrialResult
    """The content of run.json: figures by name, units in the names."""
    redone: tuple[str, ...]
    """Stages that had to be computed; the others were up to date."""

    @property
    def report(self) -> Path:
        """The report's page."""
        return self.folder / "report.html"

    @property
    def mean_error_mm(self) -> float | None:
        """Mean error against the readings in mm; None without readings."""
        return self.result.comparison and self.result.comparison.mean_error_mm

    @property
    def interval_95_mm(self) -> tuple[float, float] | None:
        """Ends of its 95 % interval in mm; None without readings."""
        return self.result.comparison and self.result.comparison.interval_95_mm

    @property
    def verdict(self) -> str | None:
        """The report's headline as one text; None without readings."""
        return self.result.comparison and self.result.comparison.verdict

    @property
    def gate_passed(self) -> bool | None:
        """True if the declared gate is kept; None if none was declared."""
        return self.result.comparison and self.result.comparison.passed

    @cached_property
    def crack(self) -> Outline:
        """The traced crack."""
        return record_files.read_outline(self.folder)

    @cached_property
    def solid(self) -> Solid:
        """The sample."""
        return record_files.read_solid(self.folder)

    @cached_property
    def path(self) -> Trajectory:
        """The nozzle's path."""
        return record_files.read_trajectory(self.folder)

    @cached_property
    def run(self) -> Run:
        """The particles as they lie."""
        return record_files.read_run(self.folder)

    @cached_property
    def level(self) -> Profile:
        """The simulated level along the crack."""
        return record_files.read_profile(self.folder)


def run_trial(
    trial: "FilePath | Mapping[str, Any] | Trial",
    *,
    out: FilePath | None = None,
    device: str = "cpu",
    threads: int = 1,
    source: FilePath | None = None,
    progress: bool = False,
) -> TrialRun:
    """Bring a whole trial up to date in its run folder, as ``sealtwin run`` does.

    Parameters
    ----------
    trial
        A trial file, or its content as a mapping or a ``Trial``.
    out
        The run folder; left out, reports/<name of the trial> under the current folder.
    device, threads
        Where the fluid runs: "cpu" (default), "cuda:0" or "auto"; and the threads of the CPU that share the run.
    source
        Folder in which photo and readings of a trial that is no file are looked for; left out, the current one.
    progress
        Show progress on stderr.

    Returns
    -------
    TrialRun
        Figures, and the records of each stage. A gate that is not kept raises nothing: see ``gate_passed``.

    Raises
    ------
    InputError
        The trial holds a key or a value that cannot be, or an input cannot be used.
    NumericalError
        The numbers stopped meaning anything, or a particle went through a wall.
    BusyError
        Another process holds the run folder.

    Warns
    -----
    RuntimeWarning
        The run cannot show this sealant, or what it shows is not sound: a sentence each, as in ``fluid_warnings``. The
        photo or the readings may not be what was meant, or a file was edited; with ``progress`` stderr says these.
    """
    from sealtwin.lab.held_out import facts_above
    from sealtwin.trial.job import STAGES
    from sealtwin.trial.pipeline import run_trial
    from sealtwin.trial.trial_file import Trial, load_trial

    if isinstance(trial, Trial | Mapping):
        settings = trial if isinstance(trial, Trial) else checked(Trial, Path("run_trial"), trial)
        home = Path(source) if source is not None else Path()
    else:
        if source is not None:
            raise InputError("run_trial: source beside a trial file, whose files lie beside it. Leave source out.")
        settings, home = load_trial(Path(trial)), Path(trial).parent
    target = Path(out) if out is not None else Path("reports", settings.folder_name)
    warned = WarnedProgress()
    with progress_for_stderr(quiet=False) if progress else warned as shown:
        outcome = run_trial(settings, home, target, STAGES, device, shown, threads, facts_above(settings, home))
    warn(dict.fromkeys([*warned.sentences, *(outcome.result.fluid.warnings if outcome.result.fluid else ())]))
    return TrialRun(target, outcome.result, outcome.redone)


@dataclass(frozen=True)
class SweepResult:
    """A sweep's folder: what ``sweep`` returns."""

    folder: Path
    rows: tuple[dict[str, Any], ...]
    """One for each run, in the order of the grid: the settings that vary, state, figures and, where it failed, the
    reason; also in runs.csv."""
    best: dict[str, Any] | None
    """Number, settings and mean error in mm of the run that is nearest to the readings; None without readings."""

    @property
    def failed(self) -> tuple[dict[str, Any], ...]:
        """The rows of runs that failed, each with its reason."""
        return tuple(row for row in self.rows if row["state"] == "failed")

    def column(self, name: str) -> Floats:
        """A column of numbers, (runs,); NaN where a run has none. Raises InputError for a name that no row has."""
        if name not in self.rows[0]:
            raise InputError(f"column: no {name!r}; there are {', '.join(self.rows[0])}.")
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
    progress: bool = False,
) -> SweepResult:
    """Run a trial once for each combination of the given settings.

    What is done is kept: killed or interrupted, the same call goes on. The work is done by ``sealtwin sweep`` in a
    process of its own, since the workers that it starts would otherwise run the calling script once more.

    Parameters
    ----------
    trial
        The trial file to start from.
    grid
        Values of each setting by its dotted name, for example ``{"fluid.U": [1, 10, 100]}``; the first one named
        varies slowest.
    out
        The sweep's folder; left out, reports/<name>. Its study.toml takes the same sweep to the command line.
    fixed
        Settings that all runs have in place of the trial's own, for example ``{"solver.radius_mm": 0.6}``.
    name
        Name of the study; left out, that of the trial's file with "-sweep".
    device, jobs
        Where fluids run, as in ``run_trial``, and processes at a time: left out, one for each core, or one on a GPU.
    progress
        Show progress on stderr.

    Returns
    -------
    SweepResult
        A row for each run; a run that fails stops none of the others.

    Raises
    ------
    InputError
        Settings that cannot be, of all runs at once, before the first one starts; or a folder that is not this sweep's.

    Warns
    -----
    RuntimeWarning
        Runs cannot show their sealant, or what they show is not sound: a sentence each, with the number of such runs.
    """
    import tomlkit

    from sealtwin.study.study_file import Study

    file = Path(trial).resolve()
    content = {"name": name or f"{file.parent.name}-{file.stem}-sweep", "trial": str(file), "grid": grid}
    if fixed:
        content["fixed"] = fixed
    # Checked here already, so that a refusal names the function.
    settings = checked(Study, Path("sweep"), content)
    target = Path(out) if out is not None else Path("reports", settings.folder_name)
    with tempfile.TemporaryDirectory(prefix="sealtwin-") as temporary:
        study = Path(temporary, "study.toml")
        study.write_text(tomlkit.dumps(json.loads(json.dumps(content, default=as_json))), encoding="utf-8")
        answer = _command(["sweep", study], target, device, jobs, progress)
    warn(answer["fluid_warnings"])
    return SweepResult(target, tuple(answer["runs"]), answer["best"])


@dataclass(frozen=True)
class CalibrationResult:
    """A calibration's folder: what ``calibrate`` returns."""

    folder: Path
    content: dict[str, Any]
    """All of calibration.json: finding, gates, combinations, roles and predictions of the trials."""
    posterior: dict[str, Floats]
    """500 draws of each free setting, (500,), by dotted name; empty where no setting makes the readings."""

    @property
    def identified(self) -> dict[str, bool]:
        """True for each setting whose 90 % interval is at most half as wide as beforehand."""
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
    progress: bool = False,
) -> CalibrationResult:
    """Find settings by the readings of one trial or several, and predict others.

    What is done is kept, as by ``sweep``; the work is done by ``sealtwin calibrate`` in a process of its own.

    Parameters
    ----------
    trials
        Trial files whose readings have the role "calibrated-on".
    free
        Range of each setting that is not known, by dotted name: ``{"fluid.yield_stress_pa": (3, 60)}``.
    hold_out
        Trial files that are predicted and judged; their readings have the role "held-out".
    budget
        Runs of each trial, 40 or more.
    out
        The folder; left out, reports/<trial>-calibrated.
    device, jobs, progress
        As in ``sweep``.

    Returns
    -------
    CalibrationResult
        Posterior, what it determines, and the predictions; also where no setting makes the readings.

    Raises
    ------
    InputError
        A trial, a setting or a role cannot be used.
    NumericalError
        A quarter of the runs has no result.

    Warns
    -----
    RuntimeWarning
        As ``sweep`` does.
    """
    files = [trials] if isinstance(trials, str | PathLike) else list(trials)
    ranges = [f"--free={name}={low:.12g}:{high:.12g}" for name, (low, high) in free.items()]
    others = [f"--hold-out={Path(file)}" for file in hold_out]
    content = _command(["calibrate", *files, f"--budget={budget}", *ranges, *others], out, device, jobs, progress)
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
    progress: bool = False,
) -> Path:
    """Draw a sweep of two settings as a page: levels, map of the error, influences, cost.

    Parameters
    ----------
    swept
        The sweep, or its folder; it needs four finished runs or more whose volume is off by 5 % at most.
    out
        Where the page goes; left out, map/ in the sweep's folder.
    readings, data
        Another sheet of readings than the trial's own, and where it comes from.
    any_volume
        Map runs whose volume is off by over 5 % too.
    fills, device, progress
        Compute some nine runs once more, to draw how they fill; where those run; and show progress on stderr.

    Returns
    -------
    Path
        The page, map.html; its figures lie beside it as SVG and CSV.

    Raises
    ------
    InputError
        The sweep cannot be mapped, or the readings cannot be read.

    Warns
    -----
    RuntimeWarning
        Another version of digitise or simulate computed the runs; or as ``sweep`` does.
    """
    from sealtwin.lab.held_out import note_use
    from sealtwin.study.study_map import PAGE, map_study

    folder = swept.folder if isinstance(swept, SweepResult) else Path(swept)
    target, caliper = path_or_none(out), path_or_none(readings)
    shown = progress_for_stderr(quiet=not progress)
    mapped = map_study(folder, target, caliper, data, device if fills else None, shown, any_volume=any_volume)
    warn([*mapped.content["other_versions"], *mapped.content["fluid_warnings"]])
    if caliper is not None:
        note_use(caliper, mapped.chart.readings, f"map of the study '{mapped.chart.name}'")
    return mapped.folder / PAGE


def _command(
    words: Sequence[FilePath], out: FilePath | None, device: str, jobs: int | None, progress: bool
) -> dict[str, Any]:
    """The answer of a command of ours, run by this very interpreter.

    Raises SealtwinError of the kind that its exit code stands for.
    """
    # -P: a folder 'validate' or 'simulate' that lies in the current one must not be taken for ours.
    line = [sys.executable, "-P", "-m", "sealtwin", *map(str, words), "--device", device, "--json"]
    line += [] if out is None else ["--out", str(out)]
    line += [] if jobs is None else ["--jobs", str(jobs)]
    line += [] if progress else ["--quiet"]
    done = subprocess.run(line, stdout=subprocess.PIPE, stderr=None if progress else subprocess.PIPE, check=False)
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        said = (done.stderr or b"").decode(errors="replace")
        raise RuntimeError(f"'sealtwin {words[0]}' ended with code {done.returncode}.\n{said}") from None
    if "error" not in answer:
        return answer
    kinds: dict[int, type[SealtwinError]] = {InputError.exit_code: InputError, NumericalError.exit_code: NumericalError}
    raise kinds.get(answer["exit_code"], SealtwinError)(answer["error"])
