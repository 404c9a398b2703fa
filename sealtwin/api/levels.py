"""Readings along the crack, their comparison with a simulated level, and a plot of both."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import InstanceOf

from sealtwin.api import FilePath, content_of, file_of, of_one_crack, settings_from, sha256_of, warn
from sealtwin.api.runs import SimulatedLevel
from sealtwin.api.samples import CrackOutline
from sealtwin.core.errors import InputError
from sealtwin.core.records import DataKind, Outline, Profile, Sections, Shown, Solid
from sealtwin.core.settings import checked
from sealtwin.core.settings_text import keywords_of
from validate.result import Comparison
from validate.settings import (
    Gate,
    Readings,
    Role,
    Uncertainty,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from validate.readings.grid import Grid

OF_A_FILE = ("sheet", "separator", "decimal", "unit")
"""Keywords about the format of a file, which do not apply to an array."""


@dataclass(frozen=True, kw_only=True, repr=False)
class LevelReadings(Profile):
    """Caliper readings along the crack: what ``read_readings`` returns.

    ``s_mm`` and ``level_mm``, (n,), are the position and the mean level of each station. ``repeats_mm`` is (n, r), with
    NaN for a missing reading.
    """

    settings: Readings
    """Declared facts about how the readings were taken."""
    sha256: str
    """Hash of the file, or of the array's bytes."""


