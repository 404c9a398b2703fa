"""Draw sealant in a sample: discs to scale, colour scales, and views along the crack, from above and across."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import Colormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Polygon, Rectangle
from matplotlib.path import Path

from sealtwin.core.arc_length import arc_length_at, at_arc_length
from sealtwin.core.records import Floats, Integers, Outline, Solid
from sealtwin.core.vtk_files import Frame
from validate.figures.theme import AGES, AIR, FOOT_IN, GROUND, HEAD_IN, ON_GROUND, SPEEDS, draw_ground, label_axes

SECTIONS_AT = (0.2, 0.5, 0.8)
"""Positions of the sections across a crack, as fractions of its length: on the slope of the paste, in the middle, and
on its plateau."""
ACROSS_MM = 9.0  # Half the width of a section
PAST_ENDS_MM = 6.0  # Length shown past each end of the crack
ABOVE_MM = 6.0  # Height shown above the face, for the nozzle's tip
MARGIN_MM = 4.0  # Width shown past the sample's edges
SLOWEST_MM_S, FASTEST_MM_S = 1.0, 1000.0  # Ends of the scale of speeds: creeping paste, and a fall of 50 mm
UNDER, FACE, WALLS, OVER = 1.0, 1.1, 3.9, 4.0
"""Drawing order in the view from above: sealant under the face, the face that hides it, the crack's walls, sealant
above the face."""


class ColourScale(NamedTuple):
    """Label, colour map and range of values of a colour scale."""

    label: str
    colours: str | Colormap
    norm: Normalize


SPEED = ColourScale("speed (mm/s)", SPEEDS, LogNorm(SLOWEST_MM_S, FASTEST_MM_S, clip=True))


def age_scale(oldest_s: float) -> ColourScale:
    return ColourScale("age (s)", AGES, Normalize(0.0, oldest_s))


def ages_of(frames: Iterable[Frame]) -> ColourScale:
    """Return one scale of ages for all frames together."""
    return age_scale(max((float(frame.age_s.max(initial=0.1)) for frame in frames), default=0.1))


def draw_discs(axes: Axes, place_mm: Floats, radius_mm: float, value: Floats, scale: ColourScale) -> EllipseCollection:
    """Draw particles at the positions ``place_mm``, (n, 2), as discs to scale.

    The discs are drawn as pixels, because 15,000 vector outlines would take megabytes.
    """
    scale.norm.autoscale_None(value)
    discs = EllipseCollection(
        [2 * radius_mm],
        [2 * radius_mm],
        [0.0],
        units="xy",
        offsets=place_mm,
        offset_transform=axes.transData,
        array=value,
        cmap=scale.colours,
        norm=scale.norm,
        linewidth=0,
        rasterized=True,
    )
    axes.add_collection(discs)
    return discs


def add_bar(figure: Figure, scale: ColourScale, axes: Axes | Sequence[Axes], **layout: Any) -> None:
    """Draw a colour bar for ``axes``. In a plate, the bar is below the labels of the axes.

    The bar of speeds ends in an arrow, which represents all lower values.
    """
    if figure.get_layout_engine() is None:
        inch = 1 / (figure.get_figheight() - HEAD_IN - FOOT_IN)
        layout |= {"location": "bottom", "fraction": 0.1 * inch, "pad": FOOT_IN * inch, "aspect": 40}
    layout.setdefault("extend", "min" if scale is SPEED else "neither")
    bar = figure.colorbar(ScalarMappable(scale.norm, scale.colours), ax=axes, label=scale.label, **layout)
    if isinstance(scale.norm, LogNorm):
        bar.long_axis.set_major_formatter("{x:g}")


@dataclass(eq=False)
class Views:
    """Views of particles in a sample. Positions are (n, 3), and the values shown as colours are (n,)."""

    outline: Outline
    solid: Solid
    radius_mm: float

    def draw_along(self, axes: Axes, position_mm: Floats, value: Floats, scale: ColourScale) -> None:
        """Draw the section along the crack. Particles nearest to the centreline are drawn last, over the others.

        A dam at an open end is not drawn. It is oblique like the sample's edge, so its position along the crack varies.
        """
        length_mm, bottom_mm = self.outline.length_mm, -self.solid.depth_mm - 2
        low_mm, high_mm = -PAST_ENDS_MM, length_mm + PAST_ENDS_MM
        along_mm = np.linspace(low_mm, high_mm, 500)
        draw_ground(axes, along_mm, -self.solid.depth_at_mm(along_mm), bottom_mm)
        for kind, start_mm in zip(self.outline.ends, (low_mm, length_mm), strict=True):
            if kind != "open":
                axes.add_artist(Rectangle((start_mm, bottom_mm), PAST_ENDS_MM, -bottom_mm, color=GROUND, linewidth=0))
        axes.plot([low_mm, high_mm], [0.0, 0.0], color=ON_GROUND, linewidth=0.8)
        axes.set_facecolor(AIR)
        s_mm = arc_length_at(position_mm[:, :2], self.outline.centreline_mm)
        away_mm = np.hypot(*(position_mm[:, :2] - _centreline_at(self.outline, s_mm)).T)
        order = np.argsort(-away_mm, kind="stable")
        draw_discs(axes, np.column_stack([s_mm, position_mm[:, 2]])[order], self.radius_mm, value[order], scale)
        show_to_scale(axes, (low_mm, high_mm), (bottom_mm, ABOVE_MM))

    def draw_from_above(
        self, axes: Axes, aside_mm: float, position_mm: Floats, value: Floats, scale: ColourScale
    ) -> None:
        """Draw the sample from above, up to ``aside_mm`` from its crack. The face hides the sealant below it."""
        outline, shown_mm = self.outline, self.shown_mm(aside_mm)
        low, high = np.clip(shown_mm, *np.reshape(self.solid.block_mm, (2, 2)))
        face = Rectangle(tuple(low), *(high - low), facecolor="none", edgecolor="none")
        # Clockwise, so that the crack is a hole in it.
        corners = np.array([low, (low[0], high[1]), high, (high[0], low[1])])
        rings = [np.vstack([ring, ring[:1]]) for ring in (corners, outline.outline_mm, *outline.islands_mm)]
        path = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
        mortar = PathPatch(path, facecolor=GROUND, edgecolor="none", zorder=FACE)
        for artist in (face, mortar):
            axes.add_artist(artist)
        for wall_mm in (outline.left_wall_mm, outline.right_wall_mm):
            # At an oblique open end the walls continue past the sample's edge.
            axes.plot(*wall_mm.T, color=ON_GROUND, linewidth=0.9, zorder=WALLS)[0].set_clip_path(face)
        mortar.set_clip_path(face)
        order = np.argsort(position_mm[:, 2], kind="stable")
        below = position_mm[order, 2] < 0
        for part, zorder in ((order[below], UNDER), (order[~below], OVER)):
            draw_discs(axes, position_mm[part, :2], self.radius_mm, value[part], scale).set_zorder(zorder)
        axes.set_facecolor(AIR)
        show_to_scale(axes, *shown_mm.T)

    def shown_mm(self, aside_mm: float) -> Floats:
        """Return the two corners, (2, 2), of a view from above.

        The view ends ``aside_mm`` from the crack, but at most ``MARGIN_MM`` past the sample's edge.
        """
        outline_mm, block_mm = self.outline.outline_mm, np.reshape(self.solid.block_mm, (2, 2))
        ends_mm = np.array([outline_mm.min(axis=0) - aside_mm, outline_mm.max(axis=0) + aside_mm])
        return np.clip(ends_mm, block_mm[0] - MARGIN_MM, block_mm[1] + MARGIN_MM)

    def draw_across(self, row: Sequence[Axes], position_mm: Floats, value: Floats, scale: ColourScale) -> None:
        """Draw the sections across the crack at ``SECTIONS_AT``: the solid, and the particles that each plane cuts.

        The view is along the path, so its left is at the left of the picture.
        """
        for axes, share in zip(row, SECTIONS_AT, strict=True):
            s_mm = share * self.outline.length_mm
            foot, ahead = plane_at(self.outline, s_mm)
            draw_solid_across(axes, self.solid, foot, ahead)
            offset = position_mm[:, :2] - foot
            right_mm = offset @ np.array([ahead[1], -ahead[0]])
            near = (np.abs(offset @ ahead) <= self.radius_mm) & (np.abs(right_mm) < ACROSS_MM)
            place_mm = np.column_stack([right_mm, position_mm[:, 2]])[near]
            draw_discs(axes, place_mm, self.radius_mm, value[near], scale)
            axes.set_facecolor(AIR)
            top_mm = max(4.0, float(place_mm[:, 1].max(initial=0.0)) + 1)
            show_to_scale(axes, (-ACROSS_MM, ACROSS_MM), (-self.solid.depth_mm - 2, top_mm))
            label_axes(axes, "across (mm)", "", f"s = {s_mm:.0f} mm")
        row[0].set_ylabel("z (mm)")


def show_to_scale(axes: Axes, x_mm: Sequence[float], y_mm: Sequence[float]) -> None:
    """Show a part of the sample with the same scale on both axes, without a grid."""
    axes.set(xlim=x_mm, ylim=y_mm, aspect="equal")
    axes.grid(visible=False)


def plane_at(outline: Outline, s_mm: float) -> tuple[Floats, Floats]:
    """Return the plane across the crack at ``s_mm``: a point on the centreline, (2,), and the unit normal, (2,).

    The normal points along the crack.
    """
    foot, tip = _centreline_at(outline, np.array([s_mm, min(s_mm + 1.0, outline.length_mm)]))
    return foot, (tip - foot) / np.linalg.norm(tip - foot)


def _centreline_at(outline: Outline, s_mm: Floats) -> Floats:
    """Return the points of the centreline at the positions ``s_mm``, (n, 2)."""
    return at_arc_length(outline.centreline_mm, outline.s_mm, s_mm)


def draw_solid_across(axes: Axes, solid: Solid, foot_mm: Floats, ahead: Floats, zorder: float = 1.0) -> None:
    """Draw the section of a solid with the plane through ``foot_mm`` that is perpendicular to ``ahead``."""
    for ring in cut_rings(solid.vertices_mm, solid.faces, foot_mm, ahead):
        axes.add_artist(Polygon(ring, facecolor=GROUND, edgecolor=ON_GROUND, linewidth=0.8, zorder=zorder))


def cut_rings(vertices_mm: Floats, faces: Integers, foot_mm: Floats, ahead: Floats) -> list[Floats]:
    """Cut a mesh with the vertical plane through ``foot_mm`` that is perpendicular to the unit vector ``ahead``.

    Returns closed rings, (n, 2) each, in mm: the distance to the right of ``foot_mm``, and the height z.
    """
    import trimesh

    cut = trimesh.Trimesh(vertices_mm, faces, process=False).section((*ahead, 0.0), (*foot_mm, 0.0))
    right = np.array([ahead[1], -ahead[0]])
    rings = [] if cut is None else cut.discrete
    return [np.column_stack([(ring[:, :2] - foot_mm) @ right, ring[:, 2]]) for ring in rings]
