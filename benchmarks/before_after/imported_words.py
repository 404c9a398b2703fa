"""A mesh with a pocket in place of a crack is refused without a word of photos or of their keys."""

import json
import tempfile
from pathlib import Path

import manifold3d
import trimesh

import sealtwin as st

mesh = (manifold3d.Manifold.cube((60, 40, 16)) - manifold3d.Manifold.cube((12, 8, 20)).translate((24, 16, 8))).to_mesh()
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder, "pocket.stl")
    trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts).export(file)
    try:
        st.import_mesh(file, units="mm", data="synthetic")
        line = "imported"
    except st.InputError as fault:
        line = str(fault).replace(folder, "")
foreign = [word for word in ("photo", "ends_px", "--ends", "mask", "walls not found") if word in line]
print(json.dumps({"line": line, "sound": line != "imported" and not foreign}))
