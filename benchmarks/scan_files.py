"""Files of the emulated scans of ``benchmarks.scan_cases``: points, triangles or heights with a scanner's faults.

The faults are noise, outliers, holes, points that are missing at random, and an unknown position of the scan.
"""

from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import trimesh
from scipy.spatial import Delaunay, KDTree
from scipy.spatial.transform import Rotation

from benchmarks.scan_cases import Sealed, rough
from sealtwin.core.records import Floats, Integers
from sealtwin.scan.settings import MM, NamedPoint, Placement, ScanUnit

FORMATS = ("binary.ply", "ascii.ply", "points.xyz", "points.csv", "mesh.stl", "mesh.ply", "map.png", "map.tiff")
NOISE_MM, NOISE_OVER_MM, TEXTURE_MM, TEXTURE_OVER_MM = 0.05, 1.0, 0.03, 0.4
MISSING, OUTLIERS = 0.5, 0.05
MAP_Z_MM, COUNT_MM = 25.0, 0.001  # Heights of a map are positive
LONGEST_STEPS = 6.0  # Longest side of a triangle, in distances of points. Longer ones would close the holes

Fault = Literal["mirrored", "metres", "inches", "far", "exchanged", "mouth only"]
DECLARED_MM: dict[Fault, float] = {"metres": 1000.0, "inches": 25.4}
Pose = tuple[Rotation, Floats]


def drawn_pose(rng: np.random.Generator) -> Pose:
    """Return the rotation and the shift in mm from the sample's frame to the scan's."""
    tilt_deg, way = rng.uniform(0, 3), rng.uniform(0, 2 * np.pi)
    turn = Rotation.from_euler("z", rng.uniform(-3, 3), degrees=True)
    return (
        Rotation.from_rotvec(tilt_deg * np.array([np.cos(way), np.sin(way), 0]), degrees=True) * turn,
        (rng.uniform(-5, 5, 3)),
    )


def write_scan(sealed: Sealed, number: int, folder: Path, fault: Fault | None = None) -> tuple[Path, Placement]:
    """Write the scan with a number, and return its path and its placement. A scan with a fault is a file of points."""
    rng = np.random.default_rng([2025, number])
    pose = drawn_pose(rng)
    step_mm = float(rng.uniform(0.1, 0.3))
    kind = "points.xyz" if fault else FORMATS[number % len(FORMATS)]
    # The name does not tell the fault, which messages are searched for.
    path = folder / f"{number}-{kind}"
    if kind.startswith("map"):
        _write_map(sealed, rng, pose, step_mm, path)
        return path, Placement(step_mm=step_mm, count_mm=COUNT_MM, up="z")
    unit: ScanUnit = "mm" if fault else rng.choice(np.array(["mm", "cm", "m", "inch"])).item()
    # Ten of the thirty files without a map have named points.
    named = (
        _named_points(sealed, rng, pose, MM[unit]) if fault == "exchanged" or (number % 3 == 0 and not fault) else []
    )
    points_mm = _on_surface(sealed, rng, step_mm, walls=not kind.startswith("mesh"))
    faces = None
    if kind.startswith("mesh"):
        faces = Delaunay(points_mm[:, :2]).simplices.astype(np.int64)
        sides_mm = np.linalg.norm(points_mm[faces, :2] - points_mm[np.roll(faces, 1, axis=1), :2], axis=2)
        faces = faces[sides_mm.max(axis=1) < LONGEST_STEPS * step_mm]
    if fault == "mouth only":
        points_mm = points_mm[sealed.beside_mm(points_mm[:, :2]) < 0.3]
    if fault == "mirrored":
        points_mm[:, 0] = sealed.solid.block_mm[2] - points_mm[:, 0]
    if fault == "exchanged":
        first, second, *others = named
        exchanged = first.model_copy(update={"sample_mm": second.sample_mm})
        named = [exchanged, second.model_copy(update={"sample_mm": first.sample_mm}), *others]
    points = (pose[0].apply(points_mm) + pose[1]) / (DECLARED_MM[fault] if fault in DECLARED_MM else MM[unit])
    if fault == "far":
        points[:, 0] += 1e6
    _write(points, faces, path)
    return path, Placement(units=unit, up="z", points=tuple(named))


