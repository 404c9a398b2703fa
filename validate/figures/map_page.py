"""A mapped study: its figures, as in the paper (Figs 7, 8, 10, 6 and 11), and its page with every run in a table."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from string import ascii_lowercase
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from sealtwin.core.records import Floats
from validate.figures.chart import (
    MIN_RUNS,
    MIN_VALUES,
    Axis,
    Chart,
    HeldRun,
    Watched,
    heat,
    medians,
    pace_of,
)
from validate.figures.page import FigureColumn, FigureTable, Page, Plot, Section
from validate.figures.particles import ColourScale, add_bar
from validate.figures.snapshots import FillScene, draw_sections
from validate.figures.theme import (
    ALONG,
    INK,
    LEVEL,
    MEASURED,
    MUTED,
    ON_SEALANT,
    SIMULATED,
    caliper_label,
    draw_curve,
    label_axes,
    themed,
    wide_axes,
    wide_figure,
)
from validate.units import percent, setting_words, settings_words, signed

MAX_ROWS = 200  # Largest number of rows on the page, best runs first. The CSV contains all rows.
ERRORS = {
    "mean error (mm)": ("mean_error_mm", "{:.3f}".format),
    "bias (mm)": ("bias_mm", partial(signed, decimals=3)),
    "worst error (mm)": ("worst_error_mm", "{:.2f}".format),
    "at s (mm)": ("worst_at_mm", "{:.1f}".format),
    "of the length under 1 mm": ("share_under_1_mm", partial(percent, decimals=0)),
}
"""Field and format of each figure about a run's error, by label."""
LINE_COLOURS = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.3, 0.88, 256)))
"""Viridis without its ends, because one end is invisible on a dark page and the other on a light page."""
HALO = [withStroke(linewidth=2.5, foreground=INK)]  # Dark edge of white marks on the map
MAX_LABELS = 15  # Largest number of runs whose points are labelled with number and error, not only the number


@dataclass(frozen=True)
class Fill:
    """A selected run with its frames."""

    run: HeldRun
    title: str  # Unique title
    scene: FillScene
    course: Watched


def map_page(chart: Chart, fills: Sequence[Fill], cautions: Sequence[str] = ()) -> Page:
    """Return the page of a study's map. ``cautions`` are shown before the cautions about its runs."""
    best, (first, second) = chart.best, chart.axes
    as_near = "unknown, since no pair was repeated"
    if chart.replicates is not None:
        as_near = f"{sum(chart.as_near)} of {len(chart.runs)}"
    influences = [
        Plot(
            f"influence-{axis.name.replace(' ', '-')}",
            f"Mean error against {axis.name}, as in the paper's Fig. 10{figure}.",
            partial(draw_influence, chart, number),
        )
        for number, axis, figure in ((1, second, "a"), (0, first, "b"))
    ]
    ends = "The lettered runs at their end, particles by age, with the level measured from them."
    during = "Sections along the crack during the fill in chosen runs, coloured by age, as in the paper's Fig. 6."
    thumbnails = [Plot("thumbnails", ends, lambda: draw_thumbnails(fills))] if fills else []
    sections = [
        Section("Levels", [_levels(chart)]),
        Section(f"Error over {first.name} and {second.name}", [chart.flatness, _error_map(chart, fills), *thumbnails]),
        Section(f"Influence of {second.name} and {first.name}", influences),
        *([Section("Fills", [Plot("fills", during, lambda: draw_fills(fills))])] if fills else []),
        Section("Cost", [*_cost(chart, fills)]),
        Section("Runs", [_runs(chart)]),
        *([Section("Not ranked", [chart.exclusion, _left_out(chart)])] if chart.excluded else []),
    ]
    return Page(
        title=f"{chart.name}: {first.name} and {second.name} against {chart.readings.source}",
        lead=f"{len(chart.runs)} runs, each compared with the same readings along the crack.",
        cautions=[*cautions, *_cautions(chart)],
        finding=(
            f"Nearest to the readings: {chart.text_of(best)}, with a mean error of {best.mean_error_mm:.2f} mm. "
            f"{chart.beside_baselines} {chart.flatness} {chart.exclusion}"
        ),
        key_figures=[
            ("nearest pair", chart.text_of(best)),
            ("its mean error", f"{best.mean_error_mm:.2f} mm"),
            *((f"{line.name}, as a baseline", f"{line.mean_error_mm:.2f} mm") for line in chart.baselines),
            ("its bias", f"{signed(best.bias_mm, 2)} mm"),
            ("of the length under 1 mm", percent(best.share_under_1_mm, 0)),
            ("pairs that fit equally well", as_near),
            ("farthest pair", f"{chart.errors_mm.max():.2f} mm"),
        ],
        sections=sections,
    )


