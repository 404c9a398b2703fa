"""Draw a cracked mortar face as a camera sees it: exact edges, then light, grain, blur, noise and JPEG.

Brightness is linear (proportional to light) until the last step. Pixel centres are integers, as everywhere.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from digitise.raster import Map, blurred
from sealtwin.records import Floats

BOARD, INK, GAP, MORTAR, CRACK, PORE = 0.72, 0.035, 0.06, 0.34, 0.022, 0.13
"""Reflectances, judged by eye from photos of mortar prisms under diffuse light."""
ROWS_PER_PX = 8
"""Sub-rows of the exact fill: edges are placed to better than 0.01 px."""
DISPLAY_GAMMA = 2.2


@dataclass(frozen=True)
class Look:
    """What the camera and the lamp do to the scene."""

    light: float
    """Brightest over mean of the uneven lighting, less 1."""
    grain: float
    """Relative brightness of the sand, standard deviation."""
    blur_px: float
    """Gaussian sigma of lens and focus."""
    noise: float
    """Standard deviation of the sensor's noise at full brightness; below it, it shrinks like shot noise."""
    jpeg_quality: int
    lit_wall: float = 0.04
    """Reflectance of a narrow rim of the wall that faces the lamp; 0.022, like the rest, in diffuse light."""


@dataclass(frozen=True)
class Scene:
    """Everything in the picture, as rings in pixels."""

    size_px: tuple[int, int]
    """Width and height."""
    px_per_mm: float
    face: Floats
    gap: Floats
    """The shadow round the face: a ring slightly larger than the face."""
    crack: Floats
    crack_floor: Floats
    """The crack's ring, shifted away from the lit wall."""
    pores: list[Floats]
    ink: list[Floats]
    """Black modules of the markers."""
    paper: list[Floats]
    """White modules inside them."""


def render_jpeg(scene: Scene, look: Look, rng: np.random.Generator) -> bytes:
    """The photo of ``scene``, as the bytes of a JPEG file."""
    light = _shade(scene, look, rng)
    light = blurred(light, look.blur_px)
    # One sensor's noise for all colours: three would double the file and help nobody.
    light += look.noise * np.sqrt(np.clip(light, 0, 1)) * rng.standard_normal(light.shape, dtype=np.float32)
    warm_bgr = np.array([0.94, 1.0, 1.03], dtype=np.float32)
    display = np.clip(light[..., None] * warm_bgr, 0, 1) ** (1 / DISPLAY_GAMMA)
    quality = [cv2.IMWRITE_JPEG_QUALITY, look.jpeg_quality]
    return cv2.imencode(".jpg", np.rint(255 * display).astype(np.uint8), quality)[1].tobytes()


def coverage(ring: Floats, size_px: tuple[int, int]) -> Map:
    """How much of each pixel lies inside a ring of pixel coordinates, 0 to 1, (height, width).

    Exact along x, ``ROWS_PER_PX`` samples along y: OpenCV's own fill grows every shape by half a pixel.
    """
    width, height = size_px
    start, end = ring, np.roll(ring, -1, axis=0)
    low, high = np.minimum(start[:, 1], end[:, 1]), np.maximum(start[:, 1], end[:, 1])
    # Sub-row r is sampled at y = (r + 0.5) / ROWS_PER_PX - 0.5.
    first = np.maximum(np.ceil((low + 0.5) * ROWS_PER_PX - 0.5), 0).astype(int)
    last = np.minimum(np.ceil((high + 0.5) * ROWS_PER_PX - 0.5), height * ROWS_PER_PX).astype(int)
    count = np.maximum(last - first, 0)
    edge = np.repeat(np.arange(len(ring)), count)
    row = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[edge]
    y = (row + 0.5) / ROWS_PER_PX - 0.5
    (x0, y0), (x1, y1) = start[edge].T, end[edge].T
    x = np.clip(x0 + (y - y0) * (x1 - x0) / (y1 - y0) + 0.5, 0, width)
    sign = np.sign(y1 - y0) / ROWS_PER_PX
    column = np.floor(x).astype(int)
    steps = np.zeros((height, width + 2), dtype=np.float64)
    np.add.at(steps, (row // ROWS_PER_PX, column), sign * (column + 1 - x))
    np.add.at(steps, (row // ROWS_PER_PX, column + 1), sign * (x - column))
    return np.abs(np.cumsum(steps, axis=1)[:, :width]).astype(np.float32)


def _shade(scene: Scene, look: Look, rng: np.random.Generator) -> Map:
    """Reflectance times light."""
    width, height = scene.size_px
    px_per_mm = scene.px_per_mm
    size = scene.size_px
    grain = 0.5 * _noise(scene, rng, 0.12 * px_per_mm) + 0.5 * _noise(scene, rng, 0.3 * px_per_mm)
    # Cubed: a few grains of sand stand out, most do not.
    grain += 0.15 * _noise(scene, rng, 0.2 * px_per_mm) ** 3
    stains = _noise(scene, rng, 3 * px_per_mm)
    mortar = MORTAR * (1 + look.grain * (grain + 0.5 * stains))
    mortar = _mix(mortar, PORE, _cover(scene.pores, size))
    inside = coverage(scene.crack, size)
    lit = inside * (1 - coverage(scene.crack_floor, size))
    mortar = _mix(mortar, CRACK * (1 + 0.3 * stains) + (look.lit_wall - CRACK) * lit, inside)

    picture = np.full((height, width), BOARD, dtype=np.float32)
    picture *= 1 + 0.15 * look.grain * grain
    face, gap = coverage(scene.face, size), coverage(scene.gap, size)
    # Side by side, not one over the other: where the gap is closed, board and mortar share the pixels of the edge.
    picture = picture * (1 - gap) + GAP * (gap - face) + mortar * face
    picture = _mix(picture, INK, _cover(scene.ink, size))
    picture = _mix(picture, BOARD, _cover(scene.paper, size))

    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j].astype(np.float32)
    direction = rng.uniform(0, 2 * np.pi)
    slope = np.cos(direction) * x + np.sin(direction) * y
    return picture * (1 + look.light * (0.7 * slope - 0.3 * (x**2 + y**2)))


def _noise(scene: Scene, rng: np.random.Generator, sigma_px: float) -> Map:
    """Smooth noise of unit standard deviation and one grain size."""
    width, height = scene.size_px
    noise = blurred(rng.standard_normal((height, width), dtype=np.float32), sigma_px)
    return noise / noise.std()


def _mix(under: Map | Floats, over: Map | Floats | float, cover: Map) -> Map:
    return (under + cover * (over - under)).astype(np.float32)


def _cover(rings: list[Floats], size_px: tuple[int, int]) -> Map:
    """Coverage of many small shapes at once; neighbours that share an edge leave no seam."""
    width, height = size_px
    total = np.zeros((height, width), dtype=np.float32)
    for ring in rings:
        left, top = np.maximum(np.floor(ring.min(axis=0)).astype(int) - 1, 0)
        right, bottom = np.minimum(np.ceil(ring.max(axis=0)).astype(int) + 2, size_px)
        if right > left and bottom > top:
            window = (int(right - left), int(bottom - top))
            total[top:bottom, left:right] += coverage(ring - (left, top), window)
    return np.minimum(total, 1)
