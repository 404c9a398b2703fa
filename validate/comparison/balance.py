"""Where the dispensed volume is: in the crack, above it, over the edge, or lost by the numbers."""

from dataclasses import dataclass

import cv2
import numpy as np

from sealtwin.records import FaceLabel, Floats, Run, Solid

CELL_MM = 0.2
"""Of the raster on which sealant beside the mouth is measured: half a particle of the paper's size."""


@dataclass(frozen=True)
class Balance:
    """Of one run, mm³: ``dispensed`` is the sum of the next four."""

    dispensed_mm3: float
    in_crack_mm3: float
    """Below the face."""
    above_mm3: float
    """Above the face, over the mouth and beside it."""
    spilled_mm3: float
    """Over the sample's edge."""
    lost_mm3: float
    """To compression by the numbers; below 0, what they gained."""
    footprint_mm2: float
    """Of the face beside the mouth that sealant lies on."""


def mass_balance(run: Run, solid: Solid, volume_ratio: float) -> Balance:
    """``volume_ratio`` is what the settled particles fill over all that was dispensed."""
    dispensed_mm3 = run.dispensed_volume_mm3
    spilled_mm3 = run.spilled_particles * run.particle_volume_mm3
    settled_mm3 = volume_ratio * dispensed_mm3
    height_mm = run.position_mm[~run.spilled, 2]
    below = float((height_mm <= 0).mean()) if len(height_mm) else 0.0
    return Balance(
        dispensed_mm3=dispensed_mm3,
        in_crack_mm3=below * settled_mm3,
        above_mm3=(1 - below) * settled_mm3,
        spilled_mm3=spilled_mm3,
        lost_mm3=dispensed_mm3 - settled_mm3 - spilled_mm3,
        footprint_mm2=_footprint_mm2(run, solid),
    )


def when_dispensed_mm3(volume_mm3: float, shrinkage_percent: float | None) -> float:
    """What cured sealant of a volume was when it was given; as it is where no shrinkage is declared."""
    return volume_mm3 / (1 - (shrinkage_percent or 0.0) / 100)


def _footprint_mm2(run: Run, solid: Solid) -> float:
    """Area of the face under the discs of the particles that rest on it."""
    on_face, corner_mm = _face(solid)
    above = run.position_mm[~run.spilled & (run.position_mm[:, 2] > 0), :2]
    covered = np.zeros_like(on_face)
    rows, columns = on_face.shape
    for column, row in np.rint((above - corner_mm) / CELL_MM).astype(int):
        # What lies over the mouth is a heap, no spill, though its disc may reach over the edge.
        if 0 <= row < rows and 0 <= column < columns and on_face[row, column]:
            cv2.circle(covered, (int(column), int(row)), max(1, round(run.radius_mm / CELL_MM)), 1, thickness=-1)
    return float((covered & on_face).sum()) * CELL_MM**2


def _face(solid: Solid) -> tuple[np.ndarray, Floats]:
    """Cells of the block's upper side that are face and not mouth, rows along y; and the middle of the first one."""
    x_min, y_min, x_max, y_max = solid.block_mm
    corner_mm = np.array([x_min, y_min])
    cells = np.zeros([int((y_max - y_min) / CELL_MM) + 1, int((x_max - x_min) / CELL_MM) + 1], np.uint8)
    triangles_mm = solid.vertices_mm[solid.faces[solid.face_label == FaceLabel.TOP]][:, :, :2]
    for triangle in np.rint((triangles_mm - corner_mm) / CELL_MM).astype(np.int32):
        cv2.fillConvexPoly(cells, triangle, 1)
    return cells, corner_mm
