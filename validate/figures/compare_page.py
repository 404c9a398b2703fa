"""Page that compares finished runs: settings that differ, the best run, shared readings.

Figures and tables name a run by its number.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sealtwin.core.facts import Fact
from sealtwin.core.records import Floats, Profile
from validate.figures.page import NONE, FigureColumn, FigureTable, Page, Plot, Section, part_of
from validate.figures.theme import ALONG, INK, LEVEL, MEASURED, SIMULATED, THIRD, label_axes, themed, wide_axes
from validate.metrics.curve_distances import level_difference
from validate.metrics.verdict import SOUND, beside_baselines, kept_volume
from validate.result import Comparison
from validate.units import setting_words

SAME_MM = 0.01
"""Largest difference in mm, at any station, between copies of the same readings: the last digit of a caliper. Repeated
readings differ by ten times as much."""
FIGURES: dict[str, tuple[str, Callable[[Any], str]]] = {
    "mean error (mm)": ("mean_error_mm", "{:.3f}".format),
    "95 % interval (mm)": ("interval_95_mm", lambda ends_mm: "{:.2f} to {:.2f}".format(*ends_mm)),
    "bias (mm)": ("bias_mm", "{:.3f}".format),
    "RMS error (mm)": ("distances.rmse_mm", "{:.3f}".format),
    "worst error (mm)": ("errors.worst_error_mm", "{:.2f}".format),
    "at s (mm)": ("errors.worst_at_mm", "{:.1f}".format),
    "share of the length under 1 mm": ("errors.share_under_1_mm", "{:.2f}".format),
    "Fréchet distance (mm)": ("distances.frechet_mm", "{:.2f}".format),
    "mean error of the best flat line (mm)": ("errors.flat_level_error_mm", "{:.3f}".format),
    "beats its baselines": ("beats_baseline", setting_words),
    "mean error of the dispensed volume's flat level (mm)": ("volumes.volume_balance_error_mm", "{:.3f}".format),
    "beats the dispensed volume's flat level": ("volumes.beats_volume_balance", setting_words),
    "share of the crack that is filled": ("simulated_volumes.fill_ratio", "{:.3f}".format),
}
"""Path and format of each figure of a comparison, by label."""

COLOURS = (SIMULATED, MEASURED, THIRD, "#cc79a7", "#e69f00", "#9467bd", INK)
"""Colours of the runs: Okabe and Ito's without sky blue, because the first colour is shown as sky blue on a dark page.
Colours four positions apart have the same stroke, so they are not shades of one colour."""
STROKES = ("-", "--", ":", "-.")
MAX_RUNS = len(COLOURS) * len(STROKES)  # Largest number of runs that look different: every stroke in every colour
LEGEND_COLUMNS = 10  # Largest number of two-digit labels, with their strokes, side by side

Row = tuple[str, Sequence[Any], Callable[[Any], str]]  # Label, value of each run, and format of a value on the page


@dataclass(frozen=True)
class Side:
    """One run of the comparison."""

    name: str  # Unique name
    settings: Mapping[str, Any]  # Settings by dotted name
    profile: Profile
    readings: Profile | None
    comparison: Comparison | None  # None without readings
    facts: Mapping[str, float | None]  # Figures of the run itself, by name with unit
    volume_ratio: float  # Settled volume, divided by the dispensed volume
    escaped_particles: int = 0  # Number of particles that went through a wall
    edited: Sequence[str] = ()  # Names of its files that were changed after the run
    fluid_warnings: Sequence[Fact] = ()  # Faults of its fluid
    without_effect: frozenset[str] = frozenset()  # Settings that change neither its level nor the error of its level

    @property
    def unranked(self) -> str:
        """Reasons why the run is not ranked. Empty if it is ranked."""
        low, high = SOUND
        reasons = {
            f"files were edited by hand after the run ({', '.join(self.edited)})": self.edited,
            "particles went through a wall": self.escaped_particles,
            f"{self.volume_ratio:.3f} of the dispensed volume settled ({low:g} to {high:g} is sound)": not kept_volume(
                self.volume_ratio
            ),
        }
        return " and ".join(reason for reason, applies in reasons.items() if applies)

    @property
    def held_out(self) -> bool:
        """True if the run's readings were not used for calibration."""
        return self.comparison is not None and self.comparison.role == "held-out"


Sides = Sequence[Side]


def differing(sides: Sides) -> dict[str, list[Any]]:
    """Return the settings that differ among the runs, with the value for each run. It is None if a run does not set it.

    Settings that change neither the level nor its error in any run come last.
    """
    effective, idle = dict[str, list[Any]](), dict[str, list[Any]]()
    for name in dict.fromkeys(name for side in sides for name in side.settings):
        values = [side.settings.get(name) for side in sides]
        if any(value != values[0] for value in values):
            without_effect = all(name in side.without_effect for side in sides if name in side.settings)
            (idle if without_effect else effective)[name] = values
    return effective | idle


