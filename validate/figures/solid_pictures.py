"""Pictures of the sample and its fill: the block, side view, top view, sections."""

from typing import Any

import numpy as np
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from sealtwin.core.records import FaceLabel, Outline, Profile, Run, Solid, Trajectory
from validate.figures import theme
from validate.figures.particles import OVER, SECTIONS_AT, ColourScale, Views, add_bar, age_scale
from validate.figures.rendering import render

FACE_COLOURS = np.array([to_rgb(colour) for colour in (theme.GROUND, "#5b87a6", "#35566e", "#8fb0c6", "#ada497")])
"""Colours of the facets of a solid, in the order of ``FaceLabel``."""
WIDTH_PX = 900
BELOW: Any = {"location": "bottom", "aspect": 40, "pad": 0.02}  # Place of a colour bar


@theme.themed()
def draw_solid(solid: Solid) -> Figure:
    """Draw the block from above, and its cavity as a cast from the side. Both are as wide as the figure."""
    colour = FACE_COLOURS[solid.face_label]
    azimuth_deg = square_on(solid)
    cavity = np.isin(solid.face_label, (FaceLabel.WALL, FaceLabel.FLOOR))
    dams = ", with the dams at its open ends" if solid.figures.dams else ""
    volume = f"{solid.cavity_volume_mm3 / 1000:.2f} ml, {solid.depth_mm:g} mm deep"
    block = render(solid.vertices_mm, solid.faces, colour, azimuth_deg - 40, 42, WIDTH_PX)
    cast = render(solid.vertices_mm, solid.faces[cavity], colour[cavity], azimuth_deg, 14, WIDTH_PX)
    figure = theme.plate(3.6)
    pictures = ((block, f"The sample{dams}"), (cast, f"Its cavity alone, {volume}"))
    for axes, (picture, title) in zip(figure.subplots(2, 1, height_ratios=(2.1, 1.0)), pictures, strict=True):
        axes.imshow(picture)
        axes.set_title(title)
        axes.set_axis_off()
        axes.set_anchor("NW")
    return figure


@theme.themed()
def draw_still(still: NDArray[np.uint8], oldest_s: float) -> Figure:
    """Draw a picture of the fill in three dimensions, (h, w, 4), with its colour bar."""
    figure = theme.wide_figure(4.6)
    axes = figure.add_subplot()
    axes.imshow(still)
    axes.set_axis_off()
    add_bar(figure, age_scale(oldest_s), [axes], location="bottom", shrink=0.5, aspect=40, pad=0.02)
    return figure


@theme.themed()
def draw_side_view(run: Run, outline: Outline, solid: Solid, profile: Profile) -> Figure:
    """Draw the section along the crack, particles coloured by age, with the level that was measured from them."""
    figure, stays = theme.plate(2.7), ~run.spilled
    axes, position_mm = figure.add_subplot(), run.position_mm[stays]
    Views(outline, solid, run.radius_mm).draw_along(axes, position_mm, run.age_s[stays], _ages(run))
    add_bar(figure, _ages(run), [axes], **BELOW)
    axes.plot(profile.s_mm, profile.level_mm, color=theme.AIR, linewidth=3.0)
    label = "profile read from the particles"
    axes.plot(profile.s_mm, profile.level_mm, color=theme.MEASURED, linewidth=1.4, label=label)
    axes.set_ylim(top=max(4.0, float(position_mm[:, 2].max(initial=0.0)) + 1.5))
    return theme.label_axes(axes, theme.ALONG, "z (mm)", "From the side: particles by age", legend=1)


@theme.themed()
def draw_top_view(run: Run, outline: Outline, solid: Solid, trajectory: Trajectory) -> Figure:
    """Draw the sample from above: particles coloured by height, the traced walls and the nozzle's path."""
    figure, position_mm = theme.plate(3.6), run.position_mm[~run.spilled]
    axes, heights = figure.add_subplot(), ColourScale("z (mm)", theme.HEIGHTS, Normalize())
    Views(outline, solid, run.radius_mm).draw_from_above(axes, 14, position_mm, position_mm[:, 2], heights)
    add_bar(figure, heights, [axes], **BELOW)
    path = {"color": theme.MEASURED, "zorder": OVER}
    axes.plot(*trajectory.position_mm[:, :2].T, **path, linewidth=1.2, label="nozzle path from the dot")
    axes.plot(*trajectory.position_mm[0, :2], "o", **path, markersize=5)
    # The legend shows the line on mortar, since it would be invisible on a dark page.
    on_mortar = [withStroke(linewidth=5.0, foreground=theme.GROUND)]
    label = f"walls in the {outline.seen_in}"
    axes.plot([], [], color=theme.ON_GROUND, linewidth=0.9, path_effects=on_mortar, label=label)
    return theme.label_axes(axes, "x (mm)", "y (mm)", "From above: particles by height", legend=2)


@theme.themed()
def draw_sections(run: Run, outline: Outline, solid: Solid) -> Figure:
    """Draw sections across the crack at three places, with particles coloured by age."""
    figure, stays = theme.plate(3.6), ~run.spilled
    row = figure.subplots(1, len(SECTIONS_AT), sharey=True)
    Views(outline, solid, run.radius_mm).draw_across(row, run.position_mm[stays], run.age_s[stays], _ages(run))
    return figure


def _ages(run: Run) -> ColourScale:
    return age_scale(float(run.age_s.max(initial=1.0)))


def square_on(solid: Solid) -> float:
    """Return the azimuth of a view at right angles to the cavity's long side."""
    cavity = np.unique(solid.faces[np.isin(solid.face_label, (FaceLabel.WALL, FaceLabel.FLOOR))])
    plan = solid.vertices_mm[cavity, :2]
    _, _, axes = np.linalg.svd(plan - plan.mean(axis=0), full_matrices=False)
    azimuth_deg = float(np.degrees(np.arctan2(axes[0, 1], axes[0, 0])))
    return (azimuth_deg + 90) % 180 - 90
