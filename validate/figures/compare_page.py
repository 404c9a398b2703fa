"""Page that compares finished runs: their figures, the settings that differ, and their levels in one plot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sealtwin.core.facts import Fact
from sealtwin.core.records import Profile
from validate.figures.page import FigureColumn, FigureTable, Page, Plot, Section
from validate.figures.theme import (
    ALONG,
    INK,
    LEVEL,
    MEASURED,
    SIMULATED,
    THIRD,
    caliper_label,
    label_axes,
    themed,
    wide_axes,
)
from validate.metrics.verdict import SOUND, beside_baselines, kept_volume
from validate.result import Comparison
from validate.units import setting_words

SAME_MM = 0.01
"""Largest difference in mm, at any station, between copies of the same readings: the last digit of a caliper. Repeated
readings differ by ten times as much."""
COLOURS = (SIMULATED, MEASURED, THIRD, "#cc79a7", "#e69f00", "#9467bd", INK)
"""Colours of the runs: Okabe and Ito's without sky blue, because the first colour is shown as sky blue on a dark page.
"""
STAGE_NUMBER = "stage_number."  # Prefix of the stage numbers among the settings


@dataclass(frozen=True)
class Side:
    """One run of the comparison."""

    name: str  # Name of the trial, and the run folder
    settings: Mapping[str, Any]  # Settings and stage numbers by dotted name
    profile: Profile
    readings: Profile | None
    comparison: Comparison | None  # None without readings
    volume_ratio: float  # Settled volume, divided by the dispensed volume
    escaped_particles: int = 0  # Number of particles that went through a wall
    edited: Sequence[str] = ()  # Names of its files that were changed after the run
    fluid_warnings: Sequence[Fact] = ()  # Faults of its fluid

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


Sides = Sequence[Side]


def differing(sides: Sides) -> dict[str, list[Any]]:
    """Return the settings that differ among the runs, with each run's value. It is None if a run does not set it."""
    by_name = {name: [side.settings.get(name) for side in sides] for side in sides for name in side.settings}
    return {name: values for name, values in by_name.items() if any(value != values[0] for value in values)}


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


def ranking(sides: Sides) -> str:
    """Return a sentence that names the ranked run with the smallest mean error, or says why none is named.

    Runs with different readings are not ranked, because some readings are easier to fit than others.
    """
    ranked = {
        number: side.comparison
        for number, side in enumerate(sides, start=1)
        if side.comparison is not None and not side.unranked
    }
    if not ranked:
        return "No run with readings is ranked, so none is nearest."
    if any(name.startswith(STAGE_NUMBER) for name in differing(sides)):
        return "The runs have different stage numbers, so none is nearest."
    if len({first_with_readings(sides)[number - 1] for number in ranked}) > 1:
        return "The runs have different readings, so none is nearest."
    best = min(ranked, key=lambda number: ranked[number].mean_error_mm)
    return f"Run {best} is nearest to the readings: {sides[best - 1].name}. {beside_baselines(ranked[best])}"


def compare_page(sides: Sides, cautions: Sequence[str] = ()) -> Page:
    """Return the page that compares ``sides``. ``cautions`` are shown before the cautions about the runs."""
    settings = differing(sides)
    columns = [FigureColumn("setting", list(settings))]
    for number, values in enumerate(zip(*settings.values(), strict=True), start=1):
        texts = [None if value is None else setting_words(value) for value in values]
        columns.append(FigureColumn(f"run {number}", texts))
    caption = "Level along the crack of each run, labelled with its number. Circles are readings."
    compared = sum(side.comparison is not None for side in sides)
    return Page(
        title="Runs side by side",
        lead="The tables and the plot name a run by its number.",
        cautions=[*cautions, *_cautions(sides)],
        finding=f"{len(sides)} runs, {compared} of them with readings. {ranking(sides)}",
        key_figures=[("settings that differ", str(len(settings)))],
        sections=[
            Section("Runs", [runs_table(sides)]),
            Section("Settings that differ", [FigureTable("By run", "settings", columns)]),
            Section("Levels", [Plot("levels", caption, lambda: _draw_levels(sides))]),
        ],
    )


def runs_table(sides: Sides) -> FigureTable:
    """Return the table with a row for each run. Its numbers are also written to compare.json."""
    readings, intervals = list[str | None](), list[str | None]()
    for number, (side, first) in enumerate(zip(sides, first_with_readings(sides), strict=True), start=1):
        same = f", the same as for run {first + 1}" if first is not None and first + 1 < number else ""
        comparison = side.comparison
        readings.append(comparison and f"{comparison.readings_data}, {comparison.role}{same}")
        ends_mm = comparison and comparison.interval_95_mm
        intervals.append(ends_mm and "{:.2f} to {:.2f}".format(*ends_mm))
    columns = [
        FigureColumn("run", range(1, len(sides) + 1), name="number"),
        FigureColumn("name", "name"),
        FigureColumn("readings", readings),
        FigureColumn("mean error (mm)", "comparison.mean_error_mm", "{:.3f}".format, "mean_error_mm"),
        FigureColumn("95 % interval (mm)", intervals, name="interval_95_mm"),
        FigureColumn("bias (mm)", "comparison.bias_mm", "{:.3f}".format, "bias_mm"),
        FigureColumn("worst error (mm)", "comparison.errors.worst_error_mm", "{:.2f}".format, "worst_error_mm"),
        FigureColumn("beats its baselines", "comparison.beats_baseline", setting_words, "beats_baseline"),
        FigureColumn("volume kept", "volume_ratio", "{:.3f}".format, "volume_ratio"),
        FigureColumn("", [side.unranked or None for side in sides], name="not_ranked"),
    ]
    return FigureTable("Figures of the runs", "runs", columns, sides)


def _cautions(sides: Sides) -> list[str]:
    kinds = sorted({side.readings.data for side in sides if side.readings is not None} - {"measured"})
    sentences = [f"Not a validation: some readings are {' and '.join(kinds)}."] if kinds else []
    reasons = [f"run {number}, because {side.unranked}" for number, side in enumerate(sides, start=1) if side.unranked]
    return [*sentences, f"Not ranked: {'; '.join(reasons)}."] if reasons else sentences


@themed()
def _draw_levels(sides: Sides) -> Figure:
    """Draw levels as lines, and readings as circles in the colour of the first run that has them."""
    _, axes = wide_axes(4.2, face=True)
    for index, (side, first) in enumerate(zip(sides, first_with_readings(sides), strict=True)):
        axes.plot(side.profile.s_mm, side.profile.level_mm, color=COLOURS[index], label=str(index + 1))
        if side.readings is not None and first == index:
            curve, label = (side.readings.s_mm, side.readings.level_mm), caliper_label(side.readings)
            axes.plot(*curve, "o", color=COLOURS[index], markerfacecolor="none", label=label)
    return label_axes(axes, ALONG, LEVEL, "Levels", len(sides))
