"""Pictures of the fill: side view, top view, sections."""

from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from sealtwin.core.records import Floats, Outline, Profile, Run, Solid, Trajectory
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
)


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
