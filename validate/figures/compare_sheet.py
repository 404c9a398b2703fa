"""Page that compares finished runs, and its figures. Figures and tables name a run by its number."""

from collections.abc import Callable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from validate.figures import theme
from validate.figures.figure_sheet import NONE, Cell, FigureSheet, FigureTable, Numbers, Plot, SheetSection, wide_axes
from validate.figures.side_by_side import (
    DifferingSettings,
    Side,
    differing,
    first_with_readings,
    held_out_mean_mm,
    nearest,
    numbered,
    replicate_words,
    setting_words,
)
from validate.metrics.verdict import beside_baselines
from validate.units import signed

FIGURES = {
    "mean error (mm)": ("errors.mean_error_mm", "{:.3f}"),
    "bias (mm)": ("errors.bias_mm", "{:.3f}"),
    "RMS error (mm)": ("distances.rmse_mm", "{:.3f}"),
    "worst error (mm)": ("errors.worst_error_mm", "{:.2f}"),
    "at s (mm)": ("errors.worst_at_mm", "{:.1f}"),
    "share of the length under 1 mm": ("errors.share_under_1_mm", "{:.2f}"),
    "Fréchet distance (mm)": ("distances.frechet_mm", "{:.2f}"),
    "mean error of the best flat line (mm)": ("errors.flat_level_error_mm", "{:.3f}"),
    "mean error of the dispensed volume's flat level (mm)": ("volume_balance_error_mm", "{:.3f}"),
    "share of the crack that is filled": ("simulated_volumes.fill_ratio", "{:.3f}"),
}
"""Key and format of each figure of a comparison, by label."""

COLOURS = (theme.SIMULATED, theme.MEASURED, theme.THIRD, "#cc79a7", "#e69f00", "#9467bd", theme.INK)
"""Okabe and Ito's colours without sky blue, because the first colour is shown as sky blue on a dark page.

Colours four places apart have the same stroke, so they are not shades of one colour.
"""
STROKES = ("-", "--", ":", "-.")
MOST = len(COLOURS) * len(STROKES)  # Most runs that look different: every stroke in every colour
LEGEND_COLUMNS = 10  # Most two-digit labels, with their strokes, side by side

Row = tuple[str, Sequence[Any], Callable[[Any], str]]  # Label, value of each run, and format of a value on the page


def compare_sheet(
    sides: Sequence[Side], cautions: Sequence[str] = (), settings: DifferingSettings | None = None
) -> FigureSheet:
    """Return the page that compares ``sides``. ``cautions`` come before the cautions on the runs.

    Its table has ``settings``; default: those that differ and change a level or its error.
    """
    compared = [side for side in sides if side.comparison is not None]
    best, held_out_mm, settings = nearest(sides), held_out_mean_mm(sides), settings or differing(sides)
    key_figures = [("settings that differ", str(len(settings.shown)))]
    if best is not None and (nearest_one := sides[best].comparison) is not None:
        error = f"mean error {nearest_one.mean_error_mm:.2f} mm"
        finding = f"Run {best + 1} is nearest to the readings: {sides[best].name}. {beside_baselines(nearest_one)}"
        key_figures.append(("nearest", f"run {best + 1}, {error}"))
    elif any(side.counts for side in compared):
        finding = "The runs have different readings, so none is nearest."
    else:
        finding = "No run with readings is ranked, so none is nearest."
    if held_out_mm is not None:
        key_figures.append(("mean error over held-out trials", f"{held_out_mm:.2f} mm"))
    no_setting = "" if settings.shown else "No setting that changes a level or its error differs."
    about_settings = [words for words in (no_setting, settings.words) if words]
    values: list[Row] = [(name, each, setting_words) for name, each in settings.shown.items()]
    caption = "Signed error of each run with readings, labelled with its number."
    errors = Plot("errors", caption, lambda: draw_errors_of_runs(sides))
    parts = [
        SheetSection("Runs", [], [_names(sides)]),
        SheetSection("Settings that differ", about_settings, [_by_run(sides, "settings", "setting", values)]),
        SheetSection("Levels", [], [_levels(sides), *([errors] if compared else [])]),
        SheetSection("Figures", [], [_by_run(sides, "figures", "figure", _figures(sides))]),
    ]
    if unranked := [[str(number), side.unranked] for number, side in enumerate(sides, start=1) if side.unranked]:
        table = FigureTable("By run", ["run", "why"], unranked, "not-ranked")
        parts.append(SheetSection("Not ranked", [], [table]))
    if compared:
        words = [_held_out_words(sides), *replicate_words(sides)]
        parts.append(SheetSection("Held out", words, [_held_out(sides)]))
    return FigureSheet(
        title="Runs side by side",
        lead="All tables and figures name a run by its number in the first table.",
        cautions=[*cautions, *_cautions(sides)],
        finding=f"{len(sides)} runs, {len(compared)} of them with readings. {finding}",
        key_figures=key_figures,
        parts=parts,
    )


