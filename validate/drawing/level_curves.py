"""The curves: level, error and histogram along the crack. One function each; every axis has its unit."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from sealtwin.records import Comparison, Floats, Profile, Sections
from validate.drawing.theme import (
    INK,
    MEASURED,
    MUTED,
    SIMULATED,
    THIRD,
    canvas,
    draw_ground,
    label_axes,
    put_legend_under_title,
    themed,
)
from validate.wording import signed

OVER_LINES = {"facecolor": "#ffffff", "edgecolor": "none", "pad": 1.5}
ALONG = "s along the crack from the end where the nozzle starts (mm)"
MOST_BIN_LABELS = 16
"""That stand side by side across a page."""


def draw_profile(
    profile: Profile,
    sections: Sections,
    readings: Profile | None,
    comparison: Comparison | None,
    on: FigureBase | None = None,
) -> FigureBase:
    """Simulated level over the crack, with the caliper's means, their 95 % band and single readings."""
    with themed():
        figure = canvas(on, 9.0, 3.9)
        axes = figure.add_subplot()
        axes.axhline(0.0, color=INK, linewidth=1.0)
        floor_mm = -np.interp(profile.s_mm, sections.s_mm, sections.depth_mm)
        bottom_mm = float(floor_mm.min()) - 1.5
        draw_ground(axes, profile.s_mm, floor_mm, bottom_mm)
        for name, z_mm in (("face", 0.0), ("floor", float(floor_mm[-1]))):
            # Beside the plot, where no curve comes.
            beside = axes.get_yaxis_transform()
            axes.annotate(
                name, (1.0, z_mm), (4, 0), beside, textcoords="offset points", va="center", color=MUTED, fontsize=8
            )
        if readings is not None and comparison is not None:
            _draw_readings(axes, readings, comparison)
            axes.axhline(
                comparison.metrics["flat_level_mm"],
                color=THIRD,
                linewidth=1.2,
                linestyle=(0, (1, 2)),
                label=f"best flat level, {comparison.metrics['flat_level_mm']:.1f} mm",
            )
        axes.plot(profile.s_mm, profile.level_mm, color=SIMULATED, label="simulated")
        axes.set_xlim(0, profile.s_mm[-1])
        axes.set_ylim(bottom_mm, max(3.0, float(profile.level_mm.max()) + 1.5))
        label_axes(axes, ALONG, "level from the face (mm)", "Level of the sealant")
        put_legend_under_title(axes, columns=3)
    return figure


def draw_error(profile: Profile, readings: Profile, comparison: Comparison, on: FigureBase | None = None) -> FigureBase:
    """Simulated minus measured level along the crack, with the readings' own band about zero."""
    with themed():
        figure = canvas(on, 9.0, 2.9)
        axes = figure.add_subplot()
        s_mm, error_mm = _signed_error(profile, readings)
        band_mm, name = _band(comparison)
        if band_mm is not None:
            axes.fill_between(readings.s_mm, -band_mm, band_mm, color=MEASURED, alpha=0.25, linewidth=0, label=name)
        axes.fill_between(s_mm, 0.0, error_mm, color=SIMULATED, alpha=0.25, linewidth=0)
        axes.plot(s_mm, error_mm, color=SIMULATED, label="simulated - measured")
        axes.axhline(0.0, color=INK, linewidth=1.0)
        bias_mm = comparison.metrics["bias_mm"]
        axes.axhline(bias_mm, color=MUTED, linewidth=1.0, linestyle="--", label=f"bias {signed(bias_mm, 2)} mm")
        worst = int(np.argmin(np.abs(s_mm - comparison.worst_at_mm)))
        axes.plot(
            s_mm[worst],
            error_mm[worst],
            "o",
            color=INK,
            markersize=6,
            markerfacecolor="none",
            linestyle="none",
            label=f"worst, {comparison.worst_error_mm:.2f} mm at s = {comparison.worst_at_mm:.1f} mm",
            clip_on=False,
        )
        axes.set_xlim(0, profile.s_mm[-1])
        axes.margins(y=0.15)
        label_axes(axes, ALONG, "error (mm)", "Signed error: above zero, the simulation stands too high")
        put_legend_under_title(axes, columns=2)
    return figure


