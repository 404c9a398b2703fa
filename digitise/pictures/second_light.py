"""A second photo of the same sample from the same camera, lit from the other side: the darker of both is taken.

A lamp from one side lights the wall across the crack, which then looks like mortar; from the other side that wall is
dark.
"""

from pathlib import Path

import cv2
import numpy as np

from digitise.pictures.raster import Map
from sealtwin.errors import InputError
from sealtwin.records import Floats

TILES = 3
"""A side: a camera that was turned has moved each part of the photo differently."""
TILE_PX = 512
GRAIN_PX, LIGHT_PX = 1, 17
"""Blur that keeps a tile's grain and less of its noise; breadth over which light changes more than grain does."""
GRAINS = 2.0
"""Times the usual grain: what differs by more is lit otherwise, and how much more says nothing about a shift."""
SEEN = 0.2
"""Least height of a tile's phase correlation: 0.7 and more where both photos show the same grain, 0.02 where not."""
MOST_MOVED_PX = 2.0
"""A tripod that was touched. Further, and the lens sees another part of the scene."""
MOST_APART_PX = 1.0
"""Of a tile's shift from the usual one: more is a turn or a step, which no shift mends."""
LEAST_MOVED_PX = 0.1
"""Below it, moving the picture would blur more than it mends."""


def darker_of_both(light: Map, second: Map, file: Path) -> tuple[Map, tuple[str, ...]]:
    """The lower of two photos' linear light in each pixel, and warnings.

    The second is first brought to the first one's exposure, and moved onto it. ``file`` is its name. Raises InputError
    where it is of another size or scene, or its camera has moved by more than ``MOST_MOVED_PX``.
    """
    if second.shape != light.shape:
        raise InputError(
            f"{file}: the second photo is {second.shape[1]} x {second.shape[0]} px, the first {light.shape[1]} x "
            f"{light.shape[0]}: take both with the same camera, and crop neither."
        )
    shifts_px, seen = _shifts(light, second)
    if np.mean(seen) < 0.5:
        raise InputError(
            f"{file}: the second photo does not show what the first shows; take both from a camera that stays in its "
            "place, and move the lamp only."
        )
    shift_px = np.median(shifts_px[seen], axis=0)
    moved_px = float(np.linalg.norm(shift_px))
    apart_px = float(np.linalg.norm(shifts_px[seen] - shift_px, axis=1).max())
    if moved_px > MOST_MOVED_PX or apart_px > MOST_APART_PX:
        raise InputError(
            f"{file}: the camera has moved by {moved_px + apart_px:.1f} px since the first photo; at most "
            f"{MOST_MOVED_PX:g} can be mended. Take both from a tripod, by remote release or timer."
        )
    aligned = second * np.float32(np.median(light[::4, ::4]) / np.median(second[::4, ::4]))
    if moved_px > LEAST_MOVED_PX:
        aligned = _moved(aligned, -shift_px)
    return np.minimum(light, aligned), _warnings(moved_px, seen)


def _warnings(moved_px: float, seen: np.ndarray) -> tuple[str, ...]:
    said = []
    if moved_px > LEAST_MOVED_PX:
        said.append(f"the second photo was moved by {moved_px:.1f} px onto the first; a tripod spares that")
    if not np.all(seen):
        said.append(
            f"in {np.sum(~seen)} of {len(seen)} parts, the second photo does not show what the first shows: look at "
            "whether both are of one sample"
        )
    return tuple(said)


def _shifts(light: Map, second: Map) -> tuple[Floats, np.ndarray]:
    """How far the second photo lies from the first in each tile, px (n, 2); and in which tiles that can be told.

    Where each photo shows another wall of the crack lit, that looks like a crack that has moved. A tile full of it
    believes another tile, whose shift lets more of its grain agree.
    """
    tiles = [(light[part], second[part]) for part in _parts(light.shape)]
    window = np.asarray(cv2.createHanningWindow(tiles[0][0].shape[::-1], cv2.CV_32F))
    # Roots of light, so that a glare does not outweigh the grain.
    own = [cv2.phaseCorrelate(np.sqrt(tile), np.sqrt(other), window) for tile, other in tiles]
    shifts_px = np.array([shift_px for shift_px, _ in own])
    seen = np.array([height_of_peak > SEEN for _, height_of_peak in own])
    believed_px = shifts_px.copy()
    for i in np.flatnonzero(seen):
        believed_px[i] = _likeliest(shifts_px[seen], *tiles[i])
    return believed_px, seen


def _parts(shape: tuple[int, ...]) -> list[tuple[slice, slice]]:
    """Rows and columns of each tile."""
    height, width = shape
    most = min(TILE_PX, height // TILES, width // TILES)
    # OpenCV pads a tile to a length that is quick to transform; where that is odd, its shift is half a pixel off.
    side = max(length for length in range(2, most + 1, 2) if cv2.getOptimalDFTSize(length) == length)
    return [
        np.s_[top : top + side, left : left + side]
        for top in np.linspace(0, height - side, TILES).astype(int)
        for left in np.linspace(0, width - side, TILES).astype(int)
    ]


def _likeliest(shifts_px: Floats, tile: Map, other: Map) -> Floats:
    """The one of the shifts that lets most of both tiles' grain agree."""
    grain, others = _grain(tile), _grain(other)
    most = GRAINS * np.median(np.abs(grain))
    apart = [np.minimum(np.abs(grain - _moved(others, -shift_px)), most).mean() for shift_px in shifts_px]
    return shifts_px[int(np.argmin(apart))]


def _grain(tile: Map) -> Map:
    """What is left of a tile without its own exposure and the light's slow changes."""
    root = cv2.GaussianBlur(np.sqrt(tile / np.mean(tile)), (0, 0), GRAIN_PX)
    return np.asarray(root - cv2.blur(root, (LIGHT_PX, LIGHT_PX)), dtype=np.float32)


def _moved(picture: Map, by_px: Floats) -> Map:
    height, width = picture.shape
    motion = np.column_stack([np.eye(2), by_px])
    moved = cv2.warpAffine(picture, motion, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved, dtype=np.float32)
