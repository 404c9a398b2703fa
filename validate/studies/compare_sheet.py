"""The page of runs side by side: each by a number, since names are as long as people like."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sealtwin.records import Floats
from validate.comparison.verdict import leak
from validate.studies.kept_volume import volume_words
from validate.studies.replicates import Compared, held_out_mean_mm, held_out_table
from validate.studies.sheet import Cell, Grid, Numbers, Part, Plot, Sheet
from validate.studies.side_by_side import (
    Side,
    differing,
    first_with_readings,
    nearest,
    numbered,
    replicate_words,
)
from validate.studies.side_curves import draw_errors_of_runs, draw_levels_of_runs
from validate.wording import signed

NONE = "-"
FIGURES = {
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
"""Of a comparison: its key and its digits."""


def compare_sheet(sides: Sequence[Side]) -> Sheet:
    trials = [Compared(str(number), dict(side.metrics)) for number, side in enumerate(sides, start=1) if side.metrics]
    parts = [
        Part("Runs", [], [_key(sides)]),
        Part("Settings that differ", _same(sides), [_settings(sides)]),
        Part("Levels", [], [_levels(sides), *([_errors(sides)] if trials else [])]),
        Part("Figures", [], [_figures(sides)]),
    ]
    if trials:
        parts.append(
            Part("Held out", [_held_out_words(sides, trials), *replicate_words(sides)], [_held_out(sides, trials)])
        )
    return Sheet(
        title="Runs side by side",
        lead="Each run goes by its number in the first table.",
        cautions=_cautions(sides),
        finding=f"{len(sides)} runs, {len(trials)} of them held against readings. {_nearest(sides)}",
        key_figures=_key_figures(sides, trials),
        parts=parts,
    )


def _nearest(sides: Sequence[Side]) -> str:
    if not any(side.metrics and side.counts for side in sides):
        return "None can be called nearer than another."
    best = nearest(sides)
    if best is None:
        return "They are held against different readings, so no one of them is the nearest."
    error_mm = sides[best].metrics["mean_error_mm"]
    return f"Nearest is run {best + 1}, {sides[best].name}, {error_mm:.2f} mm off on average."


def _key_figures(sides: Sequence[Side], trials: Sequence[Compared]) -> list[tuple[str, str]]:
    best, held_out_mm = nearest(sides), held_out_mean_mm(_that_count(sides, trials))
    told = [("settings that differ", str(len(differing(sides))))]
    if best is not None:
        told.append(("nearest", f"run {best + 1}, {sides[best].metrics['mean_error_mm']:.2f} mm off"))
    if held_out_mm is not None:
        told.append(("mean error over held-out trials", f"{held_out_mm:.2f} mm"))
    return told


def _cautions(sides: Sequence[Side]) -> list[str]:
    kinds = sorted(
        {side.readings.data for side in sides if side.readings is not None and side.readings.data != "measured"}
    )
    told = [f"Not a validation: some readings are {' and '.join(kinds)}."] if kinds else []
    told += _leaks(sides)
    told += volume_words({number: side.volume_ratio for number, side in enumerate(sides, start=1)})
    told += _known_before(sides)
    return told + [
        f"Edited by hand since run {number} was made: {', '.join(side.edited)}. What is shown of it is as edited, and "
        "counts for no finding."
        for number, side in enumerate(sides, start=1)
        if side.edited
    ]


def _leaks(sides: Sequence[Side]) -> list[str]:
    through = [index for index, side in enumerate(sides) if side.escaped_particles]
    if not through:
        return []
    escaped = sum(sides[index].escaped_particles for index in through)
    return [f"{leak(escaped)} in {numbered(through)}, which must never happen. Please report it with the trial file."]


def _known_before(sides: Sequence[Side]) -> list[str]:
    """Of each set of readings that some run was tuned on and another calls unseen."""
    roles: dict[int, dict[str, list[int]]] = {}
    for index, first in enumerate(first_with_readings(sides)):
        if first is not None:
            roles.setdefault(first, {}).setdefault(sides[index].metrics["role"], []).append(index)
    return [
        f"Not held out: the readings of {numbered(by_role['held-out'])} served to calibrate "
        f"{numbered(by_role['calibrated-on'])}."
        for by_role in roles.values()
        if len(by_role) > 1
    ]


def _key(sides: Sequence[Side]) -> Grid:
    head = ["run", "mean error (mm)", "readings", "name"]
    rows, numbers = [], []
    for number, (side, first) in enumerate(zip(sides, first_with_readings(sides), strict=True), start=1):
        readings = NONE
        if side.readings is not None and first is not None:
            readings = f"{side.readings.data}, {side.metrics['role']}"
            readings += f", the same as of run {first + 1}" if first + 1 < number else ""
        error_mm = side.metrics.get("mean_error_mm")
        rows.append([str(number), NONE if error_mm is None else f"{error_mm:.2f}", readings, side.name])
        numbers.append([number, error_mm, readings, side.name])
    return Grid("Numbers and names", head, rows, "runs", Numbers(["run", "mean_error_mm", "readings", "name"], numbers))


def _same(sides: Sequence[Side]) -> list[str]:
    return [] if differing(sides) else ["No setting differs."]


def _settings(sides: Sequence[Side]) -> Grid:
    rows = [[name, *(_plain(value) for value in values)] for name, values in differing(sides).items()]
    return Grid("By run", ["setting", *_numbers(sides)], rows, "settings", Numbers(["setting", *_named(sides)], rows))


def _figures(sides: Sequence[Side]) -> Grid:
    rows, numbers = [], []
    for label, (key, digits) in FIGURES.items():
        values = [side.metrics.get(key) for side in sides]
        rows.append([label, *(NONE if value is None else f"{value:.{digits}f}" for value in values)])
        numbers.append([label, *values])
    for label in dict.fromkeys(name for side in sides for name in side.facts):
        values = [side.facts.get(label) for side in sides]
        rows.append([label, *(NONE if value is None else _rounded(value) for value in values)])
        numbers.append([label, *values])
    return Grid("By run", ["figure", *_numbers(sides)], rows, "figures", Numbers(["figure", *_named(sides)], numbers))


def _that_count(sides: Sequence[Side], trials: Sequence[Compared]) -> list[Compared]:
    return [trial for trial in trials if sides[int(trial.name) - 1].counts]


def _held_out_words(sides: Sequence[Side], trials: Sequence[Compared]) -> str:
    held_out_mm = held_out_mean_mm(_that_count(sides, trials))
    if held_out_mm is None and any(trial.held_out for trial in trials):
        return "No run that was held out counts: each was edited by hand, or particles went through a wall."
    if held_out_mm is None:
        return "No run was held against readings that nobody tuned on: every error here is what a fit left over."
    return f"Mean error over the held-out trials: {held_out_mm:.2f} mm."


def _held_out(sides: Sequence[Side], trials: Sequence[Compared]) -> Grid:
    head = ["run", "role", "readings", "mean error (mm)", "95 % interval (mm)", "bias (mm)", "worst (mm)"]
    head += ["beats the best flat level", "beats the volume's level"]
    rows, numbers = [], []
    for row in held_out_table(trials):
        interval = NONE if row.low_mm is None or row.high_mm is None else f"{row.low_mm:.2f} to {row.high_mm:.2f}"
        beats = [
            NONE if value is None else "yes" if value else "no"
            for value in (row.beats_flat_level, row.beats_volume_balance)
        ]
        figures = [f"{row.mean_error_mm:.3f}", interval, signed(row.bias_mm, 3), f"{row.worst_error_mm:.2f}"]
        rows.append([row.name, row.role, row.data, *figures, *beats])
        cells: list[Cell] = [row.name, sides[int(row.name) - 1].name, row.role, row.data]
        cells += [row.mean_error_mm, row.low_mm, row.high_mm, row.bias_mm, row.worst_error_mm, *beats]
        numbers.append(cells)
    columns = ["run", "trial", "role", "readings", "mean_error_mm", "low_mm", "high_mm", "bias_mm", "worst_error_mm"]
    columns += ["beats_flat_level", "beats_volume_balance"]
    return Grid("Held-out trials first", head, rows, "held-out", Numbers(columns, numbers))


def _levels(sides: Sequence[Side]) -> Plot:
    s_mm = sides[0].profile.s_mm
    levels = [np.interp(s_mm, side.profile.s_mm, side.profile.level_mm, right=np.nan) for side in sides]
    columns = ["s_mm", *(f"{name}: level_mm" for name in _named(sides))]
    firsts = [first for first in first_with_readings(sides) if first is not None]
    shared = len(firsts) > len(set(firsts))
    told = "The level along the crack of every run, by its number."
    if firsts:
        told += " Circles are readings, in the colour of their run"
        told += ", or in that of these words where several runs share them." if shared else "."
    return Plot(
        "levels",
        told,
        lambda on: draw_levels_of_runs(sides, on),
        Numbers(columns, _cells(np.column_stack([s_mm, *levels]))),
    )


def _errors(sides: Sequence[Side]) -> Plot:
    return Plot(
        "errors",
        "Signed error of every run that has readings, by its number.",
        lambda on: draw_errors_of_runs(sides, on),
    )


def _numbers(sides: Sequence[Side]) -> list[str]:
    return [str(index + 1) for index in range(len(sides))]


def _named(sides: Sequence[Side]) -> list[str]:
    """For a CSV, which is read without the page."""
    return [f"{number} {side.name}" for number, side in enumerate(sides, start=1)]


def _cells(rows: Floats) -> list[list[Cell]]:
    return [[None if np.isnan(value) else float(value) for value in row] for row in rows]


def _rounded(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


def _plain(value: Any) -> str:
    return NONE if value is None else f"{value:g}" if isinstance(value, float) else str(value)
