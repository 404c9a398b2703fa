"""Fit the edges of a hollow or heap to those of the mouth, stretch by stretch along the crack."""

from dataclasses import dataclass

import numpy as np

from sealtwin.core.arc_length import arc_length, arc_length_at, at_arc_length
from sealtwin.core.arrays import Booleans, Floats, Integers, unit
from sealtwin.scan.height_map import MAD
from sealtwin.scan.mouth_search import MouthSearch, Pose

LEAST_AGREEING, SURE_AGREEING = 0.5, 0.75
"""Smallest share of the crack along which the edges of the scan's hollow or heap agree with the mouth's, and smallest
share that is certain. Other cracks across like faces may reach the first."""
REACH_MM = 3.0  # Largest distance between the edges of scan and mouth that is searched
AGREES_MM = 0.25  # Edges agree within this distance, or within a cell if that is larger
VISIBLE = 0.5  # Smallest correlation of a stretch whose edges are visible
FEWEST = 5  # Smallest number of such stretches
LEAST_SEEN = 0.3  # Smallest share of a stretch that must be seen
ROUNDS, REWEIGHTED, SETTLED_MM = 6, 10, 0.01
LEAST_SD_MM = 0.15  # Smallest standard deviation of a stretch's shift: neighbours share errors
RIDGE = (LEAST_SD_MM / REACH_MM) ** 2
START_MM = 4.0, -4.0, 8.0, -8.0  # Shifts along the crack from which the fit begins again


@dataclass(frozen=True)
class EdgeFit:
    """Position at which the edges agree best."""

    pose: Pose
    agreeing: float  # Share of all stretches whose edges agree
    along_sd_mm: float  # Standard uncertainty of the position along the crack's chord
    across_sd_mm: float  # The same across it


