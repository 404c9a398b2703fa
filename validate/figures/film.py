"""The fill as moving pictures: the section along the crack, and the crack from above, pulled straight."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection
from PIL import Image

from sealtwin.core.errors import InputError
from sealtwin.core.files import replacing
from sealtwin.core.records import Pixels
from sealtwin.core.vtk_files import Frame
from validate.figures.particles import SPEED, add_bar, draw_discs
from validate.figures.snapshots import OVER, UNDER, FillScene
from validate.figures.theme import ALONG, GROUND, INK, label_axes, themed, wide_figure

WIDTH_IN, DPI = 9.6, 100
ASIDE_MM = 6.0  # Width of the face that is shown on each side of the walls
FASTEST_FPS, SLOWEST_FPS = 50, 1
"""Limits of the frame rate: a GIF counts hundredths of a second, and browsers show a frame for at least two
hundredths."""
LAST_FRAME_S = 1.5  # Time for which a GIF shows its last frame before it begins again
COLOURS = 128  # Size of a GIF's palette


class Painter:
    """Canvas on which frames are painted one after the other."""

    @themed()
    def __init__(self, scene: FillScene) -> None:
        self._scene = scene
        low_mm, high_mm, bottom_mm, top_mm = scene.limits_mm
        walls = scene.walls_mm()
        reach_mm = ASIDE_MM + max(float(np.abs(wall[:, 1]).max()) for wall in walls)
        heights = top_mm - bottom_mm, 2 * reach_mm
        # To scale, with room for labels.
        height_in = (WIDTH_IN - 1.6) * sum(heights) / (high_mm - low_mm) + 1.5
        self._figure = wide_figure(height_in, WIDTH_IN)
        self._canvas = FigureCanvasAgg(self._figure)
        self._side, self._plan = self._figure.subplots(2, 1, sharex=True, height_ratios=heights)
        scene.draw_ground(self._side)
        left, right = walls
        self._plan.set_facecolor(GROUND)
        self._plan.fill(*np.vstack([left, right[::-1]]).T, color="white", linewidth=0, zorder=0.5)
        for wall, edge_mm in ((left, reach_mm), (right, -reach_mm)):
            # The face hides the sealant below it, also past the ends of the walls.
            shore = np.vstack([[low_mm, wall[0, 1]], wall, [high_mm, wall[-1, 1]]])
            self._plan.fill_between(*shore.T, edge_mm, color=GROUND, linewidth=0, zorder=UNDER + 0.1)
            self._plan.plot(*wall.T, color=INK, linewidth=0.8, zorder=OVER - 0.1)
        self._plan.set_ylim(-reach_mm, reach_mm)
        self._plan.set_aspect("equal")
        self._plan.grid(visible=False)
        label_axes(self._side, "", "z (mm)", " ")
        label_axes(self._plan, ALONG, "left of the crack (mm)", "From above, the crack pulled straight")
        add_bar(self._figure, SPEED, [self._side, self._plan], pad=0.01, aspect=25)
        self._nozzle = scene.draw_nozzle(self._side, 0.0)
        self._discs: list[EllipseCollection] = []
        self._canvas.draw()
        # The layout is fixed, so that the panels of all pictures coincide.
        self._figure.set_layout_engine("none")

    @themed()
    def paint(self, frame: Frame) -> Pixels:
        for discs in self._discs:
            discs.remove()
        self._discs = []
        scene, speed_mm_s, height_mm = self._scene, frame.speed_mm_s, frame.position_mm[:, 2]
        place_mm, shown = scene.side(frame)
        self._discs.append(draw_discs(self._side, place_mm, scene.radius_mm, speed_mm_s[shown], SPEED))
        place_mm, shown = scene.plan(frame)
        for part, order in ((height_mm[shown] < 0, UNDER), (height_mm[shown] >= 0, OVER)):
            value = speed_mm_s[shown][part]
            discs = draw_discs(self._plan, place_mm[part], scene.radius_mm, value, SPEED)
            discs.set_zorder(order)
            self._discs.append(discs)
        scene.move_nozzle(self._nozzle, frame.t_s)
        self._side.set_title(f"t = {frame.t_s:.2f} s: section along the crack, by speed")
        self._canvas.draw()
        return np.asarray(self._canvas.buffer_rgba())[:, :, :3].copy()


def write_film(
    path: Path, times_s: Sequence[float], read: Callable[[int], Frame], scene: FillScene, report: Callable[[int], None]
) -> None:
    """Write a film of a run in real time, as GIF.

    Only one frame at a time is in memory. ``read`` returns a frame by its index in ``times_s``; ``report`` receives the
    number of finished frames.

    Raises InputError if there are fewer than two frames, or if ``path`` does not end in .gif.
    """
    if len(times_s) < 2:
        raise InputError(f"{path}: a film needs two frames, found {len(times_s)}. Set a smaller frames_every_s.")
    if path.suffix.lower() != ".gif":
        raise InputError(f"{path}: a film is written as GIF; give a name that ends in .gif.")
    painter = Painter(scene)

    def pictures() -> Iterator[Image.Image]:
        for number in range(len(times_s)):
            yield Image.fromarray(painter.paint(read(number)))
            report(number + 1)

    shown_ms = [round(1000 * min(max(b - a, 1 / FASTEST_FPS), 1 / SLOWEST_FPS)) for a, b in pairwise(times_s)]
    painted = pictures()
    # The colour bar of the first picture has the colours of all pictures.
    palette = next(painted).quantize(COLOURS, dither=Image.Dither.NONE)
    rest = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in painted)
    duration = [*shown_ms, round(1000 * LAST_FRAME_S)]
    with replacing(path) as temporary:
        palette.save(temporary, "GIF", save_all=True, append_images=rest, duration=duration, loop=0, optimize=False)
