"""A second photo lit from the other side, so that each wall is dark in one of them: the darker of both is used."""

from pathlib import Path

import cv2
import numpy as np

from digitise.image.raster import Map, moved
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

TILES = 3  # Tiles along each side of the photo; a rotation of the camera shifts each differently
TILE_PX = 512
GRAIN_PX, LIGHT_PX = 1, 17  # Blur that keeps a tile's grain; width above which light varies more than grain
GRAINS = 2.0  # Largest difference that counts, over the median grain; more is a difference in light, not in place
SEEN = 0.2  # Least height of a tile's phase correlation: over 0.7 where both photos show the same grain, 0.02 where not
MOST_MOVED_PX = 2.0  # Largest shift that is corrected, as of a tripod that was touched
MOST_APART_PX = 1.0  # Largest difference of a tile's shift from the median; more is a rotation, which no shift corrects
LEAST_MOVED_PX = 0.1  # Smallest shift that is corrected; resampling for less would blur more than it corrects


def darker_of_both(light: Map, second: Map, file: Path) -> tuple[Map, tuple[str, ...]]:
    """Return the lower light of both photos, the second aligned, and warnings. Raises InputError for ``file``."""
    if second.shape != light.shape:
        raise InputError(
            f"{file}: the second photo is {second.shape[1]} x {second.shape[0]} px, the first {light.shape[1]} x "
            f"{light.shape[0]}: take both with the same camera, and do not crop them."
        )
    shifts_px, seen = _shifts(light, second)
    if np.mean(seen) < 0.5:
        raise InputError(
            f"{file}: the second photo does not show the scene of the first; keep the camera in place, and move only "
            "the lamp."
        )
    shift_px = np.median(shifts_px[seen], axis=0)
    (x_px, y_px), moved_px = shift_px, float(np.linalg.norm(shift_px))
    apart_px = float(np.linalg.norm(shifts_px[seen] - shift_px, axis=1).max())
    if moved_px > MOST_MOVED_PX or apart_px > MOST_APART_PX:
        raise InputError(
            f"{file}: the camera has moved by {moved_px + apart_px:.1f} px since the first photo; at most "
            f"{MOST_MOVED_PX:g} can be corrected. Take both from a tripod, by remote release or timer."
        )
    aligned = second * np.float32(np.median(light[::4, ::4]) / np.median(second[::4, ::4]))
    warnings: list[str] = []
    if moved_px > LEAST_MOVED_PX:
        aligned = moved(aligned, -x_px, -y_px, cv2.INTER_CUBIC, cv2.BORDER_REPLICATE)
        warnings.append(f"the second photo was moved by {moved_px:.1f} px onto the first; a tripod avoids that")
    if not np.all(seen):
        warnings.append(
            f"in {np.sum(~seen)} of {len(seen)} parts, the second photo does not show the scene of the first: check "
            "that both are of one sample"
        )
    return np.minimum(light, aligned), tuple(warnings)


def _shifts(light: Map, second: Map) -> tuple[Floats, np.ndarray]:
    """Return the shift of the second photo in each tile, px (n, 2), and the tiles in which it can be measured."""
    tiles = [(light[part], second[part]) for part in _parts(light.shape)]
    window = np.asarray(cv2.createHanningWindow(tiles[0][0].shape[::-1], cv2.CV_32F))
    # Roots of light, so that glare does not outweigh grain.
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
    """Return the shift with which most of both tiles' grain agrees."""
    grain, others = _grain(tile), _grain(other)
    most = GRAINS * np.median(np.abs(grain))
    back = (moved(others, -x_px, -y_px, cv2.INTER_CUBIC, cv2.BORDER_REPLICATE) for x_px, y_px in shifts_px)
    return shifts_px[int(np.argmin([np.minimum(np.abs(grain - other), most).mean() for other in back]))]


def _grain(tile: Map) -> Map:
    """Return a tile without its exposure and the slow changes of the light."""
    root = cv2.GaussianBlur(np.sqrt(tile / np.mean(tile)), (0, 0), GRAIN_PX)
    return np.asarray(root - cv2.blur(root, (LIGHT_PX, LIGHT_PX)), dtype=np.float32)
