"""Mean level of an emulated scan after Open3D's ICP to the drawn surface, for ``benchmarks.scans``."""

from importlib import import_module
from pathlib import Path
from typing import cast

import cv2
import numpy as np
import trimesh
from scipy.ndimage import generic_filter

from benchmarks.scan_cases import Sealed
from benchmarks.scan_files import COUNT_MM, MAP_Z_MM, drawn_pose
from sealtwin.core.records import Floats
from sealtwin.scan.settings import MM, Placement

CELLS, CLEAR_MM, FAR_MM = 8, 0.35, 0.4
"""Cells across the crack, their distance from the walls, and distance of an outlier from others along the crack."""


def written_mm(path: Path, placement: Placement, number: int) -> Floats:
    """Return the points of a scan with a number, brought back into the sample's frame by the drawn pose, (n, 3)."""
    turn, shift_mm = drawn_pose(np.random.default_rng([2025, number]))
    if placement.step_mm is not None:
        counts = np.array(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))[::-1]
        row, column = np.nonzero(counts)
        plan_mm = np.column_stack([column, row]) * placement.step_mm
        scan_mm = np.column_stack([plan_mm, counts[row, column] * COUNT_MM - MAP_Z_MM])
    elif path.suffix in (".ply", ".stl"):
        # Points and triangles both have vertices, but the type of what is loaded does not say so.
        cloud = cast(trimesh.PointCloud, trimesh.load_scene(path, process=False).to_geometry())
        scan_mm = np.unique(np.array(cloud.vertices), axis=0) * MM[placement.units or "mm"]
    else:
        header = int(path.suffix == ".csv")
        scan_mm = np.loadtxt(path, skiprows=header, delimiter="," if header else None) * MM[placement.units or "mm"]
    return turn.inv().apply(scan_mm - shift_mm)


def mean_along_mm(s_mm: Floats, level_mm: Floats) -> float:
    """Return the mean over arc length, as ``mean_level_mm`` of a scan is: a station beside a hole counts for more."""
    return float(np.trapezoid(level_mm, s_mm) / np.ptp(s_mm))


def mean_by_icp_mm(sealed: Sealed, points_mm: Floats, s_mm: Floats) -> float:
    """Return the mean level at stations after Open3D's ICP of the points to the drawn surface, from the drawn pose."""
    o3d = import_module("open3d")
    plan_mm = sealed.grid_mm(0.2)
    clouds = [o3d.geometry.PointCloud() for _ in range(2)]
    for cloud, rows_mm in zip(clouds, (points_mm, np.column_stack([plan_mm, sealed.seen_mm(plan_mm)])), strict=True):
        cloud.points = o3d.utility.Vector3dVector(rows_mm)
    clouds[1].estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(0.7, 20))
    methods = o3d.pipelines.registration
    to_plane = methods.TransformationEstimationPointToPlane(methods.TukeyLoss(0.3))
    motion = methods.registration_icp(*clouds, 1.0, np.eye(4), to_plane).transformation
    levels = levels_mm(sealed, points_mm @ motion[:3, :3].T + motion[:3, 3], s_mm)
    return mean_along_mm(s_mm[np.isfinite(levels)], levels[np.isfinite(levels)])


def levels_mm(sealed: Sealed, points_mm: Floats, s_mm: Floats) -> Floats:
    """Return the mean between the walls at stations: of a parabola through medians in cells clear of the walls."""
    depth_mm = np.maximum(-np.interp(sealed.local_mm(points_mm[:, :2])[0], sealed.outline.s_mm, sealed.level_mm), 0.0)
    along_mm, across_mm, half_mm, _ = sealed.local_mm(points_mm[:, :2] - depth_mm[:, None] * sealed.shear)
    half_mm = np.maximum(half_mm - depth_mm * sealed.narrowing, 1e-6)
    column = np.floor((across_mm / half_mm + 1) / 2 * CELLS)
    row = np.searchsorted((s_mm[1:] + s_mm[:-1]) / 2, along_mm)
    near = (np.abs(along_mm - s_mm[row]) < 1.0) & (np.abs(across_mm) < half_mm - CLEAR_MM)
    cells_mm = np.full((len(s_mm), CELLS), np.nan)
    numbers = row[near] * CELLS + column[near].astype(int)
    order = np.argsort(numbers)
    cells, begins = np.unique(numbers[order], return_index=True)
    cells_mm.ravel()[cells] = [np.median(z_mm) for z_mm in np.split(points_mm[near, 2][order], begins[1:])]
    along = generic_filter(cells_mm, np.nanmedian, size=(11, 1), mode="nearest")
    cells_mm = np.where(np.abs(cells_mm - along) < FAR_MM, cells_mm, along)
    shares = (np.arange(CELLS) + 0.5) / CELLS * 2 - 1
    seen = np.isfinite(cells_mm)
    parabolas = [
        np.polyfit(shares[clear], row_mm[clear], 2 if clear.sum() > 3 else 0) if clear.any() else [np.nan]
        for row_mm, clear in zip(cells_mm, seen, strict=True)
    ]
    return np.array([np.polyval(np.polyint(terms), [1, -1]) @ [0.5, -0.5] for terms in parabolas])