def _cautions(chart: Chart) -> Iterator[str]:
    if chart.screening:
        yield chart.screening
    yield (
        f"The nearest of {len(chart.runs)} pairs was chosen with these readings, which is a calibration: its error is "
        "the residual of the fit, not a test. Compare the pair with other readings."
    )
    yield from chart.fluid_warnings
    if (data := chart.readings.data) != "measured":
        yield f"The origin of the readings: {data}. A small error shows only agreement with their source."


def _levels(chart: Chart) -> Plot:
    s_mm = chart.best.profile.s_mm
    levels = {f"level_of_run_{run.number}_mm": run.profile.level_at_mm(s_mm) for run in chart.runs}
    caption = (
        "Level along the crack of each run, the nearest in bold, and the readings with their 95 % band, as in the "
        "paper's Fig. 7."
    )
    return Plot("levels", caption, lambda: draw_levels_of_study(chart), {"s_mm": s_mm} | levels)


def _error_map(chart: Chart, fills: Sequence[Fill]) -> Plot:
    """Return the map of the errors. Its numbers are in the table of all runs."""
    draw = partial(draw_error_map, chart, [fill.run for fill in fills])
    letters = "; letters mark the runs that are drawn below" if fills else ""
    if chart.has_surface:
        between = "interpolated linearly between them, as in the paper's Fig. 8"
        return Plot("heat", f"Mean error of each run (points), {between}{letters}.", draw)
    caption = (
        f"Mean error of each run, with its number{letters}. A surface between the runs needs "
        f"{MIN_RUNS} or more ranked runs, with {MIN_VALUES} or more values of each setting, that enclose two "
        "thirds of the map."
    )
    return Plot("points", caption, draw)


def _cost(chart: Chart, fills: Sequence[Fill]) -> Iterator[str | Plot]:
    wall_s = np.array([run.wall_s for run in chart.runs])
    yield (
        f"A run took {np.median(wall_s):.1f} s (median; {wall_s.min():.1f} to {wall_s.max():.1f} s), and all runs "
        f"together {wall_s.sum():,.0f} s, on the machine of the study, which may also do other work."
    )
    caption, numbers = "Time of a run against each setting.", None
    if fills:
        caption = f"Time of a frame against the number of moving particles, as in the paper's Fig. 11. {caption}"
        particles, frame_ms = frame_times(fills)
        numbers = {"moving_particles": particles, "frame_ms": frame_ms}
        if (pace := pace_of(particles, frame_ms)) is not None:
            start_ms, particle_us, explained = pace
            yield (
                f"A frame takes {start_ms:.2f} ms plus {particle_us:.2f} µs for each moving particle; "
                f"this line explains {percent(explained, 0)} of the variance of the medians."
            )
    yield Plot("cost", caption, lambda: draw_cost(chart, fills), numbers)


def _runs(chart: Chart) -> FigureTable:
    near = [setting_words(near) for near in chart.as_near]
    columns = [
        FigureColumn("run", "number"),
        *(
            FigureColumn(axis.label, values, "{:g}".format, axis.setting)
            for axis, values in zip(chart.axes, chart.pairs.T, strict=True)
        ),
        *(FigureColumn(head, name, text, name) for head, (name, text) in ERRORS.items()),
        FigureColumn("fits equally well", near, {"yes": "yes", "no": ""}.__getitem__, "as_near_as_the_best"),
        FigureColumn("time (s)", "wall_s", "{:.1f}".format, "wall_s"),
    ]
    more = f"; the nearest {MAX_ROWS} of {len(chart.runs)}" if len(chart.runs) > MAX_ROWS else ""
    nearest = np.argsort(chart.errors_mm, kind="stable")[:MAX_ROWS]
    return FigureTable(f"Nearest first{more}", "runs", columns, chart.runs, nearest.tolist())


def _left_out(chart: Chart) -> FigureTable:
    columns = [
        FigureColumn("run", "number"),
        FigureColumn("settings", [settings_words(run.settings) for run in chart.excluded]),
        FigureColumn("why", "reason.text"),
        FigureColumn("volume ratio", "volume_ratio", "{:.3f}".format),
    ]
    order = range(min(len(chart.excluded), MAX_ROWS))
    return FigureTable("Runs that are not ranked", "left-out", columns, chart.excluded, order)