def _write(points: Floats, faces: Integers | None, path: Path) -> None:
    if faces is not None:
        trimesh.Trimesh(points, faces, process=False).export(path)
    elif path.suffix == ".ply":
        trimesh.PointCloud(points).export(path, file_type="ply", encoding=path.stem.split("-")[-1])
    else:
        comma = path.suffix == ".csv"
        header = "x,y,z" if comma else ""
        np.savetxt(path, points, fmt="%.9g", delimiter="," if comma else " ", header=header, comments="")


def _on_surface(sealed: Sealed, rng: np.random.Generator, step_mm: float, walls: bool) -> Floats:
    """Return points on the surface with the scanner's faults, in the sample's frame, (n, 3)."""
    plan_mm = sealed.grid_mm(step_mm)
    plan_mm = plan_mm[rng.random(len(plan_mm)) > MISSING]
    # No scanner's points lie in rows of the sample's frame.
    plan_mm = plan_mm + rng.uniform(-0.4, 0.4, plan_mm.shape) * step_mm
    points_mm = np.column_stack([plan_mm, sealed.seen_mm(plan_mm)])
    if walls:
        points_mm = np.vstack([points_mm, _on_walls(sealed, rng, step_mm)])
    points_mm[:, 2] += _errors_mm(sealed, rng, points_mm[:, :2])
    return points_mm[~_in_holes(sealed, rng, points_mm[:, :2])]


def _on_walls(sealed: Sealed, rng: np.random.Generator, step_mm: float) -> Floats:
    """Return points of the walls above the sealant, as dense as the others. A scanner that turns sees both walls."""
    s_mm, line_mm = sealed.outline.s_mm, sealed.outline.centreline_mm
    edge_mm = np.maximum(0.0, -(sealed.level_mm + sealed.curve_mm * 2 / 3))
    count = int((1 - MISSING) * np.trapezoid(edge_mm, s_mm) / step_mm**2)
    walls = list[Floats]()
    for wall_mm in (sealed.outline.left_wall_mm, sealed.outline.right_wall_mm):
        row = rng.choice(len(s_mm), count, p=edge_mm / edge_mm.sum()) if count else np.empty(0, dtype=int)
        depth_mm = rng.random(count) * edge_mm[row]
        inward = line_mm[row] - wall_mm[row]
        inward /= np.linalg.norm(inward, axis=1)[:, None]
        plan_mm = wall_mm[row] + depth_mm[:, None] * (sealed.shear + sealed.narrowing * inward)
        walls.append(np.column_stack([plan_mm, -depth_mm]))
    return np.vstack(walls)


def _errors_mm(sealed: Sealed, rng: np.random.Generator, plan_mm: Floats) -> Floats:
    """Return texture of the face, noise and outliers, half of which are single points and half in clusters."""
    errors_mm = NOISE_MM * rough(rng, plan_mm, NOISE_OVER_MM)
    on_face = sealed.beside_mm(plan_mm) > 0
    errors_mm[on_face] += TEXTURE_MM * rough(rng, plan_mm, TEXTURE_OVER_MM)[on_face]
    single = rng.random(len(plan_mm)) < OUTLIERS / 2
    errors_mm[single] += rng.uniform(-4, 4, single.sum())
    tree, clustered = KDTree(plan_mm), 0
    while clustered < OUTLIERS / 2 * len(plan_mm):
        cluster = tree.query_ball_point(plan_mm[rng.integers(len(plan_mm))], rng.uniform(0.3, 1.5))
        errors_mm[cluster] += rng.choice([-1, 1]) * rng.uniform(0.5, 5)
        clustered += len(cluster)
    return errors_mm


