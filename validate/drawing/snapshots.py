"""The fill as it goes: single moments in full, and several below each other as in the paper's Fig. 6."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path

from sealtwin.records import Floats, Frame, Integers, Outline, ParticleState, Solid, Trajectory
from validate.drawing.level_curves import ALONG
from validate.drawing.particles import SPEED, Along, Scale, add_bar, age_scale, draw_discs, draw_section
from validate.drawing.pictures import SECTIONS_AT
from validate.drawing.theme import AIR, GROUND, ON_GROUND, THIRD, canvas, draw_ground, label_axes, themed

MARGIN_MM = 6.0
"""Shown past each end of the crack."""
ABOVE_MM = 6.0
"""Shown above the face: the nozzle's tip."""
MOST_ROWS = 8
"""Moments below each other; of more, these are spread over the run."""
NOZZLE_MM = 5.0
"""Of the nozzle that is drawn above its tip."""
UNDER, OVER = 1.0, 4.0
"""Order in which what lies under the face and on it is drawn, the face between the two."""


class Scene:
    """What stays the same from moment to moment: the crack, the nozzle's path, the size of particles."""

    def __init__(
        self, outline: Outline, solid: Solid, trajectory: Trajectory, radius_mm: float, diameter_mm: float
    ) -> None:
        """``diameter_mm`` is the nozzle's."""
        self.outline, self.solid, self.radius_mm = outline, solid, radius_mm
        self._trajectory, self._diameter_mm = trajectory, diameter_mm
        self._along = Along(outline)

    @property
    def limits_mm(self) -> tuple[float, float, float, float]:
        """Of a side view: s, then z."""
        return -MARGIN_MM, self.outline.length_mm + MARGIN_MM, -self.solid.depth_mm - 2, ABOVE_MM

    def side(self, frame: Frame) -> tuple[Floats, Integers]:
        """Places along the crack and in height of what is shown, (k, 2), and their numbers in the frame, (k,).

        What lies nearest to the centreline comes last: drawn in this order, it is the section along the crack.
        """
        s_mm, aside_mm = self._along.of(frame.position_mm[:, :2])
        order = np.argsort(-np.abs(aside_mm), kind="stable")
        order = order[frame.state[order] != ParticleState.SPILLED]
        return np.column_stack([s_mm, frame.position_mm[:, 2]])[order], order

    def plan(self, frame: Frame) -> tuple[Floats, Integers]:
        """The same along the crack and to its left, seen from above: what is highest comes last."""
        s_mm, aside_mm = self._along.of(frame.position_mm[:, :2])
        order = np.argsort(frame.position_mm[:, 2], kind="stable")
        order = order[frame.state[order] != ParticleState.SPILLED]
        return np.column_stack([s_mm, aside_mm])[order], order

    def walls_mm(self) -> tuple[Floats, Floats]:
        """Left and right wall on the face, along the crack and to its left, each (n, 2)."""
        outline = self.outline
        left, right = (np.column_stack(self._along.of(wall)) for wall in (outline.left_wall_mm, outline.right_wall_mm))
        return left, right

    def draw_ground(self, axes: Axes) -> None:
        """The sample below the cavity's floor, its face, and the walls at its closed ends; and the axes to scale.

        At an open end a dam stands, oblique like the edge of the face: no section along the crack shows where.
        """
        low_mm, high_mm, bottom_mm, top_mm = self.limits_mm
        length_mm = self.outline.length_mm
        along_mm = np.linspace(low_mm, high_mm, 500)
        draw_ground(axes, along_mm, -self.solid.depth_at_mm(along_mm), bottom_mm)
        for kind, start_mm in zip(self.outline.ends, (low_mm, length_mm), strict=True):
            if kind != "open":
                end = Rectangle((start_mm, bottom_mm), MARGIN_MM, -bottom_mm, facecolor=GROUND, edgecolor="none")
                axes.add_patch(end)
        axes.plot([low_mm, high_mm], [0.0, 0.0], color=ON_GROUND, linewidth=0.8)
        axes.set_facecolor(AIR)
        axes.set_xlim(low_mm, high_mm)
        axes.set_ylim(bottom_mm, top_mm)
        axes.set_aspect("equal")
        axes.grid(visible=False)

    def nozzle_mm(self, t_s: float) -> Floats | None:
        """Its tip; None once it has gone."""
        path = self._trajectory
        if t_s - path.t_s[0] > path.duration_s:
            return None
        return np.array([np.interp(t_s, path.t_s, axis) for axis in path.position_mm.T])

    def draw_nozzle(self, axes: Axes, t_s: float) -> Rectangle:
        """Seen from the side; invisible once it has gone."""
        tip_mm = self.nozzle_mm(t_s)
        nozzle = Rectangle((0, 0), self._diameter_mm, NOZZLE_MM, facecolor=AIR, edgecolor=ON_GROUND, linewidth=0.9)
        axes.add_patch(nozzle)
        self.move_nozzle(nozzle, tip_mm)
        return nozzle

    def move_nozzle(self, nozzle: Rectangle, tip_mm: Floats | None) -> None:
        nozzle.set_visible(tip_mm is not None)
        if tip_mm is not None:
            s_mm, _ = self._along.of(tip_mm[None, :2])
            nozzle.set_xy((float(s_mm[0]) - self._diameter_mm / 2, float(tip_mm[2])))


