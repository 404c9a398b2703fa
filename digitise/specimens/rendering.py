"""Paint a cracked mortar face with exact edges: reflectance, pixel by pixel, before any light falls on it.

Pixel centres are integers, as everywhere.
"""

from dataclasses import dataclass

import numpy as np

from digitise.pictures.raster import Map, blurred
from digitise.specimens.lighting import SideLamp
from sealtwin.records import Floats

BOARD, INK, GAP, MORTAR, CRACK, PORE = 0.72, 0.035, 0.06, 0.34, 0.022, 0.13
"""Reflectances, judged by eye from photos of mortar prisms under diffuse light."""
UNLIT_RIM = 0.04
"""Of a narrow rim of one wall, which even diffuse light reaches more than the rest of the crack."""
ROWS_PER_PX = 8
"""Sub-rows of the exact fill: edges are placed to better than 0.01 px."""
STAIN_MM = 2.5
"""Size of stains of oil or damp: about that of the crack's width, and so the hardest to tell from it."""
STAINED = 0.25
"""Share of the face that they cover."""


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
    cards: list[Floats]
    """White squares under the markers, where the board itself is not white."""
    side_cracks: list[Floats]
    stones: list[Floats]
    """Inside the crack, level with the face."""
    mortar: float
    """Reflectance of the face."""
    board: float
    """Reflectance of what it lies on."""


@dataclass(frozen=True)
class Texture:
    """What the surface itself shows: unit noise of sand and of larger unevenness, and stains."""

    grain: Map | Floats
    unevenness: Map
    stains: Map | None
    """0 to 1; None on a clean face."""


def draw_texture(scene: Scene, rng: np.random.Generator, stained: np.random.Generator | None) -> Texture:
    """The same surface for every photo of it; ``stained`` draws its stains."""
    px_per_mm = scene.px_per_mm
    grain = 0.5 * _noise(scene, rng, 0.12 * px_per_mm) + 0.5 * _noise(scene, rng, 0.3 * px_per_mm)
    # Cubed: a few grains of sand stand out, most do not.
    grain += 0.15 * _noise(scene, rng, 0.2 * px_per_mm) ** 3
    unevenness = _noise(scene, rng, 3 * px_per_mm)
    if stained is None:
        return Texture(grain, unevenness, None)
    blots = _noise(scene, stained, STAIN_MM * px_per_mm)
    rim = np.quantile(blots[::8, ::8], 1 - STAINED)
    return Texture(grain, unevenness, np.clip((blots - rim) / 0.5 + 0.5, 0, 1).astype(np.float32))


def paint(scene: Scene, texture: Texture, grain: float, stain: float, lamp: SideLamp | None) -> Map:
    """Reflectance of every pixel.

    ``grain`` is the relative brightness of the sand, ``stain`` the share of its light that a stain swallows; ``lamp``
    lights one wall of the crack, which is part of the scene since it depends on where the crack's floor is seen.
    """
    size = scene.size_px
    mortar = scene.mortar * (1 + grain * (texture.grain + 0.5 * texture.unevenness))
    if texture.stains is not None:
        mortar *= 1 - stain * texture.stains
    stone = mortar
    mortar = _mix(mortar, PORE, _cover(scene.pores, size))
    inside = coverage(scene.crack, size)
    lit = inside * (1 - coverage(scene.crack_floor, size))
    for ring in scene.side_cracks:
        side = coverage(ring, size)
        inside, lit = inside + (1 - inside) * side, lit * (1 - side)
    # A lit wall is broken mortar: as grainy as the face, and brighter where it stands out.
    wall = UNLIT_RIM if lamp is None else lamp.wall * (1 + 2 * grain * (texture.grain + texture.unevenness))
    mortar = _mix(mortar, CRACK * (1 + 0.3 * texture.unevenness) + (wall - CRACK) * lit, inside)
    if scene.stones:
        mortar = _mix(mortar, stone, _cover(scene.stones, size))

    width, height = size
    picture = np.full((height, width), scene.board, dtype=np.float32)
    picture *= 1 + 0.15 * grain * texture.grain
    face, gap = coverage(scene.face, size), coverage(scene.gap, size)
    # Side by side, not one over the other: where the gap is closed, board and mortar share the pixels of the edge.
    picture = picture * (1 - gap) + GAP * (gap - face) + mortar * face
    if scene.cards:
        picture = _mix(picture, BOARD, _cover(scene.cards, size))
    picture = _mix(picture, INK, _cover(scene.ink, size))
    return _mix(picture, BOARD, _cover(scene.paper, size))


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


def _noise(scene: Scene, rng: np.random.Generator, sigma_px: float) -> Map:
    """Smooth noise of unit standard deviation and one grain size."""
    width, height = scene.size_px
    noise = blurred(rng.standard_normal((height, width), dtype=np.float32), sigma_px)
    return noise / noise.std()


def _mix(under: Map | Floats, over: Map | Floats | float, cover: Map | Floats) -> Map:
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
