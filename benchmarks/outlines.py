"""Cracks of every shape that a solid must be made of, as outlines without any photo: same kind and seed, same crack."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from manifold3d import CrossSection, FillRule
from scipy.ndimage import gaussian_filter1d

from digitise.geometry.polyline import left_normals, signed_area
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Outline
from sealtwin.core.solid_figures import EndKind
from tests.support.shapes import outline_between, to_px

Kind = Literal["plain", "pinched", "self-touching", "tapered", "branches", "islands"]
KINDS: tuple[Kind, ...] = get_args(Kind)
SMOOTH_MM = 0.3
"""Length over which a wall's roughness keeps its sign: three pixels, the least that a trace resolves."""
CLOSING_WIDTHS = 2.0
"""Of a closed end, over which the walls come together."""


def odd_outline(kind: Kind, seed: int) -> Outline:
    """50 to 300 mm of crack in 200 to 2000 points, wandering and rough, with closed or cut ends.

    pinched: one to three necks of 0.02 to 0.3 mm; self-touching: as many of no width at all; tapered: to both tips over
    its whole length; branches: one to three side cracks, kept; islands: one to four stones inside.
    """
    rng = np.random.default_rng([KINDS.index(kind), seed])
    length_mm = float(np.exp(rng.uniform(np.log(50.0), np.log(300.0))))
    points = int(np.exp(rng.uniform(np.log(200.0), np.log(2000.0))))
    width_mm = float(rng.uniform(1.5, 6.0))
    rough_mm = float(rng.choice([0.0, 0.02, 0.05]))
    ends = rng.choice(["closed", "cut"], 2) if kind in ("plain", "pinched") else ["closed", "closed"]
    t = np.linspace(0.0, length_mm, points // 2)
    centre = np.column_stack([t, rng.uniform(0.01, 0.08) * length_mm * _waves(rng, t, length_mm)])
    along = arc_length(centre)
    share = _profile(kind, rng, along, width_mm, (ends[0] == "closed", ends[1] == "closed"))
    sides = [_half_widths(rng, along, width_mm, rough_mm) * share for _ in range(2)]
    outline = _between(centre, sides[0], sides[1], (_end(ends[0]), _end(ends[1])))
    more: dict[Kind, Callable[[Outline, np.random.Generator, float], Outline]] = {
        "branches": _with_branches,
        "islands": _with_islands,
    }
    return more[kind](outline, rng, width_mm) if kind in more else outline


def _end(name: str) -> EndKind:
    return "closed" if name == "closed" else "cut"


def _profile(kind: Kind, rng: np.random.Generator, s_mm: Floats, width_mm: float, closed: tuple[bool, bool]) -> Floats:
    """What is left of the width at each station: 0 at tips and where the walls touch."""
    length_mm = s_mm[-1]
    share = np.ones_like(s_mm)
    if kind == "tapered":
        share = np.sqrt(np.clip(1.0 - np.abs(2 * s_mm / length_mm - 1.0), 0.0, 1.0)) * 1.3
    if kind in ("pinched", "self-touching"):
        for at in rng.uniform(0.2, 0.8, int(rng.integers(1, 4))):
            neck_mm = rng.uniform(0.02, 0.3) if kind == "pinched" else 0.0
            # The neck itself is a station, so that it is as narrow as it says.
            away_mm = s_mm - s_mm[int(np.argmin(np.abs(s_mm - at * length_mm)))]
            share *= 1 - (1 - neck_mm / width_mm) * np.exp(-((away_mm / (2 * width_mm)) ** 2))
    for is_closed, from_end_mm in zip(closed, (s_mm, length_mm - s_mm), strict=True):
        if is_closed:
            share *= np.clip(from_end_mm / (CLOSING_WIDTHS * width_mm), 0.0, 1.0) ** 0.5
    return share


def _half_widths(rng: np.random.Generator, s_mm: Floats, width_mm: float, rough_mm: float) -> Floats:
    change = 1 + 0.15 * _waves(rng, s_mm, s_mm[-1])
    step_mm = s_mm[-1] / (len(s_mm) - 1)
    noise = gaussian_filter1d(rng.standard_normal(len(s_mm)), max(SMOOTH_MM / step_mm, 1e-3))
    return np.maximum(width_mm / 2 * change + rough_mm * noise / max(float(noise.std()), 1e-9), 0.1 * width_mm)


def _with_branches(outline: Outline, rng: np.random.Generator, width_mm: float) -> Outline:
    """Side cracks that leave at 30 to 100 degrees and taper; one may come back to the main crack around an island."""
    crack = _region(outline.outline_mm)
    lines = []
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.uniform(0.2, 0.8) * len(outline.centreline_mm))
        onward = outline.centreline_mm[at + 1] - outline.centreline_mm[at]
        angle = np.arctan2(onward[1], onward[0]) + np.radians(rng.uniform(30.0, 100.0)) * rng.choice([-1.0, 1.0])
        t = np.linspace(0.0, float(rng.uniform(6.0, 20.0)), 40)
        across = 0.05 * t[-1] * (_waves(rng, t, t[-1]) - _waves(rng, t * 0, t[-1]))
        ray = np.array([np.cos(angle), np.sin(angle)])
        line = outline.centreline_mm[at] + np.outer(t, ray) + np.outer(across * t / t[-1], [-ray[1], ray[0]])
        half_mm = rng.uniform(0.15, 0.4) * width_mm * np.sqrt(np.clip(1 - t / t[-1], 0.0, 1.0))
        side = half_mm[:, None] * left_normals(line)
        crack += _region(np.vstack([line - side, (line + side)[::-1]]))
        lines.append(line)
    rings = sorted(crack.to_polygons(), key=lambda ring: -abs(signed_area(ring)))
    holes = tuple(ring for ring in rings if signed_area(ring) < 0)
    return replace(
        outline,
        outline_mm=rings[0],
        outline_px=to_px(rings[0]),
        islands_mm=holes,
        branches_mm=tuple(lines),
        branches_kept=True,
    )


