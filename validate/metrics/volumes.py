"""Volumes below and above a level along the crack, the mass balance of a run, and the flat level of a volume."""

import cv2
import numpy as np

from sealtwin.core.records import FaceLabel, Floats, Outline, Profile, Run, Solid
from validate.comparison import FilledVolumes, MassBalance
from validate.metrics.cavity import cavity_by_level
from validate.settings import Readings

CELL_MM = 0.2  # Raster cell for sealant on the face: half a particle of the paper's size


def mass_balance(run: Run, solid: Solid, volume_ratio: float, readings_mm3: float, settings: Readings) -> MassBalance:
    """Return the volume balance of a run, with the measured volume over the covered length.

    ``volume_ratio`` is the volume of the settled particles divided by the dispensed volume.
    """
    dispensed_mm3 = run.dispensed_volume_mm3
    spilled_mm3 = run.spilled_particles * run.particle_volume_mm3
    settled_mm3 = volume_ratio * dispensed_mm3
    below = run.share_below_face
    return MassBalance(
        dispensed_mm3=dispensed_mm3,
        in_crack_mm3=below * settled_mm3,
        above_mm3=(1 - below) * settled_mm3,
        spilled_mm3=spilled_mm3,
        lost_mm3=dispensed_mm3 - settled_mm3 - spilled_mm3,
        footprint_mm2=_footprint_mm2(run, solid),
        readings_mm3=readings_mm3,
        readings_state=settings.state,
        shrinkage_percent=settings.shrinkage_percent,
        readings_when_dispensed_mm3=readings_mm3 / (1 - (settings.shrinkage_percent or 0.0) / 100),
    )


def _footprint_mm2(run: Run, solid: Solid) -> float:
    """Return the area of the face under the discs of the particles that rest on it."""
    x_min, y_min, x_max, y_max = solid.block_mm
    corner_mm = np.array([x_min, y_min])
    # Cells of the block's upper side outside the mouth, rows along y.
    on_face = np.zeros([int((y_max - y_min) / CELL_MM) + 1, int((x_max - x_min) / CELL_MM) + 1], np.uint8)
    triangles_mm = solid.vertices_mm[solid.faces[solid.face_label == FaceLabel.TOP]][:, :, :2]
    for triangle in np.rint((triangles_mm - corner_mm) / CELL_MM).astype(np.int32):
        cv2.fillConvexPoly(on_face, triangle, 1)
    above = run.position_mm[~run.spilled & (run.position_mm[:, 2] > 0), :2]
    covered = np.zeros_like(on_face)
    rows, columns = on_face.shape
    for column, row in np.rint((above - corner_mm) / CELL_MM).astype(int):
        # Sealant over the mouth is a heap, even if its disc reaches over the edge of the mouth.
        if 0 <= row < rows and 0 <= column < columns and on_face[row, column]:
            cv2.circle(covered, (int(column), int(row)), max(1, round(run.radius_mm / CELL_MM)), 1, thickness=-1)
    return float((covered & on_face).sum()) * CELL_MM**2


def gained_level_mm(run: Run, profile: Profile, outline: Outline, solid: Solid, volume_ratio: float) -> float:
    """Return the change of level due to volume that the numerics gained; negative if they lost volume.

    It is this volume divided by the area of the fluid's surface: the area of the crack at the level, plus the area of
    the face that sealant covers outside the mouth.
    """
    spilled_mm3 = run.spilled_particles * run.particle_volume_mm3
    if not run.has_particles:
        return 0.0
    gained_mm3 = (volume_ratio - 1) * run.dispensed_volume_mm3 + spilled_mm3
    cavity = cavity_by_level(outline, solid)
    level_mm = np.interp(cavity.middle_mm, profile.s_mm, profile.level_mm)
    wetted_mm2 = float(cavity.area_at_mm2(level_mm)[level_mm > cavity.floor_mm].sum())
    return gained_mm3 / (wetted_mm2 + _footprint_mm2(run, solid))


def fill_volumes(profile: Profile, outline: Outline, solid: Solid, from_mm: float, to_mm: float) -> FilledVolumes:
    """Return the volumes below and above a level over a stretch.

    The cavity is that of the mesh, at the level of the nearest place on the main crack. Above the face it continues
    straight up; profiles do not include sealant on the face outside the mouth.
    """
    cavity = cavity_by_level(outline, solid)
    share, s_mm = cavity.between(from_mm, to_mm)
    level_mm = np.interp(s_mm, profile.s_mm, profile.level_mm)
    face_mm = np.zeros_like(level_mm)
    room_mm3 = float(share @ cavity.below_mm3(face_mm))
    sealant_mm3 = float(share @ cavity.below_mm3(level_mm))
    heap_mm3 = float(share @ (cavity.area_at_mm2(face_mm) * np.maximum(level_mm, 0.0)))
    return FilledVolumes(
        underfill_mm3=room_mm3 - sealant_mm3,
        overfill_mm3=heap_mm3,
        sealant_mm3=sealant_mm3 + heap_mm3,
        fill_ratio=sealant_mm3 / room_mm3,
    )


def mouth_widths_mm(s_mm: Floats, outline: Outline, solid: Solid) -> Floats:
    """Return the width of the crack at the face, perpendicular to the centreline, at each s, (n,)."""
    traced_mm = np.interp(s_mm, outline.s_mm, outline.width_mm)
    opening = float(np.tan(np.radians(solid.wall_angles_deg)).sum()) if solid.tilt == "flare" else 0.0
    return traced_mm + opening * solid.depth_mm


def balance_profile(volume_mm3: float, outline: Outline, solid: Solid) -> Profile:
    """Return the flat level of a volume in the whole crack, like water between dams at both ends.

    It depends only on volume and crack. A simulation, which also models the flow, should have a smaller error.
    """
    from scipy.optimize import root_scalar

    floor_mm, first_mm, last_mm = -solid.depth_at_mm(outline.s_mm), outline.s_mm[0], outline.s_mm[-1]

    def held(level_mm: float) -> FilledVolumes:
        flat = Profile(outline.s_mm, np.maximum(floor_mm, level_mm))
        return fill_volumes(flat, outline, solid, first_mm, last_mm)

    # Above the face each millimetre adds the same volume, so the level with all of the volume there is an upper bound.
    highest_mm = 1.0 + volume_mm3 / held(1.0).overfill_mm3
    level_mm = root_scalar(
        lambda level_mm: held(level_mm).sealant_mm3 - volume_mm3, bracket=(-solid.depth_mm, highest_mm)
    ).root
    return Profile(outline.s_mm, np.maximum(floor_mm, level_mm), source="volume balance")
