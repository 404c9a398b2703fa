"""Readings along the crack, their comparison with a simulated level, and a plot of both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import InstanceOf

from sealtwin.api.runs import SimulatedLevel
from sealtwin.api.samples import CrackOutline
from sealtwin.api.shared import FilePath, content_of, file_of, settings_from, sha256_of, warn
from sealtwin.core.errors import InputError
from sealtwin.core.records import DataKind, Outline, Profile, Sections, Solid
from sealtwin.core.settings import checked
from sealtwin.core.settings_text import keywords_of
from validate.result import Comparison
from validate.settings import Datum, Decimal, Gate, Quantity, Readings, Role, Separator, Uncertainty, Unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

OF_A_FILE = ("sheet", "sample", "separator", "decimal", "unit")
"""Keywords about the format of a file, which do not apply to an array."""


@dataclass(frozen=True, kw_only=True)
class LevelReadings(Profile):
    """Caliper readings along the crack: what ``read_readings`` returns.

    ``s_mm`` and ``level_mm``, (n,), are the position and the mean level of each station. ``repeats_mm`` is (n, r), with
    NaN for a missing reading.
    """

    settings: Readings
    """Declared facts about how the readings were taken."""
    sha256: str
    """Hash of the file, or of the array's bytes."""


@keywords_of(Readings)
def read_readings(
    readings: FilePath | NDArray[np.floating[Any]],
    crack: Outline | None = None,
    solid: Solid | None = None,
    *,
    quantity: Quantity | None = None,
    unit: Unit | None = None,
    datum: Datum | None = None,
    datum_level_mm: float | None = None,
    sheet: str | None = None,
    sample: str | None = None,
    separator: Separator | None = None,
    decimal: Decimal | None = None,
    as_written: Sequence[str] | None = None,
    data: DataKind = "undeclared",
    role: Role = "undeclared",
    fitted: tuple[str, ...] | None = None,
    state: Literal["wet", "cured"] | None = None,
    shrinkage_percent: float | None = None,
    resolution_mm: float | None = None,
    limit_mm: float | None = None,
    probe_mm: float | None = None,
    datum_error_mm: float | None = None,
) -> LevelReadings:
    """Read caliper readings. Missing facts are an error that names the keyword to give; nothing is guessed.

    Keywords are settings of [readings] in a trial file.

    Parameters
    ----------
    readings
        A CSV, XLSX or ODS file with columns such as ``s_mm``, ``level_1_mm``, ``level_2_mm``; or an array (n, 1 + r) in
        mm: arc length along the crack, then r levels of each station, with NaN for a missing one. Cells of an array are
        named as in a spreadsheet: "B4" is the reading [3, 1].
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
    """
    given = locals()
    from sealtwin.trial.trial_file import SETTINGS, no_such_setting
    from validate.readings.read_readings import read_readings, take_readings

    if unknown := [name for name in fitted or () if name not in SETTINGS]:
        raise InputError(f"read_readings: fitted: {no_such_setting(unknown[0])}.")
    is_array = isinstance(readings, np.ndarray)
    file = Path("readings") if is_array else file_of(readings, "readings")
    settings = settings_from(Readings, "read_readings", given, file=file)
    length_mm = None if crack is None else crack.length_mm
    depth_mm = None if solid is None else solid.depth_mm
    if is_array:
        if useless := [name for name in OF_A_FILE if given[name] is not None]:
            raise InputError(
                f"read_readings: {useless[0]} is about the format of a file, and an array has none. Omit it."
            )
        profile = take_readings(np.asarray(readings, dtype=np.float64), settings, length_mm, depth_mm)
    else:
        profile = read_readings(file, settings, length_mm, depth_mm)
    warn(profile.doubts)
    return LevelReadings(**content_of(profile), settings=settings, sha256=sha256_of(readings if is_array else file))


class LevelComparison(Comparison):
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
    """
    from validate.compare import compare, error_uncertainty
    from validate.metrics.baselines import flat_levels

    if gate_mm is not None and not 0 < gate_mm < np.inf:
        raise InputError(f"compare: gate_mm = {gate_mm}: must be above 0, in mm.")
    if isinstance(readings, LevelReadings):
        settings = readings.settings
    else:
        settings = Readings(file=Path(readings.source or "readings"), data=readings.data, role="undeclared")
    declared = checked(Uncertainty, Path("compare: uncertainty"), uncertainty or {})
    dispensed_mm3 = level.dispensed_mm3 if isinstance(level, SimulatedLevel) else 0.0
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
        uncertainty=error_uncertainty(level, readings, crack, solid, settings, declared),
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
        Axes of matplotlib to draw on; default: those of a new pyplot figure.

    Returns
    -------
    Figure
        The figure drawn on.

    Raises
    ------
    InputError
        There is nothing to draw.
    """
    if level is None and readings is None:
        raise InputError("plot_levels: there is nothing to draw; give level, readings or both.")
    from matplotlib import pyplot

    from validate.figures.levels import draw_levels
    from validate.figures.theme import themed

    with themed():
        axes = pyplot.figure(figsize=(9.0, 3.9), layout="constrained").add_subplot() if ax is None else ax
        sections = solid.sections if solid is not None else result.sections if result is not None else None
        draw_levels(axes, level, sections, readings, result if readings is not None else None)
    figure = axes.get_figure()
    if figure is None:
        raise InputError("plot_levels: ax is not part of a figure; give axes of a figure, or omit ax.")
    return figure
