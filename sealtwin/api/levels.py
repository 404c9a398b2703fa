"""Read caliper readings along the crack, compare them with a simulated level, plot both, and write the report."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import InstanceOf

from sealtwin.api import (
    FilePath,
    content_of,
    file_of,
    of_one_crack,
    require_kinds,
    settings_from,
    sha256_of,
    warn,
)
from sealtwin.api.runs import PlannedPath, SimulatedLevel
from sealtwin.api.samples import CrackOutline
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.records import DataKind, HasSummary, Outline, Profile, Run, Sections, Solid
from sealtwin.core.run_folder import MANIFEST, require_folder, versions
from sealtwin.core.settings import checked
from sealtwin.core.settings_text import keywords_of
from sealtwin.trial.job import NUMBERS, OVERLAY, STRAIGHT
from validate.result import Comparison
from validate.settings import Gate, Readings, Role, Uncertainty

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from validate.readings.grid import Grid

OF_A_FILE = ("sheet", "separator", "decimal", "unit")
"""Keywords that describe the format of a file. They do not apply to an array."""


@dataclass(frozen=True, kw_only=True, repr=False)
class LevelReadings(Profile):
    """Caliper readings along the crack: what ``read_readings`` returns.

    ``s_mm`` and ``level_mm``, (n,), are the position and the mean level of each station. ``repeats_mm``, (n, r),
    contains the single readings. A missing reading is NaN. ``scan`` has figures and heights of a scan.
    """

    settings: Readings
    """Declared settings: how the readings were taken."""
    sha256: str
    """SHA-256 hash of the file, or of the array's bytes."""


@keywords_of(Readings, without=("file", "scan"))
def read_readings(
    readings: FilePath | NDArray[np.floating[Any]] | Sequence[Sequence[float]],
    crack: Outline | None = None,
    solid: Solid | None = None,
    *,
    columns: Sequence[str] | Mapping[str, Any] | None = None,
    data: DataKind = "undeclared",
    role: Role = "undeclared",
    **keywords: Any,
) -> LevelReadings:
    """Read caliper readings. If information is missing, an error names the keyword to give; nothing is guessed.

    Keywords are settings of [readings] in a trial file.

    Parameters
    ----------
    readings
        A CSV or XLSX file with columns such as ``s_mm``, ``level_1_mm``, ``level_2_mm``. Or an array or a list of
        rows in mm, (n, 1 + r): the arc length along the crack, then r levels for each station, with NaN for a missing
        reading. Messages name the cells of an array as in a spreadsheet whose first row has the column names: "B5" is
        the reading [3, 1]. Or, if ``placement`` is given, a scan of the sealed face.
    columns
        For an array or a list: the column names as in the header of a sheet, for example ``["s_cm", "depth 1 [mm]",
        "remark"]``. The rows are then read as a sheet. For a file: the table [readings.columns].
    crack, solid
        The crack and its solid. A station outside the crack or a level outside the solid is an error. Without ``crack``
        or ``solid``, stations or levels are not checked. A scan needs both.

    Returns
    -------
    LevelReadings
        Levels relative to the face in mm, sorted by s. ``doubts`` lists readings that may be mistakes.

    Raises
    ------
    InputError
        The file is ambiguous, or a value is not possible. The text lists all faults, each with its cell.

    Warns
    -----
    RuntimeWarning
        One warning for each of the result's ``doubts``.

    Examples
    --------
    >>> readings = st.read_readings([[10, -2.0, -2.2], [30, -1.0, -1.2], [50, -2.0, -2.2]])
    >>> readings.level_mm
    array([-2.1, -1.1, -2.1])
    """
    arguments = locals()
    from sealtwin.trial.trial_file import SETTINGS, no_such_setting
    from validate.readings.grid import SheetFaults
    from validate.readings.read_readings import read_readings as from_file
    from validate.readings.read_readings import readings_of
    from validate.readings.reading_checks import Filling

    if unknown := [name for name in keywords.get("fitted") or () if name not in SETTINGS]:
        raise InputError(f"read_readings: fitted: {no_such_setting(unknown[0])}.")
    file = file_of(readings, "readings") if isinstance(readings, str | PathLike) else None
    names = None if columns is None or isinstance(columns, Mapping) else list(columns)
    kind = "file" if keywords.get("placement") is None else "scan"
    replaced = {kind: file or Path("readings"), "columns": columns if names is None else None}
    settings = settings_from(Readings, "read_readings", arguments, **replaced)
    # Readings remain valid for another solid of the same crack.
    made_of = of_one_crack("read_readings", crack, solid)[:1]
    limits_mm = None if crack is None else crack.length_mm, None if solid is None else solid.depth_mm
    try:
        if file is None:
            grid, digest = _sheet_of(readings, names, keywords)
            profile = readings_of(grid, settings, *limits_mm)
        elif names is None:
            sample = None if crack is None or solid is None else Filling(crack, solid)
            profile, digest = from_file(file, settings, *limits_mm, sample), sha256_of(file)
        else:
            raise InputError(
                'read_readings: for a file, columns must be a table such as {"s": "A", "levels": ["B:D"]}.'
            )
    except SheetFaults as fault:
        raise InputError("\n".join(doubt.in_words("python") for doubt in fault.doubts)) from None
    doubts = tuple(doubt.in_words("python") for doubt in profile.questions)
    profile = replace(profile, doubts=doubts, made_of=made_of)
    warn(profile.doubts)
    return LevelReadings(**content_of(profile), settings=settings, sha256=digest)