def first_with_readings(sides: Sides) -> list[int | None]:
    """Return for each run the index of the first run with the same readings, or None for a run without readings.

    Readings with equal numbers count as the same, even if their sheets differ.
    """
    return [next((first for first, other in enumerate(sides) if _same(other.readings, side.readings)), None)
            for side in sides]  # fmt: skip


def _same(first: Profile | None, second: Profile | None) -> bool:
    if first is None or second is None or len(first.s_mm) != len(second.s_mm):
        return False
    numbers = ([readings.s_mm, readings.level_mm] for readings in (first, second))
    return np.allclose(*numbers, rtol=0, atol=SAME_MM)


def nearest(sides: Sides) -> int | None:
    """Return the index of the ranked run with the smallest mean error.

    Returns None if no ranked run has readings. Also returns None if the runs have different readings, because some
    readings are easier to fit than others.
    """
    errors_mm = _ranked_errors_mm(sides)
    firsts = first_with_readings(sides)
    return min(errors_mm, key=errors_mm.__getitem__) if len({firsts[index] for index in errors_mm}) == 1 else None


def held_out_mean_mm(sides: Sides) -> float | None:
    """Return the average of the mean errors of the ranked held-out runs. Returns None if there are none."""
    errors_mm = [error_mm for index, error_mm in _ranked_errors_mm(sides).items() if sides[index].held_out]
    return float(np.mean(errors_mm)) if errors_mm else None


def _ranked_errors_mm(sides: Sides) -> dict[int, float]:
    """Return the mean error of each ranked run with readings, by the run's index."""
    return {
        index: side.comparison.mean_error_mm
        for index, side in enumerate(sides)
        if side.comparison is not None and not side.unranked
    }


def numbered(indices: Sequence[int]) -> str:
    """Return the numbers of runs in words, for example "runs 1, 2 and 5"."""
    *before, last = [str(index + 1) for index in indices]
    return f"runs {', '.join(before)} and {last}" if before else f"run {last}"


def compare_page(sides: Sides, cautions: Sequence[str] = ()) -> Page:
    """Return the page that compares ``sides``. ``cautions`` are shown before the cautions about the runs."""
    compared, settings = [side for side in sides if side.comparison is not None], differing(sides)
    key_figures = [("settings that differ", str(len(settings)))]
    if (best := nearest(sides)) is not None and (comparison := sides[best].comparison) is not None:
        finding = f"Run {best + 1} is nearest to the readings: {sides[best].name}. {beside_baselines(comparison)}"
        key_figures.append(("nearest", f"run {best + 1}, mean error {comparison.mean_error_mm:.2f} mm"))
    elif _ranked_errors_mm(sides):
        finding = "The runs have different readings, so none is nearest."
    else:
        finding = "No run with readings is ranked, so none is nearest."
    held_out = "No run has held-out readings, so every error here is the residual of a calibration."
    if (held_out_mm := held_out_mean_mm(sides)) is not None:
        held_out = f"Mean error over the held-out trials: {held_out_mm:.2f} mm."
        key_figures.append(("mean error over held-out trials", f"{held_out_mm:.2f} mm"))
    elif any(side.held_out for side in sides):
        held_out = "No held-out run is ranked; see the reasons above."
    caption = "Signed error of each run with readings, labelled with its number."
    errors = [Plot("errors", caption, lambda: draw_errors_of_runs(sides))] if compared else []
    differing_rows = [(name, values, setting_words) for name, values in settings.items()]
    return Page(
        title="Runs side by side",
        lead="All tables and figures name a run by its number in the first table.",
        cautions=[*cautions, *_cautions(sides)],
        finding=f"{len(sides)} runs, {len(compared)} of them with readings. {finding}",
        key_figures=key_figures,
        sections=[
            Section("Runs", [_names(sides)]),
            Section("Settings that differ", [_by_run(sides, "settings", "setting", differing_rows)]),
            Section("Levels", [_levels(sides), *errors]),
            Section("Figures", [_by_run(sides, "figures", "figure", _figures(sides))]),
            *([Section("Held out", [held_out])] if compared else []),
        ],
    )


def _cautions(sides: Sides) -> list[str]:
    kinds = sorted({side.readings.data for side in sides if side.readings is not None} - {"measured"})
    sentences = [f"Not a validation: some readings are {' and '.join(kinds)}."] if kinds else []
    reasons = [f"run {number}, because {side.unranked}" for number, side in enumerate(sides, start=1) if side.unranked]
    if reasons:
        leak = " Particles must never pass a wall: please report it with the trial file."
        leaks = any(side.escaped_particles for side in sides)
        sentences.append(f"Not ranked: {'; '.join(reasons)}.{leak if leaks else ''}")
    # Readings that are held out in one run but were used to calibrate another.
    roles: dict[int, dict[str, list[int]]] = {}
    for index, first in enumerate(first_with_readings(sides)):
        if first is not None and (comparison := sides[index].comparison) is not None:
            roles.setdefault(first, {}).setdefault(comparison.role, []).append(index)
    return sentences + [
        f"Not held out: the readings of {numbered(by_role['held-out'])} were used to calibrate "
        f"{numbered(by_role['calibrated-on'])}."
        for by_role in roles.values()
        if {"held-out", "calibrated-on"} <= by_role.keys()
    ]


