"""Outlines of known shape, made without any photo: for the tests of every stage that needs a crack."""

from dataclasses import replace
from typing import cast

import numpy as np

from sealtwin.core.records import Floats, Outline, Sections
from sealtwin.core.solid_figures import EndKind

PAPER_FACE_MM = (0.0, 0.0, 160.0, 40.0)
MM_PER_PX = 0.1
OPEN: tuple[EndKind, EndKind] = ("open", "open")
CLOSED: tuple[EndKind, EndKind] = ("closed", "closed")
CUT: tuple[EndKind, EndKind] = ("cut", "cut")


def straight_slot(
    length_mm: float = 80.0,
    width_mm: float = 3.1,
    ends: tuple[EndKind, EndKind] = CUT,
    face_mm: tuple[float, float, float, float] | None = None,
) -> Outline:
    """A rectangle along x from the origin. With open ends give a face, or its sides are taken at x = 0 and length."""
    if face_mm is None and "open" in ends:
        face_mm = (0.0 if ends[0] == "open" else -20.0, -20.0, length_mm + (0.0 if ends[1] == "open" else 20.0), 20.0)
    s_mm = np.linspace(0.0, length_mm, round(length_mm) + 1)
    centre = np.column_stack([s_mm, np.zeros_like(s_mm)])
    return _between(centre, np.full_like(s_mm, width_mm / 2), np.full_like(s_mm, width_mm / 2), ends, face_mm)


def arc_slot(
    radius_mm: float = 60.0, sweep_deg: float = 80.0, width_mm: float = 3.0, ends: tuple[EndKind, EndKind] = CUT
) -> Outline:
    """A circular arc about the origin, counter-clockwise from (radius, 0)."""
    turn = np.radians(np.linspace(0.0, sweep_deg, round(radius_mm * np.radians(sweep_deg) * 4) + 1))
    centre = radius_mm * np.column_stack([np.cos(turn), np.sin(turn)])
    half = np.full_like(turn, width_mm / 2)
    return _between(centre, half, half, ends, None)


def dog_leg(turn_deg: float) -> Outline:
    """Two straight halves of 40 mm, 3 mm wide, that meet at an angle."""
    t, turn = np.linspace(-40.0, 40.0, 321), np.radians(turn_deg)
    centre = np.where(t[:, None] < 0, np.outer(t, [1.0, 0.0]), np.outer(t, [np.cos(turn), np.sin(turn)]))
    return _between(centre, np.full_like(t, 1.5), np.full_like(t, 1.5), CUT, None)


def oblique_slot(width_mm: float = 3.1) -> Outline:
    """The paper's crack without its wander: straight, 80 mm, at 30 degrees across the 40 mm of the face, both open."""
    return wandering_crack(wander_mm=0.0, width_mm=width_mm, width_change=0.0)


def wandering_crack(
    seed: int = 0, wander_mm: float = 1.2, width_mm: float = 3.1, width_change: float = 0.2, rough_mm: float = 0.0
) -> Outline:
    """A crack like the paper's: across a 160 x 40 mm face at 30 degrees to its long side, open at both ends.

    ``rough_mm`` is the standard deviation of noise on each wall point, as tracing leaves it.
    """
    rng = np.random.default_rng(seed)
    along = np.array([np.cos(np.radians(30)), np.sin(np.radians(30))])
    t = np.linspace(-12.0, 92.0, 417)
    across = wander_mm * _waves(rng, t)
    centre = np.array([80.0, 20.0]) + np.outer(t - 40.0, along) + np.outer(across, [-along[1], along[0]])
    half_left, half_right = (
        width_mm / 2 * (1 + width_change * _waves(rng, t)) + rough_mm * rng.standard_normal(len(t)) for _ in range(2)
    )
    normal = _left_normals(centre)
    left = centre + half_left[:, None] * normal
    right = centre - half_right[:, None] * normal
    inside = (centre[:, 1] > 0) & (centre[:, 1] < 40)
    middle = [_crossing(centre, level) for level in (0.0, 40.0)]
    centreline = np.vstack([middle[0], centre[inside], middle[1]])
    walls = []
    for wall in (left, right):
        stations = wall[inside]
        stations = stations[(stations[:, 1] > 0) & (stations[:, 1] < 40)]
        # Stations whose wall already lies beyond the face all meet it where the wall crosses its edge.
        first, last = _crossing(wall, 0.0), _crossing(wall, 40.0)
        missing_low = int((wall[inside][:, 1] <= 0).sum())
        missing_high = int((wall[inside][:, 1] >= 40).sum())
        walls.append(np.vstack([np.tile(first, (missing_low + 1, 1)), stations, np.tile(last, (missing_high + 1, 1))]))
    return outline_between(centreline, walls[0], walls[1], OPEN, PAPER_FACE_MM)


def closed_crack(seed: int = 0, length_mm: float = 60.0, width_mm: float = 3.0, rough_mm: float = 0.0) -> Outline:
    """A wandering lens with a tip at both ends; no face known."""
    return random_crack("tapered", seed, length_mm=length_mm, width_mm=width_mm, rough_mm=rough_mm)


def cut_crack(seed: int = 0, length_mm: float = 40.0, width_mm: float = 3.0, rough_mm: float = 0.0) -> Outline:
    """A piece of a longer, wandering crack, cut at both ends; no face known."""
    return random_crack("plain", seed, length_mm=length_mm, width_mm=width_mm, rough_mm=rough_mm, ends=CUT)


