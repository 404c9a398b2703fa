"""How chosen runs of a study fill the crack: as it goes, the paper's Fig. 6, and at the end, its Fig. 8."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import FigureBase

from sealtwin.records import Floats, Frame
from validate.drawing.particles import Scale, age_scale, draw_discs
from validate.drawing.snapshots import Scene
from validate.drawing.theme import AIR, MEASURED, canvas, themed
from validate.studies.held import Held


@dataclass(frozen=True)
class Fill:
    """A chosen run as it went."""

    run: Held
    title: str
    """What tells it from the others."""
    scene: Scene
    frames: tuple[Frame, ...]
    """In the order of time; the last one is the end."""
    particles: Floats
    """That moved, frame of the run by frame, averaged over some, (k,)."""
    frame_ms: Floats
    """What such a frame took, (k,)."""
    rerun_differs_mm: float
    """Mean distance between the level of this second run and that of the study's own; 0 where they are the same."""


def draw_fills(fills: Sequence[Fill], on: FigureBase | None = None) -> FigureBase:
    """A row a run, a column a moment; sections along the crack, particles by age."""
    moments = max(len(fill.frames) for fill in fills)
    with themed():
        figure = canvas(on, 9.0, 0.8 + 0.95 * len(fills))
        grid = figure.subplots(len(fills), moments, squeeze=False, sharex=True, sharey=True)
        scale = _ages(fills)
        for row, fill in zip(grid, fills, strict=True):
            for axes, frame in zip(row, fill.frames, strict=False):
                _draw(axes, fill, frame, scale)
                axes.annotate(
                    f"{frame.t_s:.1f} s", (1.0, 1.0), (0, 3), "axes fraction", "offset points", ha="right", fontsize=7.5
                )
            row[0].set_title(fill.title, fontsize=8.5)
            for axes in row[len(fill.frames) :]:
                axes.set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel("s (mm)")
        _add_bar(figure, list(grid.ravel()), scale)
    return figure


def draw_thumbnails(fills: Sequence[Fill], on: FigureBase | None = None) -> FigureBase:
    """Each run at its end, with the level that was read from it."""
    columns = min(3, len(fills))
    rows = -(-len(fills) // columns)
    with themed():
        figure = canvas(on, 9.0, 0.5 + 1.3 * rows)
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        scale = _ages(fills)
        for axes, fill in zip(grid.ravel(), fills, strict=False):
            _draw(axes, fill, fill.frames[-1], scale)
            profile = fill.run.run.profile
            axes.plot(profile.s_mm, profile.level_mm, color=AIR, linewidth=2.4)
            axes.plot(profile.s_mm, profile.level_mm, color=MEASURED, linewidth=1.1)
            axes.set_title(f"{fill.title}\n{fill.run.mean_error_mm:.2f} mm off", fontsize=7.5)
        for axes in grid.ravel()[len(fills) :]:
            axes.set_axis_off()
        _add_bar(figure, list(grid.ravel()), scale)
    return figure


def _draw(axes: Axes, fill: Fill, frame: Frame, scale: Scale) -> None:
    place_mm, shown = fill.scene.side(frame)
    fill.scene.draw_ground(axes)
    draw_discs(axes, place_mm, fill.scene.radius_mm, frame.age_s[shown], scale)
    fill.scene.draw_nozzle(axes, frame.t_s)


def _add_bar(figure: FigureBase, axes: list[Axes], scale: Scale) -> None:
    label, colours, norm = scale
    figure.colorbar(
        ScalarMappable(norm, colours), ax=axes, label=label, location="bottom", aspect=60, pad=0.01, shrink=0.6
    )


def _ages(fills: Sequence[Fill]) -> Scale:
    return age_scale(max(float(np.max(frame.age_s, initial=0.1)) for fill in fills for frame in fill.frames))
