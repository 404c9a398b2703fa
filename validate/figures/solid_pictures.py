"""Pictures of the sample and its fill: shaded meshes, side view, top view, sections.

A shaded picture is a parallel projection, computed without a display or GL. Hidden surfaces are removed pixel by pixel.
Matplotlib's mplot3d sorts whole triangles instead, and drew the far dam in front of the near one.
"""

import cv2
import numpy as np
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from sealtwin.core.arrays import counted_up, normals
from sealtwin.core.records import FaceLabel, Floats, Integers, Outline, Profile, Run, Solid, Trajectory, unit
from validate.figures.particles import OVER, SECTIONS_AT, ColourScale, Views, add_bar, age_scale
from validate.figures.theme import (
    ALONG,
    GROUND,
    HEIGHTS,
    MEASURED,
    ON_GROUND,
    ON_SEALANT,
    label_axes,
    plate,
    themed,
    wide_figure,
)

FACE_COLOURS = np.array([to_rgb(colour) for colour in (GROUND, "#5b87a6", "#35566e", "#8fb0c6", "#ada497")])
"""Colours of a solid's facets, in the order of ``FaceLabel``."""
INSIDE = (FaceLabel.WALL, FaceLabel.FLOOR)  # Labels of the facets of the cavity
WIDTH_PX = 690  # Width of a plate at 150 dpi

LIGHT = np.array([-0.36, 0.48, 0.8])
"""Unit vector towards the light. Its components point to the right and up in the picture, and towards the viewer."""
DARKEST = 0.55  # Brightness of a facet without light. Its colour can still be compared with the colour scale.
SMOOTHING = 2  # Number of samples along each side of a pixel, which are averaged for smooth edges
MAX_AT_ONCE = 200_000  # Largest number of samples in the bounding boxes of facets computed together (20 MB)
FLAT = 1e-9  # Smallest width of a row, in samples, by which the change of nearness is divided


@themed()
def draw_solid(solid: Solid) -> Figure:
    """Draw the block from above, and its cavity from the side as a cast. Both are as wide as the figure."""
    colour = FACE_COLOURS[solid.face_label]
    azimuth_deg = square_on(solid)
    cavity = np.isin(solid.face_label, INSIDE)
    dams = ", with the dams at its open ends" if solid.figures.dams else ""
    volume = f"{solid.cavity_volume_mm3 / 1000:.2f} ml, {solid.depth_mm:g} mm deep"
    view_deg = azimuth_deg - 40, 42
    # Facets of a closed body that face away are hidden.
    front = facet_normals(solid.vertices_mm, solid.faces) @ view_axes(*view_deg)[2] > 0
    block = render(solid.vertices_mm, solid.faces[front], colour[front], *view_deg, WIDTH_PX)
    cast = render(solid.vertices_mm, solid.faces[cavity], colour[cavity], azimuth_deg, 14, WIDTH_PX)
    figure = plate(3.6)
    figure.subplots_adjust(0.01, 0.01, 0.99)
    pictures = ((block, f"The sample{dams}"), (cast, f"Its cavity alone, {volume}"))
    for axes, (picture, title) in zip(figure.subplots(2, 1, height_ratios=(2.1, 1.0)), pictures, strict=True):
        axes.imshow(picture)
        axes.set_title(title)
        axes.set_axis_off()
        axes.set_anchor("NW")
    return figure


@themed()
def draw_still(still: NDArray[np.uint8], oldest_s: float) -> Figure:
    """Draw a picture of the fill in three dimensions, (h, w, 4), with its colour bar."""
    figure = wide_figure(4.6)
    axes = figure.add_subplot()
    axes.imshow(still)
    axes.set_axis_off()
    add_bar(figure, age_scale(oldest_s), axes, location="bottom", shrink=0.5, aspect=40, pad=0.02)
    return figure


