"""Pictures in a run folder: the fill at single moments and over time, and the run's numerical health over time."""

import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path as Outlines
from matplotlib.ticker import MaxNLocator

from sealtwin.core.files import replacing
from sealtwin.core.records import Floats, Integers, Outline, Solid, Trajectory
from sealtwin.core.vtk_files import Frame, ParticleState
from validate.figures import particles, theme
from validate.figures.drawing import as_picture

MARGIN_MM = 6.0  # Length shown past each end of the crack
ABOVE_MM = 6.0  # Height shown above the face, with the nozzle's tip
AROUND_MM = 8.0  # Width of the face shown around the crack
MOST_ROWS = 8  # Most moments below each other; of more frames, this many are drawn, evenly chosen
NOZZLE_MM = 5.0  # Length of the nozzle that is drawn
UNDER, OVER = 1.0, 4.0  # Drawing order of the sealant under the face and over it; the face is drawn between them
PANELS = (
    ("compression (%)", {"density_error_mean": "mean of moving particles", "density_error_p95": "95th percentile"}),
    ("particles", {"particles": "released", "moving": "moving"}),
    ("particles", {"escaped": "through a wall: must stay 0", "spilled": "spilled over the sample's edge"}),
    ("iterations", {"viscosity_iterations": "viscosity solve, per substep"}),
    ("time (ms)", {"ms_a_frame": "computing time per frame"}),
)  # fmt: skip
"""Unit of each panel, and the labels of its curves by column."""
STYLES = ((theme.SIMULATED, "-"), (theme.MEASURED, (0, (4, 2))))
"""Colour and dashes of a panel's two curves. They can be distinguished without colour, and if they coincide."""
Shade = Literal["speed", "age"]  # Quantity by which particles are coloured
DPI = 150  # Resolution of a PNG


class FillScene:
    """The parts of a picture of the fill that do not change during a run: crack, nozzle, size of the particles."""

    def __init__(
        self, outline: Outline, solid: Solid, trajectory: Trajectory, radius_mm: float, nozzle_diameter_mm: float
    ) -> None:
        self.outline, self.solid, self.radius_mm = outline, solid, radius_mm
        self._trajectory, self._diameter_mm = trajectory, nozzle_diameter_mm
        self._along = particles.AlongCrack(outline)

    @property
    def limits_mm(self) -> tuple[float, float, float, float]:
        """Limits of a side view: lowest and highest place along the crack, then lowest and highest z."""
        return -MARGIN_MM, self.outline.length_mm + MARGIN_MM, -self.solid.depth_mm - 2, ABOVE_MM

    def side(self, frame: Frame) -> tuple[Floats, Integers]:
        """Return places along the crack and in height, (k, 2), and the particles' indices in the frame, (k,).

        The particles nearest to the centreline come last: drawn in this order, they form the section along the crack.
        """
        s_mm, aside_mm = self._along.of(frame.position_mm[:, :2])
        order = _sorted(frame, -np.abs(aside_mm))
        return np.column_stack([s_mm, frame.position_mm[:, 2]])[order], order

    def draw_side(self, axes: Axes, frame: Frame, value: Floats, scale: particles.ColourScale) -> None:
        """Draw the section along the crack with ground and nozzle. Particles are coloured by ``value``."""
        place_mm, shown = self.side(frame)
        self.draw_ground(axes)
        particles.draw_discs(axes, place_mm, self.radius_mm, value[shown], scale)
        self.draw_nozzle(axes, frame.t_s)

    def plan(self, frame: Frame) -> tuple[Floats, Integers]:
        """Return places along the crack and to its left, (k, 2), and indices, (k,), of particles sorted by height."""
        order = _sorted(frame, frame.position_mm[:, 2])
        return np.column_stack(self._along.of(frame.position_mm[:, :2]))[order], order

    def walls_mm(self) -> tuple[Floats, Floats]:
        """Return the left and right wall on the face, along the crack and to its left, each (n, 2)."""
        outline = self.outline
        left, right = (np.column_stack(self._along.of(wall)) for wall in (outline.left_wall_mm, outline.right_wall_mm))
        return left, right

    def draw_ground(self, axes: Axes) -> None:
        """Draw the sample in a side view: its face, and the mortar below the cavity's floor and past its closed ends.

        A dam at an open end is not drawn: it is oblique like the sample's edge, so its place along the crack varies.
        """
        low_mm, high_mm, bottom_mm, top_mm = self.limits_mm
        length_mm = self.outline.length_mm
        along_mm = np.linspace(low_mm, high_mm, 500)
        theme.draw_ground(axes, along_mm, -self.solid.depth_at_mm(along_mm), bottom_mm)
        for kind, start_mm in zip(self.outline.ends, (low_mm, length_mm), strict=True):
            if kind != "open":
                end = Rectangle((start_mm, bottom_mm), MARGIN_MM, -bottom_mm, facecolor=theme.GROUND, edgecolor="none")
                axes.add_artist(end)
        axes.plot([low_mm, high_mm], [0.0, 0.0], color=theme.ON_GROUND, linewidth=0.8)
        axes.set_facecolor(theme.AIR)
        particles.show_to_scale(axes, (low_mm, high_mm), (bottom_mm, top_mm))

    def nozzle_mm(self, t_s: float) -> Floats | None:
        """Return the position of the nozzle's tip, (3,), or None after the end of its path."""
        path = self._trajectory
        if t_s - path.t_s[0] > path.duration_s:
            return None
        return np.array([np.interp(t_s, path.t_s, axis) for axis in path.position_mm.T])

    def draw_nozzle(self, axes: Axes, t_s: float) -> Rectangle:
        nozzle = Rectangle(
            (0, 0), self._diameter_mm, NOZZLE_MM, facecolor=theme.AIR, edgecolor=theme.ON_GROUND, linewidth=0.9
        )
        axes.add_artist(nozzle)
        self.move_nozzle(nozzle, t_s)
        return nozzle

    def move_nozzle(self, nozzle: Rectangle, t_s: float) -> None:
        tip_mm = self.nozzle_mm(t_s)
        nozzle.set_visible(tip_mm is not None)
        if tip_mm is not None:
            s_mm, _ = self._along.of(tip_mm[None, :2])
            nozzle.set_xy((float(s_mm[0]) - self._diameter_mm / 2, float(tip_mm[2])))


