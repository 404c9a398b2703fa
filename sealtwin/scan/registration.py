"""Bring a scan into the frame of the sample: a rigid motion by named points, or by the face and the crack's mouth.

Whichever gives the position along the face, the height and the tilt follow from the uncracked face alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from sealtwin.core.arrays import Booleans, Floats, unit
from sealtwin.core.errors import InputError
from sealtwin.scan.edge_fit import AGREES_MM, LEAST_AGREEING, SURE_AGREEING, EdgeFit, Edges
from sealtwin.scan.height_map import MAD, HeightMap
from sealtwin.scan.mouth_search import MOST_TURN_DEG, NEAR_FACE_MM, MouthSearch, Pose, Target
from sealtwin.scan.settings import MM, UPRIGHT_DEG, NamedPoint, Placement

MOST_TILT_DEG = 30.0  # Largest angle between the upward axis and the face's normal, and between the axes along the face
STEEPEST, TINY = np.cos(np.radians(MOST_TILT_DEG)), 1e-12  # Smallest upward part of the normal; length without one
MARGIN_MM = 15.0  # The face is judged up to this distance from the mouth
BESIDE_MM = 1.5  # The face begins at this distance from the mouth, whose edges may be broken or covered
FEWEST_OF_FACE = 0.4  # Smallest share of the face around the crack that a scan must show
SPANS = 0.5, 20.0  # Smallest and largest extent of a scan, divided by the extent of the crack
SCALE_OFF = 0.05  # Largest relative difference between the sizes of scan and sample
SURE_SD = 4.0  # Smallest difference of the crack's size that is certain, in standard deviations
APART_MM = 5.0  # Smallest spread of named points across their longest line
POINT_OFF_MM = 1.5  # Largest RMS distance of named points from their places, and of the crack from its place by them
FEWEST_NEAR = 100  # Smallest number of points of the face at the height of the named points
MOST_ALONG_MM = 1.5  # Largest standard uncertainty of the position along the crack by the mouth
UNSEEN_SD_MM = 0.3  # Standard uncertainty of the position by named points if the crack is not recognised
MOST_TILTED_DEG = 5.0  # Largest angle between the face and the plane of named points, or the largest plane
ALIKE = 0.03  # Difference of the correlations below which two positions cannot be distinguished
SURER = 0.15  # Difference of the shares of agreeing edges above which one position is clearly better
REMEDY = "Give at least three named points in readings.placement.points."
CELLS_MM, ACROSS, FINER = (0.4, 1.0), 3.0, 4.0
"""Smallest and largest cell of the search, its cells across the mouth, and how much finer the last step is."""
SAMPLED, PLANES, OF_FACE = 40_000, 400, 0.4  # Points and planes of the first fit, and the smallest share on the face
FEW, SEARCHED = 4000, 1_000_000  # Largest numbers of points that test a plane, and of the search
DARKEST = 0.05  # Smallest share of the face's points for each mm² of the bed that makes cells larger
COARSE_MM, FINEST_MM, CELLS_ACROSS = 4.0, 0.15, 6.0  # Cells in which points are counted; smallest cell, fewest across
BLOCKS_MM = (3.0, 6.0, 12.0)  # Sides of the blocks whose means show how far errors of neighbours agree


@dataclass(frozen=True)
class Placed:
    """A scan in the frame of the sample, and how well it fits."""

    heights: HeightMap
    face: Booleans  # Cells of the uncracked face around the mouth, (rows, columns), scanned or not
    placed_by: Literal["points", "mouth"]
    points: int  # Number of points of the scan
    residual_mm: float  # RMS height of the face's cells
    coverage: float  # Share of the face around the crack that was scanned
    in_plane: float  # Share of the scanned face that lies in its plane
    off_points_mm: float | None  # Height of this plane above the named points. None without
    tilt_deg: float  # Angle by which the scan was tilted
    agreeing: float | None  # Share of the crack along which the edges agree. None if no crack is recognised
    points_off_mm: float | None  # RMS distance of the named points from their places. None without
    along_sd_mm: float  # Standard uncertainty of the position along the crack
    across_sd_mm: float  # The same across the crack
    plane_covariance: Floats  # Of height, slope along x and slope along y, about ``centre_mm``, (3, 3)
    centre_mm: Floats  # (2,)


def place(points_mm: Floats, placement: Placement, target: Target, path: Path, limit_mm: float | None = None) -> Placed:
    """Bring the points of a scan, (n, 3), into the frame of the sample. ``limit_mm`` is the limit of its error.

    Raises InputError, with the figure and the cause, if the scan does not fit: another unit, mirrored, exchanged
    points, no visible crack, two equally good positions, or too little of the face.
    """
    upright = Rotation.from_euler("xyz", [*UPRIGHT_DEG[placement.up or "z"], 0], degrees=True)
    points_mm = points_mm @ upright.as_matrix().T
    if placement.points:
        named_mm = upright.apply(placement.unit_mm * np.array([point.scan for point in placement.points]))
        rigid, off_mm = _by_points(named_mm, placement.points, max(POINT_OFF_MM, limit_mm or 0.0), path)
        points_mm = points_mm @ rigid[:, :3].T + rigid[:, 3]
        placed_mm = named_mm @ rigid[:, :3].T + rigid[:, 3]
    else:
        off_mm, placed_mm = None, np.zeros((0, 3))
    _require_unit(points_mm, placement, target, path)
    near_mm = points_mm[np.abs(points_mm[:, 2]) < NEAR_FACE_MM] if placement.points else points_mm
    # The named points are moved like the others.
    points_mm = np.vstack([points_mm, placed_mm])
    if len(near_mm) < FEWEST_NEAR:
        raise InputError(f"{path}: has no face at the height of the named points. Correct their coordinates.")
    moved_mm, tilt_deg = _on_the_face(points_mm, near_mm, path)
    levelled_mm, placed_mm = np.split(moved_mm, [len(moved_mm) - len(placed_mm)])
    few_mm, cell_mm = _sample(levelled_mm, SEARCHED), np.clip(target.width_mm / ACROSS, *CELLS_MM)
    search = MouthSearch.of(few_mm, target, cell_mm)
    if search.map.cell_mm > target.width_mm / 2:
        raise InputError(
            f"{path}: points {search.map.cell_mm:.2g} mm apart are too far for a crack of {target.width_mm:.2g} mm. "
            f"Scan it with a point every {target.width_mm / CELLS_ACROSS:.2g} mm."
        )
    edges = Edges.of(MouthSearch.of(few_mm, target, cell_mm / FINER))
    if off_mm is None:
        fit = _by_mouth(search, edges, path)
        pose, along_sd_mm, across_sd_mm = fit.pose, fit.along_sd_mm, fit.across_sd_mm
        heights, face, coverage = _face_of(pose.apply(levelled_mm), target, path)
    else:
        heights, face, coverage = _face_of(levelled_mm, target, path)
        fit = _at_points(search, edges, max(POINT_OFF_MM, limit_mm or 0.0), path)
        # The distance of the crack from its place shows errors that all points share.
        apart_mm = np.full(2, UNSEEN_SD_MM)
        if fit is not None:
            apart_mm = np.maximum(edges.apart_mm(fit.pose) - [2 * fit.along_sd_mm, 2 * fit.across_sd_mm], 0.0)
        along_sd_mm, across_sd_mm = np.hypot(off_mm / np.sqrt(len(placement.points)), apart_mm).tolist()
    heights, covariance, residual_mm, in_plane, plane, centre_mm = _levelled_on_face(heights, face)
    slope_deg = float(np.degrees(np.arctan(np.hypot(*plane[1:]))))
    above_mm = plane[0] + (placed_mm[:, :2] - centre_mm) @ plane[1:] - placed_mm[:, 2]
    tilted_deg = slope_deg if off_mm is None else float(np.hypot(tilt_deg, slope_deg))
    if tilted_deg > MOST_TILTED_DEG:
        by = "largest plane of the scan" if off_mm is None else "named points"
        raise InputError(
            f"{path}: the face is tilted by {tilted_deg:.1f} degrees against the {by}. Name points on the face, or "
            "correct their coordinates, or the unit or the steps of the scan."
        )
    return Placed(
        heights,
        face,
        "points" if placement.points else "mouth",
        len(levelled_mm),
        residual_mm,
        coverage,
        in_plane,
        float(above_mm.mean()) if len(above_mm) else None,
        float(np.hypot(tilt_deg, slope_deg)),
        None if fit is None else fit.agreeing,
        off_mm,
        along_sd_mm,
        across_sd_mm,
        covariance,
        centre_mm,
    )


def _by_points(named_mm: Floats, points: Sequence[NamedPoint], most_off_mm: float, path: Path) -> tuple[Floats, float]:
    """Return the motion, (3, 4), that brings named points to their places, and the RMS distance that is left."""
    places_mm = np.array([(*point.sample_mm, 0.0) for point in points])
    spread_mm = np.linalg.svd(places_mm - places_mm.mean(axis=0), compute_uv=False)[1]
    if spread_mm < APART_MM:
        raise InputError(
            f"{path}: the named points are almost on one line ({spread_mm:.1f} mm across), so the scan could turn "
            "about it. Add a point beside the line."
        )
    scale = _size(named_mm) / _size(places_mm)
    if abs(scale - 1) > SCALE_OFF:
        raise InputError(
            f"{path}: the named points are {scale:.4g} times as far apart in the scan as on the sample. Correct "
            "readings.placement.units, or the coordinates."
        )
    rigid, off_mm = _fitted(named_mm, places_mm)
    if off_mm <= most_off_mm and rigid[2, 2] > 0:
        return rigid, off_mm
    # Exchanged points keep the scan's upper side up. A mirrored scan fits only with its upper side down.
    wrong = list[list[str]]()
    for order in permutations(range(len(points))):
        moved, left_mm = _fitted(named_mm[list(order)], places_mm)
        if left_mm <= most_off_mm and moved[2, 2] > 0:
            wrong.append([point.name for index, point in enumerate(points) if order[index] != index])
    if off_mm > most_off_mm:
        # A rectangle fits in several orders, so that only the fewest exchanged points are likely.
        fewest = " or ".join(" and ".join(names) for names in wrong if len(names) == min(map(len, wrong)))
        cause = f"The points {fewest} are exchanged: in another order they agree." if wrong else "Correct them."
        raise InputError(f"{path}: the named points are {off_mm:.1f} mm (RMS) from their places. {cause}")
    raise InputError(
        f"{path}: the named points agree to {off_mm:.2f} mm only if the scan is turned upside down. The scan is "
        f"mirrored, or two points are exchanged, or its upward axis is not readings.placement.up."
    )


def _size(points_mm: Floats) -> float:
    return float(np.sqrt(((points_mm - points_mm.mean(axis=0)) ** 2).sum()))


def _fitted(named_mm: Floats, places_mm: Floats) -> tuple[Floats, float]:
    """Return the rigid motion, (3, 4), with the smallest squared distances, and the RMS distance (Kabsch 1976)."""
    middle, goal = named_mm.mean(axis=0), places_mm.mean(axis=0)
    left, _, right = np.linalg.svd((places_mm - goal).T @ (named_mm - middle))
    matrix = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    off_mm = _size((named_mm - middle) @ matrix.T - places_mm + goal) / np.sqrt(len(named_mm))
    return np.column_stack([matrix, goal - matrix @ middle]), float(off_mm)


def _require_unit(points_mm: Floats, placement: Placement, target: Target, path: Path) -> None:
    """Raise InputError if the scan is so small or large that its unit must be wrong."""
    crack_mm = float(np.ptp(target.centreline_mm, axis=0).max())
    span_mm = float(np.ptp(np.quantile(points_mm, [0.01, 0.99], axis=0), axis=0).max())
    if SPANS[0] * crack_mm <= span_mm <= SPANS[1] * crack_mm:
        return
    spans = span_mm / placement.unit_mm / crack_mm
    likely = " or ".join(f'"{name}"' for name, mm in MM.items() if 0.9 <= spans * mm <= 6)
    cause = f"It seems to be in another unit: set readings.placement.units = {likely}." if likely else ""
    raise InputError(
        f"{path}: the scan is {span_mm:.4g} mm long, but the crack {crack_mm:.4g} mm. "
        f"{cause or 'Crop the scan to the face, or correct its unit.'}"
    )


def _on_the_face(points_mm: Floats, near_mm: Floats, path: Path) -> tuple[Floats, float]:
    """Return the points with the face's plane at z = 0, and the angle by which they were turned.

    Of the points ``near_mm``, the plane has the smallest 40 % quantile of distances (least quantile of squares,
    Rousseeuw & Leroy 1987).
    """
    random, some = np.random.default_rng(0), _sample(near_mm, SAMPLED)
    corners = some[random.integers(len(some), size=(PLANES, 3))]
    normals = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) + TINY)
    few = some[random.integers(len(some), size=FEW)]
    away_mm = np.quantile(np.abs(few @ normals.T - (normals * corners[:, 0]).sum(axis=1)), OF_FACE, axis=0)
    away_mm[np.abs(normals[:, 2]) < STEEPEST] = np.inf
    best = int(away_mm.argmin())
    normal, height_mm = normals[best], float(normals[best] @ corners[best, 0])
    spread_mm = away_mm[best] * 1.9  # 40 % of a normal distribution are within 0.524 sd
    for _ in range(4):
        near = some[np.abs(some @ normal - height_mm) < max(3 * spread_mm, 1e-6)]
        middle = near.mean(axis=0)
        normal = np.linalg.svd(near - middle, full_matrices=False)[2][2]
        normal = normal * np.sign(normal[2])
        height_mm = float(middle @ normal)
        spread_mm = MAD * float(np.median(np.abs(near @ normal - height_mm)))
    if normal[2] < STEEPEST:
        raise InputError(
            f"{path}: no plane within {MOST_TILT_DEG:g} degrees of the upward axis: set readings.placement.up to the "
            "axis that points out of the face."
        )
    turn = Rotation.align_vectors([[0.0, 0.0, 1.0]], [normal])[0]
    return points_mm @ turn.as_matrix().T - [0.0, 0.0, height_mm], float(np.degrees(turn.magnitude()))


def _sample(points_mm: Floats, count: int) -> Floats:
    return points_mm if len(points_mm) <= count else np.random.default_rng(0).choice(points_mm, count, replace=False)


def _at_points(search: MouthSearch, edges: Edges, most_mm: float, path: Path) -> EdgeFit | None:
    """Return the position of the crack near that by named points. None if no crack is recognised.

    Raises InputError if the crack is surely elsewhere.
    """
    fit = edges.fit_near(Pose(0.0, 0.0, 0.0))
    if fit is not None and fit.agreeing >= LEAST_AGREEING:
        along_mm, across_mm = edges.apart_mm(fit.pose)
        if across_mm <= most_mm and along_mm <= most_mm + 2 * fit.along_sd_mm:
            return fit
    elsewhere = edges.fit(search.best(lambda _: True).pose)
    if elsewhere is not None and elsewhere.agreeing >= SURE_AGREEING:
        shift_mm = np.hypot(*edges.apart_mm(elsewhere.pose))
        raise InputError(
            f"{path}: the crack is {shift_mm:.1f} mm away from its place by the named points, and turned by "
            f"{elsewhere.pose.turn_deg:.0f} degrees. Points are exchanged, or their coordinates are wrong: sample_mm "
            "is x to the right and y up."
        )
    return None


def _by_mouth(search: MouthSearch, edges: Edges, path: Path) -> EdgeFit:
    """Return the position at which the edges of the hollow or heap agree best with the mouth, in finer cells.

    The user excludes positions that are turned by more than ``MOST_TURN_DEG``, and the mirror image, so they matter
    only if they agree better: a crack that looks alike from both ends is placed as the axes say.
    """
    best, turned = search.best(lambda pose: pose.is_allowed), search.best(lambda pose: not pose.is_allowed)
    mirrored = search.mirrored.best(lambda _: True)
    fit = edges.fit(best.pose)
    agreeing = 0.0 if fit is None else fit.agreeing
    if agreeing < LEAST_AGREEING:
        around = _mapped(np.zeros((0, 3)), search.target)
        face_mm2 = _face_around(around, search.target).sum() * around.cell_mm**2
        seen_mm2 = (search.map.known.sum() - search.template.sum()) * search.map.cell_mm**2
        _require_face(max(seen_mm2 / face_mm2, 0.0), search.map.cell_mm, path)
    others = (
        (turned, edges, f"turned by {turned.pose.turn_deg:.0f} degrees, or placement.up is another axis"),
        (mirrored, Edges.of(edges.search.mirrored), "mirrored, or its upward axis is not placement.up"),
    )
    fits = [(of_other.fit(other.pose), cause) for other, of_other, cause in others if other.agreement > best.agreement]
    better, cause = max(((near.agreeing, cause) for near, cause in fits if near is not None), default=(0.0, ""))
    if better > max(agreeing + SURER, LEAST_AGREEING):
        raise InputError(
            f"{path}: the scan is {cause}: edges agree with the mouth's along {better:.0%} of the crack if it is, and "
            f"along {agreeing:.0%} if it is not. Export it without mirroring, with axes that agree with the photo's up "
            f"to {MOST_TURN_DEG:g} degrees, or name points."
        )
    if fit is None or agreeing < LEAST_AGREEING:
        raise InputError(
            f"{path}: the crack is not found in the scan: its edges agree with the mouth's (up to {AGREES_MM:g} mm) "
            f"along {agreeing:.0%} of the crack ({LEAST_AGREEING:.0%} are needed). The sealant may be level with the "
            "face, a part of the crack may be missing, the scan may be of another sample or in another unit, or its "
            f"largest plane may be a table: crop the scan to the face. {REMEDY}"
        )
    size, size_sd = Edges.of(edges.search, single=True).size(fit.pose)
    if abs(size - 1) > max(SCALE_OFF, SURE_SD * size_sd):
        raise InputError(
            f"{path}: the crack is {size:.2f} times as large as the mouth. Correct the scale of the scan, such as "
            "readings.placement.units or step_mm, or that of the photo. If an edge is broken or covered, name points."
        )
    rival = search.best(lambda pose: search.is_rival(pose, best.pose))
    if rival.agreement > best.agreement - ALIKE or fit.along_sd_mm > MOST_ALONG_MM:
        raise InputError(
            f"{path}: the crack agrees with the mouth at several positions, such as two like cracks, or along a "
            f"straight one. {REMEDY}"
        )
    return fit


def _require_face(coverage: float, cell_mm: float, path: Path) -> None:
    """Raise InputError if less than ``FEWEST_OF_FACE`` of the face around the crack was scanned."""
    if coverage < FEWEST_OF_FACE:
        raise InputError(
            f"{path}: shows only {coverage:.0%} of the face up to {MARGIN_MM:g} mm beside the crack, but at least "
            f"{FEWEST_OF_FACE:.0%} are needed for the height of the face. Scan the face on both sides of the crack, "
            f"with a point every {cell_mm:.2g} mm, and do not crop it to the crack."
        )


def _face_of(points_mm: Floats, target: Target, path: Path) -> tuple[HeightMap, Booleans, float]:
    """Return the heights around the crack, which of its cells are face, (rows, columns), and the share that is seen."""
    heights = _mapped(points_mm, target)
    face = _face_around(heights, target)
    coverage = float((face & heights.known).sum() / max(face.sum(), 1))
    _require_face(coverage, heights.cell_mm, path)
    return heights, face, coverage


def _mapped(points_mm: Floats, target: Target) -> HeightMap:
    """Return the heights around the crack, in cells of two points on average."""
    rings_mm = np.vstack(target.rings_mm)
    low_mm, high_mm = rings_mm.min(axis=0) - MARGIN_MM, rings_mm.max(axis=0) + MARGIN_MM
    near = ((points_mm[:, :2] >= low_mm) & (points_mm[:, :2] <= high_mm)).all(axis=1)
    coarse = HeightMap.of(points_mm[near], low_mm, high_mm, COARSE_MM)
    per_mm2 = near.sum() / max(coarse.known.sum() * COARSE_MM**2, 1.0)
    # A dark bed may have fewer points than the face.
    fine = HeightMap(low_mm, FINEST_MM, np.zeros(np.ceil((high_mm - low_mm)[::-1] / FINEST_MM).astype(int)))
    mouth = replace(fine, height_mm=fine.inside(target.rings_mm).astype(float))
    in_mouth = np.nansum(mouth.at_mm(*points_mm[near, :2].T))
    in_mouth_mm2 = in_mouth / max(mouth.height_mm.sum() * FINEST_MM**2, 1.0)
    per_mm2 = max(min(per_mm2, in_mouth_mm2), DARKEST * per_mm2)
    widest_mm = max(target.width_mm / CELLS_ACROSS, FINEST_MM)
    cell_mm = float(np.clip(np.sqrt(2.0 / max(per_mm2, 1e-3)), FINEST_MM, widest_mm))
    return HeightMap.of(points_mm[near], low_mm, high_mm, cell_mm)


def _face_around(heights: HeightMap, target: Target) -> Booleans:
    """Return the cells of the uncracked face up to ``MARGIN_MM`` beside the mouth, (rows, columns)."""
    away_mm = heights.away_mm(heights.inside(target.rings_mm))
    face = (away_mm > BESIDE_MM) & (away_mm < MARGIN_MM)
    if target.face_mm is not None:
        x_min, y_min, x_max, y_max = target.face_mm
        x_mm, y_mm = heights.middles_mm
        face &= ((x_mm > x_min + 1) & (x_mm < x_max - 1)) & ((y_mm > y_min + 1) & (y_mm < y_max - 1))[:, None]
    return face


def _levelled_on_face(heights: HeightMap, face: Booleans) -> tuple[HeightMap, Floats, float, float, Floats, Floats]:
    """Return the heights above the plane of the face's cells, and the covariance of the plane.

    Further parts are the RMS height and the share of the cells in the plane, and the plane's height and slopes about a
    point.

    Cells with sealant or dirt are left out. Neighbouring cells share errors, so the covariance follows from the means
    of blocks, of the size at which it is largest.
    """
    x_mm, y_mm = (grid.astype(float) for grid in np.meshgrid(*heights.middles_mm))
    used = face & heights.known
    centre_mm = np.array([x_mm[used].mean(), y_mm[used].mean()])
    design = np.stack([np.ones_like(x_mm), x_mm - centre_mm[0], y_mm - centre_mm[1]], axis=-1)
    plane, spread_mm = np.zeros(3), 0.0
    for _ in range(5):
        off_mm = heights.height_mm - design @ plane
        middle_mm = float(np.median(off_mm[used]))
        spread_mm = MAD * float(np.median(np.abs(off_mm[used] - middle_mm)))
        kept = used & (np.abs(off_mm - middle_mm) <= max(3 * spread_mm, 1e-6))
        plane = np.linalg.lstsq(design[kept], heights.height_mm[kept], rcond=None)[0]
    off_mm = heights.height_mm - design @ plane
    kept = used & (np.abs(off_mm) <= max(3 * spread_mm, 1e-6))
    covariances = [_plane_covariance(off_mm, design, kept, heights.cell_mm, side_mm) for side_mm in BLOCKS_MM]
    covariance = max(covariances, key=np.trace)
    residual_mm = float(np.sqrt(np.mean(off_mm[kept] ** 2)))
    in_plane = float(kept.sum() / used.sum())
    return replace(heights, height_mm=off_mm), covariance, residual_mm, in_plane, plane.astype(np.float64), centre_mm


def _plane_covariance(off_mm: Floats, design: Floats, kept: Booleans, cell_mm: float, side_mm: float) -> Floats:
    row, column = np.nonzero(kept)
    step = max(round(side_mm / cell_mm), 1)
    _, block, count = np.unique((row // step) * 100_000 + column // step, return_inverse=True, return_counts=True)
    means_mm = np.bincount(block, off_mm[kept]) / count
    rows = np.stack([np.bincount(block, design[kept][:, k]) / count for k in range(3)], axis=1)
    weight = count / count.max()
    information = (rows * weight[:, None]).T @ rows
    variance_mm2 = float((weight * means_mm**2).sum() / max(len(count) - 3, 1))
    return variance_mm2 * np.linalg.pinv(information)
