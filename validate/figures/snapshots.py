"""Pictures of a run as it fills: single moments, and the fill over time."""

import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.files import replacing
from sealtwin.core.records import Floats, Outline, Solid, Trajectory
from sealtwin.core.vtk_files import Frame, ParticleState
from validate.figures.particles import (
    OVER,
    SECTIONS_AT,
    SPEED,
    ColourScale,
    Views,
    add_bar,
    age_scale,
    ages_of,
)
from validate.figures.theme import (
    AIR,
    ALONG,
    ON_GROUND,
    THIRD,
    as_picture,
    label_axes,
    plate,
    themed,
    wide_figure,
)

AROUND_MM = 8.0  # Width of the face shown around the crack
MAX_ROWS = 8  # Largest number of moments below each other. More frames are thinned out evenly.
NOZZLE_MM = 5.0  # Length of the nozzle that is drawn
Shade = Literal["speed", "age"]  # Quantity by which particles are coloured


class FillScene(Views):
    """The unchanging parts of a picture of the fill: crack, nozzle and particle size."""

    def __init__(
        self, outline: Outline, solid: Solid, trajectory: Trajectory, radius_mm: float, nozzle_diameter_mm: float
    ) -> None:
        super().__init__(outline, solid, radius_mm)
        self._trajectory, self._diameter_mm = trajectory, nozzle_diameter_mm

    def draw_side(self, axes: Axes, frame: Frame, value: Floats, scale: ColourScale) -> None:
        """Draw the section along the crack with the nozzle. Particles are coloured by ``value``, (n,)."""
        stays = frame.state != ParticleState.SPILLED
        self.draw_along(axes, frame.position_mm[stays], value[stays], scale)
        if (tip_mm := self.nozzle_mm(frame.t_s)) is not None:
            s_mm = float(arc_length_at(tip_mm[None, :2], self.outline.centreline_mm)[0])
            corner = s_mm - self._diameter_mm / 2, float(tip_mm[2])
            axes.add_artist(
                Rectangle(corner, self._diameter_mm, NOZZLE_MM, facecolor=AIR, edgecolor=ON_GROUND, linewidth=0.9)
            )

    def nozzle_mm(self, t_s: float) -> Floats | None:
        """Return the position of the nozzle's tip, (3,), or None after the end of its path."""
        path = self._trajectory
        if t_s - path.t_s[0] > path.duration_s:
            return None
        return np.array([np.interp(t_s, path.t_s, axis) for axis in path.position_mm.T])


@themed()
def draw_fill(frames: Sequence[Frame], scene: FillScene) -> Figure:
    """Draw a section along the crack for each frame, one below the other, with particles coloured by speed."""
    if len(frames) > MAX_ROWS:
        frames = [frames[round(index)] for index in np.linspace(0, len(frames) - 1, MAX_ROWS)]
    figure = plate(1.0 + 1.35 * len(frames))
    grid = draw_sections(figure, [[(scene, frame)] for frame in frames], "speed")
    for axes, frame in zip(grid.flat, frames, strict=True):
        axes.set(title=f"t = {frame.t_s:.2f} s", ylabel="z (mm)")
    grid[-1, 0].set_xlabel("s along the crack (mm)")
    return figure


def draw_sections(figure: Figure, rows: Sequence[Sequence[tuple[FillScene, Frame]]], by: Shade) -> NDArray[Any]:
    """Draw sections along the crack and one colour bar. Returns the panels, (rows, columns)."""
    grid = figure.subplots(len(rows), max(map(len, rows)), squeeze=False, sharex=True, sharey=True)
    scale = SPEED if by == "speed" else ages_of(frame for row in rows for _, frame in row)
    for axes in grid.flat:
        axes.set_axis_off()
    for panels, row in zip(grid, rows, strict=True):
        for axes, (scene, frame) in zip(panels, row, strict=False):
            axes.set_axis_on()
            scene.draw_side(axes, frame, _values(frame, by), scale)
    add_bar(figure, scale, figure.axes, location="bottom", aspect=60, pad=0.01, shrink=0.6)
    return grid


def _values(frame: Frame, shade: str) -> Floats:
    return frame.speed_mm_s if shade == "speed" else frame.age_s


class Snapshot:
    """A figure that shows one frame after another.

    Axes, ticks and colour bars are made only once, because they take as long as the particles.
    """

    @themed()
    def __init__(self, scene: FillScene) -> None:
        """Prepare the panels: sections along the crack by age and by speed, a view from above, and sections across.

        The last two are coloured by speed.
        """
        self._scene, self._scales = scene, {"age": age_scale(1.0), "speed": SPEED}
        cuts = [f"cut {number}" for number in range(len(SECTIONS_AT))]
        figure = wide_figure(11.0)
        rows: Any = [[name] * len(cuts) for name in ("age", "speed", "top")]
        self._axes = figure.subplot_mosaic([*rows, cuts], height_ratios=(1.0, 1.0, 1.7, 1.35))
        add_bar(figure, self._scales["age"], [self._axes["age"]], pad=0.01, shrink=0.9, aspect=12)
        self._cuts = [self._axes[name] for name in cuts]
        by_speed = [axes for name, axes in self._axes.items() if name != "age"]
        add_bar(figure, SPEED, by_speed, pad=0.01, shrink=0.4, aspect=25)
        self.figure = figure

    @themed()
    def draw(self, frame: Frame) -> Figure:
        """Draw a frame in place of the previous one."""
        for axes in self._axes.values():
            for artist in (*axes.collections, *axes.lines, *axes.patches):
                artist.remove()
        scene, top, stays = self._scene, self._axes["top"], frame.state != ParticleState.SPILLED
        self._scales["age"].norm.vmax = ages_of([frame]).norm.vmax
        for shade, scale in self._scales.items():
            scene.draw_side(self._axes[shade], frame, _values(frame, shade), scale)
            title = f"t = {frame.t_s:.2f} s: section along the crack, by {shade}"
            label_axes(self._axes[shade], ALONG, "z (mm)", title)
        sealant = frame.position_mm[stays], frame.speed_mm_s[stays], SPEED
        scene.draw_from_above(top, AROUND_MM, *sealant)
        if (tip_mm := scene.nozzle_mm(frame.t_s)) is not None:
            top.plot(*tip_mm[:2], "o", color=THIRD, markersize=5, zorder=OVER + 0.1)
        label_axes(top, "x (mm)", "y (mm)", "From above, by speed; the dot is the nozzle")
        scene.draw_across(self._cuts, *sealant)
        return self.figure


def write_gallery(folder: Path, frames: dict[str, Frame], scene: FillScene) -> list[str]:
    """Write a PNG of each frame under the frame's name, and return the names of the files in ``folder``."""
    written, snapshot = list[str](), Snapshot(scene)
    # The last frame first: its ages have the widest labels, which set the layout of all.
    for name, frame in reversed(frames.items()):
        written += _write(folder, f"snapshots/{name}", snapshot.draw(frame))
        snapshot.figure.set_layout_engine("none")
    return written


def _write(folder: Path, name: str, figure: Figure) -> list[str]:
    with replacing(folder / f"{name}.png") as temporary:
        # Most of a figure has one colour: run-length encoding takes half the time, and the file is not larger.
        as_picture(figure).save(temporary, format="png", compress_type=zlib.Z_RLE)
    return [f"{name}.png"]
