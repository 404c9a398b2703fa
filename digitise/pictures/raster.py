"""Two picture operations with the types that they really return."""

import cv2
import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float32]
"""One number per pixel, (height, width)."""


def blurred(picture: Map | NDArray[np.float64], sigma_px: float) -> Map:
    """Gaussian blur."""
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), sigma_px), dtype=np.float32)


def shrunk(picture: Map, size_px: tuple[int, int]) -> Map:
    """Scaled down to a width and height, each new pixel the mean of those it covers."""
    return np.asarray(cv2.resize(picture, size_px, interpolation=cv2.INTER_AREA), dtype=np.float32)