@themed()
def draw_levels_of_study(chart: Chart) -> Figure:
    """Draw the levels of all runs and the readings, with the nearest run in bold."""
    _, axes = wide_axes(4.2, face=True)
    readings, best = chart.readings, chart.best
    curves = [np.column_stack([profile.s_mm, profile.level_mm]) for profile in (run.profile for run in chart.runs)]
    thin = LineCollection(curves, colors=MUTED, linewidths=0.7, alpha=0.5, rasterized=True, label="a run")
    axes.add_collection(thin)
    draw_curve(
        axes,
        readings.s_mm,
        readings.level_mm,
        "--o",
        chart.band_mm,
        color=MEASURED,
        markersize=3.5,
        label=f"{caliper_label(readings)}, 95 % band",
    )
    draw_curve(
        axes, best.profile.s_mm, best.profile.level_mm, color=SIMULATED, linewidth=3.0, label=f"{chart.nearest} off"
    )
    s_mm, level_mm = np.vstack([*curves, np.column_stack([readings.s_mm, readings.level_mm])]).T
    axes.set_xlim(0, s_mm.max())
    axes.set_ylim(level_mm.min() - 1, level_mm.max() + 1)
    axes.legend(loc="lower right")
    return label_axes(axes, ALONG, LEVEL, f"Levels of {len(chart.runs)} runs")


def scale_axis(axes: Axes, name: Literal["x", "y"], setting: Axis) -> None:
    """Make an axis of a plot logarithmic if the axis of its setting is logarithmic. Labels are then plain numbers."""
    if setting.logarithmic:
        axes.set(**{f"{name}scale": "log"})
        (axes.xaxis if name == "x" else axes.yaxis).set_major_formatter("{x:g}")


@themed()
def draw_influence(chart: Chart, axis: int) -> Figure:
    """Draw the mean error over the setting of ``axis``.

    For a grid of runs, each value of the other setting has a line. Otherwise each run is a point.
    """
    along, other = chart.axes[axis], chart.axes[1 - axis]
    figure, axes = wide_axes(4.2)
    places, values = chart.pairs[:, axis], chart.pairs[:, 1 - axis]
    norm = (LogNorm if other.logarithmic else Normalize)(other.values[0], other.values[-1])
    axes.scatter(places, chart.errors_mm, c=values, cmap=LINE_COLOURS, norm=norm, s=12)
    for value in other.values if other.is_graded(len(chart.runs)) else ():
        line = np.flatnonzero(values == value)
        line = line[np.argsort(places[line])]
        axes.plot(places[line], chart.errors_mm[line], color=LINE_COLOURS(norm(value)), linewidth=1.2)
    if along.is_graded(len(chart.runs)):
        mean_mm = [chart.errors_mm[places == value].mean() for value in along.values]
        axes.plot(along.values, mean_mm, color=INK, linewidth=3.0, label=f"mean over {other.name}")
        axes.legend(loc="best")
    add_bar(figure, ColourScale(other.label, LINE_COLOURS, norm), [axes], pad=0.01)
    scale_axis(axes, "x", along)
    axes.set_ylim(0, None)
    return label_axes(axes, along.label, "mean error (mm)", f"Influence of {along.name}")


@themed()
def draw_error_map(chart: Chart, chosen: Sequence[HeldRun]) -> Figure:
    """Draw the mean error over the two settings: runs as points in the colour of their error, over a surface.

    If there are too few runs for a surface, each run has its number and, if there is room, its error. The runs in
    ``chosen`` have letters.
    """
    figure, axes = wide_axes(5.4)
    surface, errors_mm = chart.has_surface, chart.errors_mm
    colours: Any = {"cmap": "viridis" if surface else LINE_COLOURS, "norm": Normalize(errors_mm.min(), errors_mm.max())}
    if surface:
        axes.pcolormesh(*heat(chart), **colours, shading="auto", rasterized=True)
        axes.grid(visible=False)
    drawn = axes.scatter(
        *chart.pairs.T,
        c=errors_mm,
        **colours,
        s=24 if surface else 130,
        edgecolors=MEASURED if surface else INK,
        clip_on=False,
        zorder=3,
        label="a run",
    )
    figure.colorbar(drawn, ax=axes, pad=0.01).set_label("mean error (mm)")
    near = chart.pairs[np.array(chart.as_near) & (chart.replicates is not None)]
    for pairs, size, label in ((near, 9, "fit equally well"), (np.array([chart.best.values]), 18, chart.nearest)):
        if len(pairs):
            axes.plot(
                *pairs.T,
                "o",
                color="white",
                markerfacecolor="none",
                clip_on=False,
                zorder=3,
                path_effects=HALO,
                markersize=size,
                label=label,
            )
    for name, axis in zip(("x", "y"), chart.axes, strict=True):
        scale_axis(axes, name, axis)
    letters = dict(zip((run.number for run in chosen), ascii_lowercase, strict=False))
    _label_runs(axes, chart, letters)
    # Space for labels at the edges.
    axes.margins(*((0.0, 0.0) if surface else (0.14, 0.16)))
    label_axes(axes, chart.axes[0].label, chart.axes[1].label, "")
    axes.set_title("Mean error against the readings", pad=12.0)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=4, fontsize=8.0)
    return figure