@themed()
def draw_side_view(run: Run, outline: Outline, solid: Solid, profile: Profile) -> Figure:
    """Draw the section along the crack with particles coloured by age, and the level measured from them."""
    figure, (position_mm, age_s, scale) = plate(2.7), _settled(run)
    axes = figure.add_subplot()
    Views(outline, solid, run.radius_mm).draw_along(axes, position_mm, age_s, scale)
    add_bar(figure, scale, axes)
    axes.plot(
        profile.s_mm,
        profile.level_mm,
        color=MEASURED,
        linewidth=1.4,
        path_effects=ON_SEALANT,
        label="level measured from the particles",
    )
    axes.set_ylim(top=max(4.0, float(position_mm[:, 2].max(initial=0.0)) + 1.5))
    return label_axes(axes, ALONG, "z (mm)", "From the side: particles by age", legend=1)


@themed()
def draw_top_view(run: Run, outline: Outline, solid: Solid, trajectory: Trajectory) -> Figure:
    """Draw the sample from above: particles coloured by height, the traced walls and the nozzle's path."""
    figure, (position_mm, _, _), heights = plate(3.6), _settled(run), ColourScale("z (mm)", HEIGHTS, Normalize())
    axes = figure.add_subplot()
    Views(outline, solid, run.radius_mm).draw_from_above(axes, 14, position_mm, position_mm[:, 2], heights)
    add_bar(figure, heights, axes)
    path = {"color": MEASURED, "zorder": OVER}
    axes.plot(*trajectory.position_mm[:, :2].T, **path, linewidth=1.2, label="nozzle path from the dot")
    axes.plot(*trajectory.position_mm[0, :2], "o", **path, markersize=5)
    # The legend shows the line on mortar, since it would be invisible on a dark page.
    on_mortar = [withStroke(linewidth=5.0, foreground=GROUND)]
    label = f"walls in the {outline.seen_in}"
    axes.plot([], [], color=ON_GROUND, linewidth=0.9, path_effects=on_mortar, label=label)
    return label_axes(axes, "x (mm)", "y (mm)", "From above: particles by height", legend=2)


@themed()
def draw_sections(run: Run, outline: Outline, solid: Solid) -> Figure:
    """Draw sections across the crack at three positions, with particles coloured by age."""
    figure = plate(3.6)
    row = figure.subplots(1, len(SECTIONS_AT), sharey=True)
    Views(outline, solid, run.radius_mm).draw_across(row, *_settled(run))
    return figure


def _settled(run: Run) -> tuple[Floats, Floats, ColourScale]:
    """Return the positions, (n, 3), and ages, (n,), of the particles on the sample, and the scale of ages."""
    stays = ~run.spilled
    return run.position_mm[stays], run.age_s[stays], age_scale(float(run.age_s.max(initial=1.0)))


def square_on(solid: Solid) -> float:
    """Return the azimuth of a view at right angles to the cavity's long side."""
    cavity = np.unique(solid.faces[np.isin(solid.face_label, INSIDE)])
    plan = solid.vertices_mm[cavity, :2]
    _, _, axes = np.linalg.svd(plan - plan.mean(axis=0), full_matrices=False)
    azimuth_deg = float(np.degrees(np.arctan2(axes[0, 1], axes[0, 0])))
    return (azimuth_deg + 90) % 180 - 90