def _cautions(sides: Sequence[Side]) -> list[str]:
    kinds = sorted({side.readings.data for side in sides if side.readings is not None} - {"measured"})
    sentences = [f"Not a validation: some readings are {' and '.join(kinds)}."] if kinds else []
    if unranked := [
        f"run {number}, because {side.unranked}" for number, side in enumerate(sides, start=1) if side.unranked
    ]:
        leak = " Particles must never pass a wall: please report it with the trial file."
        sentences.append(f"Not ranked: {'; '.join(unranked)}.{leak if any(s.escaped_particles for s in sides) else ''}")
    return sentences + _not_held_out(sides)


def _not_held_out(sides: Sequence[Side]) -> list[str]:
    """Return a sentence for each set of readings that is held out in one run but was used to calibrate another."""
    roles: dict[int, dict[str, list[int]]] = {}
    for index, first in enumerate(first_with_readings(sides)):
        comparison = sides[index].comparison
        if first is not None and comparison is not None:
            roles.setdefault(first, {}).setdefault(comparison.role, []).append(index)
    return [
        f"Not held out: the readings of {numbered(by_role['held-out'])} were used to calibrate "
        f"{numbered(by_role['calibrated-on'])}."
        for by_role in roles.values()
        if {"held-out", "calibrated-on"} <= by_role.keys()
    ]


def _names(sides: Sequence[Side]) -> FigureTable:
    rows, numbers = [], []
    for number, (side, first) in enumerate(zip(sides, first_with_readings(sides), strict=True), start=1):
        readings, error_mm = NONE, None
        if side.readings is not None and first is not None and side.comparison is not None:
            error_mm = side.comparison.mean_error_mm
            readings = f"{side.readings.data}, {side.comparison.role}"
            readings += f", the same as of run {first + 1}" if first + 1 < number else ""
        rows.append([str(number), NONE if error_mm is None else f"{error_mm:.2f}", readings, side.name])
        numbers.append([number, error_mm, readings, side.name])
    head, columns = ["run", "mean error (mm)", "readings", "name"], ["run", "mean_error_mm", "readings", "name"]
    return FigureTable("Numbers and names", head, rows, "runs", Numbers(columns, numbers))


def _by_run(sides: Sequence[Side], name: str, first: str, rows: Sequence[Row]) -> FigureTable:
    """Return a table with a column for each run. Its head is the run's number; in the CSV, number and name."""
    head = [first, *(str(index + 1) for index in range(len(sides)))]
    shown = [[label, *(NONE if value is None else text(value) for value in values)] for label, values, text in rows]
    content = [
        [label, *(value if value is None or isinstance(value, int | float) else text(value) for value in values)]
        for label, values, text in rows
    ]
    numbers = Numbers([first, *_named(sides)], content)
    return FigureTable("By run", head, shown, name, numbers)


def _figures(sides: Sequence[Side]) -> list[Row]:
    facts = dict.fromkeys(name for side in sides for name in side.facts)
    return [
        *((label, [_figure(side, key) for side in sides], form.format) for label, (key, form) in FIGURES.items()),
        *((label, [side.facts.get(label) for side in sides], _rounded) for label in facts),
    ]


def _figure(side: Side, key: str) -> float | None:
    if (comparison := side.comparison) is None:
        return None
    if key == "volume_balance_error_mm":
        return comparison.volumes and comparison.volumes.volume_balance_error_mm
    return attrgetter(key)(comparison)


def _held_out_words(sides: Sequence[Side]) -> str:
    held_out_mm = held_out_mean_mm(sides)
    if held_out_mm is not None:
        return f"Mean error over the held-out trials: {held_out_mm:.2f} mm."
    if any(side.held_out for side in sides):
        return "No held-out run is ranked; see the reasons in the table of runs that are not ranked."
    return "No run has held-out readings, so every error here is the residual of a calibration."


