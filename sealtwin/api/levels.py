"""Read caliper readings along the crack, compare them with a simulated level, plot both, and write the report."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack

import numpy as np
from pydantic import InstanceOf

from sealtwin.api import FilePath, Points, content_of, file_of, public, settings_from, sha256_of, warn
from sealtwin.api.runs import SimulatedLevel, SimulatedRun
from sealtwin.api.samples import SampleSolid
from sealtwin.core import files
from sealtwin.core.arrays import HasSummary
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import DataKind, Profile
from sealtwin.core.run_folder import MANIFEST, require_folder, versions
from sealtwin.core.settings import checked
from sealtwin.scan.settings import Placement
from sealtwin.trial.job import NUMBERS, OVERLAY, STRAIGHT
from validate.result import Comparison, Evidence, ReadingsSheet, provenance
from validate.settings import (
    Datum,
    Decimal,
    Gate,
    Quantity,
    Readings,
    Role,
    Rounding,
    Separator,
    Uncertainty,
    Unit,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from validate.readings.grid import Grid

OF_A_FILE = ("sheet", "separator", "decimal", "unit")
"""Keywords that describe the format of a file. They do not apply to an array."""


SAME_MM = 1e-3  # Walls and areas that differ by less are equal. Run folders round to five decimals


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class LevelReadings(Profile):
    """Caliper readings along the crack: what ``read_readings`` returns.

    ``s_mm`` and ``level_mm``, (n,), are the position and the mean level of each station. ``repeats_mm``, (n, r),
    contains the single readings. A missing reading is NaN. ``scan`` has figures and heights of a scan.
    """

    solid: SampleSolid | None
    """Solid with the crack along which the readings were taken. None if it was not given."""
    settings: Readings
    """Declared settings: how the readings were taken."""
    sha256: str
    """SHA-256 hash of the file, or of the array's bytes."""


class ReadingsKeywords(TypedDict, total=False):
    """Settings of [readings] that a function accepts."""

    sheet: str | None
    sample: str | None
    separator: Separator | None
    decimal: Decimal | None
    quantity: Quantity | None
    unit: Unit | None
    as_written: Sequence[str] | None
    datum: Datum
    datum_level_mm: float | None
    placement: Placement | Mapping[str, Any] | None
    fitted: Sequence[str] | None
    state: Literal["wet", "cured"] | None
    shrinkage_percent: float | None
    resolution_mm: float
    rounding: Rounding | None
    limit_mm: float | None
    probe_mm: float | None
    datum_error_mm: float | None