def _sorted(frame: Frame, key: Floats) -> Integers:
    """Return the indices of the particles that have not spilled, by increasing ``key``."""
    order = np.argsort(key, kind="stable")
    return order[frame.state[order] != ParticleState.SPILLED]


@theme.themed()
def draw_fill(frames: Sequence[Frame], scene: FillScene, by: Sequence[Shade] = ("speed", "age")) -> Figure:
    """Draw sections along the crack, with a row for each frame and a column for each way to colour the particles."""
    if len(frames) > MOST_ROWS:
        frames = [frames[round(place)] for place in np.linspace(0, len(frames) - 1, MOST_ROWS)]
    figure = theme.wide_figure(1.0 + 1.35 * len(frames), len(by) * 4.5)
    grid = figure.subplots(len(frames), len(by), sharex=True, sharey=True, squeeze=False)
    scales = {"speed": particles.SPEED, "age": particles.ages_of(frames)}
    for frame, row in zip(frames, grid, strict=True):
        for axes, shade in zip(row, by, strict=True):
            scene.draw_side(axes, frame, frame.speed_mm_s if shade == "speed" else frame.age_s, scales[shade])
        row[0].set_title(f"t = {frame.t_s:.2f} s")
        row[0].set_ylabel("z (mm)")
    for column, shade in zip(grid.T, by, strict=True):
        column[-1].set_xlabel("s along the crack (mm)")
        particles.add_bar(figure, scales[shade], column, location="bottom", aspect=40, pad=0.02)
    return figure


class Snapshot:
    """A figure of one frame after another: making axes, ticks and colour bars takes as long as drawing particles."""

    @theme.themed()
    def __init__(self, scene: FillScene) -> None:
        self._scene, self._ages, self._figure = scene, particles.age_scale(1.0), theme.wide_figure(11.0)
        rows = self._figure.add_gridspec(4, len(particles.SECTIONS_AT), height_ratios=(1.0, 1.0, 1.7, 1.35))
        self._views = [self._figure.add_subplot(rows[row, :]) for row in range(3)]
        self._sections = [self._figure.add_subplot(rows[3, column]) for column in range(len(particles.SECTIONS_AT))]
        by_age, *by_speed = *self._views, *self._sections
        particles.add_bar(self._figure, self._ages, [by_age], pad=0.01, shrink=0.9, aspect=12)
        particles.add_bar(self._figure, particles.SPEED, by_speed, pad=0.01, shrink=0.4, aspect=25)

    @theme.themed()
    def draw(self, frame: Frame) -> Figure:
        """Draw a frame in place of the last one."""
        for axes in (*self._views, *self._sections):
            for artist in (*axes.collections, *axes.lines, *axes.patches):
                artist.remove()
        scene, ages, (by_age, by_speed, top) = self._scene, self._ages, self._views
        ages.norm.vmax = particles.ages_of([frame]).norm.vmax
        scene.draw_side(by_age, frame, frame.age_s, ages)
        scene.draw_side(by_speed, frame, frame.speed_mm_s, particles.SPEED)
        theme.label_axes(by_age, theme.ALONG, "z (mm)", f"t = {frame.t_s:.2f} s: section along the crack, by age")
        theme.label_axes(by_speed, theme.ALONG, "z (mm)", "The same by speed")
        _draw_top(top, frame, scene)
        stays = frame.state != ParticleState.SPILLED
        place_mm, speed_mm_s = frame.position_mm[stays], frame.speed_mm_s[stays]
        sample = scene.outline, scene.solid
        particles.draw_across(self._sections, *sample, place_mm, scene.radius_mm, speed_mm_s, particles.SPEED)
        return self._figure