def render(
    vertices_mm: Floats,
    faces: Integers,
    face_colour: Floats,
    azimuth_deg: float,
    elevation_deg: float,
    width_px: int,
    face_normal: Floats | None = None,
) -> NDArray[np.uint8]:
    """Return an RGBA picture of a mesh, (h, w, 4), ``width_px`` wide, with a transparent background.

    At ``azimuth_deg`` 0 the view is along +y, and at ``elevation_deg`` 90 straight down. ``face_colour`` is (f, 3),
    from 0 to 1. ``face_normal`` (f, 3) replaces the facets' normals for the shading. Facets that face away are drawn
    too.
    """
    right, up, toward = view_axes(azimuth_deg, elevation_deg)
    used, corner = np.unique(faces, return_inverse=True)
    # Coordinates to the right and down in the picture, and toward the viewer, in samples.
    vertices = vertices_mm[used] @ np.column_stack([right, -up, toward])
    vertices -= vertices.min(axis=0)
    vertices *= width_px * SMOOTHING / vertices[:, 0].max()
    width, height = width_px * SMOOTHING, int(np.ceil(vertices[:, 1].max() / SMOOTHING)) * SMOOTHING

    normal = facet_normals(vertices_mm, faces) if face_normal is None else face_normal
    # Facets that face away are lit from their back.
    normal = np.copysign(1.0, normal @ toward)[:, None] * normal
    shade = DARKEST + (1 - DARKEST) * np.clip(normal @ (LIGHT @ np.array([right, up, toward])), 0.0, 1.0)
    triangle, owner = vertices[corner.reshape(faces.shape)], np.full(height * width, -1)
    nearest = np.full(height * width, -np.inf)
    sizes = np.cumsum(np.prod(np.ptp(triangle[..., :2], axis=1) + 1, axis=1))
    batches = np.searchsorted(sizes, np.arange(MAX_AT_ONCE, sizes[-1], MAX_AT_ONCE))
    for part in np.split(np.arange(len(faces)), np.unique(batches)):
        facet, sample, nearness = _covered(triangle[part], width, height)
        np.maximum.at(nearest, sample, nearness)
        front = nearness == nearest[sample]
        owner[sample[front]] = part[facet[front]]
    # The last row is the colour of samples that no facet covers.
    colour = np.zeros((len(faces) + 1, 4), np.float32)
    colour[:-1, :3] = face_colour * shade[:, None]
    colour[:-1, 3] = 1.0
    samples = colour[owner].reshape(height, width, 4)
    mean = cv2.resize(samples, (width_px, height // SMOOTHING), interpolation=cv2.INTER_AREA)
    # The average is over covered samples only; otherwise edges would darken.
    mean[..., :3] /= np.where(mean[..., 3:] > 0, mean[..., 3:], 1.0)
    return np.round(255 * np.clip(mean, 0, 1)).astype(np.uint8)


def view_axes(azimuth_deg: float, elevation_deg: float) -> tuple[Floats, Floats, Floats]:
    """Return three unit vectors, (3,) each: to the right and up in the picture, and towards the viewer."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    right = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    away = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    toward = -np.cos(elevation) * away + np.array([0.0, 0.0, np.sin(elevation)])
    return right, np.cross(toward, right), toward


def facet_normals(vertices_mm: Floats, faces: Integers) -> Floats:
    """Return the outward unit normal of each facet, (f, 3). It is zero for a facet without area."""
    return unit(normals(vertices_mm[faces]))


def _covered(corner: Floats, width: int, height: int) -> tuple[Integers, Integers, Floats]:
    """Return the samples that triangles cover: triangle, sample and nearness to the viewer, (n,) each.

    ``corner`` is (f, 3, 3): the corners' coordinates to the right, down and towards the viewer. Triangles are filled
    row by row, so that slivers cost little.
    """
    y = corner[..., 1]
    first = np.maximum(np.ceil(y.min(axis=1) - 0.5), 0).astype(int)
    last = np.minimum(np.floor(y.max(axis=1) - 0.5), height - 1).astype(int)
    triangle, row = counted_up(last - first + 1, first)
    # A row's middle crosses two of the three edges of its triangle, or ends at a corner of two edges.
    start, step = corner[triangle], np.roll(corner, -1, axis=1)[triangle] - corner[triangle]
    share = (row[:, None] + 0.5 - start[..., 1]) / np.where(step[..., 1] == 0, np.nan, step[..., 1])
    crosses = (share >= 0) & (share <= 1)
    crossing = start + np.where(crosses, share, 0.0)[..., None] * step
    rows = np.arange(len(row))
    left = crossing[rows, np.where(crosses, crossing[..., 0], np.inf).argmin(axis=1)]
    right = crossing[rows, np.where(crosses, crossing[..., 0], -np.inf).argmax(axis=1)]
    begin = np.clip(np.ceil(left[:, 0] - 0.5), 0, width).astype(int)
    end = np.clip(np.floor(right[:, 0] - 0.5), -1, width - 1).astype(int)
    span, column = counted_up(np.where(crosses.any(axis=1), end - begin + 1, 0), begin)
    slope = (right[:, 2] - left[:, 2]) / np.maximum(right[:, 0] - left[:, 0], FLAT)
    nearness = left[span, 2] + slope[span] * (column + 0.5 - left[span, 0])
    return triangle[span], row[span] * width + column, nearness