def _with_islands(outline: Outline, rng: np.random.Generator, width_mm: float) -> Outline:
    """Rough stones of a fifth to a half of the width; one may touch a wall."""
    stones = []
    for at in rng.uniform(0.15, 0.85, int(rng.integers(1, 5))):
        middle = outline.centreline_mm[int(at * len(outline.centreline_mm))]
        turn = -2 * np.pi * np.arange(24) / 24
        radius_mm = width_mm * rng.uniform(0.1, 0.25) * (1 + 0.1 * rng.standard_normal(24))
        offset = rng.uniform(-0.25, 0.25, 2) * width_mm
        stones.append(middle + offset + radius_mm[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]))
    return replace(outline, islands_mm=tuple(stones))


def _between(centre: Floats, half_left_mm: Floats, half_right_mm: Floats, ends: tuple[EndKind, EndKind]) -> Outline:
    normal = left_normals(centre)
    left, right = centre + half_left_mm[:, None] * normal, centre - half_right_mm[:, None] * normal
    return outline_between(centre, left, right, ends, None)


def _region(ring_mm: Floats) -> CrossSection:
    return CrossSection([ring_mm], FillRule.NonZero)


def _waves(rng: np.random.Generator, t: Floats, length_mm: float) -> Floats:
    """A smooth wander of amplitude about 1, of waves between 12 mm and the length."""
    waves_mm = np.geomspace(12.0, max(length_mm, 24.0), 4)
    weights = np.array([0.05, 0.15, 0.35, 0.6])
    phases = rng.uniform(0, 2 * np.pi, len(waves_mm))
    return (weights * np.sin(2 * np.pi * t[:, None] / waves_mm + phases)).sum(axis=1)
