"""Fit the edges of a hollow or heap to those of the mouth, stretch by stretch along the crack."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from sealtwin.core.arc_length import arc_length, arc_length_at
from sealtwin.core.arrays import Booleans, Floats, Integers, unit
from sealtwin.scan.height_map import MAD
from sealtwin.scan.mouth_search import MouthSearch, Pose

LEAST_AGREEMENT, LEAST_AGREEING = 0.5, 0.5
"""Smallest correlation of the scan's hollow or heap with the mouth, and smallest share of the crack along which their
edges agree. Other cracks across like faces may reach both."""
SURE_AGREEMENT, SURE_AGREEING = 0.65, 0.75  # Of 105 other cracks, two reach both
REACH_MM = 3.0  # Largest distance between the edges of scan and mouth that is searched
AGREES_MM = 0.25  # Edges agree within this distance, or within a cell if that is larger
VISIBLE = 0.5  # Smallest correlation of a stretch whose edges are visible
FEWEST = 5  # Smallest number of such stretches
LEAST_SEEN = 0.3  # Smallest share of a stretch that must be seen
ROUNDS, REWEIGHTED, SETTLED_MM = 6, 10, 0.01
LEAST_SD_MM = 0.15  # Smallest standard deviation of a stretch's shift: neighbours share errors
RIDGE = (LEAST_SD_MM / REACH_MM) ** 2
RIGID, BESIDE = slice(3), slice(1, 3)  # Unknowns of a motion: along, across and turn; the last two
START_MM = 4.0, -4.0, 8.0, -8.0  # Shifts along the crack from which the fit begins again
FINE_MM = 1.5  # Length of the stretches of a single edge that give the position along the crack
ALONG_MM, ALONG_STEP_MM = 6.0, 0.5  # Shifts along the crack at which these are compared
ROUGH_MM, UNSEEN_MM, SHARED = 0.2, 1.5, 2.0
"""Half width at half maximum of their Cauchy distribution, shift of a stretch that is not seen, and number of
neighbours that share an error."""


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
    side: Integers  # 1 for the left edge, -1 for the right one, 0 for both or an end, (m,)
    is_end: Booleans  # (m,)

    @classmethod
    def of(cls, search: MouthSearch, *, single: bool = False, stretch_mm: float | None = None) -> "Edges":
        """Return the stretches of a search's mouth, each with both edges, or for a ``single`` edge.

        A stretch is as long as the crack is wide, and has all samples, unless ``stretch_mm`` is given: then it has
        those near the edge. A stretch without both mouth and face is left out.
        """
        target, samples_mm, template = search.target, search.samples_mm, search.template
        if stretch_mm is not None:
            of_mouth, of_face = (KDTree(samples_mm[template == value]) for value in (1, 0))
            others = np.where(template == 1, of_face.query(samples_mm)[0], of_mouth.query(samples_mm)[0])
            samples_mm, template = samples_mm[others < REACH_MM], template[others < REACH_MM]
        line_mm = target.centreline_mm
        s_mm, along_mm = arc_length_at(samples_mm, line_mm), arc_length(line_mm)
        length_mm, ahead = along_mm[-1], unit(np.gradient(line_mm, axis=0))
        count = max(int(length_mm / max(stretch_mm or target.width_mm, 2 * search.map.cell_mm)), FEWEST)
        number = np.clip(s_mm / length_mm * count, 0, count - 1).astype(int)

        def along(places_mm: Floats, values: Floats) -> Floats:
            return np.column_stack([np.interp(places_mm, along_mm, column) for column in values.T])

        aside = np.column_stack([-ahead[:, 1], ahead[:, 0]])
        side = np.sign(((samples_mm - along(s_mm, line_mm)) * along(s_mm, aside)).sum(axis=1)) if single else 0 * s_mm
        places_mm = (np.arange(count) + 0.5) / count * length_mm
        parts, ways, middles, sides = list[Integers](), list[Floats](), list[Floats](), list[int]()
        for of_side in (-1, 1) if single else (0,):
            parts += [np.flatnonzero((number == stretch) & (side == of_side)) for stretch in range(count)]
            ways += [*along(places_mm, aside)]
            middles += [*along(places_mm, line_mm) + of_side * target.width_mm / 2 * along(places_mm, aside)]
            sides += [of_side] * count
        for end, kind in ((0, target.ends[0]), (-1, target.ends[1])):
            if kind == "closed":
                parts.append(np.flatnonzero(np.hypot(*(samples_mm - line_mm[end]).T) < length_mm / count))
                ways.append(ahead[end])
                middles.append(line_mm[end])
                sides.append(0)
        shares = [float(template[part].mean()) if len(part) else 0.0 for part in parts]
        used = [index for index, share in enumerate(shares) if 0.02 < share < 0.98]
        chosen = np.concatenate([np.empty(0, dtype=int), *(parts[index] for index in used)])
        return cls(
            search,
            samples_mm[chosen],
            template[chosen],
            np.repeat(np.arange(len(used)), [len(parts[index]) for index in used]).astype(int),
            np.array([ways[index] for index in used]).reshape(-1, 2),
            np.array([middles[index] for index in used]).reshape(-1, 2),
            np.array([sides[index] for index in used], dtype=int),
            np.array([index >= count * (1 + single) for index in used], dtype=bool),
        )

    def fit(self, pose: Pose) -> EdgeFit | None:
        """Return the best position near a pose or shifted from it along the crack, or None without visible edges."""
        fits = list[EdgeFit]()
        for start_mm in (0.0, *START_MM):
            fit = self.fit_near(pose.moved(np.zeros(2), 0.0, start_mm * self.search.target.axes[0]))
            fits += [] if fit is None else [fit]
            if fit is not None and fit.agreeing >= SURE_AGREEING:
                break
        return max(fits, key=lambda fit: fit.agreeing * self.search.agreement(fit.pose), default=None)

    def certain_fit(self, pose: Pose) -> tuple[EdgeFit | None, float]:
        """Return the best position near a pose if it is certain, and the product of its agreements."""
        fit = self.fit(pose)
        agreement = 0.0 if fit is None else self.search.agreement(fit.pose)
        if fit is None or fit.agreeing < LEAST_AGREEING or agreement < LEAST_AGREEMENT:
            return None, 0.0
        return fit, fit.agreeing * agreement

    def fit_near(self, pose: Pose) -> EdgeFit | None:
        """Return the best position near a pose. None if too few edges are visible.

        If an end disagrees, the outline may be short of it, and neither end takes part.
        """
        used = np.ones(len(self.ways), dtype=bool)
        agrees, fit = self._fit_with(used, pose)
        if fit is not None and not agrees[self.is_end].all():
            _, fit = self._fit_with(~self.is_end, pose)
        return fit

    def _fit_with(self, used: Booleans, pose: Pose, unknowns: slice = RIGID) -> tuple[Booleans, EdgeFit | None]:
        """Return the fit of some stretches, and which stretches agree, (m,)."""
        agrees, covariance = np.zeros(len(used), dtype=bool), np.eye(3)
        for _ in range(ROUNDS):
            shift_mm, visible = self._shifts_mm(pose)
            visible &= used
            if visible.sum() < FEWEST:
                return agrees, None
            motion, covariance, left_mm = self._motion(shift_mm, visible, unknowns)
            pose = pose.moved(self._middle_mm, float(np.degrees(motion[2])), motion[:2] @ self.search.target.axes)
            agrees = visible & (np.abs(left_mm) < max(AGREES_MM, self.search.map.cell_mm))
            if np.abs(motion[:2]).max() < SETTLED_MM:
                break
        along_sd_mm, across_sd_mm = np.sqrt(np.diag(covariance)[:2]).tolist()
        return agrees, EdgeFit(pose, float(agrees[used].mean()), along_sd_mm, across_sd_mm)

    def fit_along(self, fit: EdgeFit) -> EdgeFit:
        """Return a fit with the position along the crack at which single edges are most alike.

        Waves and roughness of the edges, much finer than the crack is wide, give it. Each edge may lie aside, as one
        below a spill does. Position and uncertainty are those of the posterior distribution. The position across the
        crack follows from both edges, as before.
        """
        along, fine = self.search.target.axes[0], Edges.of(self.search, single=True, stretch_mm=FINE_MM)
        shifts_mm = np.arange(-ALONG_MM, ALONG_MM + ALONG_STEP_MM / 2, ALONG_STEP_MM)
        unlike = [fine.unlike(fit.pose.moved(np.zeros(2), 0.0, shift_mm * along)) for shift_mm in shifts_mm]
        fine_mm = np.linspace(-ALONG_MM, ALONG_MM, 241)
        off = np.interp(fine_mm, shifts_mm, unlike) / SHARED
        likely = np.exp(off.min() - off)
        likely /= likely.sum()
        middle_mm = float(likely @ fine_mm)
        along_sd_mm = float(np.hypot(np.sqrt(likely @ (fine_mm - middle_mm) ** 2), LEAST_SD_MM / 3))
        pose = fit.pose.moved(np.zeros(2), 0.0, middle_mm * along)
        _, across = self._fit_with(~self.is_end, pose, BESIDE)
        return replace(across or replace(fit, pose=pose), along_sd_mm=along_sd_mm)

    def unlike(self, pose: Pose) -> float:
        """Return how unlikely the shifts of single edges at a pose are, as minus the logarithm of their likelihood.

        A turn, and a shift of each edge, are free. A stretch beyond the scan is as unlikely as the others are.
        """
        shift_mm, visible = self._shifts_mm(pose)
        lever = self.middles_mm - self._middle_mm
        turned = self.ways[:, 1] * lever[:, 0] - self.ways[:, 0] * lever[:, 1]
        design = np.column_stack([turned, self.side > 0, self.side < 0]).astype(np.float64)
        weight, left_mm = visible.astype(np.float64), -shift_mm
        for _ in range(REWEIGHTED):
            weighted = design * weight[:, None]
            information = weighted.T @ design + 1e-6 * np.eye(3)
            left_mm = design @ np.linalg.solve(information, weighted.T @ shift_mm) - shift_mm
            weight = visible / (1 + (left_mm / ROUGH_MM) ** 2)
        seen = self.search.seen(pose.back(self.samples_mm), beyond=False)[1]
        scanned = np.bincount(self.stretch, seen, len(self.ways)) > LEAST_SEEN * np.bincount(self.stretch)
        off = np.log1p((np.where(visible, left_mm, UNSEEN_MM)[scanned] / ROUGH_MM) ** 2)
        return float(off.mean() * len(self.ways)) if scanned.any() else 0.0

    def apart_mm(self, pose: Pose) -> Floats:
        """Return how far a pose moves the middle of the mouth along and across the chord, (2,), as absolute values."""
        return np.abs(self.search.target.axes @ (pose.back(self._middle_mm[None])[0] - self._middle_mm))

    def size(self, pose: Pose) -> tuple[float, float]:
        """Return the size of the scan's crack divided by the mouth's, and its standard uncertainty."""
        shift_mm, visible = self._shifts_mm(pose)
        motion, covariance, _ = self._motion(shift_mm, visible, slice(4))
        return 1.0 - float(motion[3]), float(np.sqrt(covariance[3, 3]))

    @property
    def _middle_mm(self) -> Floats:
        return self.search.samples_mm.mean(axis=0)

    def _motion(self, shift_mm: Floats, visible: Booleans, unknowns: slice) -> tuple[Floats, Floats, Floats]:
        """Return the shifts along and across, the turn and the growth that undo shifts of stretches, (4,).

        All but the ``unknowns`` are 0. Further parts are the covariance, (4, 4), and the shifts that are left, (m,).
        The sum of squares has the weights of a Cauchy distribution.
        """
        lever = self.middles_mm - self._middle_mm
        turned = np.column_stack([-lever[:, 1], lever[:, 0]])
        columns = [self.ways @ self.search.target.axes.T, *((self.ways * arm).sum(axis=1) for arm in (turned, lever))]
        design = np.column_stack(columns)[:, unknowns]
        weight, inverse = visible.astype(np.float64), np.eye(design.shape[1])
        motion, left_mm = np.zeros(4), -shift_mm
        for _ in range(REWEIGHTED):
            weighted = design * weight[:, None]
            information = weighted.T @ design
            # Without slopes of the edges, the ridge keeps the position along the crack.
            ridged, inverse = (
                np.linalg.inv(information + least * np.eye(len(inverse))).astype(np.float64) for least in (RIDGE, 1e-6)
            )
            motion[unknowns] = -ridged @ (weighted.T @ shift_mm)
            left_mm = -shift_mm - design @ motion[unknowns]
            scale_mm = max(MAD * float(np.median(np.abs(left_mm[visible]))), LEAST_SD_MM / 3)
            weight = visible / (1 + (left_mm / (2 * scale_mm)) ** 2)
        variance_mm2 = float((weight * left_mm**2).sum() / weight.sum()) + LEAST_SD_MM**2
        covariance = np.zeros((4, 4))
        covariance[unknowns, unknowns] = variance_mm2 * inverse
        return motion, covariance, left_mm

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
