"""Levels along a crack of 80 mm, those of the paper and arbitrary ones, and their comparison."""

from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Outline, Profile, Solid
from validate.compare import compare

LENGTH_MM, WIDTH_MM, DEPTH_MM = 80.0, 3.0, 16.0
STATIONS = np.linspace(0, LENGTH_MM, 17)
PROSE = np.interp(STATIONS, [0, 20, 30, 40, 80], [-16, -4, -4, 1, 1])
heights = st.floats(-20, 20, allow_nan=False).map(lambda value: round(value, 6))
places = st.floats(0, 80, allow_nan=False).map(lambda value: round(value, 3))


def outline(length_mm: float = LENGTH_MM) -> Outline:
    line = np.column_stack([np.linspace(0, length_mm, 81), np.zeros(81)])
    half = np.array([0, WIDTH_MM / 2])
    left, right = line + half, line - half
    ring = np.vstack([right, left[::-1]])
    return Outline(line, left, right, ring, line, left, right, ring, ("cut", "cut"), None, 0.1, "given", None, "ends")


@cache
def solid() -> Solid:
    return build_solid(outline(), CrackShape(depth_mm=DEPTH_MM, tilt="vertical"))


def profile(x, y, **kind) -> Profile:
    return Profile(np.asarray(x, dtype=float), np.asarray(y, dtype=float), **kind)


def measured() -> Profile:
    return profile(STATIONS, PROSE, data="measured", source="caliper.csv")


def compared(simulated: Profile, read: Profile | None = None, **choices):
    kinds: dict[str, Any] = {"role": "held-out", "photo_data": "measured"} | choices
    return compare(simulated, read or measured(), outline(), solid(), **kinds)


@st.composite
def curves(draw):
    x = sorted({0.0, 80.0} | draw(st.sets(places, max_size=20)))
    return np.array(x), np.array(draw(st.lists(heights, min_size=len(x), max_size=len(x))))
