"""Fills of chosen runs, the paper's Fig. 6, and the cost of runs and frames, its Fig. 11."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from sealtwin.core.drawing.particles import ColourScale, age_scale
from sealtwin.core.drawing.snapshots import FillScene
from sealtwin.core.drawing.theme import AIR, INK, MEASURED, SIMULATED, label_axes, themed
from sealtwin.core.records import Floats, Frame
from validate.study_figures.chart import Chart
from validate.study_figures.figure_sheet import wide_figure
from validate.study_figures.run_errors import HeldRun
from validate.study_figures.setting_maps import scale_axis

STEPS = 12  # Number of equal steps of the number of moving particles
FEWEST = 3  # Least number of frames in a step, and of steps for a straight line


@dataclass(frozen=True)
class Watched:
    """The course of a run that was computed once more."""

    frames: tuple[Frame, ...]  # Frames in the order of time; the last one is the end of the run
    particles: Floats  # Number of moving particles, every few frames, (k,)
    frame_ms: Floats  # Computing time of a frame at the same moments, (k,)
    differs_mm: float  # Mean distance of its level from the study's, which is 0 on the same kind of device


@dataclass(frozen=True)
class Fill:
    """A chosen run with its course."""

    run: HeldRun
    title: str  # Unique title
    scene: FillScene
    seen: Watched


@themed()
def draw_fills(fills: Sequence[Fill]) -> Figure:
    """Draw sections along the crack by age, with a row for each run and a column for each moment."""
    moments = max(len(fill.seen.frames) for fill in fills)
    figure = wide_figure(0.8 + 0.95 * len(fills))
    grid = figure.subplots(len(fills), moments, squeeze=False, sharex=True, sharey=True)
    scale = _ages(fills)
    for row, fill in zip(grid, fills, strict=True):
        for axes, frame in zip(row, fill.seen.frames, strict=False):
            fill.scene.draw_side(axes, frame, frame.age_s, scale)
            axes.annotate(
                f"{frame.t_s:.1f} s", (1.0, 1.0), (0, 3), "axes fraction", "offset points", ha="right", fontsize=7.5
            )
        row[0].set_title(fill.title, fontsize=8.5)
        for axes in row[len(fill.seen.frames) :]:
            axes.set_axis_off()
    for axes in grid[-1]:
        axes.set_xlabel("s (mm)")
    _add_bar(figure, scale)
    return figure


@themed()
def draw_thumbnails(fills: Sequence[Fill]) -> Figure:
    """Draw each run at its end, with the level measured from it."""
    columns = min(3, len(fills))
    rows = -(-len(fills) // columns)
    figure = wide_figure(0.5 + 1.3 * rows)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    scale = _ages(fills)
    for axes, fill in zip(grid, fills, strict=False):
        end, profile = fill.seen.frames[-1], fill.run.profile
        fill.scene.draw_side(axes, end, end.age_s, scale)
        axes.plot(profile.s_mm, profile.level_mm, color=AIR, linewidth=2.4)
        axes.plot(profile.s_mm, profile.level_mm, color=MEASURED, linewidth=1.1)
        axes.set_title(f"{fill.title}\n{fill.run.mean_error_mm:.2f} mm off", fontsize=7.5)
    for axes in grid[len(fills) :]:
        axes.set_axis_off()
    _add_bar(figure, scale)
    return figure


def _add_bar(figure: Figure, scale: ColourScale) -> None:
    mappable = ScalarMappable(scale.norm, scale.colours)
    figure.colorbar(mappable, ax=figure.axes, label=scale.label, location="bottom", aspect=60, pad=0.01, shrink=0.6)


def _ages(fills: Sequence[Fill]) -> ColourScale:
    return age_scale(max(float(np.max(frame.age_s, initial=0.1)) for fill in fills for frame in fill.seen.frames))


@dataclass(frozen=True)
class Pace:
    """Straight line through the times of frames."""

    start_ms: float  # Time of a frame without particles
    particle_us: float  # Additional time for each moving particle
    explained: float  # Share of the medians' variance that the line explains, R²


def medians(particles: Floats, frame_ms: Floats) -> tuple[Floats, Floats]:
    """Return the medians of particles and time in each step, which other load on the machine changes little."""
    step = np.minimum((particles / particles.max() * STEPS).astype(int), STEPS - 1)
    inside = [step == number for number in range(STEPS) if (step == number).sum() >= FEWEST]
    return np.array([np.median(particles[one]) for one in inside]), np.array(
        [np.median(frame_ms[one]) for one in inside]
    )


def pace_of(particles: Floats, frame_ms: Floats) -> Pace | None:
    """Fit a straight line to the medians by least squares; None if there are too few."""
    particles, frame_ms = medians(particles, frame_ms)
    if len(particles) < FEWEST:
        return None
    slope, start = np.polyfit(particles, frame_ms, 1)
    left = frame_ms - (start + slope * particles)
    return Pace(float(start), float(1000 * slope), float(1 - left.var() / frame_ms.var()))


@themed()
def draw_cost(chart: Chart, fills: Sequence[Fill]) -> Figure:
    """Draw the times of frames of the chosen runs, and the times of whole runs over each of the two settings."""
    figure = wide_figure(3.4)
    row = figure.subplots(1, 3 if fills else 2)
    wall_s = [run.wall_s for run in chart.runs]
    for index, (axis, axes) in enumerate(zip(chart.axes, row[-2:], strict=True)):
        axes.plot([run.at[index] for run in chart.runs], wall_s, "o", color=SIMULATED, markersize=3.5, alpha=0.6)
        scale_axis(axes, "x", axis)
        axes.set_ylim(0, None)
        label_axes(axes, axis.label, "time of a run (s)", f"Whole runs, over {axis.name}")
    if fills:
        particles, frame_ms = frame_times(fills)
        row[0].plot(particles, frame_ms, "o", color=MEASURED, markersize=2, alpha=0.25, rasterized=True)
        row[0].plot(*medians(particles, frame_ms), "s", color=INK, markersize=5)
        title = "Frames, their medians"
        if (pace := pace_of(particles, frame_ms)) is not None:
            ends = np.array([0.0, particles.max()])
            row[0].plot(ends, pace.start_ms + pace.particle_us * ends / 1000, color=INK)
            title = f"{title}, R² = {pace.explained:.2f}"
        row[0].set_xlim(0, None)
        row[0].set_ylim(0, 1.3 * float(np.quantile(frame_ms, 0.95)))
        label_axes(row[0], "moving particles", "time of a frame (ms)", title)
    return figure


def frame_times(fills: Sequence[Fill]) -> tuple[Floats, Floats]:
    """Return moving particles and milliseconds of the frames of all fills."""
    seen = [fill.seen for fill in fills]
    return np.concatenate([one.particles for one in seen]), np.concatenate([one.frame_ms for one in seen])
