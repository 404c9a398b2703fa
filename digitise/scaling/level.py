"""Whether markers lie level with the face: where they do not, every length is off by the offset over the distance."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from digitise.geometry.polyline import Box, rectangle
from digitise.pictures.raster import Map
from digitise.scaling.face_scale import FACE_MM
from digitise.scaling.straight import fit_line_to_most, meeting
from digitise.scaling.view import View
from sealtwin.errors import InputError
from sealtwin.records import Floats

REACH = 0.04
"""Of the face's longer side: how far its edges are looked for from where the markers put them. Markers would have to
lie off by that share of the camera's distance for more.
"""
LEAST_REACH_PX = 10.0
STEP_PX = 0.5
ROWS = 200
"""Across each edge; a crack takes some."""
UNLIKE = 0.2
"""Relative difference in light from the face where it ends: thrice the grain's, averaged along the edge."""
STEEPEST_PX = 1.5
"""Beyond the first unlike place, to where light changes most: narrower gaps of shadow are one with their edge."""
STRAIGHT_PX = 1.0
BENT_MM = 0.5
"""Of the edges found, from a rectangle of the face's shape: what is more bent is something else."""
EDGE_PX = 1.0
"""Standard uncertainty of a corner of the face in the photo."""
SIGMAS = 3.0
MOST = 0.05
"""Refused beyond: a twentieth of the camera's distance is no bent frame, it is a table under a sample."""


@dataclass(frozen=True)
class Level:
    """What the face's edges say about its markers."""

    excess: float
    """Relative size of the face as it is seen in the markers' plane, less 1; 0 where it agrees or cannot be told."""
    warnings: tuple[str, ...]


def check_level(
    brightness: Map, view: View, face_mm: Box | None, given_px: Floats | None, distance_mm: float | None, file: Path
) -> Level:
    """Compare the face's edges, seen or given as corners, with where markers put them.

    Raises InputError where they disagree by more than ``MOST``.
    """
    corners_px = given_px
    if corners_px is None and face_mm is not None:
        corners_px = _face_near(brightness, view.to_px(rectangle(face_mm)))
    if corners_px is None or face_mm is None:
        return Level(0.0, (_rule(distance_mm, face_mm is None),))
    true_mm = rectangle(face_mm)
    seen_mm = view.to_mm(corners_px)
    grown, bent_mm = _grown(seen_mm, true_mm)
    px_mm = float(view.mm_per_px_at(corners_px).mean())
    if given_px is None and bent_mm > max(BENT_MM, EDGE_PX * px_mm):
        return Level(0.0, (_rule(distance_mm, False),))
    width_mm, height_mm = face_mm[2:]
    diagonal_mm = float(np.hypot(width_mm, height_mm))
    if abs(grown) <= SIGMAS * np.hypot(FACE_MM, EDGE_PX * px_mm) / diagonal_mm:
        return Level(0.0, ())
    seen = (
        f"by the markers, the face is {width_mm * (1 + grown):.1f} x {height_mm * (1 + grown):.1f} mm; face_mm says "
        f"{width_mm:g} x {height_mm:g}"
    )
    side = "below" if grown > 0 else "above"
    cause = f"markers {side} the face"
    if distance_mm is not None:
        cause = f"markers {abs(grown) * distance_mm:.1f} mm {side} the face, {distance_mm:.0f} mm from the camera,"
    if abs(grown) > MOST:
        raise InputError(
            f"{file}: {seen}. Check face_mm and size_mm; or {cause} would do that: lay them level with it."
        )
    return Level(grown, (f"{seen}, {abs(grown):.1%} off: {cause} would do that",))


def _rule(distance_mm: float | None, unmeasured: bool) -> str:
    cost = "0.4 % of every length at 250 mm from the camera"
    if distance_mm is not None:
        cost = f"{1 / distance_mm:.2%} of every length at {distance_mm:.0f} mm from the camera"
    why = "without face_mm" if unmeasured else "since the edges of the face do not show clearly"
    return f"whether the markers lie level with the face is not seen, {why}: each mm above or below it costs {cost}"


def _grown(seen_mm: Floats, true_mm: Floats) -> tuple[float, float]:
    """Factor, less 1, of the similarity that fits best, and how far a corner is from it, in mm."""
    seen, true = (points - points.mean(axis=0) for points in (seen_mm, true_mm))
    seen_z, true_z = (points[:, 0] + 1j * points[:, 1] for points in (seen, true))
    factor = np.vdot(true_z, seen_z) / np.vdot(true_z, true_z)
    return float(abs(factor)) - 1, float(np.abs(seen_z - factor * true_z).max())


def _face_near(brightness: Map, rough_px: Floats) -> Floats | None:
    """Corners of a face whose place is known to ``REACH``, (4, 2); None where an edge does not stand out."""
    longest_px = float(np.linalg.norm(np.roll(rough_px, -1, axis=0) - rough_px, axis=1).max())
    reach_px = max(LEAST_REACH_PX, REACH * longest_px)
    edges = [edge for side in range(4) if (edge := _inner_edge(brightness, rough_px, side, reach_px)) is not None]
    return np.array([meeting(edges[side - 1], edges[side]) for side in range(4)]) if len(edges) == 4 else None


def _inner_edge(brightness: Map, rough_px: Floats, side: int, reach_px: float) -> Floats | None:
    """Line, point and direction, where light first ceases to be the face's, going outward."""
    start, end = rough_px[side], rough_px[(side + 1) % 4]
    along = (end - start) / np.linalg.norm(end - start)
    outward = np.array([along[1], -along[0]])
    outward *= np.sign(outward @ (start - rough_px.mean(axis=0)))
    foot = start + np.outer(np.linspace(0.06, 0.94, ROWS), end - start)
    offset = np.arange(-reach_px, reach_px + STEP_PX, STEP_PX)
    place = (foot[:, None] + offset[:, None] * outward).astype(np.float32)
    light = cv2.remap(
        brightness, place[..., 0], place[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0
    )
    # Neighbours along the edge share it, but not their grain.
    light = np.asarray(cv2.blur(light, (3, 9)), dtype=float)
    count = len(offset)
    # Row by row, since stains and the lamp change along the edge.
    of_face = np.median(light[:, : count // 4], axis=1, keepdims=True)
    unlike = np.abs(light - of_face) > UNLIKE * of_face
    lasting = unlike[:, :-2] & unlike[:, 1:-1] & unlike[:, 2:]
    lasting[:, : count // 8] = False
    first = lasting.argmax(axis=1)
    row = np.flatnonzero(first > 0)
    if len(row) < ROWS // 2:
        return None
    slope = np.abs(np.gradient(light, axis=1))
    near = np.arange(-round(2 * STEEPEST_PX / STEP_PX), round(STEEPEST_PX / STEP_PX) + 1)
    column = np.clip(first[row][:, None] + near, 1, count - 2)
    peak = column[np.arange(len(row)), slope[row[:, None], column].argmax(axis=1)]
    across = offset[peak]
    usual = np.abs(across - np.median(across)) <= max(
        2 * STRAIGHT_PX, 3 * float(np.median(np.abs(across - np.median(across))))
    )
    return fit_line_to_most(foot[row[usual]] + across[usual, None] * outward, STRAIGHT_PX)[0]
