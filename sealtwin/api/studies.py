"""Compute many runs of trials: sweeps and calibrations of settings, and maps of a sweep."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date as day
from os import PathLike
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np

from sealtwin.api import FilePath, path_or_none, public, settings_from, warn
from sealtwin.calibration import CalibrationOptions
from sealtwin.core.errors import InputError, NumericalError, SealtwinError
from sealtwin.core.files import read_table
from sealtwin.core.progress import Progress, wanted
from sealtwin.core.records import DataKind, Floats
from sealtwin.core.settings import checked


@dataclass(frozen=True)
class SweepResult:
    """Results of a sweep, and its folder: what ``sweep`` returns."""

    folder: Path
    rows: tuple[dict[str, Any], ...]
    """One row for each run, in the order of the grid: the settings that vary, the state of the run, its figures, and
    the reason if it failed. The file runs.csv has the same rows."""
    best: dict[str, Any] | None
    """Number, settings and mean error in mm of the run nearest to the readings. None if there are no readings."""

    @property
    def failed(self) -> tuple[dict[str, Any], ...]:
        """Rows of the failed runs, each with its reason."""
        return tuple(row for row in self.rows if row["state"] == "failed")

    def column(self, name: str) -> Floats:
        """Return a column of numbers, (runs,). Missing values are NaN. Raises InputError for an unknown name."""
        if name not in self.rows[0]:
            raise InputError(f"column: there is no column {name!r}; the columns are {', '.join(self.rows[0])}.")
        return np.array([np.nan if row[name] is None else row[name] for row in self.rows], float)


@public()
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
    """Run a trial once for each combination of the values in ``grid``.

    Finished runs are kept. After an interruption, repeat the same call to continue. The command ``sealtwin sweep``
    computes the runs in a process of its own, because worker processes would otherwise run the calling script again.

    Parameters
    ----------
    trial
        Trial file whose settings are varied.
    grid
        Values of each setting by its dotted name, for example ``{"fluid.U": [1, 10, 100]}``. The first setting varies
        slowest.
    out
        Folder for the sweep. Default: reports/<name>. Its study.toml runs the same sweep on the command line.
    fixed
        Settings that replace settings of the trial in all runs, for example ``{"solver.radius_mm": 0.6}``.
    name
        Name of the study. Default: <folder of the trial file>-<name of the trial file>-sweep.
    device, jobs
        Device of the fluid runs, as in ``run_trial``, and number of processes. Default of ``jobs``: one per core, or
        one on a GPU.
    accurate
        True to compute with the trial's solver settings. Otherwise the runs are drafts (solver.preset), unless ``grid``
        or ``fixed`` has settings of the solver other than model and settle_s.
    progress
        True to show progress on stderr. Default: True in a terminal or a notebook.

    Returns
    -------
    SweepResult
        A row for each run. A failed run does not stop the others.

    Raises
    ------
    InputError
        A setting of a run is not valid (all are checked before the first run), or the folder contains another sweep.

    Warns
    -----
    RuntimeWarning
        The model cannot represent the sealant of a run, or results are unreliable. There is one warning for each
        reason, with the number of runs.

    Examples
    --------
    >>> grid = {"fluid.yield_stress_pa": [3, 9], "fluid.viscosity_pa_s": [0.5, 2]}
    >>> swept = st.sweep("trial.toml", grid, out="swept", jobs=1)
    >>> swept.column("fluid.yield_stress_pa")
    array([3., 3., 9., 9.])
    """
    import tomlkit

    from sealtwin.study.study_file import Study

    file = Path(trial).resolve()
    content = {"name": name or f"{file.parent.name}-{file.stem}-sweep", "trial": file, "grid": grid, "fixed": fixed}
    # The settings are checked here, so that messages name this function.
    settings = checked(Study, Path("sweep"), content)
    target = Path(out) if out is not None else Path("reports", settings.folder_name)
    with tempfile.TemporaryDirectory(prefix="sealtwin-") as temporary:
        study = Path(temporary, "study.toml")
        study.write_text(tomlkit.dumps(settings.model_dump(mode="json", exclude_unset=True)), encoding="utf-8")
        answer = _command(["sweep", study], progress, accurate, out=target, device=device, jobs=jobs)
    warn(answer["fluid_warnings"])
    return SweepResult(target, tuple(answer["runs"]), answer["best"])


@dataclass(frozen=True)
class CalibrationResult:
    """Results of a calibration, and its folder: what ``calibrate`` returns."""

    folder: Path
    content: dict[str, Any]
    """Content of calibration.json: finding, gates, roles and predictions of the trials."""
    posterior: dict[str, Floats]
    """500 random draws of each free setting, (500,), by dotted name. Empty if no settings reproduce the readings."""

    @property
    def identified(self) -> dict[str, bool]:
        """True for each setting whose 90 % interval is at most half as wide as before the calibration."""
        return {free["setting"]: free["identified"] for free in self.content["free"] if isinstance(free, dict)}


class CalibrationKeywords(TypedDict, total=False):
    """Options of a calibration."""

    hold_out: Sequence[FilePath]
    budget: int
    date: day | str | None


@public(CalibrationOptions)
def calibrate(
    trials: FilePath | Sequence[FilePath],
    free: Mapping[str, tuple[float, float]],
    *,
    out: FilePath | None = None,
    device: str = "cpu",
    jobs: int | None = None,
    accurate: bool = False,
    progress: bool | None = None,
    **keywords: Unpack[CalibrationKeywords],
) -> CalibrationResult:
    """Determine settings from the readings of one or several trials, and predict other trials.

    Finished runs are kept, as in ``sweep``. The command ``sealtwin calibrate`` computes the runs in a process of its
    own.

    Parameters
    ----------
    trials
        Trial files whose readings have the role "calibrated-on".
    out
        Folder for the calibration. Default: reports/<trial>-calibrated.
    device, jobs, accurate, progress
        Same as in ``sweep``.

    Returns
    -------
    CalibrationResult
        The posterior distribution of the settings, the settings that it determines, and the predictions. The posterior
        is empty if no settings reproduce the readings.

    Raises
    ------
    InputError
        A trial, a setting or a role cannot be used.
    NumericalError
        More than a quarter of the runs failed or have a volume error above 5 %.

    Warns
    -----
    RuntimeWarning
        The model cannot represent the sealant of a run, or results are unreliable. There is one warning for each
        reason.

    Examples
    --------
    >>> calibration = st.calibrate("pour.toml", {"fluid.yield_stress_pa": (3, 60)}, hold_out=["other.toml"], out="fit")
    >>> calibration.identified
    {'fluid.yield_stress_pa': True}
    >>> calibration.posterior["fluid.yield_stress_pa"].shape
    (500,)
    """
    options = settings_from(CalibrationOptions, "calibrate", keywords, free=free)
    words: list[FilePath] = ["calibrate", *([trials] if isinstance(trials, str | PathLike) else trials)]
    words += [f"--hold-out={file}" for file in options.hold_out]
    words += [f"--free={name}={low:.12g}:{high:.12g}" for name, (low, high) in options.free.items()]
    numbers = {"budget": options.budget, "date": options.date, "jobs": jobs}
    content = _command(words, progress, accurate, out=out, device=device, **numbers)
    warn(content["fluid_warnings"])
    folder = Path(content["page"]).parent
    posterior = {}
    if content["possible"]:
        names = [setting["setting"] for setting in content["free"]]
        draws = read_table(folder / "posterior.csv", names, finite=True)
        posterior = dict(zip(names, draws.T, strict=True))
    return CalibrationResult(folder, content, posterior)


@public()
def write_map(
    swept: SweepResult | FilePath,
    *,
    out: FilePath | None = None,
    readings: FilePath | None = None,
    data: DataKind | None = None,
    any_volume: bool = False,
    fills: bool = False,
) -> Path:
    """Draw a sweep of two settings as a page: levels, map of the error, influences, cost.

    Parameters
    ----------
    swept
        The sweep, or its folder. It must have at least four finished runs with a volume error of at most 5 %.
    out
        Folder for the page. Default: map/ in the sweep's folder.
    readings, data
        A sheet of readings that replaces the trial's sheet, and its origin.
    any_volume
        True to include runs with a volume error above 5 %.
    fills
        True to draw how the crack fills in about nine of the runs.

    Returns
    -------
    Path
        The page, map.html. Its figures are in the same folder as SVG and CSV.

    Raises
    ------
    InputError
        The sweep cannot be mapped, or the readings cannot be read.

    Warns
    -----
    RuntimeWarning
        Another version of digitise or simulate computed the runs, the model cannot represent the sealant of a run, or
        results are unreliable.

    Examples
    --------
    The folder is from the example of ``sweep``.

    >>> st.write_map("swept").name
    'map.html'
    """
    from sealtwin.study.study_map import PAGE, map_study

    folder = swept.folder if isinstance(swept, SweepResult) else Path(swept)
    progress = Progress()
    files = path_or_none(out), path_or_none(readings)
    mapped = map_study(folder, *files, data, progress, fills=fills, any_volume=any_volume)
    warn(
        [
            *(warned.text for warned in progress.warned),
            *mapped.content["other_versions"],
            *mapped.content["fluid_warnings"],
        ]
    )
    return mapped.folder / PAGE


def _command(words: Sequence[FilePath], progress: bool | None, accurate: bool, **options: object) -> dict[str, Any]:
    """Run a command of sealtwin with this Python interpreter, and return its JSON output.

    Options that are None are left out. If the command fails, raises the SealtwinError that matches the exit code.
    """
    # With -P, Python does not import folders named 'validate' or 'simulate' in the current folder.
    line = [sys.executable, "-P", "-m", "sealtwin", *map(str, words), "--json"]
    line += [f"--{name}={value}" for name, value in options.items() if value is not None]
    flags = {"--accurate": accurate, "--quiet": not wanted(progress)}
    line += [name for name, is_set in flags.items() if is_set]
    errors = subprocess.PIPE if "--quiet" in line else None
    done = subprocess.run(line, stdout=subprocess.PIPE, stderr=errors, check=False)
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        text = (done.stderr or b"").decode(errors="replace")
        raise RuntimeError(f"'sealtwin {words[0]}' ended with code {done.returncode}.\n{text}") from None
    if "error" not in answer:
        return answer
    kinds: dict[int, type[SealtwinError]] = {InputError.exit_code: InputError, NumericalError.exit_code: NumericalError}
    raise kinds.get(answer["exit_code"], SealtwinError)(answer["error"])
