"""Search the position of a crack in a levelled scan: where its hollow or heap agrees best with the mouth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.optimize import minimize

from sealtwin.core.arc_length import arc_length, arc_length_at
from sealtwin.core.arrays import Floats, Integers
from sealtwin.scan.height_map import MAD, HeightMap

STEP_DEG = 3.0
AROUND_MM = 8.0  # Width of the face around the mouth that takes part in the agreement
NOISE_SD = 2.0, 6.0  # Heights below the first are flat and above the second hollow or heap, in standard deviations
LEAST_MM = 0.15  # Smallest height of a hollow or heap
MOST_TURN_DEG = 30.0  # Largest angle between the axes of a scan and the photo along the face
REFINED = 3  # Number of coarse positions that are refined before they are compared
STRETCHES = 12  # Number of stretches of the crack whose halves are compared
SIZES, SIZE_STEP, SIZE_SAMPLES = (0.85, 1.0, 1.15), 0.05, 5000
"""Relative sizes at which the search of another size begins, its first step, and the number of its samples."""


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
    rings_mm: tuple[Floats, ...]
    samples_mm: Floats  # Places in and around the mouth, (n, 2)
    template: Floats  # 1 in the mouth and 0 around it, (n,)

    @classmethod
    def of(cls, points_mm: Floats, rings_mm: Sequence[Floats], cell_mm: float) -> "MouthSearch":
        """Return the search in cells of a size, or in larger ones if the scan has less than one point in a cell."""
        low_mm, high_mm = (np.quantile(points_mm[:, :2], share, axis=0) for share in (0.001, 0.999))
        per_cell = len(points_mm) * cell_mm**2 / max(float(np.prod(high_mm - low_mm)), cell_mm**2)
        cell_mm *= max(1.0, float(np.sqrt(1.0 / per_cell)))
        heights = HeightMap.of(points_mm, low_mm, high_mm, cell_mm)
        corners = np.vstack(rings_mm)
        grid = HeightMap(
            corners.min(axis=0) - AROUND_MM,
            cell_mm,
            np.zeros(np.ceil((np.ptp(corners, axis=0)[::-1] + 2 * AROUND_MM) / cell_mm).astype(int)),
        )
        mouth = grid.inside(rings_mm)
        near = grid.away_mm(mouth) <= AROUND_MM
        x_mm, y_mm = np.meshgrid(*grid.middles_mm)
        return cls(heights, tuple(rings_mm), np.column_stack([x_mm[near], y_mm[near]]), mouth[near].astype(float))

    @cached_property
    def _picture(self) -> Floats:
        """Hollows and heaps as 1, the flat face and unseen cells as 0, (rows, columns)."""
        height_mm = np.abs(self.map.height_mm)
        noise_mm = MAD * float(np.nanmedian(height_mm))
        low_mm, high_mm = (max(share * noise_mm, LEAST_MM * share / NOISE_SD[1]) for share in NOISE_SD)
        return np.nan_to_num(np.clip((height_mm - low_mm) / (high_mm - low_mm), 0.0, 1.0))

    @cached_property
    def _smooth(self) -> Floats:
        return gaussian_filter(self._picture, 0.7)

    @cached_property
    def _candidates(self) -> list[Candidate]:
        """The best shift for each turn."""
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
            row, column = np.unravel_index(int(scores.argmax()), scores.shape)
            corner_mm = self.map.corner_mm + cell_mm * (np.array([column - pad[1], row - pad[0]]) + 0.5)
            shift = (low - corner_mm) @ back.T
            candidates.append(Candidate(Pose(turn_deg, *shift.tolist()), float(scores[row, column])))
        return candidates

    @cached_property
    def mirrored(self) -> "MouthSearch":
        """The search in the mirror image of the scan."""
        width_mm = self.map.height_mm.shape[1] * self.map.cell_mm
        corner_mm = np.array([-self.map.corner_mm[0] - width_mm, self.map.corner_mm[1]])
        return replace(self, map=HeightMap(corner_mm, self.map.cell_mm, self.map.height_mm[:, ::-1]))

    def near(self, candidate: Candidate) -> Candidate:
        """Return the best position near another one."""
        pose = self.refined(candidate.pose)
        return Candidate(pose, self.agreement(pose))

    def best(self, *, turned: bool) -> Candidate:
        """Return the best position, of those turned by more than ``MOST_TURN_DEG`` or of the others."""
        candidates = [entry for entry in self._candidates if (abs(entry.pose.turn_deg) > MOST_TURN_DEG) == turned]
        candidates.sort(key=lambda entry: -entry.agreement)
        return max(
            map(self.near, candidates[:REFINED]),
            key=lambda entry: entry.agreement,
            default=Candidate(Pose(0.0, 0.0, 0.0), -1.0),
        )

    def agreement(self, pose: Pose, part: Integers | None = None) -> float:
        """Return the correlation of the scan's hollows and heaps with the mouth, -1 to 1."""
        part = np.arange(len(self.template)) if part is None else part
        return self._correlation(pose.back(self.samples_mm[part]), self.template[part])

    def _correlation(self, places_mm: Floats, template: Floats) -> float:
        places = (places_mm - self.map.corner_mm) / self.map.cell_mm - 0.5
        seen = map_coordinates(self._smooth, places.T[::-1], order=1, mode="constant")
        if np.ptp(seen) < 1e-9 or np.ptp(template) == 0:
            return 0.0
        return float(np.corrcoef(seen, template)[0, 1])

    def refined(self, pose: Pose) -> Pose:
        """Return the pose near ``pose`` with the largest agreement. It turns about the middle of the mouth."""
        middle = self.samples_mm.mean(axis=0)
        cell_mm = self.map.cell_mm

        def moved(change: Floats) -> Pose:
            turn_deg = pose.turn_deg + float(change[0])
            before_mm = pose.back(middle[None])[0]
            return Pose(turn_deg, *(middle + change[1:] - _turn(turn_deg) @ before_mm).tolist())

        sides = np.array([[0, 0, 0], [STEP_DEG, 0, 0], [0, 2 * cell_mm, 0], [0, 0, 2 * cell_mm]], dtype=float)
        options = {"initial_simplex": sides, "xatol": 1e-3, "fatol": 1e-6, "maxiter": 300}

        def off(change: Floats) -> float:
            return -self.agreement(moved(change))

        return moved(minimize(off, np.zeros(3), method="Nelder-Mead", options=options).x)

    def size(self, pose: Pose) -> tuple[float, float]:
        """Return the length of the scan relative to the mouth at which they agree best near a pose, and the agreement.

        The width does not count: the edges of a hollow are blurred.
        """
        middle = self.samples_mm.mean(axis=0)
        every = slice(None, None, max(len(self.template) // SIZE_SAMPLES, 1))
        around_mm, template = self.samples_mm[every] - middle, self.template[every]
        start_mm = pose.back(middle[None])[0]
        ahead = np.linalg.svd(around_mm[template > 0], full_matrices=False)[2][0]
        along_mm = np.outer(around_mm @ ahead, ahead)

        def off(change: Floats) -> float:
            turned = Pose(pose.turn_deg + float(change[0]), 0.0, 0.0)
            return -self._correlation(
                turned.back(around_mm + (change[3] - 1) * along_mm) + start_mm + change[1:3], template
            )

        steps = np.diag([STEP_DEG, 2 * self.map.cell_mm, 2 * self.map.cell_mm, SIZE_STEP])
        options = {"xatol": 1e-3, "fatol": 1e-5, "maxiter": 200}
        fits = []
        for size in SIZES:
            sides = np.vstack([np.zeros(4), steps]) + np.array([0.0, 0.0, 0.0, size])
            fits.append(minimize(off, sides[0], method="Nelder-Mead", options={"initial_simplex": sides, **options}))
        best = min(fits, key=lambda fit: fit.fun)
        return float(best.x[3]), -float(best.fun)

    def shift_sd_mm(self, pose: Pose, centreline_mm: Floats) -> tuple[float, float]:
        """Return the standard uncertainty of the position along and across the crack, from fits to either half of it.

        The halves consist of alternating stretches, so that both contain an end. Half of their distance is the standard
        uncertainty of a fit to both, for errors that stretches do not share.
        """
        part = arc_length_at(self.samples_mm, centreline_mm) / arc_length(centreline_mm)[-1]
        stretch = np.clip(np.floor(part * STRETCHES), 0, STRETCHES - 1)
        sides = self.map.cell_mm * np.array([[0, 0], [1.0, 0], [0, 1.0]])
        options = {"initial_simplex": sides, "xatol": 1e-2, "fatol": 1e-5, "maxiter": 80}

        def off(change: Floats, samples: Integers) -> float:
            return -self.agreement(Pose(pose.turn_deg, pose.x_mm + change[0], pose.y_mm + change[1]), samples)

        def shift_mm(samples: Integers) -> Floats:
            return minimize(off, np.zeros(2), samples, method="Nelder-Mead", options=options).x

        chord = centreline_mm[-1] - centreline_mm[0]
        chord /= np.linalg.norm(chord)
        shifts_mm = []
        for width in (1, 2, 3):
            first = (stretch // width) % 2 == 0
            apart_mm = shift_mm(np.flatnonzero(first)) - shift_mm(np.flatnonzero(~first))
            shifts_mm.append((apart_mm @ chord / 2, (chord[0] * apart_mm[1] - chord[1] * apart_mm[0]) / 2))
        along_mm, across_mm = np.sqrt(np.mean(np.square(shifts_mm), axis=0)).tolist()
        return along_mm, across_mm
