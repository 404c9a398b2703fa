"""Meshes of clean slots in zigzag, 3 mm wide, that turn by 60, 100 and 140 degrees: length, width and volume."""

import json
import tempfile
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

import sealtwin as st

LEG_MM, LEGS, WIDTH_MM, DEPTH_MM = 25.0, 4, 3.0, 10.0


def zigzag(turn_deg: float) -> manifold3d.CrossSection:
    """Strip of constant width along legs that turn left and right in turn, with mitred corners."""
    directions = np.radians([sign * turn_deg / 2 for sign in [-1, 1] * (LEGS // 2)])
    ahead = np.column_stack([np.cos(directions), np.sin(directions)])
    line = np.vstack([np.zeros(2), np.cumsum(LEG_MM * ahead, axis=0)])
    normal = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    inner = (normal[1:] + normal[:-1]) / (1 + (normal[1:] * normal[:-1]).sum(axis=1))[:, None]
    half = WIDTH_MM / 2 * np.vstack([normal[:1], inner, normal[-1:]])
    return manifold3d.CrossSection([np.vstack([line - half, (line + half)[::-1]])], manifold3d.FillRule.NonZero)


def imported(turn_deg: float) -> tuple[str, bool]:
    mouth = zigzag(turn_deg)
    low, high = np.reshape(mouth.bounds(), (2, 2)) + np.array([[-10.0], [10.0]])
    block = manifold3d.Manifold.cube((*(high - low), DEPTH_MM + 5)).translate((*low, -DEPTH_MM - 5))
    mesh = (block - mouth.extrude(DEPTH_MM + 1).translate((0, 0, -DEPTH_MM))).to_mesh()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "zigzag.stl")
        trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts).export(file)
        try:
            crack, solid = st.import_mesh(file, units="mm", data="synthetic")
        except st.InputError as fault:
            return str(fault).removeprefix(folder)[:60], False
    length_mm, wide_mm = LEGS * LEG_MM, crack.mean_width_mm
    volume_mm3 = float(np.trapezoid(solid.sections.area_mm2, solid.sections.s_mm))
    off = [
        value - 1 for value in (crack.length_mm / length_mm, wide_mm / WIDTH_MM, volume_mm3 / mouth.area() / DEPTH_MM)
    ]
    words = f"{crack.length_mm:.1f} mm of {length_mm:g}, {wide_mm:.2f} mm wide, sections hold {1 + off[2]:.1%}"
    return words, bool(np.all(np.abs(off) < [0.02, 0.03, 0.02]))


seen = {turn_deg: imported(turn_deg) for turn_deg in (60.0, 100.0, 140.0)}
line = "; ".join(f"{turn_deg:g} degrees: {words}" for turn_deg, (words, _) in seen.items())
print(json.dumps({"line": line, "sound": all(sound for _, sound in seen.values())}))
