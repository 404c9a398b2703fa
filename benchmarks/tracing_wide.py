"""Photos of wide, obvious cracks: black on grey with stones, pores, a stain, noise and JPEG, as a telephone takes them.

They share nothing with the specimens of ``digitise.specimens``: no face, no markers, another texture.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

SIZE_PX = (2200, 1000)
MM_PER_PX = 0.05
CLICK_PX = 3.0
"""Distance of each click from the true tip."""
WIDTHS_PX = (62.0, 124.0)
TOLERANCE_PERCENT = 3.0
"""A mean width farther off is wrong."""
FINE = 4
"""Pixels of the drawing per pixel of the photo."""


@dataclass(frozen=True)
class WideCrack:
    """One photo and its truth."""

    picture: NDArray[np.uint8]
    ends_px: Floats
    """The clicks, (2, 2)."""
    width_px: float
    """Mean over the centreline."""


@dataclass(frozen=True)
class WideFigures:
    name: str
    true_width_px: float
    """0 where there is no crack."""
    width_error_percent: float
    """Signed; NaN where the photo was refused, infinite where there is none to trace."""
    refusal: str = ""


def wide_crack(seed: int, width_px: float) -> WideCrack:
    """Draw a crack about so wide that tapers to two tips; with a width of 0, the same ground and clicks without one."""
    rng = np.random.default_rng([seed, round(width_px), 11])
    x = np.arange(300.0, 1900.0)
    share = (x - x[0]) / (x[-1] - x[0])
    middle = SIZE_PX[1] / 2 + _waves(rng, share, 5, 35.0)
    taper = np.clip(np.minimum(share, 1 - share) / 0.06, 0.04, 1) ** 0.5
    width = width_px * np.clip(1 + _waves(rng, share, 6, 0.25), 0.45, 1.5) * taper
    centre = np.column_stack([x, middle])
    tangent = np.gradient(centre, axis=0)
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]]) / np.linalg.norm(tangent, axis=1)[:, None]
    rough = [cv2.GaussianBlur(rng.normal(0, 4.0, (len(x), 1)), (0, 0), 4.0) * taper[:, None] for _ in range(2)]
    away = [width[:, None] / 2 + one for one in rough]
    true_px = float(np.mean(away[0] + away[1]))
    # What is filled reaches half a fine pixel beyond its outline.
    beyond = 0.5 / FINE
    left, right = centre + normal * (away[0] - beyond), centre - normal * (away[1] - beyond)
    ring = np.concatenate([left, right[::-1]])
    turn = rng.uniform(0, 2 * np.pi, 2)
    clicks = centre[[0, -1]] + CLICK_PX * np.column_stack([np.cos(turn), np.sin(turn)])
    return WideCrack(_photographed(rng, ring if width_px > 0 else None), clicks, true_px)


def trace_wide(seed: int, width_px: float, folder: Path) -> WideFigures:
    """Trace one between its clicks and compare the mean width."""
    crack = wide_crack(seed, width_px)
    file = folder / "wide.jpg"
    quality = int(np.random.default_rng([seed, 12]).integers(70, 96))
    cv2.imwrite(str(file), crack.picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    name = f"wide {width_px:g} px {seed}" if width_px > 0 else f"wide, no crack {seed}"
    true_px = crack.width_px if width_px > 0 else 0.0
    (first_x, first_y), (last_x, last_y) = crack.ends_px.tolist()
    settings = PhotoInput(file=file, data="synthetic", mm_per_px=MM_PER_PX)
    try:
        photo = load_photo(settings, folder)
        outline = trace_outline(photo, find_path(photo, ((first_x, first_y), (last_x, last_y))))
    except InputError as refusal:
        return WideFigures(name, true_px, float("nan"), str(refusal))
    seen_px = outline.mean_width_mm / MM_PER_PX
    return WideFigures(name, true_px, 100 * (seen_px / true_px - 1) if true_px > 0 else float("inf"))


def _photographed(rng: np.random.Generator, ring: Floats | None) -> NDArray[np.uint8]:
    """Display values: the texture, the crack on it, then what camera and light add."""
    width, height = SIZE_PX
    grey = np.full((height, width), rng.uniform(140, 200), dtype=np.float32)
    for sigma_px, strength in ((1.0, 9.0), (4.0, 9.0), (60.0, 7.0)):
        texture = cv2.GaussianBlur(rng.standard_normal((height, width)).astype(np.float32), (0, 0), sigma_px)
        grey += strength * texture / texture.std()
    typical = float(grey.mean())
    for _ in range(600):
        _spot(rng, grey, rng.uniform(2, 15), typical * rng.uniform(0.85, 1.2))
    for _ in range(120):
        _spot(rng, grey, rng.uniform(3, 18), typical * rng.uniform(0.45, 0.7))
    stain = np.zeros_like(grey)
    _spot(rng, stain, rng.uniform(100, 250), 1.0)
    grey *= 1 - rng.uniform(0, 0.25) * cv2.GaussianBlur(stain, (0, 0), 15.0)
    large = np.zeros((FINE * height, FINE * width), dtype=np.uint8)
    if ring is not None:
        corners = (ring + 0.5) * FINE - 0.5
        cv2.fillPoly(large, [np.rint(corners * 16).astype(np.int32)], [255], shift=4)
    cover = cv2.resize(large, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    inside = typical * rng.uniform(0.1, 0.5)
    grey += cover * (inside - grey)
    slope = rng.uniform(-0.2, 0.2, 2)
    grey *= 1 + slope[0] * np.linspace(-1, 1, width)[None] + slope[1] * np.linspace(-1, 1, height)[:, None]
    grey = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), rng.uniform(0.5, 1.5))
    grey += rng.normal(0, rng.uniform(1, 4), grey.shape)
    return cv2.cvtColor(np.clip(np.rint(grey), 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR)


def _spot(rng: np.random.Generator, grey: NDArray[np.float32], radius_px: float, value: float) -> None:
    """A stone, pore or stain anywhere."""
    x, y = rng.uniform((0, 0), SIZE_PX)
    axes = (round(radius_px), max(1, round(radius_px * rng.uniform(0.6, 1))))
    cv2.ellipse(grey, (round(x), round(y)), axes, rng.uniform(0, 180), 0, 360, [value], -1, cv2.LINE_AA)


def _waves(rng: np.random.Generator, share: Floats, most: int, size: float) -> Floats:
    """Sines that begin and end at 0."""
    return sum(
        (rng.normal(0, size / wave**0.5) * np.sin(np.pi * wave * share) for wave in range(1, most + 1)),
        start=np.zeros_like(share),
    )
