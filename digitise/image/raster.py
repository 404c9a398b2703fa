"""Blur, shrink and sample one-channel pictures."""

import cv2
import numpy as np
from numpy.typing import NDArray

from sealtwin.core.records import Booleans, Floats

Map = NDArray[np.float32]  # One number per pixel, (height, width)
Mask = NDArray[np.uint8]  # 255 on the pixels of a region, 0 elsewhere, (height, width)
Size = tuple[int, int]  # Width and height in px
Window = tuple[slice, slice]  # Rows and columns of a part of a picture
DISPLAY_GAMMA = 2.2  # Exponent from stored brightness to linear light, close to a camera's
MEDIAN_WEIGHT = 1e-3  # Weight of the median in ``continued``. It has an effect only far from valid pixels
MAX_ROWS = 16384  # Number of rows that OpenCV samples at once: a power of two below its limit of 32,767


def blurred(picture: Map | Floats, sigma_px: float) -> Map:
    """Blur a picture by a Gaussian with standard deviation ``sigma_px``."""
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), sigma_px), np.float32)


def blurred_copy(picture: Map, sigma_px: float) -> Map:
    """Return a blurred copy. If ``sigma_px`` is 10 or more, the copy is smaller, to save time."""
    times = max(1, int(sigma_px / 5))
    small = max(1, picture.shape[1] // times), max(1, picture.shape[0] // times)
    return blurred(shrunk(picture, small), sigma_px / times)


def median_of(values: Map | Floats) -> float:
    """Return the median of the values, or 0 if there are none."""
    return float(np.median(values)) if len(values) else 0.0


def continued(picture: Map, valid: Booleans, sigma_px: float) -> Map:
    """Return the Gaussian mean of the valid pixels around each pixel. Far from valid pixels, return their median."""
    weight = valid.astype(np.float32)
    usual = median_of(picture[valid])
    mean = (blurred(picture * weight, sigma_px) + MEDIAN_WEIGHT * usual) / (blurred(weight, sigma_px) + MEDIAN_WEIGHT)
    return np.asarray(mean, np.float32)


def shrunk(picture: Map | Mask, size_px: Size) -> Map:
    """Scale down to a width and height in px. Each new pixel is the mean of the pixels that it covers."""
    return np.asarray(cv2.resize(picture, size_px, interpolation=cv2.INTER_AREA), np.float32)


def scaled_down(picture: Map | Mask, scale: float) -> Map:
    """Scale down by a factor. Each side keeps at least one pixel."""
    height, width = (max(1, round(side * scale)) for side in picture.shape)
    return shrunk(picture, (width, height))


def sampled(
    picture: NDArray, places_px: Floats, method: int = cv2.INTER_LINEAR, beyond: int = cv2.BORDER_REPLICATE
) -> NDArray:
    """Interpolate the picture at points, (..., 2), x and y in px.

    ``method`` is OpenCV's interpolation, and ``beyond`` is its border mode.
    """
    x, y = np.moveaxis(places_px.astype(np.float32), -1, 0)
    if x.size == 0:
        return np.zeros(x.shape, picture.dtype)
    # OpenCV has a limit on rows; a list of places is split into columns.
    rows = min(len(x), MAX_ROWS)
    map_x, map_y = (np.resize(axis, (rows, -(-x.size // rows))) for axis in (x, y))
    return cv2.remap(picture, map_x, map_y, method, borderMode=beyond, borderValue=0).ravel()[: x.size].reshape(x.shape)


def resized(picture: Map, shape: tuple[int, ...]) -> Map:
    """Scale to a height and width in px, linearly between the pixels."""
    return np.asarray(cv2.resize(picture, shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def widened(mask: NDArray[np.generic], reach_px: int) -> Booleans:
    """Return the mask grown by ``reach_px`` pixels in all directions."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * reach_px + 1,) * 2, np.uint8)) > 0


def lightness(light: Map | Floats) -> Map:
    """Return the CIE 1976 lightness, 0 to 100, of linear light. The formula's linear part near black is left out."""
    return np.asarray(116 * np.cbrt(np.maximum(light, 3e-3)) - 16, np.float32)


def window_around(points_px: Floats, reach_px: float, size_px: Size) -> tuple[Floats, Window]:
    """Return a box around some points: its first pixel, (x, y), and the slices of its rows and columns.

    The box has a margin of ``reach_px`` around the points, and is limited to the picture.
    """
    low = np.maximum(np.floor(points_px.min(axis=0) - reach_px), 0)
    high = np.minimum(np.ceil(points_px.max(axis=0) + reach_px) + 1, size_px)
    columns, rows = (slice(int(first), int(past)) for first, past in zip(low, high, strict=True))
    return low, (rows, columns)


def draw_line(picture: Mask, points: Floats, width: float = 1.0) -> None:
    """Set the pixels of a line, (n, 2) as column and row, to 255. The line is at least a pixel wide."""
    cv2.polylines(picture, [np.rint(points).astype(np.int32)], False, 255, max(1, round(width)))


def filled_polygon(shape: tuple[int, ...], corners_px: Floats) -> Mask:
    """Return a mask with 255 inside a polygon and 0 elsewhere."""
    mask = np.zeros(shape, np.uint8)
    cv2.fillPoly(mask, [np.rint(corners_px * 16).astype(np.int32)], [255], shift=4)
    return mask
