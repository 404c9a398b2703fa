"""Figures of a mapped study, as in the paper: levels (Fig.

7), error over two settings (8, 10), fills (6), cost (11).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from string import ascii_lowercase
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from sealtwin.core.records import Floats
from sealtwin.core.vtk_files import Frame
from validate.figures import theme
from validate.figures.chart import Axis, Chart, HeldRun
from validate.figures.figure_sheet import wide_axes
from validate.figures.particles import ColourScale, add_bar, ages_of
from validate.figures.snapshots import FillScene

CELLS = 240  # Number of the map's cells along each axis, finer than a page shows
LINE_COLOURS = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.3, 0.88, 256)))
"""Viridis without its ends: one is invisible on a dark page, the other on a light one."""
HALO = [withStroke(linewidth=2.5, foreground=theme.INK)]  # Dark edge of white marks on the map
MOST_LABELS = 15  # Most runs with number and error beside their point; others have the number alone
STEPS = 12  # Number of equal steps of the number of moving particles
FEWEST = 3  # Least number of frames in a step, and of steps with a median for a straight line


@theme.themed()
def draw_levels_of_study(chart: Chart) -> Figure:
    """Draw the levels of all runs and the readings, with the nearest run in bold."""
    figure, axes = wide_axes(4.2, face=True)
    curves = [np.column_stack([run.profile.s_mm, run.profile.level_mm]) for run in chart.runs]
    axes.add_collection(LineCollection(curves, colors=theme.MUTED, linewidths=0.7, alpha=0.5, rasterized=True))
    readings, best = chart.readings, chart.best
    theme.draw_band(axes, readings.s_mm, readings.level_mm, chart.band_mm, theme.MEASURED, 0.3)
    (caliper,) = axes.plot(readings.s_mm, readings.level_mm, "--o", color=theme.MEASURED, markersize=3.5)
    (nearest,) = axes.plot(best.profile.s_mm, best.profile.level_mm, color=theme.SIMULATED, linewidth=3.0)
    s_mm, level_mm = np.vstack([*curves, np.column_stack([readings.s_mm, readings.level_mm])]).T
    axes.set_xlim(0, s_mm.max())
    axes.set_ylim(level_mm.min() - 1, level_mm.max() + 1)
    theme.label_axes(axes, theme.ALONG, theme.LEVEL, f"Levels of {len(chart.runs)} runs")
    kind = "" if readings.data == "measured" else f", {readings.data.upper()}"
    axes.legend(
        [Line2D([], [], color=theme.MUTED, linewidth=0.7), nearest, caliper],
        ["a run", f"nearest: {chart.said(best)}, {best.mean_error_mm:.2f} mm off", f"caliper{kind}, 95 % band"],
        loc="lower right",
    )
    return figure


def scale_axis(axes: Axes, name: Literal["x", "y"], setting: Axis) -> None:
    """Make an axis of a plot logarithmic if the axis of its setting is. Its labels are then plain numbers."""
    if setting.logarithmic:
        axes.set(**{f"{name}scale": "log"})
        (axes.xaxis if name == "x" else axes.yaxis).set_major_formatter("{x:g}")


@theme.themed()
def draw_influence(chart: Chart, of: int) -> Figure:
    """Draw the mean error over axis ``of``: a line for each value of the other axis on a grid of runs, else points."""
    along, other = chart.axes[of], chart.axes[1 - of]
    figure, axes = wide_axes(4.2)
    places, values = (np.array([run.at[index] for run in chart.runs]) for index in (of, 1 - of))
    norm = (LogNorm if other.logarithmic else Normalize)(other.values[0], other.values[-1])
    if other.is_graded(len(chart.runs)):
        for value in other.values:
            here = np.flatnonzero(values == value)
            here = here[np.argsort(places[here])]
            colour = LINE_COLOURS(norm(value))
            axes.plot(places[here], chart.errors_mm[here], "o-", color=colour, markersize=3, linewidth=1.2)
    else:
        axes.scatter(places, chart.errors_mm, c=values, cmap=LINE_COLOURS, norm=norm, s=18)
    if along.is_graded(len(chart.runs)):
        mean_mm = [chart.errors_mm[places == value].mean() for value in along.values]
        axes.plot(along.values, mean_mm, color=theme.INK, linewidth=3.0, label=f"mean over {other.name}")
        axes.legend(loc="best")
    add_bar(figure, ColourScale(other.label, LINE_COLOURS, norm), [axes], pad=0.01)
    scale_axis(axes, "x", along)
    axes.set_ylim(0, None)
    theme.label_axes(axes, along.label, "mean error (mm)", f"Influence of {along.name}")
    return figure


@theme.themed()
def draw_points(chart: Chart, chosen: Sequence[HeldRun] = ()) -> Figure:
    """Draw each run as a point in the colour of its mean error, with its number and error, and no surface between.

    Runs that are not ranked are empty squares. ``chosen`` runs have their letters.
    """
    figure, axes = wide_axes(5.0)
    at, best = np.array([run.at for run in chart.runs]), chart.best
    drawn = axes.scatter(
        *at.T, c=chart.errors_mm, cmap=LINE_COLOURS, s=130, edgecolors=theme.INK, label="a run", zorder=3
    )
    figure.colorbar(drawn, ax=axes, pad=0.01).set_label("mean error (mm)")
    label = f"nearest: {chart.said(best)}, {best.mean_error_mm:.2f} mm"
    ring: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": theme.INK, "linestyle": "none"}
    axes.plot(*best.at, "o", **ring, markersize=18, markeredgewidth=1.6, label=label)
    letters = {run.number: f"{letter}, " for letter, run in zip(ascii_lowercase, chosen, strict=False)}
    names = [
        (run.at, f"{letters.get(run.number, '')}run {run.number}", f": {run.mean_error_mm:.2f} mm")
        for run in chart.runs
    ]
    across, up = (axis.setting for axis in chart.axes)
    pairs = [(each.number, (each.settings.get(across), each.settings.get(up))) for each in chart.excluded]
    unranked = [(number, pair) for number, pair in pairs if all(map(_has_place, chart.axes, pair))]
    if unranked:
        axes.plot(*zip(*(pair for _, pair in unranked), strict=True), "s", **ring, markersize=9, label="not ranked")
    names += [(pair, f"run {number}", ": not ranked") for number, pair in unranked]
    for pair, name, result in names:
        text = f"{name}{result}" if len(names) <= MOST_LABELS else name.replace("run ", "")
        axes.annotate(text, pair, (0, 13), textcoords="offset points", ha="center", fontsize=8.0)
    scale_axis(axes, "x", chart.axes[0])
    scale_axis(axes, "y", chart.axes[1])
    # Space for labels at the edges.
    axes.margins(0.14, 0.16)
    theme.label_axes(axes, chart.axes[0].label, chart.axes[1].label, "Mean error of each run against the readings")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize=8.0)
    return figure


def _has_place(axis: Axis, value: Any) -> bool:
    """Return True if a setting of any run, also of one that failed, can be drawn on the axis."""
    return isinstance(value, int | float) and (value > 0 or not axis.logarithmic)


@theme.themed()
def draw_heat(chart: Chart, chosen: Sequence[HeldRun] = ()) -> Figure:
    """Draw the map of the mean error, with the runs as crosses and a letter at each of the ``chosen`` runs."""
    figure, axes = wide_axes(5.4)
    across, up, error_mm = heat(chart)
    drawn = axes.pcolormesh(across, up, error_mm, cmap="viridis", shading="auto", rasterized=True)
    figure.colorbar(drawn, ax=axes, pad=0.01).set_label("mean error (mm)")
    at, near, best = np.array([run.at for run in chart.runs]), np.array(chart.as_near), chart.best
    axes.plot(*at.T, "x", color=theme.MEASURED, markersize=5, markeredgewidth=1.1, label="a run", clip_on=False)
    label = "fit equally well"
    ring = {"color": "white", "markerfacecolor": "none", "markersize": 9, "path_effects": HALO}
    axes.plot(*at[near].T, "o", **ring, label=label, clip_on=False)
    label = f"nearest: {chart.said(best)}, {best.mean_error_mm:.2f} mm"
    star = {"color": "white", "markeredgecolor": theme.INK, "markersize": 16, "linestyle": "none"}
    axes.plot(*best.at, "*", **star, label=label, clip_on=False)
    numbers = [run.number for run in chart.runs]
    for letter, run in zip(ascii_lowercase, chosen, strict=False):
        # Toward the middle, since title and colour bar are at the edges.
        right, above = chart.places[numbers.index(run.number)] > 0.5
        axes.annotate(
            letter,
            run.at,
            (-9 if right else 9, -12 if above else 8),
            textcoords="offset points",
            ha="right" if right else "left",
            color="white",
            fontsize=11,
            fontweight="bold",
            path_effects=HALO,
        )
    scale_axis(axes, "x", chart.axes[0])
    scale_axis(axes, "y", chart.axes[1])
    axes.grid(visible=False)
    theme.label_axes(axes, chart.axes[0].label, chart.axes[1].label, "Mean error against the readings")
    # Space for the marks of runs on the upper edge.
    axes.set_title(axes.get_title(loc="left"), pad=12.0)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=8.0)
    return figure


def heat(chart: Chart) -> tuple[Floats, Floats, Floats]:
    """Return values along both axes, (k,) each, and the mean error on their grid, (k, k).

    It is interpolated between the runs by SciPy's linear griddata. A logarithmic axis is interpolated in its logarithm;
    outside the runs' hull the error is NaN.
    """
    from scipy.interpolate import griddata

    values = np.array([run.at for run in chart.runs]).T
    places = [axis.spaced(each) for axis, each in zip(chart.axes, values, strict=True)]
    lines = [np.linspace(each.min(), each.max(), CELLS) for each in places]
    grid = tuple(np.meshgrid(*lines))
    error_mm = griddata(np.column_stack(places), chart.errors_mm, grid, method="linear", rescale=True)
    across, up = (10.0**line if axis.logarithmic else line for axis, line in zip(chart.axes, lines, strict=True))
    return across, up, error_mm


@dataclass(frozen=True)
class Watched:
    """Frames and times of a run."""

    frames: tuple[Frame, ...]  # Frames in the order of time; the last one is the end of the run
    particles: Floats  # Number of moving particles, every few frames, (k,)
    frame_ms: Floats  # Computing time of a frame at the same moments, (k,)
    differs_mm: float | None
    """Mean distance of the level of a repeated run from that in the study, 0 on the same kind of device; None if it is
    the study's own run."""


