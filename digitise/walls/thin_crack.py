"""Measure cracks too thin for walls: follow the darkest line to a fraction of a pixel, and fit the width."""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from digitise.crack_path.hints import IN_ITS_MIDDLE, CrackPath
from digitise.crack_path.line_map import WORK_PX
from digitise.crack_path.standing_out import is_darker_than_both_sides, unlike_length_px
from digitise.geometry.polyline import depth_inside, left_normals, resampled, smoothed, unit
from digitise.image.raster import sampled
from digitise.photo import Photo
from digitise.walls.box_fit import BoxFit, fit_box
from digitise.walls.centreline_and_walls import Traced
from digitise.walls.ends import PathEnd, judge_end
from digitise.walls.straightened import Patch, patch_around
from digitise.walls.wall_profile import cheapest_way
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.core.solid_figures import EndKind

STATION_PX, STEP_PX = 1.0, 0.5  # Spacing of stations along the line and of samples across


# Constants of following a thin crack's line and fitting its width. "widths" are widths of the path.
#
# Chosen on the drawn photos on which ``box_fit`` was set. A wider ``NEAR_PX`` recovers from worse paths and meets
# more neighbouring lines; a longer ``WINDOW`` averages more grain and follows fewer changes of width.
WINDOW = 10  # Stations in a window; its mean profile is fitted
REACH = 1.5  # Widths to either side that are fitted, plus ``REACH_PX``; as much again is the ground
REACH_PX = 6.0
CELLS = 2.0  # Largest distance of a path from the crack, in cells of the search map
NEAR_PX = 3.0  # Distance, beyond half a width, within which the line is followed a second time
ALONG = 2.0  # Blur along the line before it is followed, in stations
ACROSS = 0.4  # Blur across it, in widths
LEAST_ACROSS_PX = 1.0
STIFFNESS = 0.15  # Cost of a step aside by a sample, in darkness
LEAST_SMOOTHING_PX = 4.0  # Least sigma of the line, which is otherwise the width: windows have offsets
DARKEST = 1e-4  # Least light: between pixels a cubic may fall below 0
LEAST_WINDOWS = 5  # Least number of windows; fewer do not separate blur and width
MOST_UNLIKE = 0.5  # Largest share of the path with unlike sides; more is an edge or a wide thing's wall
JUDGED_PX = 8.0  # Least width for which an end is judged: grain ends a hairline for a few px
MOST_ONWARD_PX = 20.0  # Longest way from an open end to the edge of the face; the face's rim is not searched
NARROWEST = 0.1  # Least local width over the mean, so that walls do not cross


class NotFittedError(InputError):
    """The path is along a crack whose width cannot be fitted."""


def trace_line(photo: Photo, path: CrackPath) -> Traced:
    """Follow the darkest line along ``path``; both walls are that line."""
    patch = _patch(photo, path)
    return _placed(photo, patch, path, _line_px(photo, path), np.zeros(1))


