"""Scans of a small sealed crack, 40 mm long and 3 mm wide, whose level is known."""

from collections.abc import Callable

import numpy as np

from sealtwin.core.arc_length import arc_length_at
from sealtwin.core.records import Booleans, Floats, Outline
from sealtwin.scan.height_map import HeightMap
from sealtwin.scan.mouth_search import Target
from tests.support.shapes import cut_crack

OUTLINE = cut_crack(5)
AROUND_MM = 12.0


def target() -> Target:
    return Target.of(OUTLINE)


def sloping_mm(s_mm: Floats) -> Floats:
    return -1.0 - 0.03 * s_mm


def _places(outline: Outline, spacing_mm: float) -> tuple[Floats, Floats, Booleans]:
    """Return points along the face, (n, 2), their arc lengths, and whether they are in the mouth."""
    low_mm, high_mm = outline.outline_mm.min(axis=0) - AROUND_MM, outline.outline_mm.max(axis=0) + AROUND_MM
    x_mm, y_mm = np.meshgrid(*(np.arange(a, b, spacing_mm) for a, b in zip(low_mm, high_mm, strict=True)))
    jitter = np.random.default_rng(1).uniform(-0.3, 0.3, (x_mm.size, 2))
    places_mm = np.column_stack([x_mm.ravel(), y_mm.ravel()]) + spacing_mm * jitter
    fine = HeightMap(low_mm - 1, 0.1, np.zeros(np.ceil((high_mm - low_mm + 2)[::-1] / 0.1).astype(int)))
    mouth = HeightMap(fine.corner_mm, 0.1, fine.inside([outline.outline_mm]).astype(float))
    return places_mm, arc_length_at(places_mm, outline.centreline_mm), mouth.at_mm(*places_mm.T) > 0


def bed(level_mm: Callable[[Floats], Floats] = sloping_mm, spacing_mm: float = 0.5, noise_mm: float = 0.02) -> Floats:
    """Return the points of a scan in the frame of the sample, (n, 3)."""
    return bed_of(OUTLINE, level_mm, spacing_mm, noise_mm)


def bed_of(outline: Outline, level_mm: Callable[[Floats], Floats], spacing_mm: float, noise_mm: float = 0.02) -> Floats:
    """Return the points of a scan of another crack, (n, 3)."""
    places_mm, s_mm, mouth = _places(outline, spacing_mm)
    noise = noise_mm * np.random.default_rng(2).standard_normal(len(places_mm))
    return np.column_stack([places_mm, np.where(mouth, level_mm(s_mm), 0.0) + noise])
