"""Particles in a figure: discs to scale, colour scales, places along a crack, and sections across it."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import Colormap, LogNorm, Normalize
from matplotlib.figure import FigureBase
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray
from scipy.spatial import KDTree

from sealtwin.core.mesh_file import load_trimesh
from sealtwin.core.records import Floats, Integers, Outline, Solid
from sealtwin.core.vtk_files import Frame
from validate.figures.theme import AGES, AIR, GROUND, ON_GROUND, SPEEDS, label_axes

SECTIONS_AT = (0.2, 0.5, 0.8)
"""Places of the sections across a crack, as shares of its length: slope, middle and plateau of the paste."""
ACROSS_MM = 9.0  # Half the width of a section
MARGIN_MM = 4.0  # Width shown past the sample's edges
BEYOND_MM = 30.0  # Length by which the centreline is continued straight past its ends, for sealant on the face
FINE_MM = 0.1  # Spacing of the points of a centreline: an eighth of a particle of the paper
CELLS = 6  # Cells of a disc's radius in the search for hidden discs
DISCS_AT_ONCE = 20_000  # Discs that are searched together, in 20 MB
SLOWEST_MM_S, FASTEST_MM_S = 1.0, 1000.0  # Ends of the scale of speeds: creeping paste, and a fall of 50 mm


class ColourScale(NamedTuple):
    """Label, colour map and range of the values that colours represent."""

    label: str
    colours: str | Colormap
    norm: Normalize


SPEED = ColourScale("speed (mm/s)", SPEEDS, LogNorm(SLOWEST_MM_S, FASTEST_MM_S, clip=True))


def age_scale(oldest_s: float) -> ColourScale:
    return ColourScale("age (s)", AGES, Normalize(0.0, oldest_s))


def ages_of(frames: Iterable[Frame]) -> ColourScale:
    """Return one scale of ages for all frames."""
    return age_scale(max((float(frame.age_s.max(initial=0.1)) for frame in frames), default=0.1))


def draw_discs(axes: Axes, place_mm: Floats, radius_mm: float, value: Floats, scale: ColourScale) -> EllipseCollection:
    """Draw particles at (n, 2) as discs to scale. They become pixels, since 15,000 outlines would take megabytes."""
    scale.norm.autoscale_None(value)
    visible = not_hidden(place_mm, radius_mm)
    discs = EllipseCollection(
        [2 * radius_mm],
        [2 * radius_mm],
        [0.0],
        units="xy",
        offsets=place_mm[visible],
        offset_transform=axes.transData,
        array=value[visible],
        cmap=scale.colours,
        norm=scale.norm,
        linewidth=0,
        rasterized=True,
    )
    axes.add_collection(discs)
    return discs


def not_hidden(place_mm: Floats, radius_mm: float) -> NDArray[np.bool_]:
    """Return a mask, (n,), of the discs at (n, 2) that are at least partly visible. Later discs cover earlier ones.

    Discs are compared on cells of a sixth of their radius. A disc hides only what is at least one cell inside its edge.
    """
    if not len(place_mm):
        return np.zeros(0, dtype=bool)
    cell = np.floor((place_mm - place_mm.min(axis=0)) * (CELLS / radius_mm)).astype(np.int64) + CELLS
    rows, columns = cell.max(axis=0) + CELLS + 1
    side = np.arange(-CELLS, CELLS + 1)
    from_middle = np.hypot(side[:, None], side)
    step = side[:, None] * columns + side
    whole, inside = step[from_middle <= CELLS], step[from_middle <= CELLS - 1]
    middle = cell @ [columns, 1]
    number = np.arange(len(middle), dtype=np.int32)[:, None]
    top = np.full(rows * columns, -1, dtype=np.int32)
    visible = np.empty(len(middle), dtype=bool)
    parts = [slice(first, first + DISCS_AT_ONCE) for first in range(0, len(middle), DISCS_AT_ONCE)]
    for part in parts:
        top[middle[part, None] + inside] = number[part]
    for part in parts:
        visible[part] = (top[middle[part, None] + whole] <= number[part]).any(axis=1)
    return visible


def add_bar(figure: FigureBase, scale: ColourScale, axes: Iterable[Axes], **layout: Any) -> None:
    """Draw a colour bar for ``axes``. The bar of speeds ends in an arrow, which means all lower values."""
    layout.setdefault("extend", "min" if scale is SPEED else "neither")
    bar = figure.colorbar(ScalarMappable(scale.norm, scale.colours), ax=list(axes), label=scale.label, **layout)
    if isinstance(scale.norm, LogNorm):
        bar.long_axis.set_major_formatter("{x:g}")


class AlongCrack:
    """Coordinates along a crack's centreline and to its left."""

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
        """Return the arc length of points (n, 2) and their distance to the left of the line, both to ``FINE_MM``."""
        distance_mm, nearest = self._tree.query(points_mm)
        (dx, dy), (ahead_x, ahead_y) = (points_mm - self._point_mm[nearest]).T, self._ahead[nearest].T
        left = ahead_x * dy - ahead_y * dx >= 0
        return self._s_mm[nearest], np.where(left, distance_mm, -distance_mm)


