"""
Your own mesh
=============

A sample that was modelled or scanned takes the place of photo, depth and tilt. Here a block with a slanted slot is
modelled first, so that the example needs no other file.
"""

# %%
# A block of 100 x 40 x 20 mm with a slot that is 4 mm wide and 12 mm deep, turned by 20 degrees.
import tempfile
from pathlib import Path

import manifold3d
import matplotlib.pyplot as plt
import trimesh

import sealtwin as st

block = manifold3d.Manifold.cube((100.0, 40.0, 20.0)).translate((0.0, 0.0, -20.0))
slot = manifold3d.Manifold.cube((60.0, 4.0, 20.0), center=True).translate((0.0, 0.0, -2.0))
mesh = (block - slot.rotate((0.0, 0.0, 20.0)).translate((50.0, 20.0, 0.0))).to_mesh()

# %%
# The file is read as any other: only its unit must be said, since an STL holds none.
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder, "sample.stl")
    trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts).export(file)
    solid = st.import_mesh(file, units="mm", data="synthetic")
crack = solid.crack
print(f"{crack.length_mm:.1f} mm long, {crack.mean_width_mm:.2f} mm wide, {solid.depth_mm:.1f} mm deep")

# %%
# From here on everything is as from a photo.
path = st.plan_path(solid, speed_mm_s=20, trim_mm=5, fill=0.9)
paste = st.Fluid(viscosity_pa_s=2.0, yield_stress_pa=10)
run = st.inject(path, paste, solver=st.Solver(radius_mm=0.8), device="cpu")
st.plot_levels(run)

# %%
# The walls as they were found in the mesh, with the nozzle's path between them.
figure, ax = plt.subplots(figsize=(9, 4), layout="constrained")
for wall_mm in (crack.left_wall_mm, crack.right_wall_mm):
    ax.plot(*wall_mm.T, color="black")
ax.plot(*path.position_mm[:, :2].T, ".-", label="nozzle")
ax.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
ax.legend()