def _draw_top(axes: Axes, frame: Frame, scene: FillScene) -> None:
    outline, block_mm = scene.outline, np.reshape(scene.solid.block_mm, (2, 2))
    # The visible part of the face, since a clip path replaces that of the axes.
    x_min, y_min = np.maximum(block_mm[0], outline.outline_mm.min(axis=0) - AROUND_MM)
    x_max, y_max = np.minimum(block_mm[1], outline.outline_mm.max(axis=0) + AROUND_MM)
    face = Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, facecolor="none", edgecolor="none")
    axes.add_artist(face)
    # Clockwise, so that the crack is a hole in it. The face hides the sealant below it.
    corners = np.array([(x_min, y_min), (x_min, y_max), (x_max, y_max), (x_max, y_min)])
    mortar = PathPatch(
        Outlines.make_compound_path(*map(_ring, [corners, outline.outline_mm, *outline.islands_mm])),
        facecolor=theme.GROUND,
        edgecolor="none",
        zorder=UNDER + 0.1,
    )
    axes.add_artist(mortar)
    mortar.set_clip_path(face)
    stays = frame.state != ParticleState.SPILLED
    height_mm = frame.position_mm[:, 2]
    for part, zorder in ((stays & (height_mm < 0), UNDER), (stays & (height_mm >= 0), OVER)):
        order = np.flatnonzero(part)[np.argsort(height_mm[part])]
        place_mm, speed_mm_s = frame.position_mm[order, :2], frame.speed_mm_s[order]
        particles.draw_discs(axes, place_mm, scene.radius_mm, speed_mm_s, particles.SPEED).set_zorder(zorder)
    particles.draw_walls(axes, outline, face, zorder=OVER - 0.1)
    if (tip_mm := scene.nozzle_mm(frame.t_s)) is not None:
        axes.plot(*tip_mm[:2], "o", color=theme.THIRD, markersize=5, zorder=OVER + 0.1)
    axes.set_facecolor(theme.AIR)
    title = "From above, by speed; the dot is the nozzle"
    particles.show_from_above(axes, outline, scene.solid, AROUND_MM, title)


def _ring(points_mm: Floats) -> Outlines:
    return Outlines(np.vstack([points_mm, points_mm[:1]]), closed=True)


@theme.themed()
def draw_health(columns: Mapping[str, Floats]) -> Figure:
    """Draw the columns of health.csv, given by name. They have the same length; NaN is an empty field."""
    figure = theme.wide_figure(8.5)
    rows = figure.subplots(len(PANELS), 1, sharex=True)
    for axes, (unit, curves) in zip(rows, PANELS, strict=True):
        factor = 100.0 if "%" in unit else 1.0
        for (name, label), (colour, dashes) in zip(curves.items(), STYLES, strict=False):
            values = factor * columns[name]
            line = {"color": colour, "linestyle": dashes, "linewidth": 1.2, "label": label}
            # Drawn above the axis, which would hide a line of zeros.
            axes.plot(columns["t_s"], values, **line, clip_on=False, zorder=3)
        highest = max(float(np.nanmax(columns[name], initial=0.0)) for name in curves)
        axes.set_ylim(0.0, 1.08 * factor * highest if highest else 1.0)
        if unit == "particles":
            axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
        theme.label_axes(axes, "", unit, "", legend=2)
    rows[-1].set_xlabel("simulated time (s)")
    return figure


def write_gallery(folder: Path, frames: dict[str, Frame], scene: FillScene, health: Mapping[str, Floats]) -> list[str]:
    """Write PNGs of the run's health, of each frame under its name, and of all frames below each other.

    Returns the names of the files in ``folder``.
    """
    written = _write(folder, "health", draw_health(health))
    snapshot = Snapshot(scene)
    # The last frame first: its ages have the widest labels, which set the layout of all.
    for name, frame in reversed(frames.items()):
        written += _write(folder, f"snapshots/{name}", figure := snapshot.draw(frame))
        figure.set_layout_engine("none")
    if frames:
        written += _write(folder, "snapshots/fill", draw_fill(list(frames.values()), scene))
    return written


def _write(folder: Path, name: str, figure: Figure) -> list[str]:
    with replacing(folder / f"{name}.png") as temporary:
        # Most of a figure has one colour: run-length encoding takes half the time, and the file is not larger.
        as_picture(figure, DPI).save(temporary, format="png", compress_type=zlib.Z_RLE)
    return [f"{name}.png"]