def _label_runs(axes: Axes, chart: Chart, letters: Mapping[int, str]) -> None:
    """Write the letters of runs.

    Without a surface, also write each run's number, and its error if there are few runs.
    """
    surface, few = chart.has_surface, len(chart.runs) <= MAX_LABELS
    for run, position in zip(chart.runs, chart.places, strict=True):
        letter = letters.get(run.number, "")
        style: Any = {"textcoords": "offset points", "ha": "center"}
        if surface:
            # Labels are toward the middle, since title and colour bar are at the edges.
            style |= {"va": "center", "fontsize": 11, "fontweight": "bold", "color": "white", "path_effects": HALO}
            axes.annotate(letter, run.values, tuple(np.where(position > 0.5, -11, 11)), **style)
        else:
            name = f"run {run.number}: {run.mean_error_mm:.2f} mm" if few else str(run.number)
            axes.annotate(f"{letter}, {name}" if letter else name, run.values, (0, 13), **style, fontsize=8.0)


@themed()
def draw_fills(fills: Sequence[Fill]) -> Figure:
    """Draw sections along the crack with particles coloured by age: a row for each run, a column for each moment."""
    rows = [[(fill.scene, frame) for frame in fill.course.frames] for fill in fills]
    figure = wide_figure(0.8 + 0.95 * len(fills))
    grid = draw_sections(figure, rows, "age")
    for panels, fill in zip(grid, fills, strict=True):
        panels[0].set_title(fill.title, fontsize=8.5)
        for axes, frame in zip(panels, fill.course.frames, strict=False):
            time = f"{frame.t_s:.1f} s"
            axes.annotate(time, (1.0, 1.0), (0, 3), "axes fraction", "offset points", ha="right", fontsize=7.5)
    for axes in grid[-1]:
        axes.set_xlabel("s (mm)")
    return figure


@themed()
def draw_thumbnails(fills: Sequence[Fill]) -> Figure:
    """Draw each selected run at its end, with the level measured from its particles."""
    ends = [(fill.scene, fill.course.frames[-1]) for fill in fills]
    rows = [ends[first : first + 3] for first in range(0, len(ends), 3)]
    figure = wide_figure(0.5 + 1.3 * len(rows))
    grid = draw_sections(figure, rows, "age")
    for axes, fill in zip(grid.flat, fills, strict=False):
        draw_curve(
            axes,
            fill.run.profile.s_mm,
            fill.run.profile.level_mm,
            color=MEASURED,
            linewidth=1.1,
            path_effects=ON_SEALANT,
        )
        axes.set_title(f"{fill.title}\n{fill.run.mean_error_mm:.2f} mm off", fontsize=7.5)
    return figure


@themed()
def draw_cost(chart: Chart, fills: Sequence[Fill]) -> Figure:
    """Draw the times of the selected runs' frames, and the times of whole runs over each of the two settings."""
    figure = wide_figure(3.4)
    row = figure.subplots(1, 3 if fills else 2)
    wall_s = [run.wall_s for run in chart.runs]
    for index, (axis, axes) in enumerate(zip(chart.axes, row[-2:], strict=True)):
        axes.plot(chart.pairs[:, index], wall_s, "o", color=SIMULATED, markersize=3.5, alpha=0.6)
        scale_axis(axes, "x", axis)
        axes.set_ylim(0, None)
        label_axes(axes, axis.label, "time of a run (s)", f"Whole runs, over {axis.name}")
    if fills:
        particles, frame_ms = frame_times(fills)
        row[0].plot(particles, frame_ms, "o", color=MEASURED, markersize=2, alpha=0.25, rasterized=True)
        row[0].plot(*medians(particles, frame_ms), "s", color=INK, markersize=5)
        if (pace := pace_of(particles, frame_ms)) is not None:
            ends = np.array([0.0, particles.max()])
            start_ms, particle_us, _ = pace
            row[0].plot(ends, start_ms + particle_us * ends / 1000, color=INK)
        row[0].set_xlim(0, None)
        row[0].set_ylim(0, 1.3 * float(np.quantile(frame_ms, 0.95)))
        label_axes(row[0], "moving particles", "time of a frame (ms)", "Frames, their medians")
    return figure


def frame_times(fills: Sequence[Fill]) -> tuple[Floats, Floats]:
    """Return the number of moving particles and the computing time in ms of each frame of all fills, (k,) each."""
    courses = [fill.course for fill in fills]
    return np.concatenate([course.particles for course in courses]), np.concatenate(
        [course.frame_ms for course in courses]
    )
