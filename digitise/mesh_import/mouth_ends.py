"""Ends of a crack in its mouth: an opening in the edge of the face, a tip, a blunt front, or a cut."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from digitise.geometry.polyline import Box, unit
from digitise.mesh_import.rim import Place, dense, fine, first_exit, openings, stretch, within
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import FACING, Floats
from sealtwin.core.solid_figures import EndKind

ACROSS = 20  # Steps along the rim in the length of one width
WAYS_ON = ((0.6, 0.4, True), (1.0, 1.0, False))  # Distance from a blunt end, length, in widths; True to use the walls
AHEAD = 2.0  # Widths ahead of a path within which the crack ends; a path with more crack ahead is cut there
OPENS, POINTED = 0.15, 0.15  # Largest growth of circles from a sharp tip on, and their largest radius in it, in widths


@dataclass(frozen=True)
class MouthEnd:
    """Places where the rim, followed counter-clockwise, enters and leaves an end of the crack."""

    kind: EndKind
    arrives: Place
    leaves: Place
    blunt: bool = False  # True of a tip with a front across the crack, in which both walls begin


def end_before(ring_mm: Floats, path_mm: Floats, width_mm: float, face_mm: Box, whole: bool) -> MouthEnd:
    """Return the end of the crack before the first point of a path. A ``whole`` path leads to the crack's own ends."""
    leaf_mm = path_mm[0]
    sharp = False
    if whole:
        s_mm = arc_length(path_mm)
        to_rim_mm = np.asarray(KDTree(dense(ring_mm, width_mm / ACROSS)).query(path_mm)[0])
        # Circles that fit shrink fast into the corner of a blunt end, and slowly into a sharp tip.
        grows_mm = np.interp(s_mm + width_mm / 2, s_mm, to_rim_mm) - to_rim_mm
        begin = int(np.argmax(grows_mm < OPENS * width_mm / 2))
        sharp = begin == 0 and to_rim_mm[0] < POINTED * width_mm
        path_mm = path_mm[begin:]
    place_mm, ahead = path_mm[0], ahead_of(path_mm, width_mm)
    at_mm, exit_at = first_exit(ring_mm, place_mm, ahead)
    for arrives, leaves in openings(ring_mm, face_mm):
        opening_mm = KDTree(fine(stretch(ring_mm, arrives, leaves), width_mm / ACROSS))
        if opening_mm.query(leaf_mm)[0] <= width_mm / 2 or (
            at_mm <= AHEAD * width_mm and within(exit_at, arrives, leaves)
        ):
            return MouthEnd("open", arrives, leaves)
    if at_mm <= AHEAD * width_mm and not sharp:
        return MouthEnd("closed", exit_at, exit_at, blunt=True)
    if whole:
        away_mm = np.linalg.norm(ring_mm - leaf_mm, axis=1)
        near = away_mm <= max(width_mm, away_mm.min())
        tip = int(np.argmax(np.where(near, (ring_mm - leaf_mm) @ ahead, -np.inf)))
        return MouthEnd("closed", tip, tip)
    aside = np.array([-ahead[1], ahead[0]])
    arrives, leaves = (first_exit(ring_mm, place_mm, turn * aside)[1] for turn in (-1, 1))
    return MouthEnd("cut", arrives, leaves)


def straight_on(ring_mm: Floats, end: MouthEnd, lines_mm: Floats, width_mm: float) -> list[MouthEnd]:
    """Return the places at which the centreline, continued straight, may meet a blunt end. Other ends do not change.

    ``lines_mm``, (n, 6), are centreline, left and right wall from this end on. In a bend the best continuation starts
    near the end and is square to the lines from wall to wall. Before a slanted front the best one starts farther from
    the end and follows the line itself.
    """
    if not end.blunt:
        return [end]
    s_mm, ends = arc_length(lines_mm[:, :2]), []
    for before, over, by_walls in WAYS_ON:
        near_mm = lines_mm[(s_mm >= before * width_mm) & (s_mm <= (before + over) * width_mm)]
        if len(near_mm) < 2:
            continue
        backward = near_mm[-1, :2] - near_mm[0, :2]
        x, y = (near_mm[:, 2:4] - near_mm[:, 4:]).sum(axis=0)
        ahead = np.array([y, -x]) * -np.sign(y * backward[0] - x * backward[1]) if by_walls else -backward
        at_mm, exit_at = first_exit(ring_mm, near_mm[0, :2], unit(ahead))
        if at_mm <= AHEAD * width_mm:
            ends.append(replace(end, arrives=exit_at, leaves=exit_at))
    return ends or [end]


def are_square(lines_mm: Floats) -> NDArray[np.bool_]:
    """Return True for each station whose walls face each other square to the centreline.

    ``lines_mm``, (n, 6), are centreline, left and right wall.
    """
    along, across_mm = np.gradient(lines_mm[:, :2], axis=0), lines_mm[:, 2:4] - lines_mm[:, 4:]
    square_mm2 = np.abs(along[:, 0] * across_mm[:, 1] - along[:, 1] * across_mm[:, 0])
    return square_mm2 >= FACING * np.linalg.norm(along, axis=1) * np.linalg.norm(across_mm, axis=1)


def ahead_of(path_mm: Floats, over_mm: float) -> Floats:
    """Return the direction out of a path at its first point, measured over the stretch ``over_mm`` behind it."""
    back = int(np.searchsorted(arc_length(path_mm), over_mm))
    return unit(path_mm[0] - path_mm[min(back, len(path_mm) - 1)])
