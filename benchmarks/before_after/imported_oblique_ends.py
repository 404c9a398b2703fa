"""Meshes of straight slots across a block 40 mm wide, at several angles to its sides: length from side to side."""

import json
import tempfile
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

import sealtwin as st


def length_mm(angle_deg: float, width_mm: float) -> float:
    slot = manifold3d.Manifold.cube((400, width_mm, 20), center=True).rotate((0, 0, angle_deg)).translate((80, 20, 0))
    mesh = (manifold3d.Manifold.cube((160, 40, 16)).translate((0, 0, -16)) - slot).to_mesh()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "oblique.stl")
        trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts).export(file)
        return st.import_mesh(file, units="mm", data="synthetic")[0].length_mm


off_mm = {
    (angle_deg, width_mm): length_mm(angle_deg, width_mm) - 40 / np.sin(np.radians(angle_deg))
    for angle_deg in (90.0, 60.0, 45.0, 30.0)
    for width_mm in (3.0, 6.2)
}
line = "; ".join(f"{angle:g} degrees, {width:g} mm wide: {off:+.2f} mm" for (angle, width), off in off_mm.items())
print(json.dumps({"line": line, "sound": bool(max(map(abs, off_mm.values())) < 0.05)}))