@dataclass(frozen=True)
class Fill:
    """A chosen run with its frames."""

    run: HeldRun
    title: str  # Unique title
    scene: FillScene
    course: Watched


@theme.themed()
def draw_fills(fills: Sequence[Fill]) -> Figure:
    """Draw sections along the crack by age, with a row for each run and a column for each moment."""
    moments = max(len(fill.course.frames) for fill in fills)
    figure = theme.wide_figure(0.8 + 0.95 * len(fills))
    grid = figure.subplots(len(fills), moments, squeeze=False, sharex=True, sharey=True)
    scale = _ages(fills)
    for row, fill in zip(grid, fills, strict=True):
        for axes, frame in zip(row, fill.course.frames, strict=False):
            fill.scene.draw_side(axes, frame, frame.age_s, scale)
            axes.annotate(
                f"{frame.t_s:.1f} s", (1.0, 1.0), (0, 3), "axes fraction", "offset points", ha="right", fontsize=7.5
            )
        row[0].set_title(fill.title, fontsize=8.5)
        for axes in row[len(fill.course.frames) :]:
            axes.set_axis_off()
    for axes in grid[-1]:
        axes.set_xlabel("s (mm)")
    _add_bar(figure, scale)
    return figure


@theme.themed()
def draw_thumbnails(fills: Sequence[Fill]) -> Figure:
    """Draw the end of each chosen run, with the level measured from its particles."""
    columns = min(3, len(fills))
    rows = -(-len(fills) // columns)
    figure = theme.wide_figure(0.5 + 1.3 * rows)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    scale = _ages(fills)
    for axes, fill in zip(grid, fills, strict=False):
        end, profile = fill.course.frames[-1], fill.run.profile
        fill.scene.draw_side(axes, end, end.age_s, scale)
        axes.plot(profile.s_mm, profile.level_mm, color=theme.AIR, linewidth=2.4)
        axes.plot(profile.s_mm, profile.level_mm, color=theme.MEASURED, linewidth=1.1)
        axes.set_title(f"{fill.title}\n{fill.run.mean_error_mm:.2f} mm off", fontsize=7.5)
    for axes in grid[len(fills) :]:
        axes.set_axis_off()
    _add_bar(figure, scale)
    return figure


def _add_bar(figure: Figure, scale: ColourScale) -> None:
    add_bar(figure, scale, figure.axes, location="bottom", aspect=60, pad=0.01, shrink=0.6)


def _ages(fills: Sequence[Fill]) -> ColourScale:
    return ages_of(frame for fill in fills for frame in fill.course.frames)


def medians(particles: Floats, frame_ms: Floats) -> Floats:
    """Return the median number of particles and the median time in each step, (2, k).

    Other load changes them little.
    """
    step = np.minimum((particles / particles.max() * STEPS).astype(int), STEPS - 1)
    inside = [step == number for number in range(STEPS) if (step == number).sum() >= FEWEST]
    return np.array([[np.median(values[one]) for one in inside] for values in (particles, frame_ms)])


def pace_of(particles: Floats, frame_ms: Floats) -> tuple[float, float, float] | None:
    """Fit a straight line to the medians by least squares.

    Returns None if there are too few medians; else the time of a frame without particles in ms, the time that each
    moving particle adds in µs, and R², the share of the medians' variance that the line explains.
    """
    from scipy.stats import linregress

    particles, frame_ms = medians(particles, frame_ms)
    if len(particles) < FEWEST:
        return None
    line: Any = linregress(particles, frame_ms)
    return line.intercept, 1000 * line.slope, line.rvalue**2


@theme.themed()
def draw_cost(chart: Chart, fills: Sequence[Fill]) -> Figure:
    """Draw the times of frames of the chosen runs, and the times of whole runs over each of the two settings."""
    figure = theme.wide_figure(3.4)
    row = figure.subplots(1, 3 if fills else 2)
    wall_s = [run.wall_s for run in chart.runs]
    for index, (axis, axes) in enumerate(zip(chart.axes, row[-2:], strict=True)):
        axes.plot([run.at[index] for run in chart.runs], wall_s, "o", color=theme.SIMULATED, markersize=3.5, alpha=0.6)
        scale_axis(axes, "x", axis)
        axes.set_ylim(0, None)
        theme.label_axes(axes, axis.label, "time of a run (s)", f"Whole runs, over {axis.name}")
    if fills:
        particles, frame_ms = frame_times(fills)
        row[0].plot(particles, frame_ms, "o", color=theme.MEASURED, markersize=2, alpha=0.25, rasterized=True)
        row[0].plot(*medians(particles, frame_ms), "s", color=theme.INK, markersize=5)
        title = "Frames, their medians"
        if (pace := pace_of(particles, frame_ms)) is not None:
            ends = np.array([0.0, particles.max()])
            start_ms, particle_us, explained = pace
            row[0].plot(ends, start_ms + particle_us * ends / 1000, color=theme.INK)
            title = f"{title}, R² = {explained:.2f}"
        row[0].set_xlim(0, None)
        row[0].set_ylim(0, 1.3 * float(np.quantile(frame_ms, 0.95)))
        theme.label_axes(row[0], "moving particles", "time of a frame (ms)", title)
    return figure


def frame_times(fills: Sequence[Fill]) -> tuple[Floats, Floats]:
    """Return the number of moving particles and the time in ms of each frame of all fills, (k,) each."""
    courses = [fill.course for fill in fills]
    return np.concatenate([one.particles for one in courses]), np.concatenate([one.frame_ms for one in courses])
