"""Pictures of the sample and its fill: the block, side view, top view, sections."""

from typing import Any

import numpy as np
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.records import FaceLabel, Outline, Profile, Run, Solid, Trajectory
from validate.figures import theme
from validate.figures.particles import (
    SECTIONS_AT,
    ColourScale,
    add_bar,
    age_scale,
    draw_across,
    draw_discs,
    draw_walls,
    show_from_above,
    show_to_scale,
)
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
    """Draw the particles from the side, coloured by age, with the level that was measured from them."""
    figure = theme.plate(2.7)
    axes = figure.add_subplot()
    s_mm = arc_length_at(run.position_mm[:, :2], outline.centreline_mm)
    shown = ~run.spilled & (s_mm > -8) & (s_mm < outline.length_mm + 8)
    along_mm = np.linspace(-6, outline.length_mm + 6, 500)
    theme.draw_ground(axes, along_mm, -solid.depth_at_mm(along_mm), -solid.depth_mm - 2)
    axes.axhline(0.0, color=theme.ON_GROUND, linewidth=0.8)
    axes.set_facecolor(theme.AIR)
    place_mm = np.column_stack([s_mm, run.position_mm[:, 2]])[shown]
    draw_discs(axes, place_mm, run.radius_mm, run.age_s[shown], _ages(run))
    add_bar(figure, _ages(run), [axes], **BELOW)
    axes.plot(profile.s_mm, profile.level_mm, color=theme.AIR, linewidth=3.0)
    label = "profile read from the particles"
    axes.plot(profile.s_mm, profile.level_mm, color=theme.MEASURED, linewidth=1.4, label=label)
    top_mm = max(4.0, float(run.position_mm[shown, 2].max(initial=0.0)) + 1.5)
    show_to_scale(axes, (-6, outline.length_mm + 6), (-solid.depth_mm - 2, top_mm))
    return theme.label_axes(axes, theme.ALONG, "z (mm)", "From the side: particles by age", legend=1)


@theme.themed()
def draw_top_view(run: Run, outline: Outline, solid: Solid, trajectory: Trajectory) -> Figure:
    """Draw the sample from above: particles coloured by height, the traced walls and the nozzle's path."""
    figure = theme.plate(3.6)
    axes = figure.add_subplot()
    x_min, y_min, x_max, y_max = solid.block_mm
    face = Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, facecolor=theme.GROUND, edgecolor="none")
    axes.add_artist(face)
    shown = ~run.spilled
    position_mm = run.position_mm[shown][np.argsort(run.position_mm[shown, 2])]
    heights = ColourScale("z (mm)", theme.HEIGHTS, Normalize())
    draw_discs(axes, position_mm[:, :2], run.radius_mm, position_mm[:, 2], heights)
    add_bar(figure, heights, [axes], **BELOW)
    draw_walls(axes, outline, face)
    axes.plot(*trajectory.position_mm[:, :2].T, color=theme.MEASURED, linewidth=1.2, label="nozzle path from the dot")
    axes.plot(*trajectory.position_mm[0, :2], "o", color=theme.MEASURED, markersize=5)
    # The legend shows the line on mortar, since it would be invisible on a dark page.
    on_mortar = [withStroke(linewidth=5.0, foreground=theme.GROUND)]
    label = f"walls in the {outline.seen_in}"
    axes.plot([], [], color=theme.ON_GROUND, linewidth=0.9, path_effects=on_mortar, label=label)
    show_from_above(axes, outline, solid, 14, "From above: particles by height", legend=2)
    return figure


@theme.themed()
def draw_sections(run: Run, outline: Outline, solid: Solid) -> Figure:
    """Draw sections across the crack at three places, with particles coloured by age."""
    figure, stays = theme.plate(3.6), ~run.spilled
    row = figure.subplots(1, len(SECTIONS_AT), sharey=True)
    draw_across(row, outline, solid, run.position_mm[stays], run.radius_mm, run.age_s[stays], _ages(run))
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
