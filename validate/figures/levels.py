"""Curves of one trial: level, histogram of the error, uncertainty at the stations, and the weighed cavity."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sealtwin.core.records import Profile, Sections
from sealtwin.core.solid_figures import WeighedCavity
from validate.figures.page import part_of
from validate.figures.theme import (
    ALONG,
    BAND,
    CARD,
    INK,
    LEVEL,
    MEASURED,
    MUTED,
    SIMULATED,
    THIRD,
    caliper_label,
    draw_band,
    draw_curve,
    draw_face,
    draw_ground,
    label_axes,
    plate,
    themed,
)
from validate.intervals import StationErrors
from validate.result import Comparison
from validate.uncertainty.validation import COVERAGE

OVER_LINES = {"facecolor": CARD, "edgecolor": "none", "pad": 1.5}
DOTTED = (0, (1, 2))
MAX_BIN_LABELS = 10  # Largest number of bins whose labels fit side by side


def draw_levels(
    axes: Axes,
    profile: Profile | None,
    sections: Sections | None,
    readings: Profile | None,
    comparison: Comparison | None,
    *,
    title: str | None = "Level of the sealant",
    colour: str = SIMULATED,
    label: str = "simulated",
) -> Figure:
    """Draw levels along a crack on ``axes``. Call this function inside ``themed``.

    Give ``profile``, ``readings`` or both. The floor of the crack needs ``sections``, and the band of the readings
    needs ``comparison``. ``colour`` and ``label`` are for the simulated level. Without a ``title`` the axes keep their
    own title and a plain legend.
    """
    curves = [curve for curve in (profile, readings) if curve is not None]
    s_mm, bottom_mm = curves[0].s_mm, min(float(curve.level_mm.min()) for curve in curves) - 1.5
    draw_face(axes)
    if sections is not None:
        floor_mm = -np.interp(s_mm, sections.s_mm, sections.depth_mm)
        bottom_mm = float(floor_mm.min()) - 1.5
        draw_ground(axes, s_mm, floor_mm, bottom_mm)
    if readings is not None:
        if readings.repeats_mm is not None:
            lines = axes.plot(readings.s_mm, readings.repeats_mm, "_", color=MEASURED, markersize=7, alpha=0.6)
            lines[0].set_label("single readings")
        half_mm = part_of(comparison, "uncertainty.levels.profile_band_95_mm")
        draw_curve(
            axes,
            readings.s_mm,
            readings.level_mm,
            "o-",
            half_mm,
            band=BAND,
            color=MEASURED,
            markersize=3.5,
            label=caliper_label(readings),
        )
    if comparison is not None and any(baseline.numbers for baseline in comparison.baselines):
        flat_mm = comparison.errors.flat_level_mm
        axes.axhline(flat_mm, color=THIRD, linewidth=1.2, linestyle=DOTTED, label=f"best flat level, {flat_mm:.1f} mm")
    if profile is not None:
        axes.plot(profile.s_mm, profile.level_mm, color=colour, label=label)
    axes.set_xlim(0, s_mm[-1])
    axes.set_ylim(bottom_mm, max(3.0, float(curves[0].level_mm.max()) + 1.5))
    if title is not None:
        return label_axes(axes, ALONG, LEVEL, title, legend=2)
    axes.set(xlabel=ALONG, ylabel=LEVEL)
    axes.legend()
    return axes.figure.get_figure(root=True)


@themed()
def draw_histogram(comparison: Comparison) -> Figure:
    """Draw the mean absolute error in each 10 mm of the crack's length, as in the paper's Fig. 9b."""
    axes, gate = plate(2.9).add_subplot(), comparison.gate
    bins = [part for part in comparison.distances.by_bin if part.covered_mm > 0]
    edges_mm = [*(part.from_mm for part in bins), *(part.to_mm for part in bins[-1:])]
    errors_mm = np.array([part.mean_error_mm for part in bins], float)
    bars = axes.bar(
        edges_mm[:-1], errors_mm, np.diff(edges_mm), align="edge", color=SIMULATED, edgecolor="white", linewidth=1.5
    )
    if len(bins) <= MAX_BIN_LABELS:
        axes.bar_label(bars, fmt="{:.2f}", padding=3, zorder=5, fontsize=8, bbox=OVER_LINES)
    mean = f"mean error {comparison.mean_error_mm:.2f} mm"
    axes.axhline(comparison.mean_error_mm, color=INK, linestyle="--", linewidth=1.0, label=mean)
    if gate is not None:
        limit = f"gate for the mean, {gate.mean_error_mm:g} mm"
        axes.axhline(gate.mean_error_mm, color=MEASURED, linestyle=DOTTED, label=limit)
    axes.set_xlim(0, edges_mm[-1])
    axes.margins(y=0.12)
    axes.grid(visible=False, axis="x")
    ticks_mm = edges_mm[:: len(bins) // MAX_BIN_LABELS + 1]
    axes.set_xticks(ticks_mm, [f"{edge_mm:.3g}" for edge_mm in ticks_mm])
    return label_axes(axes, ALONG, "mean |error| (mm)", "Error by place, over each 10 mm", legend=2)


@themed()
def draw_uncertainty(stations: StationErrors) -> Figure:
    """Draw the error at each station, and below it the standard uncertainties."""
    s_mm, error_mm, off = stations.s_mm, stations.error_mm, stations.off
    upper, lower = plate(3.6).subplots(2, 1, sharex=True, height_ratios=(3, 2), gridspec_kw={"hspace": 0.65})
    draw_face(upper)
    upper.errorbar(
        s_mm,
        error_mm,
        COVERAGE * stations.validation_mm,
        fmt="none",
        ecolor=MUTED,
        elinewidth=1.0,
        capsize=2.5,
        label="± 2 u",
    )
    draw_band(upper, s_mm, 0.0, stations.profile_mm, MUTED, 0.2, BAND)
    for which, fill, name in ((off, SIMULATED, "outside it"), (~off, CARD, "inside")):
        upper.plot(s_mm[which], error_mm[which], "o", color=SIMULATED, markerfacecolor=fill, markersize=5, label=name)
    label_axes(upper, "", "E (mm)", "Error at the stations", legend=2)
    parts = (
        (stations.data_mm, "-", MEASURED, "readings"),
        (stations.numerics_mm, "--", SIMULATED, "numerics"),
        (stations.inputs_mm, "-.", THIRD, "inputs"),
    )
    for part_mm, dashes, colour, name in parts:
        if part_mm is not None:
            lower.plot(s_mm, part_mm, dashes, color=colour, label=name)
    if len(lower.lines) > 1:
        lower.plot(s_mm, stations.validation_mm, color=INK, linewidth=1.0, label="all together")
    lower.set_ylim(bottom=0.0)
    return label_axes(lower, ALONG, "u (mm)", "Standard uncertainties", legend=2)


@themed()
def draw_weighed_fill(weighed: WeighedCavity) -> Figure:
    """Draw the weighed volumes over their levels, with the curve of the fitted walls."""
    axes = plate(2.6).subplots()
    levels_mm, volumes_ml = np.array(weighed.levels_mm), np.array(weighed.volumes_mm3) / 1e3
    fitted_ml = volumes_ml - np.array(weighed.misfits_mm3) / 1e3
    errors_ml = 2 * np.array(weighed.misfit_sds_mm3) / 1e3
    axes.errorbar(
        levels_mm,
        volumes_ml,
        yerr=errors_ml,
        label="weighed, ± 2 sd",
        fmt="o",
        color=MEASURED,
        markersize=5,
        markerfacecolor="none",
        capsize=3,
    )
    below_mm, below_ml = np.append(-weighed.depth_mm, levels_mm), np.append(0.0, fitted_ml)
    axes.plot(below_mm, below_ml, color=SIMULATED, label="fitted walls")
    return label_axes(axes, "mean level from the face (mm)", "liquid (ml)", "Liquid below each level", legend=2)
