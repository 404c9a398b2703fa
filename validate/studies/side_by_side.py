"""Finished runs side by side: what they were made with, what came out, what was never tuned on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from string import ascii_lowercase
from typing import Any

import numpy as np
from matplotlib.figure import FigureBase

from sealtwin.records import Floats, Profile
from validate.comparison.curves import Difference, Pieces
from validate.drawing.level_curves import ALONG
from validate.drawing.theme import INK, MEASURED, SIMULATED, THIRD, canvas, label_axes, put_legend_under_title, themed
from validate.studies.replicates import FEWEST, Compared, area_validation_metric, held_out_mean_mm, held_out_table
from validate.studies.sheet import Cell, Grid, Numbers, Part, Plot, Sheet

COLOURS = (SIMULATED, MEASURED, THIRD, "#cc79a7", "#56b4e9", "#e69f00", INK)
"""Okabe and Ito's."""
STROKES = ("-", "--", ":", "-.")
LEGEND_COLUMNS = 8
"""Letters side by side."""
NONE = "-"


@dataclass(frozen=True)
class Side:
    """One run."""

    name: str
    """By which it is told from the others."""
    settings: Mapping[str, Any]
    """By dotted name."""
    profile: Profile
    readings: Profile | None
    sheet: str
    """Hash of its readings; empty where it has none."""
    metrics: Mapping[str, Any]
    """Its comparison.json; empty where it has no readings."""
    facts: Mapping[str, float]
    """What is known of the run itself, by name with unit."""
    replicate_of: str
    """The same where crack as it was ordered, path, paste and solver are: runs of one trial, done again."""


def side_by_side(sides: Sequence[Side]) -> Sheet:
    compared = [side for side in sides if side.metrics]
    trials = [Compared(side.name, dict(side.metrics)) for side in compared]
    held_out_mm = held_out_mean_mm(trials)
    finding = f"{len(sides)} runs, {len(compared)} of them held against readings. {_nearest(compared)}"
    parts = [
        Part("Settings that differ", _same(sides), [_settings(sides)]),
        Part("Levels", [], [_levels(sides), *([_errors(sides)] if compared else [])]),
        Part("Figures", [], [_figures(sides)]),
    ]
    if trials:
        told = (
            "No run was held against readings that nobody tuned on: every error here is what a fit left over."
            if held_out_mm is None
            else f"Mean error over the held-out trials: {held_out_mm:.2f} mm."
        )
        parts.append(Part("Held out", [told, *replicate_words(sides)], [_held_out(trials)]))
    return Sheet(
        title="Runs side by side",
        lead=", ".join(side.name for side in sides),
        cautions=_cautions(sides),
        finding=finding,
        key_figures=[
            (
                f"{letter}: {side.name}",
                f"{side.metrics['mean_error_mm']:.2f} mm off" if side.metrics else "no readings",
            )
            for letter, side in zip(lettered(sides), sides, strict=True)
        ],
        parts=parts,
    )


