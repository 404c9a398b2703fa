"""Curves of one trial: level, error, its distribution, histogram and uncertainty, and the weighed cavity."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sealtwin.core.records import Profile, Sections
from sealtwin.core.solid_figures import WeighedCavity
from validate.figures import theme
from validate.intervals import StationErrors
from validate.metrics.curve_distances import level_difference
from validate.result import Comparison
from validate.uncertainty.validation import COVERAGE

OVER_LINES = {"facecolor": theme.CARD, "edgecolor": "none", "pad": 1.5}
DOTTED = (0, (1, 2))
MOST_BIN_LABELS = 10  # Most bins whose labels fit side by side


def draw_levels(
    axes: Axes,
    profile: Profile | None,
    sections: Sections | None,
    readings: Profile | None,
    comparison: Comparison | None,
    *,
    title: str | None = "Level of the sealant",
    colour: str = theme.SIMULATED,
    label: str = "simulated",
) -> Figure:
    """Draw levels along a crack on ``axes``. Give ``profile`` or ``readings`` or both, and call it inside ``themed``.

    The crack's floor is drawn only with ``sections``, the band of the readings only with ``comparison``. ``colour``
    and ``label`` are those of the simulated level. Without a ``title`` the axes keep their own, and a plain legend.
    """
    curves = [curve for curve in (profile, readings) if curve is not None]
    s_mm = curves[0].s_mm
    bottom_mm = min(float(curve.level_mm.min()) for curve in curves) - 1.5
    theme.draw_face(axes)
    marks = [("face", 0.0)]
    if sections is not None:
        floor_mm = -np.interp(s_mm, sections.s_mm, sections.depth_mm)
        bottom_mm = float(floor_mm.min()) - 1.5
        theme.draw_ground(axes, s_mm, floor_mm, bottom_mm)
        marks.append(("floor", float(floor_mm[-1])))
    # To the right of the plot, outside all curves.
    beside = axes.get_yaxis_transform()
    for name, z_mm in marks:
        axes.annotate(
            name, (1.0, z_mm), (4, 0), beside, textcoords="offset points", va="center", color=theme.MUTED, fontsize=8
        )
    if readings is not None:
        _draw_readings(axes, readings, comparison)
    if comparison is not None and any(one.numbers for one in comparison.baselines):
        flat_mm = comparison.errors.flat_level_mm
        name = f"best flat level, {flat_mm:.1f} mm"
        axes.axhline(flat_mm, color=theme.THIRD, linewidth=1.2, linestyle=DOTTED, label=name)
    if profile is not None:
        axes.plot(profile.s_mm, profile.level_mm, color=colour, label=label)
    axes.set_xlim(0, s_mm[-1])
    axes.set_ylim(bottom_mm, max(3.0, float(curves[0].level_mm.max()) + 1.5))
    if title is not None:
        return theme.label_axes(axes, theme.ALONG, theme.LEVEL, title, legend=2)
    axes.set(xlabel=theme.ALONG, ylabel=theme.LEVEL)
    axes.legend()
    return axes.figure.get_figure(root=True)


def _draw_readings(axes: Axes, readings: Profile, comparison: Comparison | None) -> None:
    s_mm, level_mm = readings.s_mm, readings.level_mm
    if readings.repeats_mm is not None:
        lines = axes.plot(s_mm, readings.repeats_mm, "_", color=theme.MEASURED, markersize=7, alpha=0.6)
        lines[0].set_label("single readings")
    if comparison is not None and comparison.uncertainty is not None:
        band_mm = comparison.uncertainty.levels.profile_band_95_mm
        theme.draw_band(axes, s_mm, level_mm, band_mm, theme.MEASURED, 0.3, theme.BAND)
    kind = "caliper" if readings.data == "measured" else f"caliper, {readings.data.upper()}"
    axes.plot(s_mm, level_mm, "o-", color=theme.MEASURED, markersize=3.5, label=kind)


@theme.themed()
def draw_histogram(comparison: Comparison) -> Figure:
    """Draw the mean absolute error in each 10 mm of the crack's length, as in the paper's Fig. 9b."""
    axes = theme.plate(2.9).add_subplot()
    bins = [part for part in comparison.distances.by_bin if part.covered_mm > 0]
    begins_mm = np.array([part.from_mm for part in bins])
    widths_mm = np.array([part.to_mm for part in bins]) - begins_mm
    errors_mm = np.array([part.mean_error_mm for part in bins])
    bars = axes.bar(
        begins_mm, errors_mm, widths_mm, align="edge", color=theme.SIMULATED, edgecolor="white", linewidth=1.5
    )
    if len(bins) <= MOST_BIN_LABELS:
        axes.bar_label(bars, fmt="{:.2f}", padding=3, zorder=5, fontsize=8, bbox=OVER_LINES)
    mean_mm, gate = comparison.mean_error_mm, comparison.gate
    axes.axhline(mean_mm, color=theme.INK, linestyle="--", linewidth=1.0, label=f"mean error {mean_mm:.2f} mm")
    if gate is not None:
        limit_mm = gate.mean_error_mm
        axes.axhline(limit_mm, color=theme.MEASURED, linestyle=DOTTED, label=f"gate for the mean, {limit_mm:g} mm")
    axes.set_xlim(0, bins[-1].to_mm if bins else None)
    axes.margins(y=0.12)
    axes.grid(visible=False, axis="x")
    edges_mm = [*begins_mm, *(begins_mm[-1:] + widths_mm[-1:])][:: len(bins) // MOST_BIN_LABELS + 1]
    axes.set_xticks(edges_mm, [f"{edge_mm:.3g}" for edge_mm in edges_mm])
    return theme.label_axes(axes, theme.ALONG, "mean |error| (mm)", "Error by place, over each 10 mm", legend=2)


@theme.themed()
def draw_distribution(profile: Profile, readings: Profile, comparison: Comparison) -> Figure:
    """Draw the share of the crack's length on which the error is at most x. It is exact between stations."""
    axes = theme.plate(2.9).add_subplot()
    size = level_difference(profile, readings).size
    within_mm = np.linspace(0.0, comparison.worst_error_mm, 200)
    percent = [100 * size.share_below(limit_mm) for limit_mm in within_mm[:-1]] + [100.0]
    axes.plot(within_mm, percent, color=theme.SIMULATED, label="share of the length")
    for share, dashes in ((50, "-"), (95, "--")):
        at_mm = size.quantile(share / 100)
        axes.plot([0, at_mm, at_mm], [share, share, 0], color=theme.MUTED, linestyle=dashes, linewidth=1.0,
                  label=f"{share} % within {at_mm:.2f} mm")  # fmt: skip
    axes.set_xlim(0, within_mm[-1] or None)
    axes.set_ylim(0, 103)
    return theme.label_axes(
        axes, "|error| of at most (mm)", "share of the length (%)", "Distribution of the error", legend=2
    )


