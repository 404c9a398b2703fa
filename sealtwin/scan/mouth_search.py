"""Search the position of a crack in a levelled scan: where its hollow or heap agrees best with the mouth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.optimize import minimize

from sealtwin.core.arc_length import arc_length, arc_length_at
from sealtwin.core.arrays import Booleans, Floats, unit
from sealtwin.core.records import EndKind, Outline
from sealtwin.scan.height_map import MAD, HeightMap

STEP_DEG = 3.0
AROUND_MM = 8.0  # Width of the face around the mouth that takes part in the agreement
NOISE_SD = 2.0, 6.0  # Heights below the first are flat and above the second hollow or heap, in standard deviations
LEAST_MM = 0.15  # Smallest height of a hollow or heap
NEAR_FACE_MM = 5.0  # Only heights within this distance of the face show its noise
SMOOTH, SEEN = 0.7, 0.3  # Standard deviation of the smoothing in cells, and the share of cells that must be seen there
MOST_TURN_DEG = 30.0  # Largest angle between the axes of a scan and the photo along the face
AROUND_BOX = 0.25  # Margin around 98 % of the points, as a share of their extent, beyond which points are strays
RIVAL_WIDTHS, PEAKS = (2.0, 1.2), 3
"""Distances along and across the crack, in its widths, beyond which positions are different, and positions for each
turn."""
REFINED = 3  # Number of coarse positions that are refined before they are compared


@dataclass(frozen=True)
class Pose:
    """Motion along the face: a turn about the origin, then a shift."""

    turn_deg: float
    x_mm: float
    y_mm: float

    def apply(self, points_mm: Floats) -> Floats:
        """Return points, (n, 2) or (n, 3), moved by this pose."""
        turned = points_mm.copy()
        turned[:, :2] = points_mm[:, :2] @ _turn(self.turn_deg).T + [self.x_mm, self.y_mm]
        return turned

    def back(self, points_mm: Floats) -> Floats:
        """Return points, (n, 2), before this pose was applied."""
        return (points_mm - [self.x_mm, self.y_mm]) @ _turn(self.turn_deg)

    @property
    def is_allowed(self) -> bool:
        """True if the axes of the scan and the photo agree up to ``MOST_TURN_DEG``."""
        return abs(self.turn_deg) <= MOST_TURN_DEG

    def moved(self, about_mm: Floats, turn_deg: float, shift_mm: Floats) -> "Pose":
        """Return the pose followed by a turn about a point, (2,), and a shift, (2,)."""
        corner_mm = about_mm + _turn(turn_deg) @ (np.array([self.x_mm, self.y_mm]) - about_mm) + shift_mm
        return Pose((self.turn_deg + turn_deg + 180) % 360 - 180, *corner_mm.tolist())


@dataclass(frozen=True)
class Target:
    """Crack of the sample that a scan is brought to, in the sample's frame."""

    rings_mm: tuple[Floats, ...]  # The mouth: outer rings and holes
    centreline_mm: Floats  # (n, 2)
    width_mm: float
    ends: tuple[EndKind, EndKind]
    face_mm: tuple[float, float, float, float] | None  # x_min, y_min, x_max, y_max

    @classmethod
    def of(cls, outline: Outline, rings_mm: Sequence[Floats] = ()) -> "Target":
        """Return the crack of an outline, whose mouth may be given as the rings of the solid."""
        rings = tuple(map(np.asarray, rings_mm)) or (outline.outline_mm,)
        return cls(rings, outline.centreline_mm, outline.mean_width_mm, outline.ends, outline.face_mm)

    @property
    def axes(self) -> Floats:
        """Directions along and across the crack's chord, (2, 2)."""
        x, y = unit((self.centreline_mm[-1] - self.centreline_mm[0])[None])[0]
        return np.array([[x, y], [-y, x]])

    def beyond(self, points_mm: Floats) -> Booleans:
        """Return which points, (n, 2), lie beyond an end that is not closed, where the crack may go on."""
        s_mm = arc_length_at(points_mm, self.centreline_mm)
        ends = [kind != "closed" for kind in self.ends]
        return (ends[0] & (s_mm < 0)) | (ends[1] & (s_mm > arc_length(self.centreline_mm)[-1]))


@dataclass(frozen=True)
class Candidate:
    pose: Pose
    agreement: float