def fill_height_in(frames: Sequence[Frame]) -> float:
    """On a page that is A4 wide."""
    return 0.8 + 0.95 * min(len(frames), MOST_ROWS)


def draw_fill(frames: Sequence[Frame], scene: Scene, on: FigureBase | None = None) -> FigureBase:
    """Moments below each other: sections along the crack, coloured by speed on the left and by age on the right."""
    if len(frames) > MOST_ROWS:
        frames = [frames[round(place)] for place in np.linspace(0, len(frames) - 1, MOST_ROWS)]
    with themed():
        figure = canvas(on, 9.0, 1.0 + 1.35 * len(frames))
        grid = figure.subplots(len(frames), 2, sharex=True, sharey=True, squeeze=False)
        ages = _ages(frames)
        for frame, row in zip(frames, grid, strict=True):
            place_mm, shown = scene.side(frame)
            for axes, value, scale in zip(row, (frame.speed_mm_s, frame.age_s), (SPEED, ages), strict=True):
                scene.draw_ground(axes)
                draw_discs(axes, place_mm, scene.radius_mm, value[shown], scale)
                scene.draw_nozzle(axes, frame.t_s)
            row[0].set_title(f"t = {frame.t_s:.2f} s")
            row[0].set_ylabel("z (mm)")
        for column, scale in zip(grid.T, (SPEED, ages), strict=True):
            column[-1].set_xlabel("s along the crack (mm)")
            add_bar(figure, column[0].collections[-1], list(column), scale, location="bottom", aspect=40, pad=0.02)
    return figure


