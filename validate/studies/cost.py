"""What runs cost: the time of a frame over the particles that move in it, the paper's Fig. 11; and of each run."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import FigureBase
from matplotlib.ticker import FuncFormatter

from sealtwin.records import Floats
from validate.drawing.theme import INK, MEASURED, SIMULATED, canvas, label_axes, themed
from validate.studies.chart import Chart
from validate.studies.fills import Fill

STEPS = 12
FEWEST = 3
"""Frames in a step, and steps under a line."""


@dataclass(frozen=True)
class Pace:
    """A straight line through the times of frames."""

    start_ms: float
    """Of a frame without particles."""
    particle_us: float
    """What each moving particle adds."""
    explained: float
    """Share of the medians' variance that the line explains, R²."""


def medians(particles: Floats, frame_ms: Floats) -> tuple[Floats, Floats]:
    """Median time in each of some equal steps of the particles' number: what else the machine did counts little."""
    step = np.minimum((particles / particles.max() * STEPS).astype(int), STEPS - 1)
    steps = [number for number in range(STEPS) if (step == number).sum() >= FEWEST]
    return (
        np.array([np.median(particles[step == number]) for number in steps]),
        np.array([np.median(frame_ms[step == number]) for number in steps]),
    )


def pace_of(particles: Floats, frame_ms: Floats) -> Pace | None:
    """Least squares through the medians; None where they are too few to tell a line."""
    particles, frame_ms = medians(particles, frame_ms)
    if len(particles) < FEWEST:
        return None
    slope, start = np.polyfit(particles, frame_ms, 1)
    left = frame_ms - (start + slope * particles)
    return Pace(float(start), float(1000 * slope), float(1 - left.var() / frame_ms.var()))


def draw_cost(chart: Chart, fills: Sequence[Fill], on: FigureBase | None = None) -> FigureBase:
    """Times of frames where runs were watched, times of whole runs over each of the two settings."""
    with themed():
        figure = canvas(on, 9.0, 3.4)
        row = figure.subplots(1, 3 if fills else 2)
        wall_s = [run.run.wall_s for run in chart.runs]
        for index, (axis, axes) in enumerate(zip(chart.axes, row[-2:], strict=True)):
            axes.plot([run.at[index] for run in chart.runs], wall_s, "o", color=SIMULATED, markersize=3.5, alpha=0.6)
            if axis.logarithmic:
                axes.set_xscale("log")
                axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
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
    """Of all runs that were watched: moving particles, and milliseconds."""
    return np.concatenate([fill.particles for fill in fills]), np.concatenate([fill.frame_ms for fill in fills])