def _turn(angle_deg: float) -> Floats:
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.array([[cosine, -sine], [sine, cosine]])


@dataclass(frozen=True, eq=False)
class MouthSearch:
    """The hollows and heaps of a scan as a picture, and the mouth as a template."""

    map: HeightMap
    target: Target
    samples_mm: Floats  # Places in and around the mouth, but not beyond an open or cut end, (n, 2)
    template: Floats  # 1 in the mouth and 0 around it, (n,)

    @classmethod
    def of(cls, points_mm: Floats, target: Target, cell_mm: float) -> "MouthSearch":
        """Return the search in cells of a size, or in larger ones if the scan has less than one point in a cell."""
        # Strays may be far from the sample.
        low_mm, high_mm = (np.quantile(points_mm[:, :2], share, axis=0) for share in (0.01, 0.99))
        low_mm, high_mm = low_mm - AROUND_BOX * (high_mm - low_mm), high_mm + AROUND_BOX * (high_mm - low_mm)
        inside = ((points_mm[:, :2] >= low_mm) & (points_mm[:, :2] <= high_mm)).all(axis=1)
        points_mm = points_mm[inside]
        low_mm, high_mm = points_mm[:, :2].min(axis=0), points_mm[:, :2].max(axis=0)
        per_cell = len(points_mm) * cell_mm**2 / max(float(np.prod(high_mm - low_mm)), cell_mm**2)
        cell_mm *= max(1.0, float(np.sqrt(1.0 / per_cell)))
        heights = HeightMap.of(points_mm, low_mm, high_mm, cell_mm)
        corners = np.vstack(target.rings_mm)
        grid = HeightMap(
            corners.min(axis=0) - AROUND_MM,
            cell_mm,
            np.zeros(np.ceil((np.ptp(corners, axis=0)[::-1] + 2 * AROUND_MM) / cell_mm).astype(int)),
        )
        mouth = grid.inside(target.rings_mm)
        near = grid.away_mm(mouth) <= AROUND_MM
        x_mm, y_mm = np.meshgrid(*grid.middles_mm)
        samples_mm = np.column_stack([x_mm[near], y_mm[near]])
        on_stretch = ~target.beyond(samples_mm)
        return cls(heights, target, samples_mm[on_stretch], mouth[near][on_stretch].astype(float))

    @cached_property
    def _picture(self) -> Floats:
        """Hollows and heaps as 1, the flat face and unseen cells as 0, (rows, columns)."""
        height_mm = np.abs(self.map.height_mm)
        noise_mm = MAD * float(np.nanmedian(height_mm[~(height_mm > NEAR_FACE_MM)]))
        low_mm, high_mm = (max(share * noise_mm, LEAST_MM * share / NOISE_SD[1]) for share in NOISE_SD)
        return np.nan_to_num(np.clip((height_mm - low_mm) / (high_mm - low_mm), 0.0, 1.0))

    @cached_property
    def _smooth(self) -> tuple[Floats, Floats]:
        """The picture, smoothed over seen cells, and the share of seen cells, (rows, columns)."""
        seen = gaussian_filter(self.map.known.astype(float), SMOOTH)
        return gaussian_filter(self._picture, SMOOTH) / np.maximum(seen, 1e-6), seen

    def seen(self, places_mm: Floats, *, beyond: bool = True) -> tuple[Floats, Booleans]:
        """Return the hollows and heaps at places of the scan, (n, 2), and whether these are seen, (n,) each.

        Beyond the scan is a flat face: a position at which the mouth lies beyond it agrees less. Without ``beyond``, it
        is not seen.
        """
        places = ((places_mm - self.map.corner_mm) / self.map.cell_mm - 0.5).T[::-1]
        picture, share = (map_coordinates(layer, places, order=1, mode="constant") for layer in self._smooth)
        rows, columns = self.map.height_mm.shape
        outside = ((places < -0.5) | (places > np.array([[rows - 0.5], [columns - 0.5]]))).any(axis=0)
        return picture, ((share > SEEN) & ~outside) | (outside & beyond)

    @cached_property
    def _candidates(self) -> list[Candidate]:
        """The best shifts for each turn, away from each other."""
        cell_mm, candidates = self.map.cell_mm, list[Candidate]()
        for turn_deg in np.arange(-180.0, 180.0, STEP_DEG).tolist():
            back = _turn(turn_deg)
            samples = self.samples_mm @ back  # Samples of the template before the scan's turn
            low = samples.min(axis=0)
            index = np.rint((samples - low) / cell_mm).astype(int)
            shape = index.max(axis=0)[::-1] + 1
            template, mask = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
            template[index[:, 1], index[:, 0]], mask[index[:, 1], index[:, 0]] = self.template, 1.0
            pad = (np.array(shape) // 2).tolist()
            padded = np.pad(self._picture, ((pad[0], pad[0]), (pad[1], pad[1]))).astype(np.float32)
            if (np.array(padded.shape) < shape).any():
                continue
            scores = cv2.matchTemplate(padded, template, cv2.TM_CCOEFF_NORMED, mask=mask)
            scores[~np.isfinite(scores)] = -1.0
            around = round(min(RIVAL_WIDTHS) * self.target.width_mm / cell_mm)
            for _ in range(PEAKS):
                row, column = np.unravel_index(int(scores.argmax()), scores.shape)
                corner_mm = self.map.corner_mm + cell_mm * (np.array([column - pad[1], row - pad[0]]) + 0.5)
                shift = (low - corner_mm) @ back.T
                candidates.append(Candidate(Pose(turn_deg, *shift.tolist()), float(scores[row, column])))
                scores[max(row - around, 0) : row + around + 1, max(column - around, 0) : column + around + 1] = -1.0
        return candidates

    @cached_property
    def mirrored(self) -> "MouthSearch":
        """The search in the mirror image of the scan."""
        width_mm = self.map.height_mm.shape[1] * self.map.cell_mm
        corner_mm = np.array([-self.map.corner_mm[0] - width_mm, self.map.corner_mm[1]])
        return replace(self, map=HeightMap(corner_mm, self.map.cell_mm, self.map.height_mm[:, ::-1]))

    def best(self, is_usable: Callable[[Pose], bool]) -> Candidate:
        """Return the best usable position. Its agreement is -1 if there is none."""
        usable = sorted(
            (entry for entry in self._candidates if is_usable(entry.pose)), key=lambda entry: -entry.agreement
        )
        poses = [pose for pose in (self.refined(entry.pose) for entry in usable[:REFINED]) if is_usable(pose)]
        candidates = [Candidate(pose, self.agreement(pose)) for pose in poses]
        return max(candidates, key=lambda entry: entry.agreement, default=Candidate(Pose(0.0, 0.0, 0.0), -1.0))

    def is_rival(self, pose: Pose, best: Pose) -> bool:
        """Return True if a position is allowed, and away from the best one."""
        middle_mm = self.samples_mm.mean(axis=0)[None]
        apart_mm = self.target.axes @ (best.apply(pose.back(middle_mm)) - middle_mm)[0]
        return pose.is_allowed and bool((np.abs(apart_mm) > self.target.width_mm * np.array(RIVAL_WIDTHS)).any())

    def agreement(self, pose: Pose) -> float:
        """Return the correlation of the scan's hollows and heaps with the mouth, -1 to 1."""
        picture, seen = self.seen(pose.back(self.samples_mm))
        if seen.mean() < SEEN or np.ptp(picture[seen]) < 1e-9 or np.ptp(self.template[seen]) == 0:
            return 0.0
        return float(np.corrcoef(picture[seen], self.template[seen])[0, 1])

    def refined(self, pose: Pose) -> Pose:
        """Return the pose near ``pose`` with the largest agreement. It turns about the middle of the mouth."""
        middle_mm, cell_mm = self.samples_mm.mean(axis=0), self.map.cell_mm

        def moved(change: Floats) -> Pose:
            return pose.moved(middle_mm, float(change[0]), change[1:])

        sides = np.array([[0, 0, 0], [STEP_DEG, 0, 0], [0, 2 * cell_mm, 0], [0, 0, 2 * cell_mm]], dtype=float)
        options = {"initial_simplex": sides, "xatol": 1e-3, "fatol": 1e-6, "maxiter": 300}

        def off(change: Floats) -> float:
            return -self.agreement(moved(change))

        return moved(minimize(off, np.zeros(3), method="Nelder-Mead", options=options).x)
