"""Map how much each point of a photo looks like part of a dark line, of any width and direction.

The map is a small copy of the photo. At each of its cells a bar-shaped filter compares a dark middle with both of its
sides, in eight directions. The filter runs on copies that are halved again and again, so that the widest bar is a tenth
of the photo.
"""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray
from skimage.graph import route_through_array

from digitise.image.raster import (
    DISPLAY_GAMMA,
    Map,
    blurred,
    blurred_copy,
    continued,
    filled_polygon,
    resized,
    scaled_down,
    shrunk,
    window_around,
)
from digitise.photo import Photo
from sealtwin.core.records import Booleans, Floats, Integers

WORK_PX = 1000  # Longer side of the copy. More is not needed for a path, because walls are refined on the photo itself
RIM = 3  # Cells at the map's border that are replaced by the cells next to them
# Minimum displayed brightness to divide by. With less, the noise of a black board would look like lines
MIN_LIGHT = 0.05
CONTINUED = 20.0  # Sigma in cells by which brightness is continued beyond the searched area

# Constants of the filter. Lengths are in cells of the copy that is filtered.
#
# Chosen on drawn roads, on 74 real photos and on photos without cracks. Along 98 % of the real cracks the median
# clearness is over 3.1. Along the darkest paths without a crack it is under 2.7. A longer bar loses winding cracks, and
# a shorter bar finds grains. Sets of photos that came later checked them (benchmarks.real_roads).
SIGMAS = ((0.7,), (0.7, 1.4), (1.4,), (1.4,), (1.4,), (1.4,))  # Sigmas of the bar on each halved copy
# Minimum shorter side of a halved copy, in cells. With 20, a streak inside the crack was followed in three of the sound
# trials. 244 real photos checked it
MIN_SIDE = 12
DIRECTIONS = 8  # Number of directions in half a turn
ELONGATION = 2.5  # Length of the bar divided by its width
MIDDLE, SIDE = 0.7, 2.2  # Width of the bar, and distance of its sides from its middle, in sigmas
ONE_SIDED = 0.5  # Fraction of the sides' difference that is subtracted: an edge is darker than one side only
# Sigma of the mean by which brightness is divided: on the first copy, and its minimum on smaller copies
SIGMA, MIN_SIGMA = 20.0, 12.0
NOISE, MIN_NOISE = 40.0, 5.0  # Sigma over which noise is averaged: on the first copy, and its minimum on smaller copies
# In the noise, a response is limited to this many median responses, so that cracks do not count as noise
NOISE_RESPONSES = 4.0
MEAN_SIZE = 1.25  # Standard deviation of a normal distribution, divided by its mean absolute value
# Minimum noise of brightness, from rounding to 8 bits. Minimum noise for wide bars, from soft shadows
QUIET, QUIET_WIDE = 2e-3, 0.06
WIDE_FROM = 3  # Index of the first halved copy with wide bars
WIDTH = 2.4  # Width of the line that fits a bar best, in sigmas of the bar

CLEARNESS_LIMIT = 8.0  # More clearness does not lower the cost, so that a strong grain causes no detour
BY_CLEARNESS = 0.7  # Weight of clearness in a line's worth. The rest is the weight of contrast
NOTHING = 0.04  # Worth of a step off any line: a gap costs as much as a line 25 times as long
MIN_CONTRAST = 0.1  # Contrast is divided by the photo's largest contrast, but at least by this
# Margin around the box of two points: as a fraction of their distance, and its minimum in px
ROOM, MIN_ROOM_PX = 0.5, 100.0


@dataclass(frozen=True)
class LineMap:
    """A small copy of a photo, or of a region of it, with the filter's results. All maps have the copy's shape."""

    offset_px: tuple[float, float]  # x and y of the copy's upper left corner in the photo
    scale: float  # Cells per pixel of the photo
    shown: Map  # Displayed brightness
    clear: Map  # Response of the filter, in units of the noise around the cell
    contrast: Map  # Response of the filter to displayed brightness divided by its local mean
    width: Map  # Width in cells of the line that fits best
    allowed: Booleans  # True for cells on the face that no marker covers

    def to_cells(self, points_px: Floats) -> Floats:
        """Convert points in the photo, (n, 2) as x and y in px, to positions in the map, as column and row."""
        return (np.asarray(points_px, float) - self.offset_px + 0.5) * self.scale - 0.5

    def to_photo(self, places: Floats | Integers) -> Floats:
        return (np.asarray(places, float) + 0.5) / self.scale - 0.5 + self.offset_px

    def clear_along(self, cells: Integers) -> Floats:
        """Return the clearness of cells, at most ``CLEARNESS_LIMIT``. ``cells`` are rows and columns, (n, 2).

        Strong contrast also counts: a contrast of ``MIN_CONTRAST`` counts as a clearness of 1.
        """
        along = tuple(cells.T)
        clear = np.maximum(self.clear[along], self.contrast[along] / np.float32(MIN_CONTRAST))
        return np.minimum(clear, CLEARNESS_LIMIT).astype(float)

    def cost(self, clear: float = CLEARNESS_LIMIT) -> Floats:
        """Return the cost of a step through each cell. A clearness above ``clear`` does not lower the cost further."""
        usual = np.percentile(self.contrast[self.allowed], 99) if self.allowed.any() else 0.0
        share = np.clip(self.contrast / max(usual, MIN_CONTRAST), 0, 1)
        worth = BY_CLEARNESS * np.clip(self.clear, 0, clear) / clear + (1 - BY_CLEARNESS) * share
        return np.where(self.allowed, 1 / (NOTHING + worth), np.inf)


