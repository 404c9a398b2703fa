"""Meshes of slots whose walls are upright, flare, are undercut, lean or close in a V: volume below flat levels."""

import json
import tempfile
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

import sealtwin as st

LENGTH_MM, DEPTH_MM = 80.0, 16.0
LEVELS_MM = (-12.0, -8.0, -4.0, 0.0)
WALLS = {  # Width at the face and at the floor, and shift of the floor to one side
    "upright": (3.1, 3.1, 0.0),
    "flare": (6.2, 3.1, 0.0),
    "undercut": (3.1, 6.2, 0.0),
    "lean": (3.1, 3.1, 3.1),
    "V": (6.2, 0.02, 0.0),
}


def worst_off(mouth_mm: float, floor_mm: float, shift_mm: float) -> float:
    """Largest difference from the closed form, as a share of the cavity."""
    corners = [
        (x, 20 + side * width_mm / 2 + shift, z)
        for x in (10.0, 10.0 + LENGTH_MM)
        for width_mm, shift, z in ((mouth_mm, 0.0, 0.0), (floor_mm, shift_mm, -DEPTH_MM))
        for side in (-1, 1)
    ]
    block = manifold3d.Manifold.cube((100, 40, 22)).translate((0, 0, -22))
    mesh = (block - manifold3d.Manifold.hull_points(np.array(corners))).to_mesh()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "slot.stl")
        trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts).export(file)
        crack, solid = st.import_mesh(file, units="mm", data="synthetic")
    cavity_mm3 = LENGTH_MM * DEPTH_MM * (mouth_mm + floor_mm) / 2
    off = []
    for level_mm in LEVELS_MM:
        s_mm = np.linspace(0, crack.length_mm, 21)
        flat = st.read_readings(np.column_stack([s_mm, np.full(21, level_mm)]), data="synthetic", role="undeclared")
        below_mm3 = st.compare(flat, flat, crack, solid).measured_sealant_mm3
        height_mm = DEPTH_MM + level_mm
        there_mm = floor_mm + (mouth_mm - floor_mm) * height_mm / DEPTH_MM
        off.append((below_mm3 - LENGTH_MM * height_mm * (floor_mm + there_mm) / 2) / cavity_mm3)
    return float(max(off, key=abs))


off = {name: worst_off(*walls) for name, walls in WALLS.items()}
line = "; ".join(f"{name}: {share:+.1%}" for name, share in off.items())
print(json.dumps({"line": f"worst, of the cavity: {line}", "sound": max(map(abs, off.values())) < 0.01}))