def _names(sides: Sides) -> FigureTable:
    readings: list[str | None] = []
    for index, (side, first) in enumerate(zip(sides, first_with_readings(sides), strict=True)):
        same = f", the same as for run {first + 1}" if first is not None and first < index else ""
        readings.append(side.comparison and f"{side.comparison.readings_data}, {side.comparison.role}{same}")
    columns = [
        FigureColumn("run", range(1, len(sides) + 1)),
        FigureColumn("mean error (mm)", "comparison.mean_error_mm", "{:.2f}".format, "mean_error_mm"),
        FigureColumn("readings", readings),
        FigureColumn("name", "name"),
    ]
    return FigureTable("Numbers and names", "runs", columns, sides)


def _by_run(sides: Sides, name: str, first: str, rows: Sequence[Row]) -> FigureTable:
    """Return a table with a column for each run. Its head is the run's number, and in the CSV also the name."""
    columns = [FigureColumn(first, [label for label, _, _ in rows])]
    for index, named in enumerate(_named(sides)):
        cells = [(values[index], text) for _, values, text in rows]
        texts = [NONE if value is None else text(value) for value, text in cells]
        numbers = [value if value is None or isinstance(value, int | float) else text(value) for value, text in cells]
        columns += [FigureColumn(str(index + 1), texts, name=""), FigureColumn("", numbers, name=named)]
    return FigureTable("By run", name, columns)


def _figures(sides: Sides) -> list[Row]:
    labels = dict.fromkeys(label for side in sides for label in side.facts)
    return [
        *((label, [part_of(side.comparison, path) for side in sides], text) for label, (path, text) in FIGURES.items()),
        *((label, [side.facts.get(label) for side in sides], _rounded) for label in labels),
    ]


def _levels(sides: Sides) -> Plot:
    s_mm = sides[0].profile.s_mm
    levels = {
        f"{named}: level_mm": np.interp(s_mm, side.profile.s_mm, side.profile.level_mm, right=np.nan)
        for named, side in zip(_named(sides), sides, strict=True)
    }
    firsts = [first for first in first_with_readings(sides) if first is not None]
    caption = "Level along the crack of each run, labelled with its number."
    if firsts:
        shared = len(firsts) > len(set(firsts))
        caption += " Circles are readings, in the colour of their run"
        caption += ", or in the colour of the labels if several runs share them." if shared else "."
    return Plot("levels", caption, lambda: draw_levels_of_runs(sides), {"s_mm": s_mm} | levels)


def _named(sides: Sides) -> list[str]:
    """Return the runs' numbers with their names, because a CSV is read without the page."""
    return [f"{number} {side.name}" for number, side in enumerate(sides, start=1)]


def _rounded(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


@themed()
def draw_levels_of_runs(sides: Sides) -> Figure:
    """Draw levels as lines and readings as circles, which are dark if several runs have the same readings."""
    _, axes = wide_axes(4.2, face=True)
    first_with = first_with_readings(sides)
    for index, side in enumerate(sides):
        readings = side.readings
        if readings is not None and first_with[index] == index:
            colour = COLOURS[index % len(COLOURS)] if first_with.count(index) == 1 else INK
            axes.plot(readings.s_mm, readings.level_mm, "o", color=colour, markersize=4, markerfacecolor="none")
    kinds = sorted({side.readings.data for side in sides if side.readings is not None})
    origins = " and ".join(kind if kind == "measured" else kind.upper() for kind in kinds)
    title = f"Levels, and readings ({origins}) as circles" if kinds else "Levels"
    curves = [(side.profile.s_mm, side.profile.level_mm) for side in sides]
    return _draw_runs(axes, sides, enumerate(curves), LEVEL, title)


@themed()
def draw_errors_of_runs(sides: Sides) -> Figure:
    """Draw the signed errors of the runs that have readings."""
    _, axes = wide_axes(3.2, face=True)
    curves = []
    for index, side in enumerate(sides):
        if side.readings is not None:
            error = level_difference(side.profile, side.readings)
            curves.append((index, (error.x, error.value)))
    return _draw_runs(axes, sides, curves, "error (mm)", "Signed error: above 0 the simulated level is too high")


def _draw_runs(
    axes: Axes, sides: Sides, curves: Iterable[tuple[int, tuple[Floats, Floats]]], y: str, title: str
) -> Figure:
    """Draw one curve per run. ``curves`` has the run's index with each curve.

    Neighbouring curves have different strokes, so that both are visible.
    """
    for index, curve in curves:
        stroke, colour = STROKES[index % len(STROKES)], COLOURS[index % len(COLOURS)]
        axes.plot(*curve, stroke, color=colour, label=str(index + 1))
    axes.set_xlim(0, max(side.profile.s_mm[-1] for side in sides))
    return label_axes(axes, ALONG, y, title, LEGEND_COLUMNS)
