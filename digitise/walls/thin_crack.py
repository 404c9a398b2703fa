"""Measure cracks too thin for walls: follow the darkest line to a fraction of a pixel, and fit the width."""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from digitise.crack_path.hints import IN_ITS_MIDDLE, CrackPath
from digitise.crack_path.line_map import WORK_PX
from digitise.crack_path.standing_out import is_darker_than_both_sides, unlike_length_px
from digitise.geometry.polyline import left_normals, resampled, smoothed
from digitise.image.raster import sampled
from digitise.photo import Photo
from digitise.walls.box_fit import BoxFit, fit_box
from digitise.walls.ends import Traced, to_its_ends
from digitise.walls.straightened import Patch, patch_around
from digitise.walls.wall_profile import cheapest_way
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

STATION_PX, STEP_PX = 1.0, 0.5  # Spacing of stations along the line and of samples across


# Constants of following a thin crack's line and fitting its width. "widths" are widths of the path.
#
# Chosen on the drawn photos on which ``box_fit`` was set. A wider ``NEAR_PX`` recovers from worse paths and meets
# more neighbouring lines; a longer ``WINDOW`` averages more grain and follows fewer changes of width.
WINDOW = 10  # Stations in a window; its mean profile is fitted
REACH = 1.5  # Widths to either side that are fitted, plus ``REACH_PX``; as much again is the ground
REACH_PX = 6.0
PATCH, PATCH_PX = 4.5, 18.0  # Three times that reach
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
NARROWEST = 0.1  # Least local width over the mean, so that walls do not cross


class NotFittedError(InputError):
    """The path is along a crack whose width cannot be fitted."""


def trace_line(photo: Photo, path: CrackPath) -> Traced:
    """Follow the darkest line along ``path``; both walls are that line."""
    line_px = _line_px(photo, path)
    patch = patch_around(photo, path.points_px, PATCH * path.width_px + PATCH_PX)
    return to_its_ends(photo, patch, (line_px, line_px, line_px), path.width_px)


def trace_thin(photo: Photo, path: CrackPath) -> tuple[Traced, BoxFit]:
    """Follow the darkest line along ``path`` and fit the crack's width.

    Raises NotFittedError if too little is in view or the sides of the crack differ, and InputError if the path is at an
    edge: one side is far brighter, and the path is about as dark as the other.
    """
    line_px, patch = _line_px(photo, path), patch_around(photo, path.points_px, PATCH * path.width_px + PATCH_PX)
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
    half_px = (widths_px * fit.mean_px / widths_px.mean() / 2)[:, None] * left_normals(line_px)
    # y runs down in the photo, so that left in the photo is right on the face.
    lines_px = line_px, line_px - half_px, line_px + half_px
    return to_its_ends(photo, patch, lines_px, max(fit.mean_px, 1.0)), fit


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
    return (cheapest_way(-dark[None], STIFFNESS * np.array([1, 0, 1]))[0] - reach) * STEP_PX
