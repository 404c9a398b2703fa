"""Meshes such as others bring: blocks from a CAD program, scans, and the damage that both can have."""

import manifold3d
import numpy as np
from scipy.ndimage import gaussian_filter

from digitise.geometry.mesh_topology import open_edges
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import FaceLabel, Floats, Integers, Outline, Solid

Mesh = tuple[Floats, Integers]
BLOCK_MM = (100.0, 40.0, 20.0)


def modelled(outline: Outline, **shape: object) -> Mesh:
    """Our own solid, dams included, as any program may write it."""
    solid = build_solid(outline, CrackShape.model_validate(shape))
    return solid.vertices_mm, solid.faces


def block() -> manifold3d.Manifold:
    """100 x 40 x 20 mm, its face at z = 0 and its lower left corner at the origin."""
    return manifold3d.Manifold.cube(BLOCK_MM).translate((0.0, 0.0, -BLOCK_MM[2]))


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> manifold3d.Manifold:
    size = tuple(b - a for a, b in zip(low, high, strict=True))
    return manifold3d.Manifold.cube((size[0], size[1], size[2])).translate(low)


def slotted(*rooms: manifold3d.Manifold) -> manifold3d.Manifold:
    """The block less a slot 60 mm long, 4 mm wide and 10 mm deep, closed at both ends, and less other rooms."""
    return block() - manifold3d.Manifold.batch_boolean([SLOT, *rooms], manifold3d.OpType.Add)


SLOT = box((20.0, 18.0, -10.0), (80.0, 22.0, 1.0))
SLOT_MM3 = 60.0 * 4.0 * 10.0


def mesh_of(body: manifold3d.Manifold) -> Mesh:
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int64)


def fine(body: manifold3d.Manifold, edge_mm: float = 2.0) -> Mesh:
    """In many triangles, so that a few lost ones are small damage."""
    return mesh_of(body.refine_to_length(edge_mm))


def soup(mesh: Mesh, noise_mm: float = 0.0) -> Mesh:
    """Every triangle with corners of its own, as STL has them, each a little off."""
    corners = mesh[0][mesh[1]].reshape(-1, 3)
    noise = noise_mm * np.random.default_rng(0).standard_normal(corners.shape)
    return corners + noise, np.arange(len(corners)).reshape(-1, 3)


def sheet(
    step_mm: float = 0.8, rough_mm: float = 0.05, from_mm: float = -1.0, to_mm: float = 101.0, depth_mm: float = 6.0
) -> Mesh:
    """A scan of the face alone, 100 x 40 mm: a crack 4 mm wide along its middle, from one x to another, and grain."""
    x, y = (np.linspace(0.0, size, round(size / step_mm) + 1) for size in BLOCK_MM[:2])
    place = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    inward_mm = np.minimum(
        2.0 - np.abs(place[..., 1] - 20.0), np.minimum(place[..., 0] - from_mm, to_mm - place[..., 0])
    )
    grain = gaussian_filter(np.random.default_rng(0).standard_normal(place.shape[:2]), 1.0)
    height_mm = -np.clip(4 * inward_mm, 0.0, depth_mm) + rough_mm * grain / grain.std()
    number = np.arange(height_mm.size).reshape(height_mm.shape)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.concatenate([place, height_mm[..., None]], axis=-1).reshape(-1, 3), faces


def scanned(from_mm: float, to_mm: float, thick_mm: float = 12.0) -> Mesh:
    """The same on a block of that thickness, with its sides and underside."""
    vertices, faces = sheet(from_mm=from_mm, to_mm=to_mm)
    one, other = open_edges(faces).T
    under, count = vertices * (1.0, 1.0, 0.0) - (0.0, 0.0, thick_mm), len(vertices)
    sides = [np.column_stack([other, one, one + count]), np.column_stack([other, one + count, other + count])]
    return np.concatenate([vertices, under]), np.concatenate([faces, faces[:, ::-1] + count, *sides])


def area_mm2(vertices_mm: Floats, faces: Integers) -> float:
    sides = np.diff(vertices_mm[faces], axis=1)
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2)


def labelled_mm2(solid: Solid, label: FaceLabel) -> float:
    return area_mm2(solid.vertices_mm, solid.faces[solid.face_label == label])


def turned(mesh: Mesh, about: int, by_deg: float) -> Mesh:
    """About the axis of that number."""
    cosine, sine = np.cos(np.radians(by_deg)), np.sin(np.radians(by_deg))
    turn = np.roll(np.roll(np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]]), about, axis=0), about, axis=1)
    return mesh[0] @ turn.T, mesh[1]
