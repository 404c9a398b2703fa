"""The rectangular block in a sample's body: upright sides that lie in material all along, save where a crack leaves."""

from dataclasses import dataclass

import cv2
import numpy as np
from manifold3d import Manifold

from digitise.geometry.region import Box, rectangle
from sealtwin.errors import InputError
from sealtwin.records import Floats

LEVELS = 8
"""Sections, from the face to the underside, in which a side must lie in material."""
LINES = 400
"""Across each section: every 0.4 mm of the paper's sample."""
OPENING_MM = 1.0
"""A line that finds its first material this far behind most others has met a crack, and no rough side."""
MOST_OPENING = 0.5
"""Of a side's lines that may meet a crack; beyond, it is no side."""
MOST_OFF = 0.25
"""Of the body's extent that may lie outside the block: dams, chamfers and rough sides together stay below."""
TRIM_MM = 0.01
"""What is taken off a side that is not perfectly plane, so that the cut goes through material and leaves no slivers."""

CUT_TOLERANCE = 1e-7
"""Of a body's volume, that may be missing after it was cut in two."""


@dataclass(frozen=True)
class Block:
    """A sample as one block: its face at z = 0 has one corner at the origin, and its sides lie along x and y."""

    body: Manifold
    """All of the sample inside the block's sides."""
    size_mm: tuple[float, float]
    """Of the face, along x and y."""
    placed: Floats
    """(4, 4): from the level body to here."""
    yaw_deg: float
    """By how much its sides were turned from x and y."""
    trimmed_mm: float
    """The most that lay outside the block at one of its sides."""

    @property
    def face_mm(self) -> Box:
        return 0.0, 0.0, *self.size_mm


def cut_block(body: Manifold, below_mm: float) -> Block:
    """The largest upright block in a body whose face is level at z = 0, as it lies or turned to its sides.

    ``below_mm`` under the face begins what counts as a side. Raises InputError where there are no four upright sides.
    """
    choices = [_as_turned(body, yaw_deg, below_mm) for yaw_deg in _directions_deg(body, below_mm)]
    found = [choice for choice in choices if choice is not None]
    if not found:
        raise InputError(
            "Mesh is no block with four upright sides below its face. Check up, the axis that points out of the "
            "cracked face, or cut a block round the crack in the program that made it."
        )
    # Turned for nothing, exact coordinates would be lost.
    return max(found, key=lambda block: round(block.size_mm[0] * block.size_mm[1]))


def parted(body: Manifold, cutter: Manifold) -> tuple[Manifold, Manifold]:
    """What of a body lies inside the cutter, and what outside.

    Raises InputError where the two do not make up the body: a boolean that met triangles lower than its rounding may
    take others out of their plane with them.
    """
    inside, outside = body.split(cutter)
    whole_mm3 = body.volume()
    if abs(inside.volume() + outside.volume() - whole_mm3) > CUT_TOLERANCE * whole_mm3:
        raise InputError(
            "Mesh cannot be cut without loss: it crosses itself, or has triangles without height. Mend it in the "
            "program that made it."
        )
    return inside, outside


def _directions_deg(body: Manifold, below_mm: float) -> list[float]:
    """Of the sides, perhaps, each -45 to 45: as it lies, as its longest edges, as the smallest rectangle round it."""
    edges = _edges(body, -below_mm)
    if not len(edges):
        return [0.0]
    step = edges[:, 1] - edges[:, 0]
    along_x, along_y = step[np.linalg.norm(step, axis=1).argmax()]
    longest_deg = np.degrees(np.arctan2(along_y, along_x))
    (_, _), (_, _), around_deg = cv2.minAreaRect(edges[:, 0].astype(np.float32))
    return list(dict.fromkeys([0.0, *((float(angle) + 45) % 90 - 45 for angle in (longest_deg, around_deg))]))


