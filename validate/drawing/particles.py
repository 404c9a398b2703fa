"""Particles in a figure: discs of their size, and how they lie along and across a crack."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import FigureBase
from matplotlib.patches import Polygon
from matplotlib.ticker import FuncFormatter
from scipy.spatial import KDTree

from sealtwin.records import Floats, Outline, Solid
from validate.drawing.slicing import cut_rings
from validate.drawing.theme import AGES, AIR, GROUND, ON_GROUND, SPEEDS, label_axes

ACROSS_MM = 9.0
"""Shown to each side of the centreline in a section."""
BEYOND_MM = 30.0
"""By which the centreline runs on straight past its ends: what fell on the face has a place along the crack too."""
FINE_MM = 0.1
"""Between two points of a centreline that stand for all of it: an eighth of a particle of the paper's."""
SLOWEST_MM_S, FASTEST_MM_S = 1.0, 1000.0
"""Of the colours of speeds: creeping paste, and a fall of 50 mm."""


class Scale(NamedTuple):
    """What colours mean."""

    label: str
    colours: str
    norm: Normalize


SPEED = Scale("speed (mm/s)", SPEEDS, LogNorm(SLOWEST_MM_S, FASTEST_MM_S, clip=True))


def age_scale(oldest_s: float) -> Scale:
    return Scale("age (s)", AGES, Normalize(0.0, oldest_s))


def draw_discs(axes: Axes, place_mm: Floats, radius_mm: float, value: Floats, scale: Scale) -> EllipseCollection:
    """Discs of the particles' size, (n, 2), as pixels: 15,000 of them as outlines would be megabytes."""
    across_mm = np.full(len(place_mm), 2 * radius_mm)
    discs = EllipseCollection(
        across_mm,
        across_mm,
        np.zeros(len(place_mm)),
        units="xy",
        offsets=place_mm,
        offset_transform=axes.transData,
        array=value,
        cmap=matplotlib.colormaps[scale.colours],
        norm=scale.norm,
        linewidth=0,
        rasterized=True,
    )
    axes.add_collection(discs)
    return discs


def add_bar(figure: FigureBase, discs: EllipseCollection, axes: Sequence[Axes], scale: Scale, **layout: Any) -> None:
    """The colours' meaning beside ``axes``; on a scale in powers an arrow says that what is slower looks the same."""
    powers = isinstance(scale.norm, LogNorm)
    bar = figure.colorbar(discs, ax=list(axes), extend="min" if powers else "neither", **layout)
    if powers:
        # The theme shows no formulas, and powers of ten would be some.
        bar.formatter = FuncFormatter(lambda value, _: f"{value:g}")
        bar.update_ticks()
    bar.set_label(scale.label)


class Along:
    """Places along a crack's centreline, and beside it."""

    def __init__(self, outline: Outline) -> None:
        line_mm, s_mm = outline.centreline_mm, outline.s_mm
        ends = [(line_mm[0] - line_mm[1], line_mm[0]), (line_mm[-1] - line_mm[-2], line_mm[-1])]
        first, last = (end + BEYOND_MM * ahead / np.linalg.norm(ahead) for ahead, end in ends)
        s_mm = np.concatenate([[-BEYOND_MM], s_mm, [s_mm[-1] + BEYOND_MM]])
        line_mm = np.vstack([first, line_mm, last])
        self._s_mm = np.arange(s_mm[0], s_mm[-1], FINE_MM)
        self._point_mm = np.column_stack([np.interp(self._s_mm, s_mm, x) for x in line_mm.T])
        self._ahead = np.gradient(self._point_mm, FINE_MM, axis=0)
        self._tree = KDTree(self._point_mm)

    def of(self, points_mm: Floats) -> tuple[Floats, Floats]:
        """Arc length of points (n, 2) and how far they lie to the left of the centreline, both to ``FINE_MM``."""
        distance_mm, nearest = self._tree.query(points_mm)
        (dx, dy), (ahead_x, ahead_y) = (points_mm - self._point_mm[nearest]).T, self._ahead[nearest].T
        left = ahead_x * dy - ahead_y * dx >= 0
        return self._s_mm[nearest], np.where(left, distance_mm, -distance_mm)


def draw_section(
    axes: Axes, outline: Outline, solid: Solid, s_mm: float, position_mm: Floats, radius_mm: float, value: Floats,
    scale: Scale,
) -> None:  # fmt: skip
    """Across the crack at ``s_mm``: the solid, cut, and the particles within a diameter.

    Seen along the path: left of the path is left in the picture.
    """
    foot, tip = (
        np.array([np.interp(s, outline.s_mm, outline.centreline_mm[:, axis]) for axis in (0, 1)])
        for s in (s_mm, min(s_mm + 1.0, outline.length_mm))
    )
    ahead = (tip - foot) / np.linalg.norm(tip - foot)
    right = np.array([ahead[1], -ahead[0]])
    for ring in cut_rings(solid.vertices_mm, solid.faces, foot, ahead):
        axes.add_patch(Polygon(ring, closed=True, facecolor=GROUND, edgecolor=ON_GROUND, linewidth=0.8))
    offset = position_mm[:, :2] - foot
    near = (np.abs(offset @ ahead) <= radius_mm) & (np.abs(offset @ right) < ACROSS_MM)
    place_mm = np.column_stack([offset @ right, position_mm[:, 2]])[near]
    draw_discs(axes, place_mm, radius_mm, value[near], scale)
    axes.set_facecolor(AIR)
    axes.set_xlim(-ACROSS_MM, ACROSS_MM)
    axes.set_ylim(-solid.depth_mm - 2, max(4.0, float(position_mm[near, 2].max(initial=0.0)) + 1))
    axes.set_aspect("equal")
    axes.grid(visible=False)
    label_axes(axes, "across (mm)", "", f"s = {s_mm:.0f} mm")