@keywords_of(Readings, without=("file",))
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
    """Read caliper readings. Missing facts are an error that names the keyword to give; nothing is guessed.

    Keywords are settings of [readings] in a trial file.

    Parameters
    ----------
    readings
        A CSV, XLSX or ODS file with columns such as ``s_mm``, ``level_1_mm``, ``level_2_mm``; or an array or a list of
        rows, (n, 1 + r), in mm: arc length along the crack, then r levels of each station, with NaN for a missing one.
        Cells of an array are named as in a spreadsheet whose first row has the names of the columns: "B5" is the
        reading [3, 1].
    columns
        For an array or a list, the names of its columns as in the header of a sheet, for example ``["s_cm", "depth 1
        [mm]", "remark"]``: the rows are then read as a sheet. For a file, the table [readings.columns].
    crack, solid
        The crack and its solid. A station outside the crack or a level outside the solid is an error; without ``crack``
        or ``solid`` it is not checked.

    Returns
    -------
    LevelReadings
        Levels from the face in mm, sorted by s; ``doubts`` lists readings that may not mean what they seem to.

    Raises
    ------
    InputError
        The file is ambiguous, or a value is not possible; the text lists all faults, each with its place.

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
    given = locals()
    from sealtwin.trial.trial_file import SETTINGS, no_such_setting
    from validate.readings.grid import SheetFaults
    from validate.readings.read_readings import read_readings as from_file
    from validate.readings.read_readings import readings_of

    if unknown := [name for name in keywords.get("fitted") or () if name not in SETTINGS]:
        raise InputError(f"read_readings: fitted: {no_such_setting(unknown[0])}.")
    is_file = isinstance(readings, str | PathLike)
    file = file_of(readings, "readings") if isinstance(readings, str | PathLike) else Path("readings")
    names = None if columns is None or isinstance(columns, Mapping) else list(columns)
    settings = settings_from(Readings, "read_readings", given, file=file, columns=columns if names is None else None)
    # The readings stay if the solid is made again: they are of the sample.
    made_of = of_one_crack("read_readings", crack, solid)[:1]
    limits_mm = None if crack is None else crack.length_mm, None if solid is None else solid.depth_mm
    try:
        if is_file:
            if names is not None:
                raise InputError('read_readings: columns of a file is a table, such as {"s": "A", "levels": ["B:D"]}.')
            profile, digest = from_file(file, settings, *limits_mm), sha256_of(file)
        elif names is not None:
            grid, digest = _named_rows(readings, names)
            profile = readings_of(grid, settings, *limits_mm)
        else:
            if useless := [name for name in OF_A_FILE if keywords.get(name) not in (None, "mm")]:
                raise InputError(f"read_readings: {useless[0]} describes a file, but an array has no format. Omit it.")
            table = _as_numbers(readings)
            names = [
                "s_mm",
                *(f"{keywords.get('quantity') or 'level'}_{count}_mm" for count in range(1, table.shape[1])),
            ]
            profile, digest = readings_of(_named_rows(table, names)[0], settings, *limits_mm), sha256_of(table)
    except SheetFaults as fault:
        raise InputError("\n".join(doubt.in_words("python") for doubt in fault.doubts)) from None
    doubts = tuple(doubt.in_words("python") for doubt in profile.questions)
    profile = replace(profile, doubts=doubts, made_of=made_of)
    warn(profile.doubts)
    return LevelReadings(**content_of(profile), settings=settings, sha256=digest)


def _as_numbers(rows: Any) -> NDArray[np.float64]:
    try:
        table = np.asarray(rows, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            "read_readings: the rows are not all numbers of the same length. Use NaN for a missing reading, or give "
            "columns."
        ) from None
    if table.ndim != 2 or table.shape[1] < 2:
        raise InputError(f"read_readings: an array of shape {table.shape}; give (n, 1 + r): s_mm, then r readings.")
    return table


def _named_rows(rows: Any, names: list[Any]) -> "tuple[Grid, str]":
    """Return rows below the names of their columns as a sheet, and its hash."""
    from validate.readings.read_readings import grid_of_rows

    table = [names, *([*row] for row in rows)]
    if ragged := [number for number, row in enumerate(table) if len(row) != len(names)]:
        raise InputError(
            f"read_readings: row {ragged[0]} has {len(table[ragged[0]])} cells, but columns has {len(names)} names."
        )
    return grid_of_rows("readings", table), hashlib.sha256(repr(table).encode()).hexdigest()


class LevelComparison(Shown, Comparison):
    """A simulated level compared with readings: what ``compare`` returns.

    Its main figures are ``mean_error_mm``, ``interval_95_mm``, ``worst_error_mm`` at ``worst_at_mm``, ``verdict``,
    ``findings`` and ``baselines``.
    """

    level: InstanceOf[Profile]
    """The simulated level."""
    readings: InstanceOf[Profile]
    """The readings."""
    settings: Readings
    """The declared facts about how the readings were taken."""
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
        Results of the other functions. Readings may also be a plain ``Profile``; nothing is then declared about them.
    gate_mm, gate_reason
        Largest mean error in mm, declared before the run, and its reason. Without a gate the comparison neither passes
        nor fails.
    uncertainty
        Standard uncertainties of the inputs by the names of the table [uncertainty], for example
        ``{"station_mm": 1.0}``; inputs without one are not included, and the report lists them.

    Returns
    -------
    LevelComparison
        The mean error in mm is the exact area between both curves divided by the length that both cover.

    Raises
    ------
    InputError
        The curves do not overlap, a value is out of bounds, or the readings contradict a declared error.

    Examples
    --------
    ``crack``, ``solid`` and ``level`` are those of ``fill_fast``, and ``readings`` those of ``read_readings``.

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
        raise InputError(f"compare: gate_mm = {gate_mm}: must be above 0, in mm.")
    for argument, value in (("level", level), ("readings", readings)):
        if not isinstance(value, Profile) or (isinstance(value, LevelReadings) and argument == "level"):
            raise InputError(f"compare: {argument} is a {type(value).__name__}; give the level, then the readings.")
    if isinstance(readings, LevelReadings):
        settings = readings.settings
    else:
        settings = Readings(file=Path(readings.source or "readings"), data=readings.data, role="undeclared")
    declared = checked(Uncertainty, Path("compare: uncertainty"), uncertainty or {})
    dispensed_mm3 = level.dispensed_mm3 if isinstance(level, SimulatedLevel) else 0.0
    mouth = Mouth.of(crack, solid, level.density_kg_m3 if isinstance(level, SimulatedLevel) else None)
    comparison = compare(
        level,
        readings,
        crack,
        solid,
        role=settings.role,
        fitted=settings.fitted,
        photo_data=crack.data if isinstance(crack, CrackOutline) else "undeclared",
        gate=None if gate_mm is None else Gate(mean_error_mm=float(gate_mm), reason=gate_reason),
        escaped_particles=level.escaped_particles if isinstance(level, SimulatedLevel) else 0,
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
    """Plot levels along the crack: the simulated one, the readings, or both.

    Parameters
    ----------
    level, readings, result
        What to draw: a simulated level, readings, or both. ``result`` adds the 95 % band of the readings, and the best
        flat level unless the readings were held out.
    solid
        Solid whose floor is drawn; default: the solid of ``result``.
    ax
        Axes of matplotlib to draw on; default: those of a new figure outside pyplot. On axes of your own the level has
        the next colour of their cycle, limits only grow, and the title stays.
    label
        Name of the simulated level in the legend.

    Returns
    -------
    Figure
        The figure drawn on.

    Raises
    ------
    InputError
        There is nothing to draw.

    Examples
    --------
    ``level``, ``readings`` and ``result`` are those of ``compare``.

    >>> figure = st.plot_levels(level, readings, result)
    >>> figure.savefig("levels.svg")
    """
    if level is None and readings is None:
        raise InputError("plot_levels: there is nothing to draw; give level, readings or both.")
    of_one_crack("plot_levels", level, readings, *([] if result is None else [result.level, result.readings]), solid)
    if level is not None and result is not None and not np.array_equal(result.level.level_mm, level.level_mm):
        raise InputError("plot_levels: result is a comparison of another level; give the level that was compared.")
    from validate.figures.levels import draw_levels
    from validate.figures.theme import themed, wide_figure

    with themed():
        sections = solid.sections if solid is not None else result.sections if result is not None else None
        compared = result if readings is not None else None
        if ax is None:
            axes = wide_figure(3.9).add_subplot()
            draw_levels(axes, level, sections, readings, compared, label=label)
        else:
            axes, limits = ax, (ax.get_xlim(), ax.get_ylim()) if ax.has_data() else None
            how = {"title": None, "colour": ax.plot([], [])[0].get_color(), "label": label}
            draw_levels(ax, level, sections, readings, compared, **how)
            if limits is not None:
                ax.set_xlim(min(limits[0][0], ax.get_xlim()[0]), max(limits[0][1], ax.get_xlim()[1]))
                ax.set_ylim(min(limits[1][0], ax.get_ylim()[0]), max(limits[1][1], ax.get_ylim()[1]))
    figure = axes.get_figure()
    if figure is None:
        raise InputError("plot_levels: ax is not part of a figure; give axes of a figure, or omit ax.")
    return figure
