"""Photos of obvious cracks as telephones take them: 12 to 150 px wide, 1 to 24 Mpx, any direction, ground of stones.

A crack is at most 0.58 of its surroundings' display value. They share nothing with the specimens of
``fixtures.generate``: no face, no markers, another texture. Optics blur light, not display values, and so does this.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.table import Row
from benchmarks.tracing_thin import draw_spot, waves
from digitise.crack_path.find_path import find_path
from digitise.geometry.polyline import coverage, depth_inside, left_normals, signed_area
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import PhotoInput
from fixtures.generate.lighting import DISPLAY_GAMMA as GAMMA
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

MM_PER_PX = 0.05
MEGAPIXELS = (1.0, 24.0)
COMMON_MEGAPIXELS = 2.5
"""Half of the photos have fewer: large ones take long."""
SHAPES = (4 / 3, 3 / 2, 16 / 9)
WIDTHS_PX = (12.0, 150.0)
SLENDER = 10.0
"""Least length over width: of a shorter crack, the centreline's length is a matter of taste, and so the mean width."""
BEYOND_WIDTHS = 3.0
"""Least length of a crack that goes on beyond each click: a nearer tip would be taken for its end."""
CLICK_PX = 5.0
"""Greatest distance of a click from the true end."""
GOES_ON = 0.25
"""Share of the cracks that run past both clicks, out of the photo or to a tip elsewhere."""
STAIN = (0.65, 1.0)
"""Display value over that of the ground around."""
HURST = 0.8
"""Roughness exponent of fractured stone: spread over a length grows by this power of it."""
TOLERANCE_PERCENT = 3.0
"""A mean width or an area farther off is wrong."""
MAX_REFUSED = 0.01
"""Share of the obvious cracks: 2 of 200."""
WITHOUT = 5
"""Obvious cracks for each photo without a crack."""


@dataclass(frozen=True)
class ObviousCrack:
    """A photo and its truth."""

    picture: NDArray[np.uint8]
    """Grey display values."""
    ends_px: Floats
    """The clicks, (2, 2)."""
    usual_px: float
    """Width that was asked for."""
    width_px: float
    """Mean between the ends."""
    area_px2: float
    """Between the ends; nothing where no crack was drawn."""


@dataclass(frozen=True)
class WideFigures:
    name: str
    true_width_px: float
    """0 where there is no crack."""
    width_error_percent: float
    """Signed, like the next; NaN where the photo was refused, infinite where there is none to trace."""
    area_error_percent: float
    refusal: str = ""

    @property
    def summary(self) -> str:
        if self.refusal:
            return self.refusal
        return f"mean width off by {self.width_error_percent:.2f} %, area by {self.area_error_percent:.2f} %"


def obvious_crack(seed: int, drawn: bool = True) -> ObviousCrack:
    """Draw one; not ``drawn``, the same ground and clicks without it."""
    rng = np.random.default_rng([seed, 21])
    size_px = _size_px(rng)
    last_px = np.array(size_px) - 1.0
    shape = _shape(rng, size_px)
    # Between its ends the photo shows all of it.
    while depth_inside(shape.ring(shape.within), (0, 0, *last_px)).min() < 0:
        shape = _shape(rng, size_px)
    ends_px = shape.centre[shape.within][[0, -1]]
    turn, off_px = rng.uniform(0, 2 * np.pi, 2), CLICK_PX * rng.random(2) ** 0.5
    clicks = np.clip(ends_px + off_px[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]), 0, last_px)
    area_px2 = abs(signed_area(shape.ring(shape.within)))
    between_px = float(arc_length(shape.centre[shape.within])[-1])
    picture = _photographed(rng, size_px, shape.ring() if drawn else None)
    return ObviousCrack(picture, clicks, shape.usual_px, area_px2 / between_px, area_px2)