def show_to_scale(axes: Axes, x_mm: tuple[float, float], y_mm: tuple[float, float]) -> None:
    """Show a part of the sample with the same scale on both axes, without a grid."""
    axes.set(xlim=x_mm, ylim=y_mm, aspect="equal")
    axes.grid(visible=False)


def draw_walls(axes: Axes, outline: Outline, face: Patch, **style: Any) -> None:
    """Draw the walls from above, clipped to the face. At an oblique open end they continue past the sample's edge."""
    for wall_mm in (outline.left_wall_mm, outline.right_wall_mm):
        (wall,) = axes.plot(*wall_mm.T, color=ON_GROUND, linewidth=0.9, **style)
        wall.set_clip_path(face)


def show_from_above(axes: Axes, outline: Outline, solid: Solid, aside_mm: float, title: str, legend: int = 0) -> None:
    """Show the sample from above: ``aside_mm`` around its crack, but at most ``MARGIN_MM`` past the sample's edge."""
    block_mm = np.reshape(solid.block_mm, (2, 2))
    low = np.maximum(outline.outline_mm.min(axis=0) - aside_mm, block_mm[0] - MARGIN_MM)
    high = np.minimum(outline.outline_mm.max(axis=0) + aside_mm, block_mm[1] + MARGIN_MM)
    show_to_scale(axes, (low[0], high[0]), (low[1], high[1]))
    label_axes(axes, "x (mm)", "y (mm)", title, legend)


def plane_at(outline: Outline, s_mm: float) -> tuple[Floats, Floats]:
    """Return a point of the centreline and the unit vector along it: the plane across the crack there."""
    foot, tip = (
        np.array([np.interp(s, outline.s_mm, outline.centreline_mm[:, axis]) for axis in (0, 1)])
        for s in (s_mm, min(s_mm + 1.0, outline.length_mm))
    )
    return foot, (tip - foot) / np.linalg.norm(tip - foot)


def cut_rings(vertices_mm: Floats, faces: Integers, foot_mm: Floats, ahead: Floats) -> list[Floats]:
    """Cut a mesh by the upright plane through ``foot_mm`` across the unit vector ``ahead``.

    Returns closed rings, (n, 2) each: the distance to the right of ``foot_mm`` and the height z, in mm.
    """
    load_trimesh()
    import trimesh

    cut = trimesh.Trimesh(vertices_mm, faces, process=False).section((*ahead, 0.0), (*foot_mm, 0.0))
    right = np.array([ahead[1], -ahead[0]])
    rings = [] if cut is None else cut.discrete
    return [np.column_stack([(ring[:, :2] - foot_mm) @ right, ring[:, 2]]) for ring in rings]


def draw_across(
    row: Sequence[Axes], outline: Outline, solid: Solid, position_mm: Floats, radius_mm: float, value: Floats,
    scale: ColourScale,
) -> None:  # fmt: skip
    """Draw the sections across the crack at ``SECTIONS_AT``: the solid, and the particles that the plane cuts.

    The view is along the path, so its left is at the left of the picture.
    """
    for axes, share in zip(row, SECTIONS_AT, strict=True):
        s_mm = share * outline.length_mm
        foot, ahead = plane_at(outline, s_mm)
        right = np.array([ahead[1], -ahead[0]])
        for ring in cut_rings(solid.vertices_mm, solid.faces, foot, ahead):
            axes.add_artist(Polygon(ring, closed=True, facecolor=GROUND, edgecolor=ON_GROUND, linewidth=0.8))
        offset = position_mm[:, :2] - foot
        near = (np.abs(offset @ ahead) <= radius_mm) & (np.abs(offset @ right) < ACROSS_MM)
        place_mm = np.column_stack([offset @ right, position_mm[:, 2]])[near]
        draw_discs(axes, place_mm, radius_mm, value[near], scale)
        axes.set_facecolor(AIR)
        top_mm = max(4.0, float(position_mm[near, 2].max(initial=0.0)) + 1)
        show_to_scale(axes, (-ACROSS_MM, ACROSS_MM), (-solid.depth_mm - 2, top_mm))
        label_axes(axes, "across (mm)", "", f"s = {s_mm:.0f} mm")
    row[0].set_ylabel("z (mm)")
