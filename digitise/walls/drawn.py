"""Change the photo where a user drew, so that the walls are then measured where they were drawn.

Everything between the path and a line along a wall, or a stroke over crack, is surely crack. Everything beyond a line
along a wall, or a stroke over ground, is surely ground. Near a stroke over crack, pixels become crack if their
lightness is nearer to the lightness under the stroke than to the ground's. Near a stroke over ground, pixels become
ground if their lightness is nearer to the lightness under the stroke than to the crack's. Therefore a few strokes are
enough.
"""

from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from scipy.spatial import KDTree

from digitise.crack_path.hints import CrackPath, listed, snap_px
from digitise.geometry.polyline import depth_inside, resampled
from digitise.image.raster import Mask, blurred, draw_line, filled_polygon, lightness, sampled, window_around
from digitise.photo import Photo
from digitise.settings import PhotoInput, Strokes
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, Facts, doubt
from sealtwin.core.records import Booleans, Floats

Kind = Literal["crack", "ground", "wall"]


# Constants of drawn lines. "widths" are widths of the path.
#
# A longer ``REACH`` needs fewer strokes, and moves more walls that were right.
# Largest number of points to which a line is resampled, a pixel apart, or farther apart for a longer line
MAX_POINTS = 5000
BRUSH_PX = 3  # Width of a stroke
MAX_AWAY = 3.0  # A line must be within this many widths, or twice ``snap_px``, of the path, except over ground
END_WIDTHS = 0.5  # A line may extend this many widths, or ``END_PX``, past the path's ends
END_PX = 6.0
REACH = 3.0  # Light is compared within this many widths, or ``REACH_PX``, around a stroke
REACH_PX = 30.0
SOFT_PX = 1.5  # Sigma of a blur that reduces grain before lightness is compared
DARKEST = 20.0  # Percentile of an area's brightness by which areas are compared
GROUND = 60.0  # Percentile of the brightness around a line that is taken for the ground's


class ByHand(NamedTuple):
    """The photo after the changes by drawn lines."""

    photo: Photo
    decided: Mask | None = None  # 255 on pixels that lines decide, 0 elsewhere; None without lines
    warnings: Facts = ()


class _Line(NamedTuple):
    """A drawn line beside the path."""

    kind: Kind
    name: str
    place_px: Floats  # (n, 2)
    foot_px: Floats  # Nearest point of the path for each point of the line, (n, 2)


def with_drawn(photo: Photo, path: CrackPath, settings: PhotoInput) -> ByHand:
    """Return the photo, changed by the drawn lines of ``settings``.

    Raises InputError for lines that contradict each other, that leave this crack, or that mark its path as ground.
    """
    if not settings.drawn_by_hand:
        return ByHand(photo)
    width_px, warnings = max(path.width_px, 4.0), []
    lines, light = _lines(photo, path, settings, width_px, warnings), photo.brightness.copy()
    sure, decided = np.zeros((2, *light.shape), np.uint8), np.zeros(light.shape, np.uint8)
    dark, reach_px = float(np.median(sampled(light, path.points_px))), max(REACH * width_px, REACH_PX)
    # What is surely crack or ground comes last, so that no lightness changes it.
    for line in sorted(lines, key=lambda line: line.kind == "wall"):
        low, window = window_around(line.place_px, reach_px, photo.size_px)
        part, line_px, foot = light[window], line.place_px - low, line.foot_px - low
        outward = (line_px - foot) / np.maximum(np.linalg.norm(line_px - foot, axis=1), 1.0)[:, None]
        areas = _between(part.shape, line_px, foot), _between(part.shape, line_px, line_px + width_px * outward)
        near = _stroke(part.shape, line_px, 1 if line.kind == "wall" else 2 * reach_px)
        bright = float(np.percentile(part, GROUND))
        between, beyond = (float(np.percentile(part[area], DARKEST)) for area in areas)
        if line.kind == "ground" and beyond < between:
            raise InputError(
                f"{photo.file}: {line.name}, at {listed(line.place_px[:1])} px, has darker ground beyond it than "
                "between it and the path. If the crack takes another way, give via_px there."
            )
        if line.kind != "wall":
            soft = blurred(lightness(part), SOFT_PX)
            under = float(np.median(sampled(soft, line_px)))
            crack, ground = (float(lightness(np.array(level))) for level in (dark, bright))
            if line.kind == "crack":
                part[near & (soft < (under + ground) / 2)] = dark
            else:
                lighter = near & (soft > (under + crack) / 2)
                part[lighter] = np.maximum(part[lighter], bright)
        decided[window][near] = 255
        body = _stroke(part.shape, line_px, BRUSH_PX)
        for number, kind in enumerate(("crack", "ground")):
            crossed = body & (sure[1 - number][window] > 0)
            if line.kind == kind and crossed.any():
                place_px = np.argwhere(crossed)[:1, ::-1] + low
                raise InputError(
                    f"{photo.file}: {line.name}, contradicts a stroke at {listed(place_px)} px: one of them marks the "
                    "same pixels as crack, and the other as ground. Remove one of them."
                )
            if line.kind in (kind, "wall"):
                area = areas[number] if line.kind == "wall" else areas[number] | body
                sure[number][window][area], sure[1 - number][window][area] = 255, 0
    crack, ground = sure > 0
    light[ground] = np.maximum(light[ground], float(np.percentile(light, GROUND)))
    light[crack] = dark
    return ByHand(replace(photo, brightness=light), decided | sure[0] | sure[1], tuple(warnings))