def trace_obvious(first: int, count: int, folder: Path) -> Iterator[WideFigures]:
    """Trace so many cracks from this seed on, and then photos without one."""
    for drawn, photos in ((True, count), (False, count // WITHOUT)):
        for seed in range(first, first + photos):
            yield trace_wide(seed, drawn, folder)


def trace_wide(seed: int, drawn: bool, folder: Path) -> WideFigures:
    """Trace a crack between its clicks, and compare its mean width and its area."""
    crack = obvious_crack(seed, drawn)
    file = folder / "wide.jpg"
    quality = int(np.random.default_rng([seed, 22]).integers(70, 96))
    cv2.imwrite(str(file), crack.picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    kind = f"{crack.usual_px:.0f} px" if drawn else "no crack"
    name = f"wide {seed}, {kind}, {crack.picture.size / 1e6:.1f} Mpx, JPEG {quality}"
    true_px = crack.width_px if drawn else 0.0
    (first_x, first_y), (last_x, last_y) = crack.ends_px.tolist()
    settings = PhotoInput(file=file, data="synthetic", mm_per_px=MM_PER_PX)
    width_percent, area_percent, words = inf, inf, ""
    try:
        photo = load_photo(settings, folder)
        outline = trace_outline(photo, find_path(photo, ((first_x, first_y), (last_x, last_y))))
        if drawn:
            width_percent = 100 * (outline.mean_width_mm / MM_PER_PX / true_px - 1)
            area_percent = 100 * (abs(signed_area(outline.outline_px)) / crack.area_px2 - 1)
    except InputError as refusal:
        width_percent, area_percent, words = nan, nan, str(refusal).removeprefix(f"{file}: ")
    return WideFigures(name, true_px, width_percent, area_percent, words)


def wide_rows(wide: Sequence[WideFigures]) -> list[Row]:
    """What is refused, and how far off the rest is."""
    if not wide:
        return []
    cracks = [each for each in wide if each.true_width_px > 0]
    traced = [each for each in cracks if not each.refusal]
    without = [each.refusal for each in wide if each.true_width_px == 0]
    refused = len(cracks) - len(traced)
    worst_width = max((abs(each.width_error_percent) for each in traced), default=inf)
    worst_area = max((abs(each.area_error_percent) for each in traced), default=inf)
    return [
        Row(f"wide: refused of {len(cracks)}", refused, "", 0, round(MAX_REFUSED * len(cracks))),
        Row("wide: mean width, worst of these", worst_width, "%", 0, TOLERANCE_PERCENT),
        Row("wide: area, worst of these", worst_area, "%", 0, TOLERANCE_PERCENT),
        Row("wide: ground without a crack refused", sum(map(bool, without)), "", len(without), len(without)),
    ]


def _size_px(rng: np.random.Generator) -> tuple[int, int]:
    low, common, high = np.log([MEGAPIXELS[0], COMMON_MEGAPIXELS, MEGAPIXELS[1]])
    pixels = 1e6 * np.exp(np.interp(rng.random(), [0, 0.5, 1], [low, common, high]))
    shape = SHAPES[rng.integers(len(SHAPES))]
    long, short = round((pixels * shape) ** 0.5), round((pixels / shape) ** 0.5)
    return (long, short) if rng.random() < 0.7 else (short, long)


@dataclass(frozen=True)
class _Shape:
    """A crack in the photo's pixels, which may leave the photo outside ``within``."""

    usual_px: float
    centre: Floats
    left: Floats
    right: Floats
    within: NDArray[np.bool_]
    """Points between its ends."""

    def ring(self, part: NDArray[np.bool_] | slice = slice(None)) -> Floats:
        return np.concatenate([self.left[part], self.right[part][::-1]])


def _shape(rng: np.random.Generator, size_px: tuple[int, int]) -> _Shape:
    """One in any direction, with two tips, rough walls, and a width that varies."""
    goes_on = rng.random() < GOES_ON
    angle = rng.uniform(0, np.pi)
    ahead = np.array([np.cos(angle), np.sin(angle)])
    room_px = 0.9 * float(np.min(np.array(size_px) / np.maximum(np.abs(ahead), 1e-9)))
    length_px = room_px * (rng.uniform(1.0, 1.3) if goes_on else rng.uniform(0.55, 0.9))
    slender = SLENDER + 2 * BEYOND_WIDTHS * goes_on
    usual_px = min(float(np.exp(rng.uniform(*np.log(WIDTHS_PX)))), length_px / slender)
    beyond = max(0.12, BEYOND_WIDTHS * usual_px / length_px) if goes_on else 0.0
    share = np.linspace(0, 1, round(length_px))
    aside = waves(rng, share, 5, 0.022 * length_px) + 0.08 * usual_px * _rough(rng, len(share), 2 * usual_px)
    along = np.array(size_px) / 2 + (share[:, None] - 0.5) * length_px * ahead
    centre = along + aside[:, None] * np.array([-ahead[1], ahead[0]])
    taper = np.clip(np.minimum(share, 1 - share) / 0.06, 0, 1) ** 0.5
    width = usual_px * np.clip(1 + waves(rng, share, 6, 0.25), 0.55, 1.5) * taper
    rough = rng.uniform(0.02, 0.07)
    left, right = (
        centre
        + sign * left_normals(centre) * (width / 2 + taper * rough * _fractured(rng, len(share), usual_px))[:, None]
        for sign in (1, -1)
    )
    return _Shape(usual_px, centre, left, right, np.minimum(share, 1 - share) >= beyond)


def _photographed(rng: np.random.Generator, size_px: tuple[int, int], ring: Floats | None) -> NDArray[np.uint8]:
    """Display values: the ground, the crack in it, then what light and camera add."""
    width, height = size_px
    # As a camera nearer to the sample, or one with more pixels, shows stones and pores larger.
    times = (width * height / 2.2e6) ** 0.5 * rng.uniform(0.5, 1.5)
    typical = rng.uniform(110, 200)
    grey = np.full((height, width), typical, dtype=np.float32)
    for sigma_px, strength in ((1.0, 0.05), (4.0, 0.05), (60.0, 0.04)):
        grey += _texture(rng, size_px, sigma_px * max(times, 1.0), typical * strength * rng.uniform(0.4, 1.2))
    for _ in range(600):
        draw_spot(rng, grey, times * rng.uniform(2, 15), typical * rng.uniform(0.75, 1.3))
    for _ in range(120):
        draw_spot(rng, grey, times * rng.uniform(3, 14) * rng.random(), typical * rng.uniform(0.45, 0.7))
    light = np.power(np.clip(grey, 1, None) / 255, GAMMA)
    floor = typical / 255 * rng.uniform(0.08, 0.58) * (1 + _texture(rng, size_px, 6.0 * max(times, 1.0), 0.08))
    if ring is not None:
        light += coverage(ring, size_px) * (np.power(np.clip(floor, 0, None), GAMMA) - light)
    for _ in range(rng.integers(0, 4)):
        stain = np.zeros_like(light)
        draw_spot(rng, stain, rng.uniform(0.03, 0.12) * max(size_px), 1.0)
        light *= 1 - (1 - rng.uniform(*STAIN) ** GAMMA) * _blurred(stain, rng.uniform(2, 0.01 * max(size_px)))
    slope = rng.uniform(-0.2, 0.2, 2)
    shade = 1 + slope[0] * np.linspace(-1, 1, width)[None] + slope[1] * np.linspace(-1, 1, height)[:, None]
    light = cv2.GaussianBlur((light * shade**GAMMA).astype(np.float32), (0, 0), rng.uniform(0.5, 1.5))
    shown = 255 * np.power(np.clip(light, 0, None), 1 / GAMMA)
    shown += rng.uniform(1, 4) * rng.standard_normal(shown.shape, dtype=np.float32)
    return np.clip(np.rint(shown), 0, 255).astype(np.uint8)


def _texture(rng: np.random.Generator, size_px: tuple[int, int], sigma_px: float, spread: float) -> NDArray[np.float32]:
    """Smooth noise, drawn on fewer pixels where it is broad."""
    times = max(1, int(sigma_px / 2))
    small = size_px[0] // times + 1, size_px[1] // times + 1
    noise = cv2.GaussianBlur(rng.standard_normal(small[::-1], dtype=np.float32), (0, 0), sigma_px / times)
    large = cv2.resize(noise, size_px, interpolation=cv2.INTER_LINEAR)
    return np.asarray(spread * large / large.std(), dtype=np.float32)


def _blurred(picture: NDArray[np.float32], sigma_px: float) -> NDArray[np.float32]:
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), sigma_px), dtype=np.float32)


def _fractured(rng: np.random.Generator, count: int, width_px: float) -> Floats:
    """Self-affine noise, as fracture surfaces have, with one width of spread over lengths of a width."""
    octaves = 2.0 ** np.arange(1, np.log2(2 * width_px))
    parts = [along_px * (along_px / width_px) ** (HURST - 1) * _rough(rng, count, along_px) for along_px in octaves]
    return sum(parts, start=np.zeros(count))


def _rough(rng: np.random.Generator, count: int, along_px: float) -> Floats:
    """Noise of standard deviation 1 along a line, as smooth as a length."""
    noise = np.asarray(cv2.GaussianBlur(rng.standard_normal((count, 1)), (0, 0), along_px)[:, 0], dtype=float)
    return noise / max(float(noise.std()), 1e-9)
