"""Cracks that leave the crack that is measured: found in the dark that hangs together with it."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.finding.beside import unlike_length_px
from digitise.finding.crack_path import CrackPath
from digitise.finding.medial import LEAST_BRANCH, LEAST_BRANCH_PX, radius, side_lines
from digitise.geometry.polyline import resampled, smoothed
from digitise.photo import Photo
from digitise.pictures.raster import shrunk
from digitise.walls.contrast import Contrast, contrast
from digitise.walls.patch import patch_around
from digitise.walls.traced import LEAST_WIDTH_PX
from sealtwin.records import Floats, Integers, arc_length

WORK_PX = 30.0
"""Width of the crack in the copy that is searched: a side crack of a tenth of it is three pixels wide."""
AROUND = 0.5
"""Lengths of the path, to either side of it, within which side cracks are looked for."""
AS_DARK = 0.6
"""Of ``edge_fraction``: brighter in their middle, side lines are scratches, stains or shadows."""
AS_WIDE = 1.5
"""Crack widths: what is wider is no crack that leaves this one."""


EDGE = 0.9
"""Share of a line with unlike sides from which it is the edge of something, as of a sample whose size is not known."""


@dataclass(frozen=True)
class SideCrack:
    """One as it is found. Places count in the patch."""

    line_px: Floats
    """Along its middle, from the main crack's wall to its tip, or to the wall again: (n, 2), a pixel apart."""
    half_px: float
    """Half of its width, in the median."""
    comes_back: bool


@dataclass(frozen=True)
class SideCracks:
    """All those of a path, and what they were seen in."""

    found: tuple[SideCrack, ...]
    levels: Contrast
    crack: NDArray[np.bool_]
    """The main crack and all that hangs together with it, pixel by pixel of the patch."""
    way_px: Floats
    """The path, in the patch."""
    width_px: float
    edge_fraction: float


def find_side_cracks(photo: Photo, path: CrackPath, edge_fraction: float) -> SideCracks:
    """Where light has risen by less than ``edge_fraction`` of the contrast, is crack."""
    width_px = max(path.width_px, LEAST_WIDTH_PX)
    patch = patch_around(photo, path.points_px, AROUND * float(arc_length(path.points_px)[-1]))
    levels = contrast(photo, path, patch)
    way_px, (height, width) = path.points_px - patch.offset_px, patch.soft.shape
    scale = min(1.0, WORK_PX / width_px)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    small, shown = levels.share_of(shrunk(patch.soft, size)), shrunk(levels.sample.astype(np.float32), size) > 0.99
    way = np.clip(_cells((way_px + 0.5) * scale - 0.5), 0, np.array(small.shape) - 1)
    region = holding((small < edge_fraction) & shown, way)
    way = way[region[tuple(way.T)]]
    least = max(LEAST_BRANCH * width_px, LEAST_BRANCH_PX) * scale
    lines = side_lines(region, way, least) if len(way) > 1 else []
    to_rim = radius(region)
    found = []
    for line in lines:
        half = float(np.median(to_rim[tuple(line.cells.T)]))
        dark = np.median(small[tuple(line.cells.T)]) < AS_DARK * edge_fraction
        if dark and 2 * half < AS_WIDE * width_px * scale:
            line_px = (_to_the_tip(line.cells, to_rim, line.comes_back) + 0.5) / scale - 0.5
            line_px, half_px = smoothed(resampled(line_px, 1.0), half / scale), half / scale
            unlike_px = unlike_length_px(photo, line_px + patch.offset_px, 2 * half_px)
            if unlike_px < EDGE * len(line_px):
                found.append(SideCrack(line_px, half_px, line.comes_back))
    crack = np.zeros_like(levels.sample)
    if found:
        crack = holding((levels.share < edge_fraction) & levels.sample, _cells(way_px))
    return SideCracks(tuple(found), levels, crack, way_px, width_px, edge_fraction)


def holding(mask: NDArray[np.bool_], way: Integers) -> NDArray[np.bool_]:
    """The piece of a mask, joined along edges of cells, that holds most of a way, in rows and columns."""
    label = np.asarray(cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)[1])
    passed = label[tuple(np.clip(way, 0, np.array(mask.shape) - 1).T)]
    passed = passed[passed > 0]
    return label == np.bincount(passed).argmax() if len(passed) else np.zeros_like(mask)


def _cells(places_px: Floats) -> Integers:
    """Row and column of each place."""
    return np.rint(places_px[:, ::-1]).astype(np.int64)


def _to_the_tip(cells: Integers, to_rim: Floats, comes_back: bool) -> Floats:
    """Places along cells, and as much beyond the last as is crack: a skeleton stops where a tip's rim rounds off."""
    places = cells[:, ::-1].astype(float)
    left = float(to_rim[tuple(cells[-1])])
    behind = places[-1] - places[max(0, len(places) - 3 - round(2 * left))]
    if comes_back or not behind.any():
        return places
    return np.vstack([places, places[-1] + left * behind / np.linalg.norm(behind)])