def lettered(sides: Sequence[Side]) -> list[str]:
    """How figures name the runs, where a name of 80 characters has no room: a to z, then a2."""
    letters = len(ascii_lowercase)
    return [
        ascii_lowercase[index % letters] + (str(index // letters + 1) if index >= letters else "")
        for index in range(len(sides))
    ]


def differing(sides: Sequence[Side]) -> dict[str, list[Any]]:
    """Settings that are not the same in all runs, each with its values in their order; None where a run has none."""
    names = list(dict.fromkeys(name for side in sides for name in side.settings))
    values = {name: [side.settings.get(name) for side in sides] for name in names}
    return {name: found for name, found in values.items() if any(value != found[0] for value in found[1:])}


def replicate_words(sides: Sequence[Side]) -> list[str]:
    """The area validation metric of each trial that was done again, in sentences; or what it would take."""
    groups: dict[str, list[Side]] = {}
    for side in sides:
        if side.readings is not None:
            groups.setdefault(side.replicate_of, []).append(side)
    told = []
    for members in groups.values():
        # The same sheet again is no replicate of anything.
        if len(members) < FEWEST or len({side.sheet for side in members}) < len(members):
            continue
        simulated_mm, measured_mm = np.array([_mean_levels_mm(side) for side in members]).T
        metric_mm = area_validation_metric(simulated_mm, measured_mm)
        told.append(
            f"Area validation metric of the mean level over {len(members)} replicates "
            f"({', '.join(side.name for side in members)}): {metric_mm:.3f} mm."
        )
    return told or [
        f"No area validation metric: it takes {FEWEST} or more replicates of a trial, the same settings with readings "
        "of their own each, and there are none among these runs."
    ]


def _mean_levels_mm(side: Side) -> tuple[float, float]:
    """Simulated and measured, over the stretch of s that both have."""
    assert side.readings is not None, "asked of runs with readings alone"
    profile, readings = side.profile, side.readings
    error = Difference(profile.s_mm, profile.level_mm, readings.s_mm, readings.level_mm)
    measured = Pieces(error.x, np.interp(error.x, readings.s_mm, readings.level_mm)).mean()
    return measured + error.mean(), measured


def _nearest(compared: Sequence[Side]) -> str:
    if not compared:
        return "None can be called nearer than another."
    if len({side.sheet for side in compared}) > 1:
        return "They are held against different readings, so no one of them is the nearest."
    best = min(compared, key=lambda side: side.metrics["mean_error_mm"])
    return f"Nearest is {best.name}, {best.metrics['mean_error_mm']:.2f} mm off on average."


def _cautions(sides: Sequence[Side]) -> list[str]:
    kinds = sorted(
        {side.readings.data for side in sides if side.readings is not None and side.readings.data != "measured"}
    )
    return [f"Not a validation: some readings are {' and '.join(kinds)}."] if kinds else []


def _same(sides: Sequence[Side]) -> list[str]:
    return [] if differing(sides) else ["No setting differs."]


def _settings(sides: Sequence[Side]) -> Grid:
    rows = [[name, *(_plain(value) for value in values)] for name, values in differing(sides).items()]
    head = ["setting", *(side.name for side in sides)]
    return Grid("By run", head, rows, "settings", Numbers(head, rows))


def _figures(sides: Sequence[Side]) -> Grid:
    measured = {
        "mean error (mm)": ("mean_error_mm", 3),
        "bias (mm)": ("bias_mm", 3),
        "RMS error (mm)": ("rmse_mm", 3),
        "worst error (mm)": ("worst_error_mm", 2),
        "at s (mm)": ("worst_at_mm", 1),
        "share of the length under 1 mm": ("share_under_1_mm", 2),
        "Fréchet distance (mm)": ("frechet_mm", 2),
        "mean error of the best flat level (mm)": ("flat_level_error_mm", 3),
        "mean error of the volume's level (mm)": ("volume_balance_error_mm", 3),
        "share of the crack that is filled": ("simulated_fill_ratio", 3),
    }
    rows, numbers = [], []
    for label, (key, digits) in measured.items():
        values = [side.metrics.get(key) for side in sides]
        rows.append([label, *(NONE if value is None else f"{value:.{digits}f}" for value in values)])
        numbers.append([label, *values])
    for label in dict.fromkeys(name for side in sides for name in side.facts):
        values = [side.facts.get(label) for side in sides]
        rows.append([label, *(NONE if value is None else _rounded(value) for value in values)])
        numbers.append([label, *values])
    head = ["figure", *(side.name for side in sides)]
    return Grid("By run", head, rows, "figures", Numbers(head, numbers))


def _held_out(trials: Sequence[Compared]) -> Grid:
    head = ["trial", "role", "readings", "mean error (mm)", "95 % interval (mm)", "bias (mm)", "worst (mm)"]
    head += ["beats the best flat level", "beats the volume's level"]
    rows, numbers = [], []
    for row in held_out_table(trials):
        interval = NONE if row.low_mm is None or row.high_mm is None else f"{row.low_mm:.2f} to {row.high_mm:.2f}"
        beats = [
            NONE if value is None else "yes" if value else "no"
            for value in (row.beats_flat_level, row.beats_volume_balance)
        ]
        figures = [f"{row.mean_error_mm:.3f}", interval, f"{row.bias_mm:+.3f}", f"{row.worst_error_mm:.2f}"]
        rows.append([row.name, row.role, row.data, *figures, *beats])
        cells: list[Cell] = [row.name, row.role, row.data, row.mean_error_mm, row.low_mm, row.high_mm, row.bias_mm]
        numbers.append([*cells, row.worst_error_mm, *beats])
    columns = ["trial", "role", "readings", "mean_error_mm", "low_mm", "high_mm", "bias_mm", "worst_error_mm"]
    columns += ["beats_flat_level", "beats_volume_balance"]
    return Grid("Held-out trials first", head, rows, "held-out", Numbers(columns, numbers))


def _levels(sides: Sequence[Side]) -> Plot:
    s_mm = sides[0].profile.s_mm
    levels = [np.interp(s_mm, side.profile.s_mm, side.profile.level_mm, right=np.nan) for side in sides]
    numbers = Numbers(["s_mm", *(f"{side.name}: level_mm" for side in sides)], _cells(np.column_stack([s_mm, *levels])))
    return Plot(
        "levels",
        "The level along the crack of every run, by its letter above, and their readings as dots.",
        lambda on: draw_side_by_side(sides, on),
        numbers,
    )


def _errors(sides: Sequence[Side]) -> Plot:
    return Plot(
        "errors",
        "Signed error of every run that has readings: above zero, it stands too high.",
        lambda on: draw_errors(sides, on),
    )


def draw_side_by_side(sides: Sequence[Side], on: FigureBase | None = None) -> FigureBase:
    letters = lettered(sides)
    with themed():
        figure = canvas(on, 9.0, 4.2)
        axes = figure.add_subplot()
        axes.axhline(0.0, color=INK, linewidth=1.0)
        drawn: set[str] = set()
        for index, side in enumerate(sides):
            if side.readings is not None and side.sheet not in drawn:
                drawn.add(side.sheet)
                kind = "" if side.readings.data == "measured" else f", {side.readings.data.upper()}"
                # Readings that runs share belong to none of them.
                alone = sum(other.sheet == side.sheet for other in sides) == 1
                axes.plot(
                    side.readings.s_mm,
                    side.readings.level_mm,
                    "o",
                    color=_colour(index) if alone else INK,
                    markersize=4,
                    markerfacecolor="none",
                    label=f"caliper{f' of {letters[index]}' if alone else ''}{kind}",
                )
            axes.plot(
                side.profile.s_mm, side.profile.level_mm, _stroke(index), color=_colour(index), label=letters[index]
            )
        axes.set_xlim(0, max(side.profile.s_mm[-1] for side in sides))
        label_axes(axes, ALONG, "level from the face (mm)", "Levels")
        put_legend_under_title(axes, columns=LEGEND_COLUMNS)
    return figure


def draw_errors(sides: Sequence[Side], on: FigureBase | None = None) -> FigureBase:
    letters = lettered(sides)
    with themed():
        figure = canvas(on, 9.0, 3.2)
        axes = figure.add_subplot()
        axes.axhline(0.0, color=INK, linewidth=1.0)
        for index, side in enumerate(sides):
            if side.readings is None:
                continue
            profile, readings = side.profile, side.readings
            error = Difference(profile.s_mm, profile.level_mm, readings.s_mm, readings.level_mm)
            axes.plot(error.x, error.value, _stroke(index), color=_colour(index), label=letters[index])
        axes.set_xlim(0, max(side.profile.s_mm[-1] for side in sides))
        label_axes(axes, ALONG, "error (mm)", "Signed error")
        put_legend_under_title(axes, columns=LEGEND_COLUMNS)
    return figure


def _colour(index: int) -> str:
    return COLOURS[index % len(COLOURS)]


def _stroke(index: int) -> str:
    # Another one than the neighbour's: runs that came out the same lie on each other.
    return STROKES[index % len(STROKES)]


def _cells(rows: Floats) -> list[list[Cell]]:
    return [[None if np.isnan(value) else float(value) for value in row] for row in rows]


def _rounded(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


def _plain(value: Any) -> str:
    return NONE if value is None else f"{value:g}" if isinstance(value, float) else str(value)