def draw_histogram(comparison: Comparison, on: FigureBase | None = None) -> FigureBase:
    """Mean absolute error in each 10 mm of the crack's length, as in the paper's Fig. 9b."""
    with themed():
        figure = canvas(on, 9.0, 2.9)
        axes = figure.add_subplot()
        bins = [part for part in comparison.metrics["error_by_bin"] if part["covered_mm"] > 0]
        begins_mm = np.array([part["from_mm"] for part in bins])
        widths_mm = np.array([part["to_mm"] for part in bins]) - begins_mm
        errors_mm = np.array([part["mean_error_mm"] for part in bins])
        axes.bar(begins_mm, errors_mm, widths_mm, align="edge", color=SIMULATED, edgecolor="white", linewidth=1.5)
        for begin_mm, width_mm, error_mm in zip(begins_mm, widths_mm, errors_mm, strict=True):
            axes.annotate(
                f"{error_mm:.2f}",
                (begin_mm + width_mm / 2, error_mm),
                (0, 3),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=8,
                rotation=90 if len(bins) > MOST_BIN_LABELS else 0,
                bbox=OVER_LINES,
                zorder=5,
            )
        axes.axhline(
            comparison.mean_error_mm,
            color=INK,
            linestyle="--",
            linewidth=1.0,
            label=f"mean error {comparison.mean_error_mm:.2f} mm",
        )
        if "mean_error_mm" in comparison.gate:
            axes.axhline(
                comparison.gate["mean_error_mm"],
                color=MEASURED,
                linestyle=(0, (1, 2)),
                label=f"gate for the mean, {comparison.gate['mean_error_mm']:g} mm",
            )
        axes.set_xlim(0, bins[-1]["to_mm"] if bins else None)
        # Upright numbers of many bins are three times as high.
        axes.margins(y=0.12 if len(bins) <= MOST_BIN_LABELS else 0.25)
        axes.grid(visible=False, axis="x")
        edges_mm = [*begins_mm, *(begins_mm[-1:] + widths_mm[-1:])][:: len(bins) // MOST_BIN_LABELS + 1]
        axes.set_xticks(edges_mm, [f"{edge_mm:.4g}" for edge_mm in edges_mm])
        label_axes(axes, ALONG, "mean |error| (mm)", "Error by 10 mm of the crack's length")
        put_legend_under_title(axes, columns=2)
    return figure


def _draw_readings(axes: Axes, readings: Profile, comparison: Comparison) -> None:
    band_mm, name = _band(comparison)
    if readings.repeats_mm is not None:
        for index, repeat_mm in enumerate(readings.repeats_mm.T):
            axes.plot(
                readings.s_mm,
                repeat_mm,
                "_",
                color=MEASURED,
                markersize=7,
                alpha=0.6,
                label="single readings" if index == 0 else None,
            )
    if band_mm is not None:
        axes.fill_between(
            readings.s_mm,
            readings.level_mm - band_mm,
            readings.level_mm + band_mm,
            color=MEASURED,
            alpha=0.3,
            linewidth=0,
            label=name,
        )
    kind = {"measured": "caliper", "reconstructed": "caliper, RECONSTRUCTED", "synthetic": "caliper, SYNTHETIC"}
    axes.plot(readings.s_mm, readings.level_mm, "o-", color=MEASURED, markersize=3.5, label=kind[readings.data])


def _band(comparison: Comparison) -> tuple[Floats | None, str]:
    """Half the width of the 95 % band about each reading, and what it holds: the whole budget where there is one."""
    assessed = comparison.metrics.get("uncertainty")
    if assessed is not None:
        return np.asarray(assessed["levels"]["band_95_mm"]), "95 % band of the readings, their whole budget"
    return comparison.metrics["readings"]["band_95_mm"], "95 % band of the readings, by repeats alone"


def _signed_error(profile: Profile, readings: Profile) -> tuple[Floats, Floats]:
    """On the union of both curves' stations, where both are."""
    s_mm = np.unique(np.concatenate([profile.s_mm, readings.s_mm]))
    low = max(profile.s_mm[0], readings.s_mm[0])
    s_mm = s_mm[(s_mm >= low) & (s_mm <= min(profile.s_mm[-1], readings.s_mm[-1]))]
    return s_mm, np.interp(s_mm, profile.s_mm, profile.level_mm) - np.interp(s_mm, readings.s_mm, readings.level_mm)