@public(Readings)
def read_readings(
    readings: FilePath | Points | Sequence[Sequence[Any]],
    solid: SampleSolid | None = None,
    *,
    columns: Sequence[str] | Mapping[str, Any] | None = None,
    data: DataKind = "undeclared",
    role: Role = "undeclared",
    **keywords: Unpack[ReadingsKeywords],
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
    solid
        The solid. A station outside its crack or a level outside the solid is an error. Without ``solid``, stations and
        levels are not checked. A scan needs it.

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
    from sealtwin.trial.trial_file import SETTINGS, no_such_setting
    from validate.readings.grid import SheetFaults
    from validate.readings.read_readings import read_readings as from_file
    from validate.readings.read_readings import readings_of

    if unknown := [name for name in keywords.get("fitted") or () if name not in SETTINGS]:
        raise InputError(f"read_readings: fitted: {no_such_setting(unknown[0])}.")
    file = file_of(readings, "readings") if isinstance(readings, str | PathLike) else None
    names = None if columns is None or isinstance(columns, Mapping) else list(columns)
    kind = "file" if keywords.get("placement") is None else "scan"
    others = {kind: file or Path("readings"), "columns": columns if names is None else None, "data": data, "role": role}
    settings = settings_from(Readings, "read_readings", keywords, **others)
    limits_mm = (None, None) if solid is None else (solid.crack.length_mm, solid.depth_mm)
    try:
        if file is None:
            grid, digest = _sheet_of(readings, names, keywords)
            profile = readings_of(grid, settings, *limits_mm)
        elif names is None:
            crack = None if solid is None else (solid.crack, solid)
            profile, digest = from_file(file, settings, crack=crack), sha256_of(file)
        else:
            raise InputError(
                'read_readings: for a file, columns must be a table such as {"s": "A", "levels": ["B:D"]}.'
            )
    except SheetFaults as fault:
        raise InputError("\n".join(doubt.in_words("python") for doubt in fault.doubts)) from None
    doubts = tuple(doubt.in_words("python") for doubt in profile.questions)
    warn(doubts)
    return LevelReadings(**content_of(replace(profile, doubts=doubts)), solid=solid, settings=settings, sha256=digest)


def _sheet_of(rows: Any, names: list[Any] | None, keywords: Mapping[str, Any]) -> "tuple[Grid, str]":
    """Return rows as a sheet whose header is ``names``, and a hash. Without names, the columns are s and levels."""
    from validate.readings.read_readings import grid_of_rows

    cells = np.asarray(rows, object)
    table = cells.tolist()
    if not table or not all(isinstance(row, list) and len(row) > 1 for row in table):
        raise InputError(f"read_readings: readings has the shape {cells.shape}; give rows of s_mm, then r readings.")
    if names is None:
        if useless := [name for name in OF_A_FILE if keywords.get(name) not in (None, "mm")]:
            raise InputError(f"read_readings: {useless[0]} describes the format of a file; omit it for an array.")
        levels = range(1, len(table[0]))
        names = ["s_mm", *(f"{keywords.get('quantity') or 'level'}_{count}_mm" for count in levels)]
    if ragged := [number for number, row in enumerate(table, 1) if len(row) != len(names)]:
        count = len(table[ragged[0] - 1])
        raise InputError(
            f"read_readings: row {ragged[0]} of the readings has {count} cells, but there are {len(names)} columns."
        )
    return grid_of_rows("readings", [names, *table]), hashlib.sha256(repr(table).encode()).hexdigest()


class LevelComparison(HasSummary, Comparison):
    """A simulated level compared with readings: what ``compare`` returns.

    Its main figures are ``mean_error_mm``, ``interval_95_mm``, ``worst_error_mm`` at ``worst_at_mm``, ``verdict``,
    ``findings`` and ``baselines``.
    """

    level: InstanceOf[SimulatedLevel]
    """The simulated level."""
    readings: InstanceOf[LevelReadings]
    """The readings."""

    @property
    def main_figures(self) -> dict[str, str]:
        interval = "" if self.interval_95_mm is None else " ({:.2f} to {:.2f})".format(*self.interval_95_mm)
        return {
            "mean error": f"{self.mean_error_mm:.2f} mm{interval}",
            "worst": f"{self.worst_error_mm:.2f} mm at s = {self.worst_at_mm:.1f} mm",
            "readings": self.role,
            "verdict": self.verdict,
        }


@public()
def compare(
    run: SimulatedRun | SimulatedLevel,
    readings: LevelReadings,
    *,
    gate: Mapping[str, Any] | None = None,
    uncertainty: Mapping[str, Any] | None = None,
) -> LevelComparison:
    """Compare a simulated level with readings, over the part of the crack that both cover.

    Parameters
    ----------
    run, readings
        The run, or its level, and the readings.
    gate
        Limit that was declared before the run, with the names of the table [gate], for example ``{"mean_error_mm":
        1.5, "reason": "water must run off"}``. Without a gate, the comparison neither passes nor fails.
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
        The readings belong to another solid or are within a fifth of the crack, the curves do not overlap, or a value
        is out of bounds.

    Examples
    --------
    ``run`` and ``readings`` are from the examples of ``fill_fast`` and ``read_readings``.

    >>> result = st.compare(run, readings)
    >>> low_mm, high_mm = result.interval_95_mm
    >>> bool(low_mm < result.mean_error_mm < high_mm)
    True
    """
    from validate.compare import assess
    from validate.readings.reading_checks import SPAN

    level = run.level if isinstance(run, SimulatedRun) else run
    solid = level.run.path.solid
    if readings.solid is not None and not _are_equal(readings.solid, solid):
        raise InputError(
            f"compare: readings belong to {readings.solid} with {readings.solid.crack}, but run to {solid} with "
            f"{solid.crack}. Read the readings again, with solid=run.path.solid."
        )
    if readings.solid is None and np.ptp(readings.s_mm) < SPAN * solid.crack.length_mm:
        raise InputError(
            f"compare: all readings are within {np.ptp(readings.s_mm):.3g} mm of a crack that is "
            f"{solid.crack.length_mm:.3g} mm long. Correct their unit, or read them with solid=run.path.solid."
        )
    declared = checked(Uncertainty, Path("compare: uncertainty"), uncertainty or {})
    limit = None if gate is None else checked(Gate, Path("compare: gate"), gate)
    evidence = _evidence_of(level, readings, name="compare", provenance={})
    comparison = assess(evidence, readings.settings, declared, None, limit)
    return LevelComparison(**dict(comparison), level=level, readings=readings)


def _are_equal(*solids: SampleSolid) -> bool:
    """Return True if two solids have equal cracks and cavities, apart from rounding."""
    lines = ([solid.sections.area_mm2, *solid.crack.left_wall_mm.T, *solid.crack.right_wall_mm.T] for solid in solids)
    first, second = map(np.concatenate, lines)
    return first.shape == second.shape and np.allclose(first, second, rtol=0, atol=SAME_MM)


@public()
def plot_levels(
    shown: SimulatedRun | SimulatedLevel | LevelReadings | LevelComparison,
    *,
    ax: "Axes | None" = None,
    label: str = "simulated",
) -> "Figure | SubFigure":
    """Plot levels along the crack, with its floor: the simulated level, the readings, or both.

    Parameters
    ----------
    shown
        A run or its level, readings, or the result of ``compare``. A result also has the 95 % band of the readings and
        the best flat level, unless the readings were held out.
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
        ``ax`` belongs to no figure.

    Examples
    --------
    ``result`` is from the example of ``compare``.

    >>> figure = st.plot_levels(result)
    >>> figure.savefig("levels.svg")
    """
    result = shown if isinstance(shown, LevelComparison) else None
    level, readings = (None, shown) if isinstance(shown, LevelReadings) else (shown, None)
    if isinstance(level, LevelComparison):
        level, readings = level.level, level.readings
    level = level.level if isinstance(level, SimulatedRun) else level
    solid = level.run.path.solid if level is not None else None if readings is None else readings.solid
    from validate.figures.levels import draw_levels
    from validate.figures.theme import themed, wide_figure

    if ax is not None and getattr(ax, "figure", None) is None:
        raise InputError("plot_levels: ax does not belong to a figure; give axes of a figure, or omit ax.")

    with themed():
        sections = None if solid is None else solid.sections
        if ax is None:
            axes = wide_figure(3.9).add_subplot()
            draw_levels(axes, level, sections, readings, result, label=label)
        else:
            from matplotlib.transforms import Bbox

            axes, before = ax, [ax.viewLim.frozen()] if ax.has_data() else []
            style = {"title": None, "colour": ax.plot([], [])[0].get_color(), "label": label}
            draw_levels(ax, level, sections, readings, result, **style)
            limits = Bbox.union([*before, ax.viewLim])
            ax.set(xlim=limits.intervalx, ylim=limits.intervaly)
    return present(axes.get_figure(), "the figure")


@public()
def write_report(
    folder: FilePath,
    shown: LevelComparison | SimulatedRun,
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
    shown
        The result of ``compare``, or a run. The report of a run shows only the simulation.
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
        The crack has no photo, because it was unpickled or is from a run folder. Or the folder is a run folder, whose
        report 'sealtwin validate' writes.

    Examples
    --------
    ``result`` is from the example of ``compare``.

    >>> page = st.write_report("report", result)
    >>> page.name
    'report.html'
    """
    from digitise.walls.overlay import draw_overlay, straight_view
    from validate.report.write_report import REPORT
    from validate.report.write_report import write_report as write_pages

    result, level = (None, shown.level) if isinstance(shown, SimulatedRun) else (shown, shown.level)
    path, readings = level.run.path, None if result is None else result.readings
    crack = path.solid.crack
    if (photo := crack.photo) is None:
        raise InputError(
            "write_report: shown has a crack without its photo, since a pickle and a run folder do not contain it. "
            "Trace the crack again."
        )
    target = Path(folder)
    require_folder(target)
    if (target / MANIFEST).is_file():
        raise InputError(f"{target} is a run folder, whose report 'sealtwin validate' writes. Give another folder.")
    sheet, facts = None, {photo.file.name: f"sha256 {crack.sha256}"}
    if readings is not None:
        sheet = ReadingsSheet(name=readings.source, sha256=readings.sha256, operator=None, date=None)
        facts[readings.source] = f"sha256 {readings.sha256}"
    facts["written"] = datetime.now(UTC).isoformat(timespec="seconds")
    files.write_png(target / OVERLAY, draw_overlay(photo, crack, path))
    files.write_png(target / STRAIGHT, straight_view(photo, crack))
    evidence = _evidence_of(
        level,
        readings,
        target,
        name=name or target.resolve().name,
        note=note,
        provenance=provenance(facts, level.run.device, level.run.settings.get("seed"), versions(), NUMBERS),
        sheet=sheet,
        comparison=result,
    )
    write_pages(target, evidence, pdf=pdf)
    return target / REPORT[0]


def _evidence_of(level: SimulatedLevel, readings: LevelReadings | None, folder: Path = Path(), **more: Any) -> Evidence:
    from digitise.trajectory import with_path
    from simulate.profile import volume_ratio

    run, path = level.run, level.run.path
    solid, crack = path.solid, path.solid.crack
    return Evidence(
        outline=crack,
        solid=with_path(solid, path, crack, path.settings),
        trajectory=path,
        run=run,
        profile=level,
        readings=readings,
        volume_ratio=float(run.health.volume_ratio or volume_ratio(run, solid)),
        overlay_path=folder / OVERLAY,
        straight_path=folder / STRAIGHT,
        photo_data=crack.data,
        **more,
    )