def _as_turned(body: Manifold, yaw_deg: float, below_mm: float) -> Block | None:
    turned = body.rotate((0.0, 0.0, -yaw_deg)) if yaw_deg else body
    bottom_mm, top_mm = turned.bounding_box()[2], turned.bounding_box()[5]
    levels = np.linspace(-below_mm, 0.9 * bottom_mm, LEVELS)
    sections = [edges for edges in (_edges(turned, level) for level in levels) if len(edges)]
    sides = [_sides(sections, axis) for axis in (0, 1)] if sections else [None]
    if any(side is None for side in sides):
        return None
    (x_min, x_max, off_x), (y_min, y_max, off_y) = (side for side in sides if side is not None)
    sides_mm = (x_min, y_min, x_max, y_max)
    shaft = rectangle(sides_mm).extrude(top_mm - bottom_mm + 2).translate((0.0, 0.0, bottom_mm - 1))
    yaw = np.radians(yaw_deg)
    placed = np.eye(4)
    placed[:2, :2] = [[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]
    placed[:2, 3] = -x_min, -y_min
    inside, _ = parted(turned, shaft)
    return Block(
        body=inside.translate((-x_min, -y_min, 0.0)),
        size_mm=(x_max - x_min, y_max - y_min),
        placed=placed,
        yaw_deg=yaw_deg,
        trimmed_mm=max(off_x, off_y),
    )


def _edges(body: Manifold, level_mm: float) -> Floats:
    """Of a section, (n, 2, 2)."""
    rings = [np.asarray(ring, dtype=float) for ring in body.slice(level_mm).to_polygons()]
    edges = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    return np.concatenate([np.empty((0, 2, 2)), *edges])


def _sides(sections: list[Floats], axis: int) -> tuple[float, float, float] | None:
    """Both sides along an axis, and the most that lies outside of them; None where there is no such side."""
    every = np.concatenate(sections)
    lines = np.linspace(every[..., 1 - axis].min(), every[..., 1 - axis].max(), LINES + 2)[1:-1]
    met = [_first_and_last(edges, axis, lines) for edges in sections]
    low = _side([first for first, _ in met])
    high = _side([-last for _, last in met])
    if low is None or high is None:
        return None
    off = max(low - every[..., axis].min(), every[..., axis].max() + high)
    return (low, -high, off) if off <= MOST_OFF * np.ptp(every[..., axis]) else None


def _first_and_last(edges: Floats, axis: int, lines: Floats) -> tuple[Floats, Floats]:
    """Where each line along ``axis`` first meets a section and last leaves it, (n,); infinite where it misses it."""
    start, end = edges[:, 0], edges[:, 1]
    low, high = np.sort(edges[..., 1 - axis], axis=1).T
    step = lines[1] - lines[0]
    from_line = np.clip(np.ceil((low - lines[0]) / step), 0, LINES).astype(int)
    count = np.maximum(np.clip(np.floor((high - lines[0]) / step), -1, LINES - 1).astype(int) - from_line + 1, 0)
    edge = np.repeat(np.arange(len(edges)), count)
    line = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + from_line[edge]
    rise = (end - start)[edge, 1 - axis]
    # An edge along the line is met at its ends by its neighbours.
    share = np.divide(lines[line] - start[edge, 1 - axis], rise, out=np.zeros_like(rise), where=rise != 0)
    place = start[edge, axis] + share * (end - start)[edge, axis]
    first, last = np.full(LINES, np.inf), np.full(LINES, -np.inf)
    np.minimum.at(first, line, place)
    np.maximum.at(last, line, place)
    return first, last


def _side(met: list[Floats]) -> float | None:
    """The place behind which, on every level, all lines have met material, but those that run into a crack."""
    held, plane = [], True
    for places in met:
        usual = float(np.median(places))
        if not np.isfinite(usual):
            return None
        scatter = float(np.median(np.abs(places - usual)[np.isfinite(places)]))
        kept = places[places <= usual + 5 * scatter + OPENING_MM]
        if len(kept) < (1 - MOST_OPENING) * LINES:
            return None
        held.append(float(kept.max()))
        plane &= usual == held[-1] == held[0]
    return max(held) + (0.0 if plane else TRIM_MM)