def _sheet_of(rows: Any, names: list[Any] | None, keywords: Mapping[str, Any]) -> "tuple[Grid, str]":
    """Return rows as a sheet whose header is ``names``, and a hash. Without names, the columns are s and levels."""
    from validate.readings.read_readings import grid_of_rows

    if names is not None:
        table = [names, *([*row] for row in rows)]
        if ragged := [number for number, row in enumerate(table) if len(row) != len(names)]:
            cells = f"{len(table[ragged[0]])} cells, but columns has {len(names)} names"
            raise InputError(f"read_readings: row {ragged[0]} of the readings has {cells}.")
        return grid_of_rows("readings", table), hashlib.sha256(repr(table).encode()).hexdigest()
    if useless := [name for name in OF_A_FILE if keywords.get(name) not in (None, "mm")]:
        raise InputError(f"read_readings: {useless[0]} describes the format of a file; omit it for an array.")
    try:
        numbers = np.asarray(rows, np.float64)
    except (TypeError, ValueError):
        raise InputError(
            "read_readings: the rows must have the same length and contain only numbers. Use NaN for a missing "
            "reading, or give columns."
        ) from None
    if numbers.ndim != 2 or numbers.shape[1] < 2:
        raise InputError(
            f"read_readings: the array has the shape {numbers.shape}; give (n, 1 + r): s_mm, then r readings."
        )
    levels = [f"{keywords.get('quantity') or 'level'}_{count}_mm" for count in range(1, numbers.shape[1])]
    return grid_of_rows("readings", [["s_mm", *levels], *numbers.tolist()]), sha256_of(numbers)


class LevelComparison(HasSummary, Comparison):
    """A simulated level compared with readings: what ``compare`` returns.

    Its main figures are ``mean_error_mm``, ``interval_95_mm``, ``worst_error_mm`` at ``worst_at_mm``, ``verdict``,
    ``findings`` and ``baselines``.
    """

    level: InstanceOf[Profile]
    """The simulated level."""
    readings: InstanceOf[Profile]
    """The readings."""
    settings: Readings
    """Declared settings: how the readings were taken."""
    declared: Uncertainty
    """Declared standard uncertainties of the inputs."""
    sections: InstanceOf[Sections]
    """Cross-sections of the cavity along the crack, for plots."""

    @property
    def main_figures(self) -> dict[str, str]:
        interval = "" if self.interval_95_mm is None else " ({:.2f} to {:.2f})".format(*self.interval_95_mm)
        return {
            "mean error": f"{self.mean_error_mm:.2f} mm{interval}",
            "worst": f"{self.worst_error_mm:.2f} mm at s = {self.worst_at_mm:.1f} mm",
            "readings": self.role,
            "verdict": self.verdict,
        }