def trace_thin(photo: Photo, path: CrackPath) -> tuple[Traced, BoxFit]:
    """Follow the darkest line along ``path`` and fit the crack's width.

    Raises NotFittedError if too little is in view or the sides of the crack differ, and InputError if the path is at an
    edge: one side is far brighter, and the path is about as dark as the other.
    """
    line_px, patch = _line_px(photo, path), _patch(photo, path)
    reach = round((REACH * path.width_px + REACH_PX) / STEP_PX)
    places_px = STEP_PX * np.arange(-reach, reach + 1, dtype=float)
    cuts = np.linspace(0, len(line_px), max(1, len(line_px) // WINDOW) + 1).astype(int)
    light, shown = _windows(photo, patch, line_px, places_px, cuts)
    beside_px = (2 * reach + 1) * STEP_PX
    grounds = (_windows(photo, patch, line_px, places_px + side * beside_px, cuts) for side in (1, -1))
    ground = np.concatenate([values[in_view] for values, in_view in grounds])
    length_px = float(arc_length(path.points_px)[-1])
    if unlike_length_px(photo, path.points_px, path.width_px) > MOST_UNLIKE * length_px:
        if is_darker_than_both_sides(photo, path):
            raise NotFittedError(
                f"{photo.file}: the ground on one side of the crack is far brighter than on the other, so that its "
                f"width of about {path.width_px:.1f} px cannot be fitted. Give width_mm, or path_only if the path is "
                "enough."
            )
        raise InputError(
            f"{photo.file}: one side of the path is far brighter than the other, as if the path followed "
            f"one wall of a wide gap or the sample's edge; {IN_ITS_MIDDLE}."
        )
    if min(np.count_nonzero(shown), len(ground)) < LEAST_WINDOWS:
        raise NotFittedError(
            f"{photo.file}: the crack is {path.width_px:.1f} px wide, and too little of it and of the ground beside it "
            f"is in view to fit its width: {LEAST_WINDOWS} stretches of {WINDOW * STATION_PX:g} px are "
            "needed. Move the camera closer or give width_mm, or path_only if the path is enough."
        )
    fit = fit_box(light[shown], ground, places_px, path.width_px)
    middle, station = (cuts[1:] + cuts[:-1] - 1) / 2, np.arange(len(line_px))
    widths_px, offsets_px = (np.interp(station, middle[shown], each) for each in (fit.widths_px, fit.offsets_px))
    widths_px = np.maximum(widths_px, NARROWEST * fit.mean_px)
    line_px = line_px + offsets_px[:, None] * left_normals(line_px)
    path = replace(path, width_px=max(fit.mean_px, 1.0))
    return _placed(photo, patch, path, line_px, widths_px * fit.mean_px / widths_px.mean()), fit


def _patch(photo: Photo, path: CrackPath) -> Patch:
    return patch_around(photo, path.points_px, 3 * (REACH * path.width_px + REACH_PX))


def _windows(
    photo: Photo, patch: Patch, line_px: Floats, places_px: Floats, cuts: NDArray[np.int_]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the mean light of each window across the line, (windows, places), and True if it shows only the sample."""
    place_px = line_px[:, None] + places_px[:, None] * left_normals(line_px)[:, None]
    # The patch is not used: its softening would hide most of a thin crack.
    light = np.maximum(sampled(photo.brightness, place_px, cv2.INTER_CUBIC).astype(float), DARKEST)
    shown = patch.on_sample(place_px, photo.to_mm(place_px.reshape(-1, 2)).reshape(place_px.shape)).all(axis=1)
    mean = np.add.reduceat(light, cuts[:-1], axis=0) / np.diff(cuts)[:, None]
    return mean, np.logical_and.reduceat(shown, cuts[:-1])


def _line_px(photo: Photo, path: CrackPath) -> Floats:
    """Return a smooth line along the darkest places near the path."""
    line_px, width_px = smoothed(resampled(path.points_px, STATION_PX), ALONG), path.width_px
    cell_px = max(photo.size_px) / WORK_PX
    for reach_px in (CELLS * cell_px + width_px + NEAR_PX, width_px / 2 + NEAR_PX):
        aside_px = _darkest_px(photo, line_px, reach_px, width_px)
        moved_px = line_px + aside_px[:, None] * left_normals(line_px)
        line_px = smoothed(resampled(moved_px, STATION_PX), max(width_px, LEAST_SMOOTHING_PX))
    return line_px


def _darkest_px(photo: Photo, line_px: Floats, reach_px: float, width_px: float) -> Floats:
    """Return the signed distance from each point of a line to the darkest line nearby, positive to the left."""
    reach, around = (int(np.ceil(px / STEP_PX)) for px in (reach_px, width_px + NEAR_PX))
    places_px = STEP_PX * np.arange(-reach - around, reach + around + 1)
    light = sampled(photo.brightness, line_px[:, None] + places_px[:, None] * left_normals(line_px)[:, None])
    dark = 1 - light / np.maximum(np.median(light, axis=1, keepdims=True), DARKEST)
    across = max(ACROSS * width_px, LEAST_ACROSS_PX) / STEP_PX
    dark = gaussian_filter(dark.astype(float), (ALONG, across))[:, around:-around]
    column = np.clip(cheapest_way(-dark[None], STIFFNESS * np.array([1, 0, 1]))[0], 1, dark.shape[1] - 2)
    before, here, after = (np.take_along_axis(dark, column[:, None] + side, 1)[:, 0] for side in (-1, 0, 1))
    # The top of a parabola; there is none if the darkest place is at the edge of the reach.
    bend = np.minimum(before - 2 * here + after, -1e-9)
    return (column - reach + np.clip((before - after) / (2 * bend), -0.5, 0.5)) * STEP_PX


def _placed(photo: Photo, patch: Patch, path: CrackPath, line_px: Floats, widths_px: Floats) -> Traced:
    """Return the crack from end to end in mm, with its walls half a width from the line."""
    widths_px = np.broadcast_to(widths_px, len(line_px))
    aside_px = (REACH * path.width_px + NEAR_PX) * left_normals(line_px)
    threshold = float(np.median(patch.light(line_px)) + np.median(patch.light(line_px + aside_px))) / 2
    kinds: list[EndKind] = []
    for _ in range(2):
        # The line is reversed for its second end.
        ahead = unit(line_px[0] - line_px[min(len(line_px) - 1, WINDOW)])
        end = judge_end(photo, patch, line_px[0], ahead, max(path.width_px, JUDGED_PX), threshold)
        onward_px = _to_the_end(photo, line_px[0], end, ahead)
        line_px = np.vstack([onward_px, line_px])[::-1]
        widths_px = np.pad(widths_px, (len(onward_px), 0), mode="edge")[::-1]
        kinds.append(end.kind)
    half = widths_px[:, None] / 2 * left_normals(line_px)
    # y runs down in the photo, so that left in the photo is right on the face.
    line_mm, right_mm, left_mm = (photo.to_mm(places_px) for places_px in (line_px, line_px + half, line_px - half))
    length_mm = float(arc_length(line_mm)[-1])
    width_px = float(widths_px.mean())
    return Traced(line_mm, left_mm, right_mm, (kinds[0], kinds[1]), (0.0, length_mm), width_px, 0.0, 0.0)


def _to_the_end(photo: Photo, last_px: Floats, end: PathEnd, ahead: Floats) -> Floats:
    """Return the crack's tip beyond ``last_px``, or the edge of the face, (1, 2); empty, (0, 2), if neither exists."""
    onward_px = float((end.place_px - last_px) @ ahead)
    if end.kind == "open" and photo.face_mm is not None:
        steps_px = np.arange(0, MOST_ONWARD_PX, STEP_PX)
        inside_mm = depth_inside(photo.to_mm(last_px + steps_px[:, None] * ahead), photo.face_mm)
        onward_px = float(steps_px[np.argmax(inside_mm < 0)])
    return (last_px + onward_px * ahead)[None] if onward_px > STEP_PX else np.empty((0, 2))