def draw_snapshot(frame: Frame, scene: Scene, on: FigureBase | None = None) -> FigureBase:
    """One moment: the section along the crack by age and by speed, and by speed from above and across the crack."""
    outline, solid, radius_mm = scene.outline, scene.solid, scene.radius_mm
    with themed():
        figure = canvas(on, 9.0, 11.0)
        rows = figure.add_gridspec(4, len(SECTIONS_AT), height_ratios=(1.0, 1.0, 1.7, 1.35))
        by_age, by_speed, top = (figure.add_subplot(rows[row, :]) for row in range(3))
        sections = [figure.add_subplot(rows[3, column]) for column in range(len(SECTIONS_AT))]
        ages = _ages([frame])
        place_mm, shown = scene.side(frame)
        bars = []
        for axes, value, scale in ((by_age, frame.age_s, ages), (by_speed, frame.speed_mm_s, SPEED)):
            scene.draw_ground(axes)
            bars.append(draw_discs(axes, place_mm, radius_mm, value[shown], scale))
            scene.draw_nozzle(axes, frame.t_s)
            label_axes(axes, ALONG, "z (mm)", "")
        _draw_top(top, frame, scene)
        stays = frame.state != ParticleState.SPILLED
        for axes, share in zip(sections, SECTIONS_AT, strict=True):
            s_mm, speed_mm_s = share * outline.length_mm, frame.speed_mm_s[stays]
            draw_section(axes, outline, solid, s_mm, frame.position_mm[stays], radius_mm, speed_mm_s, SPEED)
        sections[0].set_ylabel("z (mm)")
        by_age.set_title(f"t = {frame.t_s:.2f} s: section along the crack, by age")
        by_speed.set_title("The same by speed")
        for discs, axes, scale in zip(bars, ([by_age], [by_speed, top, *sections]), (ages, SPEED), strict=True):
            several = len(axes) > 1
            add_bar(figure, discs, axes, scale, pad=0.01, shrink=0.4 if several else 0.9, aspect=25 if several else 12)
    return figure


def _draw_top(axes: Axes, frame: Frame, scene: Scene) -> None:
    block_mm = np.reshape(scene.solid.block_mm, (2, 2))
    around_mm = np.array([scene.outline.outline_mm.min(axis=0) - 8, scene.outline.outline_mm.max(axis=0) + 8])
    # Of the face what is shown: a clip of its own takes the place of that of the axes.
    (x_min, y_min), (x_max, y_max) = np.maximum(block_mm[0], around_mm[0]), np.minimum(block_mm[1], around_mm[1])
    face = Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, facecolor="none", edgecolor="none")
    axes.add_patch(face)
    # Clockwise, so that the crack is a hole in it. What flows under the face is not seen from above.
    corners = [(x_min, y_min), (x_min, y_max), (x_max, y_max), (x_max, y_min)]
    rings = [_ring(np.array(corners)), _ring(scene.outline.outline_mm), *map(_ring, scene.outline.islands_mm)]
    mortar = PathPatch(Path.make_compound_path(*rings), facecolor=GROUND, edgecolor="none", zorder=UNDER + 0.1)
    axes.add_patch(mortar)
    mortar.set_clip_path(face)
    stays = frame.state != ParticleState.SPILLED
    height_mm = frame.position_mm[:, 2]
    for part, zorder in ((stays & (height_mm < 0), UNDER), (stays & (height_mm >= 0), OVER)):
        order = np.flatnonzero(part)[np.argsort(height_mm[part])]
        discs = draw_discs(axes, frame.position_mm[order, :2], scene.radius_mm, frame.speed_mm_s[order], SPEED)
        discs.set_zorder(zorder)
    for wall_mm in (scene.outline.left_wall_mm, scene.outline.right_wall_mm):
        (wall,) = axes.plot(*wall_mm.T, color=ON_GROUND, linewidth=0.9, zorder=OVER - 0.1)
        # Past an oblique open end stations run on; the sample does not.
        wall.set_clip_path(face)
    if (tip_mm := scene.nozzle_mm(frame.t_s)) is not None:
        axes.plot(*tip_mm[:2], "o", color=THIRD, markersize=5, zorder=OVER + 0.1)
    low, high = np.maximum(around_mm[0], block_mm[0] - 4), np.minimum(around_mm[1], block_mm[1] + 4)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_facecolor(AIR)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    label_axes(axes, "x (mm)", "y (mm)", "From above, by speed; the dot is the nozzle")


def _ring(points_mm: Floats) -> Path:
    return Path(np.vstack([points_mm, points_mm[:1]]), closed=True)


def _ages(frames: Sequence[Frame]) -> Scale:
    return age_scale(max((float(frame.age_s.max(initial=0.1)) for frame in frames), default=0.1))