@theme.themed()
def draw_uncertainty(stations: StationErrors) -> Figure:
    """Draw the error at each station above its standard uncertainties."""
    s_mm, error_mm, validation_mm = stations.s_mm, stations.error_mm, stations.validation_mm
    upper, lower = theme.plate(3.6).subplots(2, 1, sharex=True, height_ratios=(3, 2))
    off, half_mm = stations.off, COVERAGE * validation_mm
    theme.draw_face(upper)
    upper.errorbar(s_mm, error_mm, half_mm, fmt="none", ecolor=theme.MUTED, elinewidth=1.0, capsize=2.5, label="± 2 u")
    theme.draw_band(upper, s_mm, 0.0, stations.profile_mm, theme.MUTED, 0.2, theme.BAND)
    for which, fill, name in ((off, theme.SIMULATED, "outside it"), (~off, theme.CARD, "inside")):
        upper.plot(
            s_mm[which], error_mm[which], "o", color=theme.SIMULATED, markerfacecolor=fill, markersize=5, label=name
        )
    theme.label_axes(upper, "", "E (mm)", "Error at the stations", legend=2)
    parts = (
        (stations.data_mm, "readings", theme.MEASURED, "-"),
        (stations.numerics_mm, "numerics", theme.SIMULATED, "--"),
        (stations.inputs_mm, "inputs", theme.THIRD, "-."),
    )
    computed = [part for part in parts if part[0] is not None]
    for part_mm, name, colour, style in computed:
        lower.plot(s_mm, part_mm, style, color=colour, label=name)
    if len(computed) > 1:
        lower.plot(s_mm, validation_mm, color=theme.INK, linewidth=1.0, label="all together")
    lower.set_ylim(bottom=0.0)
    return theme.label_axes(lower, theme.ALONG, "u (mm)", "Standard uncertainties", legend=2)


@theme.themed()
def draw_weighed_fill(weighed: WeighedCavity) -> Figure:
    """Draw the weighed volumes over their levels, with the fitted walls."""
    axes = theme.plate(2.6).subplots()
    levels_mm, volumes_ml = np.array(weighed.levels_mm), np.array(weighed.volumes_mm3) / 1e3
    fitted_ml = volumes_ml - np.array(weighed.misfits_mm3) / 1e3
    errors_ml = 2 * np.array(weighed.misfit_sds_mm3) / 1e3
    points = {"fmt": "o", "color": theme.MEASURED, "markersize": 5, "markerfacecolor": "none", "capsize": 3}
    axes.errorbar(levels_mm, volumes_ml, yerr=errors_ml, label="weighed, ± 2 sd", **points)
    below_mm, below_ml = np.append(-weighed.depth_mm, levels_mm), np.append(0.0, fitted_ml)
    axes.plot(below_mm, below_ml, color=theme.SIMULATED, label="fitted walls")
    return theme.label_axes(axes, "mean level from the face (mm)", "liquid (ml)", "Liquid below each level", legend=2)