def compare(
    level: Profile,
    readings: Profile,
    crack: Outline,
    solid: Solid,
    *,
    gate_mm: float | None = None,
    gate_reason: str = "",
    uncertainty: Mapping[str, float] | None = None,
) -> LevelComparison:
    """Compare a simulated level with readings, over the part of the crack that both cover.

    Parameters
    ----------
    level, readings, crack, solid
        Results of the other functions. ``readings`` may also be a ``Profile``; nothing is then declared about them.
    gate_mm, gate_reason
        Largest allowed mean error in mm, declared before the run, and the reason for it. Without a gate, the comparison
        neither passes nor fails.
    uncertainty
        Standard uncertainties of the inputs, with the names of the table [uncertainty], for example
        ``{"station_mm": 1.0}``. Inputs without an uncertainty are not included, and the report lists them.

    Returns
    -------
    LevelComparison
        Its ``mean_error_mm`` is the area between both curves, divided by the length that both cover.

    Raises
    ------
    InputError
        The curves do not overlap, a value is out of bounds, or the readings contradict a declared error.

    Examples
    --------
    ``crack``, ``solid``, ``level`` and ``readings`` are from the examples of ``fill_fast`` and ``read_readings``.

    >>> result = st.compare(level, readings, crack, solid)
    >>> low_mm, high_mm = result.interval_95_mm
    >>> bool(low_mm < result.mean_error_mm < high_mm)
    True
    """
    from validate.compare import compare, error_uncertainty
    from validate.metrics.verdict import flat_levels
    from validate.uncertainty.meniscus import Mouth

    of_one_crack("compare", level, readings, crack, solid)
    if gate_mm is not None and not 0 < gate_mm < np.inf:
        raise InputError(f"compare: gate_mm = {gate_mm} mm, but it must be above 0.")
    for argument, value in (("level", level), ("readings", readings)):
        if not isinstance(value, Profile) or (isinstance(value, LevelReadings) and argument == "level"):
            raise InputError(
                f"compare: {argument} is a {type(value).__name__}; give the simulated level first, then the readings."
            )
    if isinstance(readings, LevelReadings):
        settings = readings.settings
    else:
        settings = Readings(file=Path(readings.source or "readings"), data=readings.data, role="undeclared")
    declared = checked(Uncertainty, Path("compare: uncertainty"), uncertainty or {})
    density_kg_m3, dispensed_mm3, escaped = None, 0.0, 0
    if isinstance(level, SimulatedLevel):
        density_kg_m3, dispensed_mm3, escaped = level.density_kg_m3, level.dispensed_mm3, level.escaped_particles
    mouth = Mouth.of(crack, solid, density_kg_m3)
    comparison = compare(
        level,
        readings,
        crack,
        solid,
        role=settings.role,
        fitted=settings.fitted,
        photo_data=crack.data if isinstance(crack, CrackOutline) else "undeclared",
        gate=None if gate_mm is None else Gate(mean_error_mm=float(gate_mm), reason=gate_reason),
        escaped_particles=escaped,
        uncertainty=error_uncertainty(level, readings, mouth, settings, declared),
        unseen=flat_levels(readings, crack, solid, dispensed_mm3),
    )
    return LevelComparison(
        **dict(comparison),
        level=level,
        readings=readings,
        settings=settings,
        declared=declared,
        sections=solid.sections,
    )


def plot_levels(
    level: Profile | None = None,
    readings: Profile | None = None,
    result: LevelComparison | None = None,
    *,
    solid: Solid | None = None,
    ax: "Axes | None" = None,
    label: str = "simulated",
) -> "Figure | SubFigure":
    """Plot levels along the crack: the simulated level, the readings, or both.

    Parameters
    ----------
    level, readings, result
        The simulated level, the readings, or both. ``result`` adds the 95 % band of the readings. It also adds the best
        flat level, unless the readings were held out.
    solid
        Solid whose floor is drawn. Default: the solid of ``result``.
    ax
        matplotlib axes to draw on. Default: the axes of a new figure that pyplot does not manage. On existing axes, the
        level has the next colour of the colour cycle, the limits never shrink, and the title is kept.
    label
        Name of the simulated level in the legend.

    Returns
    -------
    Figure
        The figure that contains the axes.

    Raises
    ------
    InputError
        There is nothing to draw.

    Examples
    --------
    ``level``, ``readings`` and ``result`` are from the example of ``compare``.

    >>> figure = st.plot_levels(level, readings, result)
    >>> figure.savefig("levels.svg")
    """
    if level is None and readings is None:
        raise InputError("plot_levels: there is nothing to draw; give level, readings or both.")
    of_one_crack("plot_levels", level, readings, *([] if result is None else [result.level, result.readings]), solid)
    if level is not None and result is not None and not np.array_equal(result.level.level_mm, level.level_mm):
        raise InputError("plot_levels: result compares a different level; give the level that was compared.")
    from validate.figures.levels import draw_levels
    from validate.figures.theme import themed, wide_figure

    with themed():
        sections = solid.sections if solid is not None else result.sections if result is not None else None
        compared = result if readings is not None else None
        if ax is None:
            axes = wide_figure(3.9).add_subplot()
            draw_levels(axes, level, sections, readings, compared, label=label)
        else:
            from matplotlib.transforms import Bbox

            axes, before = ax, [ax.viewLim.frozen()] if ax.has_data() else []
            style = {"title": None, "colour": ax.plot([], [])[0].get_color(), "label": label}
            draw_levels(ax, level, sections, readings, compared, **style)
            limits = Bbox.union([*before, ax.viewLim])
            ax.set(xlim=limits.intervalx, ylim=limits.intervaly)
    figure = axes.get_figure()
    if figure is None:
        raise InputError("plot_levels: ax does not belong to a figure; give axes of a figure, or omit ax.")
    return figure