def map_lines(photo: Photo, region_px: Floats | None = None) -> LineMap:
    """Map the lines of the photo, or of a polygon in it, ``region_px``."""
    corners_px = np.array([(0, 0), photo.size_px]) if region_px is None else region_px
    low, window = window_around(corners_px, 0.0, photo.size_px)
    left, top = low.tolist()
    light, allowed = photo.brightness[window], photo.sample_mask()[window]
    if region_px is not None:
        allowed = np.minimum(allowed, filled_polygon(allowed.shape, region_px - (left, top)))
    scale = min(1.0, WORK_PX / max(light.shape))
    light = scaled_down(light, scale)
    allowed = scaled_down(allowed, scale) >= 254
    # In displayed brightness, grain has the same contrast in shadow and in light.
    shown = np.power(np.clip(light, 0, 1), 1 / DISPLAY_GAMMA).astype(np.float32)
    if allowed.any() and not allowed.all():
        # The surroundings must look like the sample, or its edge is the strongest line in the photo.
        shown = np.where(allowed, shown, continued(shown, allowed, CONTINUED))
    # The rim is replaced by the cells next to it: there, a bar has only one side in the photo.
    clear, contrast, width = (
        np.pad(picture[RIM:-RIM, RIM:-RIM], RIM, mode="edge") for picture in _filtered(shown, allowed)
    )
    return LineMap((left, top), scale, shown, clear, contrast, width, allowed)


def _filtered(shown: Map, allowed: Booleans) -> tuple[Map, Map, Map]:
    """Return three maps: clearness, contrast and width of the best line at each cell."""
    clear, contrast, width = (np.zeros_like(shown) for _ in range(3))
    for octave, sigmas in enumerate(SIGMAS):
        size = (shown.shape[1] >> octave, shown.shape[0] >> octave)
        if octave and min(size) < MIN_SIDE:
            break
        copy = shrunk(shown, size)
        mean = np.maximum(blurred(copy, max(SIGMA / 2**octave, MIN_SIGMA)), np.float32(MIN_LIGHT))
        even = np.asarray(copy / mean, np.float32)
        usable = shrunk(allowed.astype(np.float32), size) > 0.99
        for sigma in sigmas:
            responses = np.array([_response(even, sigma, direction) for direction in range(DIRECTIONS)])
            noise = _noise(responses, usable, max(NOISE / 2**octave, MIN_NOISE))
            noise = np.maximum(noise, QUIET if octave < WIDE_FROM else QUIET_WIDE)
            best = responses.max(axis=0)
            np.maximum(clear, resized(best / noise, shown.shape), out=clear)
            response = resized(best, shown.shape)
            width[response > contrast] = WIDTH * sigma * 2**octave
            np.maximum(contrast, response, out=contrast)
    return clear, contrast, width


def _response(even: Map, sigma: float, direction: int) -> Map:
    """Return by how much the two sides are brighter than the middle, minus half of the difference between the sides."""
    middle = np.asarray(cv2.filter2D(even, cv2.CV_32F, _bar(sigma, direction)), np.float32)
    angle = np.pi * direction / DIRECTIONS + np.pi / 2
    left, right = (_moved(middle, side * SIDE * sigma, angle) for side in (1, -1))
    return np.asarray((left + right - ONE_SIDED * np.abs(left - right)) / 2 - middle, np.float32)


def _bar(sigma: float, direction: int) -> Map:
    """Return the weights of a Gaussian mean along a direction. Directions are counted from x to y."""
    reach = int(np.ceil(3 * ELONGATION * sigma))
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    angle = np.pi * direction / DIRECTIONS
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    weight = np.exp(-((along / ELONGATION) ** 2 + (across / MIDDLE) ** 2) / (2 * sigma**2))
    return (weight / weight.sum()).astype(np.float32)


def _moved(picture: Map, distance: float, angle: float) -> Map:
    """Return a picture whose cells have the value that is ``distance`` away in the direction ``angle``."""
    motion = np.array([[1, 0, -distance * np.cos(angle)], [0, 1, -distance * np.sin(angle)]])
    size, mirrored = picture.shape[::-1], cv2.BORDER_REFLECT
    return np.asarray(cv2.warpAffine(picture, motion, size, flags=cv2.INTER_LINEAR, borderMode=mirrored), np.float32)


def _noise(responses: NDArray[np.float32], usable: Booleans, sigma: float) -> Map:
    """Return the standard deviation of the responses around each cell. Strong responses, at cracks, are limited."""
    few = np.abs(responses[:: DIRECTIONS // 4])
    limit = NOISE_RESPONSES * float(np.median(few[:, usable])) if usable.any() else 0.0
    size = np.where(usable, np.minimum(few, limit).mean(axis=0), 0).astype(np.float32)
    total, count = (blurred_copy(picture, sigma) for picture in (size, usable.astype(np.float32)))
    return resized((MEAN_SIZE * total / np.maximum(count, 1e-3)).astype(np.float32), size.shape)


def cheapest_legs(cost: Floats, stops: Integers, scale: float) -> list[Integers]:
    """Return the cheapest path between consecutive stops, as rows and columns, (n, 2) each.

    Each path stays near the bounding box of its two stops. ``scale`` is the number of cells per pixel of the photo.
    """
    legs = []
    for start, end in pairwise(stops):
        room = int(np.ceil(max(MIN_ROOM_PX * scale, ROOM * np.linalg.norm(end - start))))
        low, high = np.maximum(np.minimum(start, end) - room, 0), np.maximum(start, end) + room + 1
        way, _ = route_through_array(cost[low[0] : high[0], low[1] : high[1]], start - low, end - low)
        legs.append(low + np.array(way, np.int64))
    return legs
