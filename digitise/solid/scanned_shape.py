"""Depths and walls of an empty crack from a scan of its face, as far as the scanner saw them."""

from pathlib import Path

import numpy as np

from digitise.settings import MAX_STATIONS, CrackShape
from sealtwin.core.errors import InputError, present
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats, Outline, Solid
from sealtwin.scan.height_map import grid_along
from sealtwin.scan.mouth_search import Target
from sealtwin.scan.points_file import read_points
from sealtwin.scan.registration import place

STATION_MM = 2.0  # Distance between the rows of the table of depths
MIDDLE = 0.5  # Share of the width, in the middle, that may show the floor
LEAST_DEPTH_MM = 0.5  # Smallest depth of a floor, below the roughness of the face
FLOOR = 0.1  # Quantile of the heights in the middle that is the floor: walls are above it
LEAST_SEEN = 0.4  # Smallest share of the middle that must be seen for a depth
WALL_PART = 0.25, 0.75  # Parts of the depth between which a wall is measured
UPRIGHT_DEG = 2.0  # A wall that leans less cannot be distinguished from a vertical one
DIFFERENT = 0.3  # Relative difference of scanned and declared depth above which there is a warning
FEWEST_CELLS = 30  # Smallest number of cells that show a wall


def scanned_shape(outline: Outline, shape: CrackShape, folder: Path) -> tuple[CrackShape, tuple[Fact, ...]]:
    """Return the shape with the depths and walls that the scan of the empty crack shows, and what it does not show.

    A stretch whose floor is not seen keeps ``depth_mm``. Walls are seen if they close downward. Raises the errors of
    ``read_points`` and ``place``, and InputError if no floor is seen at all.
    """
    path = folder / present(shape.scan, "crack.scan")
    placement = present(shape.placement, "crack.placement")
    placed = place(read_points(path, placement), placement, Target.of(outline), path)
    heights = placed.heights
    s_mm, across_mm, x_mm, y_mm = grid_along(outline.centreline_mm, outline.width_mm.max(), heights.cell_mm)
    height_mm = heights.at_mm(x_mm, y_mm)
    half_mm = np.interp(s_mm, outline.s_mm, outline.width_mm) / 2
    middle = np.abs(across_mm)[:, None] <= MIDDLE * half_mm
    step_mm = max(STATION_MM, outline.length_mm / MAX_STATIONS)
    rows = np.arange(0.0, outline.length_mm, step_mm)
    station = np.minimum((s_mm / step_mm).astype(int), len(rows) - 1)
    depth_mm = np.full(len(rows), np.nan)
    for number in range(len(rows)):
        heights_mm = height_mm[:, station == number][middle[:, station == number]]
        if len(heights_mm) and np.isfinite(heights_mm).mean() >= LEAST_SEEN:
            depth_mm[number] = -np.nanquantile(heights_mm, FLOOR)
    places_mm = rows + step_mm / 2
    seen = depth_mm > LEAST_DEPTH_MM
    if not seen.any():
        raise InputError(f"{path}: the floor of the crack is not seen. Measure its depth, and leave crack.scan out.")
    if placed.agreeing is None:
        facts = [doubt("crack.scan", "the scan of the empty crack shows no crack at the named points")]
    else:
        text = f"in the scan of the empty crack, edges agree with the mouth's along {placed.agreeing:.0%} of it"
        facts = [doubt("crack.scan", text, placed.agreeing, level="plain")]
    if not seen.all():
        share = float(1 - seen.mean())
        text = f"the scan does not show the floor along {share:.0%} of the crack; crack.depth_mm is used there"
        facts.append(doubt("crack.scan-depth", text, share))
    table_mm = np.where(seen, depth_mm, shape.depth_at_mm(places_mm))
    declared_mm = float(np.mean(shape.depth_at_mm(places_mm)[seen]))
    scanned_mm = float(np.mean(depth_mm[seen]))
    if abs(scanned_mm - declared_mm) > DIFFERENT * declared_mm:
        text = f"the scan is {scanned_mm:.1f} mm deep, but crack.depth_mm {declared_mm:.1f} mm: was the crack empty?"
        facts.append(doubt("crack.scan-depth", text, scanned_mm, "mm"))
    angles_deg = _wall_angles_deg(height_mm, across_mm, half_mm, np.interp(s_mm, places_mm, table_mm))
    changes = {"depth_mm": tuple(zip(places_mm.tolist(), table_mm.tolist(), strict=True)), "scan": None}
    if angles_deg is None:
        facts.append(
            doubt("crack.scan-walls", "the scan does not show the walls; crack.tilt and wall_angle_deg are used")
        )
    elif max(angles_deg) < UPRIGHT_DEG:
        changes |= {"tilt": "vertical"}
        text = "the scan shows no wall that closes downward; walls that open downward cannot be seen from above"
        facts.append(doubt("crack.scan-walls", text, level="plain"))
    else:
        changes |= {"tilt": "funnel", "wall_angle_deg": angles_deg}
        text = "the walls are those of the scan: they close downward, at {:.1f} degrees left and {:.1f} right"
        facts.append(doubt("crack.scan-walls", text.format(*angles_deg), level="plain"))
    return shape.model_copy(update=changes), tuple(facts)


def shape_of(solid: Solid, shape: CrackShape) -> CrackShape:
    """Return the settings with the depths and walls of a solid that was made with a scan."""
    sections = solid.sections
    table_mm = tuple(zip(sections.s_mm.tolist(), sections.depth_mm.tolist(), strict=True))
    changes = {"depth_mm": table_mm, "tilt": solid.tilt, "wall_angle_deg": solid.wall_angles_deg, "scan": None}
    return shape.model_copy(update=changes)


def _wall_angles_deg(
    height_mm: Floats, across_mm: Floats, half_mm: Floats, depth_mm: Floats
) -> tuple[float, float] | None:
    """Return the angles of the left and the right wall from the vertical, or None if too little of a wall is seen.

    All cells of a wall between two depths are at the distance depth times tan(angle) from the edge of the mouth.
    """
    low, high = WALL_PART
    wall = (height_mm < -low * depth_mm) & (height_mm > -high * depth_mm) & (np.abs(across_mm)[:, None] <= half_mm)
    angles_deg = []
    for side in (1.0, -1.0):
        cells = wall & (side * across_mm[:, None] > 0)
        if cells.sum() < FEWEST_CELLS:
            return (0.0, 0.0) if not wall.any() else None
        from_edge_mm = (half_mm - side * across_mm[:, None])[cells]
        angles_deg.append(float(np.degrees(np.arctan(from_edge_mm.sum() / -height_mm[cells].sum()))))
    return angles_deg[0], angles_deg[1]