def write_report(
    folder: FilePath,
    crack: CrackOutline,
    solid: Solid,
    path: PlannedPath,
    run: Run | SimulatedLevel,
    result: LevelComparison | None = None,
    *,
    name: str | None = None,
    note: str = "",
    pdf: bool = False,
) -> Path:
    """Write report.html, report.json and overlay.png, as ``sealtwin run`` does.

    Parameters
    ----------
    folder
        Folder for the files. Files of an earlier call are replaced.
    crack, solid, path, run, result
        Results of the other functions. ``run`` may be the result of ``fill_fast``. Without ``result``, the report shows
        only the simulation.
    name, note
        Title of the report (default: the folder's name), and a note that a reader of the report must know.
    pdf
        True to write report.pdf too.

    Returns
    -------
    Path
        The page, report.html.

    Raises
    ------
    InputError
        ``result`` does not compare the level of ``run``. ``path`` was not made by ``plan_path``, or ``crack`` was not
        made by ``trace_crack`` or ``import_mesh``. Or the folder is a run folder, whose report 'sealtwin validate'
        writes.

    Examples
    --------
    ``crack``, ``solid``, ``path``, ``level`` and ``result`` are from the examples of ``fill_fast`` and ``compare``.

    >>> page = st.write_report("report", crack, solid, path, level, result)
    >>> page.name
    'report.html'
    """
    from digitise.trajectory import with_path
    from digitise.walls.overlay import draw_overlay, straight_view
    from simulate.profile import measure_profile, volume_ratio
    from validate.compare import assess
    from validate.report.write_report import REPORT
    from validate.report.write_report import write_report as write_pages
    from validate.result import Evidence, ReadingsSheet, provenance

    run = run.run if isinstance(run, SimulatedLevel) else run
    require_kinds("write_report", crack=(crack, CrackOutline), path=(path, PlannedPath), run=(run, Run))
    level, readings = (None, None) if result is None else (result.level, result.readings)
    of_one_crack("write_report", crack, solid, path, run, level, readings)
    target = Path(folder)
    require_folder(target)
    if (target / MANIFEST).is_file():
        raise InputError(f"{target} is a run folder, whose report 'sealtwin validate' writes. Give another folder.")
    profile = measure_profile(run, crack, solid)
    if level is not None and not np.array_equal(level.level_mm, profile.level_mm):
        raise InputError("write_report: result compares the level of a different run; give the run that was compared.")
    sheet, facts = None, {crack.photo.file.name: f"sha256 {crack.sha256}"}
    if isinstance(readings, LevelReadings):
        sheet = ReadingsSheet(name=readings.source, sha256=readings.sha256, operator=None, date=None)
        facts[readings.source] = f"sha256 {readings.sha256}"
    facts["written"] = datetime.now(UTC).isoformat(timespec="seconds")
    files.write_png(target / OVERLAY, draw_overlay(crack.photo, crack, path))
    files.write_png(target / STRAIGHT, straight_view(crack.photo, crack))
    evidence = Evidence(
        name=name or target.resolve().name,
        note=note,
        outline=crack,
        solid=with_path(solid, path, crack, path.settings),
        trajectory=path,
        run=run,
        profile=profile,
        readings=readings,
        volume_ratio=float(run.health.volume_ratio or volume_ratio(run, solid)),
        overlay_path=target / OVERLAY,
        straight_path=target / STRAIGHT,
        photo_data=crack.data,
        provenance=provenance(facts, run.device, run.settings.get("seed"), versions(), NUMBERS),
        sheet=sheet,
    )
    if result is not None:
        comparison = assess(evidence, result.settings, result.declared, None, result.gate)
        evidence = replace(evidence, comparison=comparison)
    write_pages(target, evidence, pdf=pdf)
    return target / REPORT[0]