def pinched_crack(seed: int = 0, length_mm: float = 60.0, width_mm: float = 3.0, neck_mm: float = 0.15) -> Outline:
    """Two tips, and a neck of ``neck_mm`` halfway."""
    return random_crack("pinched", seed, length_mm=length_mm, width_mm=width_mm, neck_mm=neck_mm)


def random_crack(
    kind: str,
    seed: int,
    length_mm: float = 60.0,
    width_mm: float = 3.0,
    rough_mm: float = 0.0,
    neck_mm: float = 0.15,
    ends: tuple[EndKind, EndKind] = CLOSED,
) -> Outline:
    """A wandering crack of a ``kind``: plain (about the same width all along), tapered or pinched.

    Closed ends close over the last widths of a plain or pinched crack, and over the whole length of a tapered one.
    """
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, length_mm, round(length_mm * 4) + 1)
    centre = np.column_stack([t, 0.03 * length_mm * _waves(rng, t)])
    shape = np.ones_like(t)
    if kind == "tapered":
        shape *= np.sqrt(np.clip(1.0 - np.abs(2 * t / length_mm - 1.0), 0.0, 1.0)) * 1.4
    if kind == "pinched":
        shape *= 1 - (1 - neck_mm / width_mm) * np.exp(-(((t - length_mm / 2) / (2 * width_mm)) ** 2))
    for end, s_mm in zip(ends, (t, length_mm - t), strict=True):
        if end == "closed":
            shape *= np.clip(s_mm / (2 * width_mm), 0.0, 1.0) ** 0.5
    change = 0.0 if kind == "pinched" else 0.15
    half_left, half_right = (
        np.clip(width_mm / 2 * (1 + change * _waves(rng, t)) + rough_mm * rng.standard_normal(len(t)), 0.02, None)
        * shape
        for _ in range(2)
    )
    return _between(centre, half_left, half_right, ends, None)


def reversed_path(outline: Outline) -> Outline:
    """The same crack, walked from its other end."""
    return outline_between(
        outline.centreline_mm[::-1],
        outline.right_wall_mm[::-1],
        outline.left_wall_mm[::-1],
        cast(tuple[EndKind, EndKind], outline.ends[::-1]),
        outline.face_mm,
    )


def level_floor(depth_mm: float, width_mm: float = 3.0, length_mm: float = 80.0) -> Sections:
    """Of a slot: the same section all along."""
    ends = np.array([0.0, length_mm])
    return Sections(ends, np.full(2, depth_mm), np.full(2, depth_mm * width_mm))


def with_ring(outline: Outline, ring_mm: Floats) -> Outline:
    """The same walls with another ring, for what only the ring can say."""
    return replace(outline, outline_mm=ring_mm, outline_px=to_px(ring_mm))


def _between(
    centre: Floats,
    half_left_mm: Floats,
    half_right_mm: Floats,
    ends: tuple[EndKind, EndKind],
    face_mm: tuple[float, float, float, float] | None,
) -> Outline:
    normal = _left_normals(centre)
    return outline_between(
        centre, centre + half_left_mm[:, None] * normal, centre - half_right_mm[:, None] * normal, ends, face_mm
    )


def outline_between(
    centre: Floats,
    left: Floats,
    right: Floats,
    ends: tuple[EndKind, EndKind],
    face_mm: tuple[float, float, float, float] | None,
) -> Outline:
    """Counter-clockwise: out along the right wall, back along the left."""
    ring = np.vstack([right, left[::-1]])
    ring = ring[np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1) > 1e-9]
    return Outline(
        centreline_mm=centre,
        left_wall_mm=left,
        right_wall_mm=right,
        outline_mm=ring,
        centreline_px=to_px(centre),
        left_wall_px=to_px(left),
        right_wall_px=to_px(right),
        outline_px=to_px(ring),
        ends=ends,
        face_mm=face_mm,
        mm_per_px=MM_PER_PX,
        scale_source="given: 0.1 mm/px (synthetic)",
        scale_residual_mm=None,
        path_source="ends",
    )


def to_px(points_mm: Floats) -> Floats:
    return np.column_stack([points_mm[:, 0], 100.0 - points_mm[:, 1]]) / MM_PER_PX


def _left_normals(centre: Floats) -> Floats:
    tangent = np.gradient(centre, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.column_stack([-tangent[:, 1], tangent[:, 0]])


def _waves(rng: np.random.Generator, t: Floats) -> Floats:
    """A smooth wander of amplitude about 1, of waves 12 to 60 mm long."""
    lengths = np.array([60.0, 37.0, 23.0, 12.0])
    weights = np.array([0.6, 0.35, 0.2, 0.1])
    phases = rng.uniform(0, 2 * np.pi, len(lengths))
    return (weights * np.sin(2 * np.pi * t[:, None] / lengths + phases)).sum(axis=1)


def _crossing(line: Floats, y_mm: float) -> Floats:
    """Where a polyline first crosses a height."""
    after = int(np.flatnonzero((line[:-1, 1] < y_mm) & (line[1:, 1] >= y_mm))[0]) + 1
    (x0, y0), (x1, y1) = line[after - 1], line[after]
    return np.array([x0 + (y_mm - y0) / (y1 - y0) * (x1 - x0), y_mm])