def _in_holes(sealed: Sealed, rng: np.random.Generator, plan_mm: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return which points lie in one of the holes, of which the first is on the crack."""
    _, _, width_mm, height_mm = sealed.solid.block_mm
    holes_mm = rng.uniform(0, 1, (int(rng.integers(3, 6)), 2)) * (width_mm, height_mm)
    holes_mm[0] = rng.choice(sealed.outline.centreline_mm)
    radii_mm = rng.uniform(1, 4, len(holes_mm))
    away_mm = [
        np.hypot(*(plan_mm - hole_mm).T) - radius_mm for hole_mm, radius_mm in zip(holes_mm, radii_mm, strict=True)
    ]
    return np.min(away_mm, axis=0) < 0


def _named_points(sealed: Sealed, rng: np.random.Generator, pose: Pose, unit_mm: float) -> list[NamedPoint]:
    """Return corners of the face, or marks near them, in the scan and on the sample, with errors of up to 0.1 mm."""
    _, _, width_mm, height_mm = sealed.solid.block_mm
    marks_mm = np.array([[0, 0], [width_mm, 0], [width_mm, height_mm], [0, height_mm], [width_mm / 2, height_mm]])
    inset_mm = rng.choice([0.0, 6.0]) * np.sign(np.array([width_mm / 2, height_mm / 2]) - marks_mm)
    marks_mm = np.column_stack([marks_mm + inset_mm, np.zeros(5)])
    count = int(rng.integers(3, 6))
    scan = (pose[0].apply(marks_mm) + pose[1]) / unit_mm
    known_mm = marks_mm[:, :2] + rng.uniform(-0.1, 0.1, (5, 2))
    rows = [*zip(scan[:count].tolist(), known_mm[:count].tolist(), strict=True)]
    return [
        NamedPoint(name=f"mark {row + 1}", scan=seen, sample_mm=place_mm) for row, (seen, place_mm) in enumerate(rows)
    ]


def _write_map(sealed: Sealed, rng: np.random.Generator, pose: Pose, step_mm: float, path: Path) -> None:
    """Write a height map, whose first row is the uppermost. 0 means no height."""
    _, _, width_mm, height_mm = sealed.solid.block_mm
    columns, rows = (int(side_mm / step_mm) for side_mm in (width_mm, height_mm))
    y_mm, x_mm = np.mgrid[rows - 1 : -1 : -1, 0:columns] * step_mm
    scan_mm = np.column_stack([x_mm.ravel(), y_mm.ravel(), np.zeros(rows * columns)])
    seen_mm = np.zeros(len(scan_mm))
    residual_mm = np.zeros(len(scan_mm))
    # The map's points lie on a grid of the scan, so their position on the tilted sample follows by iteration.
    for _ in range(5):
        sample_mm = pose[0].inv().apply(scan_mm - pose[1])
        seen_mm = sealed.seen_mm(sample_mm[:, :2])
        residual_mm = seen_mm - sample_mm[:, 2]
        scan_mm[:, 2] += residual_mm / pose[0].as_matrix()[2, 2]
    plan_mm = pose[0].inv().apply(scan_mm - pose[1])[:, :2]
    scan_mm[:, 2] += _errors_mm(sealed, rng, plan_mm)
    is_seen = (rng.random(len(plan_mm)) > MISSING) & ~_in_holes(sealed, rng, plan_mm) & (np.abs(residual_mm) < 0.02)
    is_seen &= ((plan_mm > 0) & (plan_mm < (width_mm, height_mm))).all(axis=1)
    counts = np.where(is_seen, np.round((scan_mm[:, 2] + MAP_Z_MM) / COUNT_MM), 0).astype(np.uint16)
    cv2.imwrite(str(path), counts.reshape(rows, columns))