@dataclass(frozen=True, eq=False)
class Edges:
    """Stretches of the mouth, each about as long as the crack is wide, and its closed ends."""

    search: MouthSearch
    samples_mm: Floats  # Samples of all stretches in turn, (n, 2)
    template: Floats  # 1 in the mouth and 0 around it, (n,)
    stretch: Integers  # Number of each sample's stretch, (n,)
    ways: Floats  # Direction in which a stretch is compared: across the crack, or along it at an end, (m, 2)
    middles_mm: Floats  # (m, 2)
    is_end: Booleans  # (m,)

    @classmethod
    def of(cls, search: MouthSearch, *, single: bool = False) -> "Edges":
        """Return the stretches of a search's mouth, each with both edges, or for a ``single`` edge.

        A stretch is as long as the crack is wide. A stretch without both mouth and face is left out.
        """
        target, samples_mm, line_mm = search.target, search.samples_mm, search.target.centreline_mm
        s_mm, along_mm = arc_length_at(samples_mm, line_mm), arc_length(line_mm)
        length_mm, ahead = along_mm[-1], unit(np.gradient(line_mm, axis=0))
        count = max(int(length_mm / max(target.width_mm, 2 * search.map.cell_mm)), FEWEST)
        number = np.clip(s_mm / length_mm * count, 0, count - 1).astype(int)
        aside = np.column_stack([-ahead[:, 1], ahead[:, 0]])
        off_mm = samples_mm - at_arc_length(line_mm, along_mm, s_mm)
        is_left = (off_mm * at_arc_length(aside, along_mm, s_mm)).sum(axis=1) > 0
        places_mm = (np.arange(count) + 0.5) / count * length_mm
        way, middle_mm = (at_arc_length(values, along_mm, places_mm) for values in (aside, line_mm))
        parts, ways, middles = list[Booleans](), list[Floats](), list[Floats]()
        for side in (-1, 1) if single else (0,):
            parts += [(number == stretch) & ((side == 0) | (is_left == (side > 0))) for stretch in range(count)]
            ways += [*way]
            middles += [*middle_mm + side * target.width_mm / 2 * way]
        for end, kind in ((0, target.ends[0]), (-1, target.ends[1])):
            if kind == "closed":
                parts.append(np.hypot(*(samples_mm - line_mm[end]).T) < length_mm / count)
                ways.append(ahead[end])
                middles.append(line_mm[end])
        used = [
            index for index, part in enumerate(parts) if 0.02 < search.template[part].sum() / max(part.sum(), 1) < 0.98
        ]
        cells = [np.flatnonzero(parts[index]) for index in used]
        chosen = np.concatenate([np.empty(0, dtype=int), *cells])
        return cls(
            search,
            samples_mm[chosen],
            search.template[chosen],
            np.repeat(np.arange(len(used)), [*map(len, cells)]).astype(int),
            np.array(ways)[used].reshape(-1, 2),
            np.array(middles)[used].reshape(-1, 2),
            np.array(used, dtype=int) >= count * (1 + single),
        )

    def fit(self, pose: Pose) -> EdgeFit | None:
        """Return the best position near a pose or shifted from it along the crack, or None without visible edges."""
        fits = list[EdgeFit]()
        for start_mm in (0.0, *START_MM):
            fit = self.fit_near(pose.moved(np.zeros(2), 0.0, start_mm * self.search.target.axes[0]))
            fits += [] if fit is None else [fit]
            if fit is not None and fit.agreeing >= SURE_AGREEING:
                break
        return max(fits, key=lambda fit: fit.agreeing, default=None)

    def fit_near(self, pose: Pose) -> EdgeFit | None:
        """Return the best position near a pose. None if too few edges are visible.

        If an end disagrees, the outline may be short of it, and neither end takes part.
        """
        used = np.ones(len(self.ways), dtype=bool)
        agrees, fit = self._fit_with(used, pose)
        if fit is not None and not agrees[self.is_end].all():
            _, fit = self._fit_with(~self.is_end, pose)
        return fit

    def _fit_with(self, used: Booleans, pose: Pose) -> tuple[Booleans, EdgeFit | None]:
        """Return the fit of some stretches, and which stretches agree, (m,)."""
        agrees, covariance = np.zeros(len(used), dtype=bool), np.eye(3)
        for _ in range(ROUNDS):
            shift_mm, visible = self._shifts_mm(pose)
            visible &= used
            if visible.sum() < FEWEST:
                return agrees, None
            motion, covariance, left_mm = self._motion(shift_mm, visible, 3)
            pose = pose.moved(self._middle_mm, float(np.degrees(motion[2])), motion[:2] @ self.search.target.axes)
            agrees = visible & (np.abs(left_mm) < max(AGREES_MM, self.search.map.cell_mm))
            if np.abs(motion[:2]).max() < SETTLED_MM:
                break
        along_sd_mm, across_sd_mm = np.sqrt(np.diag(covariance)[:2]).tolist()
        return agrees, EdgeFit(pose, float(agrees[used].mean()), along_sd_mm, across_sd_mm)

    def apart_mm(self, pose: Pose) -> Floats:
        """Return how far a pose moves the middle of the mouth along and across the chord, (2,), as absolute values."""
        return np.abs(self.search.target.axes @ (pose.back(self._middle_mm[None])[0] - self._middle_mm))

    def size(self, pose: Pose) -> tuple[float, float]:
        """Return the size of the scan's crack divided by the mouth's, and its standard uncertainty."""
        shift_mm, visible = self._shifts_mm(pose)
        motion, covariance, _ = self._motion(shift_mm, visible, 4)
        return 1.0 - float(motion[3]), float(np.sqrt(covariance[3, 3]))

    @property
    def _middle_mm(self) -> Floats:
        return self.search.samples_mm.mean(axis=0)

    def _motion(self, shift_mm: Floats, visible: Booleans, unknowns: int) -> tuple[Floats, Floats, Floats]:
        """Return the motion that undoes shifts of stretches, (k,): the first of along, across, turn and growth.

        Further parts are the covariance, (k, k), and the shifts that are left, (m,). The sum of squares has the weights
        of a Cauchy distribution.
        """
        lever = self.middles_mm - self._middle_mm
        turned = np.column_stack([-lever[:, 1], lever[:, 0]])
        columns = [self.ways @ self.search.target.axes.T, *((self.ways * arm).sum(axis=1) for arm in (turned, lever))]
        design = np.column_stack(columns)[:, :unknowns]
        weight, inverse = visible.astype(np.float64), np.eye(unknowns)
        motion, left_mm = np.zeros(unknowns), -shift_mm
        for _ in range(REWEIGHTED):
            weighted = design * weight[:, None]
            information = weighted.T @ design
            # Without slopes of the edges, the ridge keeps the position along the crack.
            ridged, inverse = (
                np.linalg.inv(information + least * np.eye(unknowns)).astype(np.float64) for least in (RIDGE, 1e-6)
            )
            motion = -ridged @ (weighted.T @ shift_mm)
            left_mm = -shift_mm - design @ motion
            scale_mm = max(MAD * float(np.median(np.abs(left_mm[visible]))), LEAST_SD_MM / 3)
            weight = visible / (1 + (left_mm / (2 * scale_mm)) ** 2)
        variance_mm2 = float((weight * left_mm**2).sum() / weight.sum()) + LEAST_SD_MM**2
        return motion, variance_mm2 * inverse, left_mm

    def _shifts_mm(self, pose: Pose) -> tuple[Floats, Booleans]:
        """Return how far the scan's edges lie from the mouth's in each stretch, and whether they are visible, (m,)."""
        cell_mm, count = self.search.map.cell_mm, len(self.ways)
        steps = cell_mm * np.arange(-round(REACH_MM / cell_mm), round(REACH_MM / cell_mm) + 1)
        ways = self.ways[self.stretch]
        agreement = np.array([self._agreements(pose.back(self.samples_mm + step * ways)) for step in steps])
        best = agreement.argmax(axis=0)
        visible = (agreement.max(axis=0) > VISIBLE) & (best > 0) & (best < len(steps) - 1)
        inner, every = np.clip(best, 1, len(steps) - 2), np.arange(count)
        before, middle, after = (agreement[inner + side, every] for side in (-1, 0, 1))
        bend = np.minimum(before - 2 * middle + after, -1e-9)
        return steps[inner] + np.clip(0.5 * (before - after) / bend, -1, 1) * cell_mm, visible

    def _agreements(self, places_mm: Floats) -> Floats:
        """Return each stretch's correlation of the scan with the mouth, (m,). 0 if little of the stretch is seen."""
        height, seen = self.search.seen(places_mm)
        weight, count = seen.astype(float), len(self.ways)

        def mean(values: Floats) -> Floats:
            return np.bincount(self.stretch, weight * values, count) / np.maximum(number, 1.0)

        number = np.bincount(self.stretch, weight, count)
        off, mouth = height - mean(height)[self.stretch], self.template - mean(self.template)[self.stretch]
        spread = np.sqrt(mean(off**2) * mean(mouth**2))
        enough = number > LEAST_SEEN * np.bincount(self.stretch, minlength=count)
        return np.where(enough & (spread > 1e-6), mean(off * mouth) / np.maximum(spread, 1e-6), 0.0)