def _held_out(sides: Sequence[Side]) -> FigureTable:
    head = ["run", "role", "readings", "mean error (mm)", "95 % interval (mm)", "bias (mm)", "worst (mm)"]
    head += ["beats its baselines", "beats the dispensed volume's flat level"]
    columns = ["run", "trial", "role", "readings", "mean_error_mm", "low_mm", "high_mm", "bias_mm", "worst_error_mm"]
    columns += ["beats_baseline", "beats_volume_balance"]
    rows: list[list[str]] = []
    numbers: list[list[Cell]] = []
    for number, side in sorted(enumerate(sides, start=1), key=lambda each: not each[1].held_out):
        if (m := side.comparison) is None:
            continue
        kind, mean_mm, bias_mm, worst_mm = (m.role, m.readings_data), m.mean_error_mm, m.bias_mm, m.worst_error_mm
        low_mm, high_mm = m.interval_95_mm or (None, None)
        interval = NONE if low_mm is None else f"{low_mm:.2f} to {high_mm:.2f}"
        beaten = m.beats_baseline, m.volumes and m.volumes.beats_volume_balance
        beats = [NONE if value is None else "yes" if value else "no" for value in beaten]
        rows.append([str(number), *kind, f"{mean_mm:.3f}", interval, signed(bias_mm, 3), f"{worst_mm:.2f}", *beats])
        numbers.append([str(number), side.name, *kind, mean_mm, low_mm, high_mm, bias_mm, worst_mm, *beats])
    return FigureTable("Held-out trials first", head, rows, "held-out", Numbers(columns, numbers))


def _levels(sides: Sequence[Side]) -> Plot:
    s_mm = sides[0].profile.s_mm
    levels = [np.interp(s_mm, side.profile.s_mm, side.profile.level_mm, right=np.nan) for side in sides]
    rows = [[None if np.isnan(value) else float(value) for value in row] for row in np.column_stack([s_mm, *levels])]
    columns = ["s_mm", *(f"{name}: level_mm" for name in _named(sides))]
    firsts = [first for first in first_with_readings(sides) if first is not None]
    caption = "Level along the crack of each run, labelled with its number."
    if firsts:
        shared = len(firsts) > len(set(firsts))
        caption += " Circles are readings, in the colour of their run"
        caption += ", or in the colour of the labels if several runs share them." if shared else "."
    return Plot("levels", caption, lambda: draw_levels_of_runs(sides), Numbers(columns, rows))


def _named(sides: Sequence[Side]) -> list[str]:
    """Return the runs' numbers with their names, because a CSV is read without the page."""
    return [f"{number} {side.name}" for number, side in enumerate(sides, start=1)]


def _rounded(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


@theme.themed()
def draw_levels_of_runs(sides: Sequence[Side]) -> Figure:
    """Draw levels as lines, and readings as circles in the colour of their run, or in ink if runs share them."""
    figure, axes = wide_axes(4.2, face=True)
    first_with = first_with_readings(sides)
    for index, side in enumerate(sides):
        readings = side.readings
        if readings is not None and first_with[index] == index:
            colour = COLOURS[index % len(COLOURS)] if first_with.count(index) == 1 else theme.INK
            axes.plot(readings.s_mm, readings.level_mm, "o", color=colour, markersize=4, markerfacecolor="none")
        _draw_line(axes, index, side.profile.s_mm, side.profile.level_mm)
    kinds = sorted({side.readings.data for side in sides if side.readings is not None})
    origins = " and ".join(kind if kind == "measured" else kind.upper() for kind in kinds)
    _finish(axes, sides, theme.LEVEL, f"Levels, and readings ({origins}) as circles" if kinds else "Levels")
    return figure


@theme.themed()
def draw_errors_of_runs(sides: Sequence[Side]) -> Figure:
    """Draw the signed errors of the runs with readings."""
    figure, axes = wide_axes(3.2, face=True)
    for index, side in enumerate(sides):
        if (error := side.error) is not None:
            _draw_line(axes, index, error.x, error.value)
    _finish(axes, sides, "error (mm)", "Signed error: above 0 the simulated level is too high")
    return figure


def _draw_line(axes: Axes, index: int, s_mm: np.ndarray, value_mm: np.ndarray) -> None:
    # Neighbours have different strokes, so that coinciding lines are both visible.
    stroke, colour = STROKES[index % len(STROKES)], COLOURS[index % len(COLOURS)]
    axes.plot(s_mm, value_mm, stroke, color=colour, label=str(index + 1))


def _finish(axes: Axes, sides: Sequence[Side], y: str, title: str) -> None:
    axes.set_xlim(0, max(side.profile.s_mm[-1] for side in sides))
    theme.label_axes(axes, theme.ALONG, y, title, LEGEND_COLUMNS)