def _between(shape: tuple[int, ...], first: Floats, second: Floats) -> Booleans:
    """Return a mask of the region between two lines."""
    return filled_polygon(shape, np.concatenate([first, second[::-1]])) > 0


def _stroke(shape: tuple[int, ...], line: Floats, width: float) -> Booleans:
    area = np.zeros(shape, np.uint8)
    draw_line(area, line, width=width)
    return area > 0


def _lines(photo: Photo, path: CrackPath, settings: PhotoInput, width_px: float, warnings: list[Fact]) -> list[_Line]:
    """Return the drawn lines beside the path, and add a warning for each stroke over ground elsewhere.

    Raises InputError for a line that leaves the photo, is not on this crack, or crosses it.
    """
    way_px = resampled(path.points_px, 1.0)
    tree, (width, height) = KDTree(way_px), photo.size_px
    most_px, beyond_px = max(MAX_AWAY * width_px, 2 * snap_px(photo)), max(END_WIDTHS * width_px, END_PX)
    drawn: tuple[tuple[Kind, str, Strokes | None], ...] = (
        ("crack", "crack_strokes_px, stroke", settings.crack_strokes_px),
        ("ground", "ground_strokes_px, stroke", settings.ground_strokes_px),
        ("wall", "walls_px, line", settings.walls_px),
    )
    lines = []
    for kind, names, points in drawn:
        for number, points_px in enumerate(points or (), start=1):
            line_px, name = np.array(points_px, float), f"photo.{names} {number}"
            if depth_inside(line_px, (-0.5, -0.5, width - 0.5, height - 0.5)).min() < 0:
                raise InputError(
                    f"{photo.file}: {name}, leaves the photo of {width} x {height} px. Draw it inside the photo."
                )
            length_px = arc_length(line_px)[-1]
            place_px = resampled(line_px, max(1.0, length_px / MAX_POINTS)) if length_px > 0 else line_px[[0, 0]]
            away_px, nearest = tree.query(place_px)
            at_end = np.isin(nearest, (0, len(way_px) - 1))
            off_px = away_px - np.where(at_end, beyond_px, most_px)
            if kind == "ground" and off_px.min() > 0:
                warnings.append(doubt("walls.stroke-aside", f"{name}, is not beside this crack and changes nothing"))
                continue
            if kind != "ground" and off_px.max() > 0:
                raise InputError(
                    f"{photo.file}: {name}, is not on this crack at {listed(place_px[[off_px.argmax()]])} px. Draw it "
                    f"between the crack's ends, at most {most_px:.0f} px from its path. If the crack takes another "
                    "way, give via_px there."
                )
            if kind != "crack" and away_px.min() < BRUSH_PX / 2:
                raise InputError(
                    f"{photo.file}: {name}, crosses the crack at {listed(place_px[[away_px.argmin()]])} px. Draw it "
                    "on one side of the path. If the crack takes another way, give via_px there, or paint the crack "
                    "in photo.mask."
                )
            lines.append(_Line(kind, name, place_px, way_px[nearest]))
    return lines
