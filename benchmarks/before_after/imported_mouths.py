"""Meshes of slots with chamfered, rounded and stepped mouths, plane or with a scan's noise: their cavity and heap."""

import json
import tempfile
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

import sealtwin as st
from sealtwin.core.records import Profile
from validate.metrics.volumes import fill_volumes

LENGTH_MM, WIDTH_MM, DEPTH_MM = 60.0, 4.0, 10.0
BEND_MM = 2.0 * np.column_stack([1 - np.sin(np.linspace(0, np.pi / 2, 64)), np.cos(np.linspace(0, np.pi / 2, 64)) - 1])
SIDES = {  # Beside a wall of the slot, outward and up, from its lowest place to the face
    "sharp": np.zeros((1, 2)),
    "chamfer 0.5": np.array([(0, -0.5), (0.5, 0)]),
    "chamfer 2": np.array([(0, -2.0), (2.0, 0)]),
    "chamfer 5": np.array([(0, -5.0), (5.0, 0)]),
    "ledge 1": np.array([(0, -1.0), (2.0, -1.0), (2.0, 0)]),
    "round 2": BEND_MM[::-1],
}
NOISES_MM = (0.0, 0.1, 0.2)
NOT_COVERED = {("chamfer 0.5", 0.2), ("ledge 1", 0.2)}  # Those of decision 0174


def off(side_mm: np.ndarray, noise_mm: float) -> tuple[float, float]:
    """Errors of the cavity and of the heap of a level 1 mm over the face, as shares."""
    half_mm = np.vstack([(0, -DEPTH_MM), side_mm, (side_mm[-1, 0], 1.0)])
    half_mm[:, 0] += WIDTH_MM / 2
    ring = np.vstack([half_mm, half_mm[::-1] * (-1, 1)])
    room = manifold3d.CrossSection([ring]).extrude(LENGTH_MM)
    room = room.transform(np.array([(0, 0, 1, 20.0), (1, 0, 0, 20.0), (0, 1, 0, 0)]))
    body = manifold3d.Manifold.cube((100, 40, 20)).translate((0, 0, -20)) - room
    mesh = (body.refine_to_length(0.8) if noise_mm else body).to_mesh64()
    vertices_mm, faces = np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int64)
    x, y, z = vertices_mm.T
    free = (z > -2.5) & (np.abs(x - 50) < 49.99) & (np.abs(y - 20) < 19.99)
    vertices_mm[free, 2] += noise_mm * np.random.default_rng(0).standard_normal(free.sum())
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "slot.stl")
        trimesh.Trimesh(vertices_mm, faces, process=False).export(file)
        crack, solid = st.import_mesh(file, units="mm", data="synthetic")
    level = Profile(np.array([0.0, crack.length_mm]), np.ones(2))
    held = fill_volumes(level, crack, solid, 0.0, crack.length_mm)
    heap_mm3 = LENGTH_MM * (WIDTH_MM + 2 * side_mm[-1, 0])
    below_mm3 = held["sealant_mm3"] - held["overfill_mm3"]
    cavity_mm3 = 20 * 100 * 40 - body.volume()
    return below_mm3 / cavity_mm3 - 1, held["overfill_mm3"] / heap_mm3 - 1


lines, sound = [], True
for name, side_mm in SIDES.items():
    errors = {noise_mm: off(side_mm, noise_mm) for noise_mm in NOISES_MM[: 1 if name == "round 2" else 3]}
    lines.append(f"{name} " + ", ".join(f"{cavity:+.2%} {heap:+.1%}" for cavity, heap in errors.values()))
    sound &= all(
        abs(cavity) < 0.002 and abs(heap) < 0.03
        for noise_mm, (cavity, heap) in errors.items()
        if (name, noise_mm) not in NOT_COVERED
    )
line = "cavity and heap at 0, 0.1 and 0.2 mm of noise: " + "; ".join(lines)
print(json.dumps({"line": line, "sound": bool(sound)}))
