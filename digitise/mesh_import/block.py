"""Find the closed body of a mesh, its face, and the rectangular block below the face.

A refusal says where the fault is.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import trimesh
from manifold3d import Error, Manifold, Mesh64
from scipy.spatial.transform import Rotation

from digitise.geometry.mesh_topology import edge_fault, mesh_volume_mm3
from digitise.geometry.polyline import Box
from digitise.geometry.region import box_region, prism
from digitise.solid.float_mesh import welded, without_needles
from sealtwin.core.arrays import Floats, Integers, lengths, normals, rms
from sealtwin.core.errors import ShapeError
from sealtwin.core.facts import Facts, doubt

# Limits of the search for a sample's face and sides. Each line says why the limit has its value.
#
# Most limits only accept or refuse a mesh. Stricter values refuse rougher samples, and looser values take another
# part of the mesh for the block.
SAMPLES = 20_000  # Number of random points on the upward surface
TRIES = 300  # Number of planes through three of them. The chance that none is on the face is 10^-17
# Cosine of the largest slope of a face or floor: a steeper surface is a wall, or another axis points up
STEEPEST = np.cos(np.radians(45.0))
ROUGHEST_MM = 1.0  # Largest distance of grain and warp from the face's plane: coarse asphalt has 1 mm
# Number of least-squares fits of the plane. A third fit would rotate the face of a rough scan by under 0.0001 degrees
REFINEMENTS = 2
MIN_SHARE = 0.5  # Minimum fraction of the upward surface that is in the plane of the face
LEVEL_RAD = 1e-6  # Largest slope of a level face, 0.2 µm over 160 mm: levelling it would only cost exact coordinates
BELOW_MM = 0.05  # Depth under the face at which the mouth is cut. Over it, walls at 11 degrees move by 0.01 mm
# Minimum of that depth in multiples of the face's RMS roughness. All but 60 in a million points of the face are higher
BELOW_ROUGHNESS = 4.0
LEVELS = 8  # Number of sections, from the face to the underside, in which a side is searched for
LINES = 400  # Number of lines across each section, one for every 0.4 mm of the paper's sample
ROUGH = 5.0  # Material up to this distance behind the median, in median deviations, is roughness of a side
ROUNDING_MM = 1e-6  # Distance added to that limit, for the rounding of a plane side
MAX_OPENING = 0.5  # Largest fraction of a side's lines that may meet a crack
MAX_OFF = 0.25  # Largest fraction of the body's extent outside the block. Dams, chamfers and rough sides take less
TRIM_MM = 0.01  # Depth cut off a side that is not plane, so that the cut leaves no slivers
# Vertices are equal if they agree to this many decimals of a mm: a text format may round its last digit
EQUAL_DIGITS = 8
CRUMB_SHARE = 0.01  # A closed surface with less than this fraction of the sample's volume is a crumb or a pore
LOST = 1e-7  # Largest fraction of a body's volume that may be lost when the body is read or cut
MEND = "Repair it in a mesh program (close holes, remove doubled parts, unite bodies), and export it again."


@dataclass(frozen=True)
class FacePlane:
    """Plane of the face, and the face's roughness."""

    normal: Floats  # Unit vector that points out of the face, (3,)
    place_mm: Floats  # Point on the plane, (3,)
    roughness_mm: float  # RMS distance of the face from its plane

    @property
    def tilt_deg(self) -> float:
        """Angle between the plane and the horizontal."""
        return float(np.degrees(np.arccos(min(1.0, self.normal[2]))))

    @property
    def below_mm(self) -> float:
        """Depth under the face at which the mouth is cut."""
        return max(BELOW_MM, BELOW_ROUGHNESS * self.roughness_mm)

    @property
    def to_level(self) -> Floats:
        """Transform, (4, 4), that makes the plane level by the smallest rotation, and moves it to z = 0."""
        placed = np.eye(4)
        if np.hypot(*self.normal[:2]) > LEVEL_RAD:
            placed[:3, :3] = Rotation.align_vectors([0, 0, 1], self.normal)[0].as_matrix()
        placed[2, 3] = -(placed[:3, :3] @ self.place_mm)[2]
        return placed


def find_face(vertices_mm: Floats, faces: Integers) -> FacePlane:
    """Return the plane that contains most of the upward surface.

    The plane is found from random samples (Fischler and Bolles 1981) and refined by least squares. Raises ShapeError if
    no plane contains enough of the surface.
    """
    corners_mm, rng, share = vertices_mm[faces], np.random.default_rng(0), 0.0
    across = normals(corners_mm)
    area = lengths(across)
    area[across[:, 2] < STEEPEST * area] = 0.0
    if area.any():
        # Uniform over the area of all upward facets.
        chosen = np.searchsorted(np.cumsum(area), rng.uniform(0, area.sum(), SAMPLES), side="right")
        u, v = np.sort(rng.uniform(size=(2, SAMPLES, 1)), axis=0)
        a, b, c = corners_mm[chosen.clip(max=len(area) - 1)].transpose(1, 0, 2)
        points_mm = u * a + (v - u) * b + (1 - v) * c
        a, b, c = points_mm[np.random.default_rng(0).integers(len(points_mm), size=(3, TRIES))]
        normal = np.cross(b - a, c - a)
        normal *= (np.sign(normal[:, 2]) / lengths(normal).clip(min=np.finfo(float).tiny))[:, None]
        planes = zip(a, normal, strict=True)
        place_mm, up = max(
            planes, key=lambda plane: (np.abs(points_mm @ plane[1] - plane[0] @ plane[1]) < ROUGHEST_MM).sum()
        )
        reach_mm, away_mm = ROUGHEST_MM, points_mm @ up
        for _ in range(REFINEMENTS):
            near_mm = points_mm[np.abs((points_mm - place_mm) @ up) <= reach_mm]
            place_mm = near_mm.mean(axis=0)
            up = np.linalg.svd(near_mm - place_mm, full_matrices=False)[2][2]
            up *= np.sign(up[2])
            away_mm = (near_mm - place_mm) @ up
            # The median is the face's roughness even if the points include the edge of a crack.
            reach_mm = min(ROUGHEST_MM, max(4.5 * np.median(np.abs(away_mm)), 1e-9))
        share = (np.abs((points_mm - place_mm) @ up) <= ROUGHEST_MM).mean()
        if share >= MIN_SHARE and up[2] > STEEPEST:
            return FacePlane(up, place_mm, rms(away_mm))
    raise ShapeError(
        f"Mesh has no plane face on its upper side: only {share:.0%} of the upward surface is in one plane, and at "
        f"least {MIN_SHARE:.0%} is needed.",
        "Check mesh.up, the axis that points out of the cracked face, and crop the mesh to the sample.",
    )


@dataclass(frozen=True)
class Block:
    """A sample as one block. Its face is at z = 0 with a corner at the origin, and its sides are along x and y."""

    body: Manifold  # Part of the sample inside the block's sides
    size_mm: tuple[float, float]  # Size of the face along x and y
    placed: Floats  # Transform, (4, 4), from the level body to the block's frame
    yaw_deg: float  # Angle of the block's sides from x and y in the level body
    trimmed_mm: float  # Largest thickness of material cut off at a side of the block

    @property
    def face_mm(self) -> Box:
        return 0.0, 0.0, *self.size_mm


def cut_block(body: Manifold, below_mm: float) -> Block:
    """Cut the largest block out of a body with a level face at z = 0.

    The sides of the block must be upright from ``below_mm`` below its face downwards. Raises ShapeError if the body has
    no four upright sides.
    """
    directions_deg = [0.0]
    if rings := body.slice(-below_mm).to_polygons():
        # The smallest rectangle around a section has a side along one of its longest edges.
        (cosine, sine, _), *_ = trimesh.bounds.oriented_bounds_2D(np.vstack(rings))[0]
        directions_deg.append((np.degrees(np.arctan2(sine, cosine)) + 45) % 90 - 45)
    blocks = list(filter(None, (_block_at(body, yaw_deg, below_mm) for yaw_deg in directions_deg)))
    if not blocks:
        raise ShapeError(
            "Mesh is not a block with four upright sides below its face.",
            "Check mesh.up, the axis that points out of the cracked face, or cut a block around the crack in the "
            "program that made the mesh.",
        )
    # If both areas are equal, the body that is not rotated is chosen, because its coordinates stay exact.
    return max(blocks, key=lambda block: round(block.size_mm[0] * block.size_mm[1]))


def parted(body: Manifold, cutter: Manifold) -> tuple[Manifold, Manifold]:
    """Return the parts of a body inside and outside the cutter. Raises ShapeError if they do not add up to the body."""
    inside, outside = body.split(cutter)
    require_whole(inside.volume() + outside.volume(), body.volume())
    return inside, outside


def _block_at(body: Manifold, yaw_deg: float, below_mm: float) -> Block | None:
    turned = body.rotate((0.0, 0.0, -yaw_deg)) if yaw_deg else body
    low_mm, high_mm = np.reshape(turned.bounding_box(), (2, 3))
    (x_min, x_max, off_x), (y_min, y_max, off_y) = (_sides(turned, below_mm, axis) for axis in (0, 1))
    if (np.array([off_x, off_y]) > MAX_OFF * (high_mm - low_mm)[:2]).any():
        return None
    inside, _ = parted(turned, prism(box_region((x_min, y_min, x_max, y_max)), low_mm[2] - 1, high_mm[2] + 1))
    placed = np.eye(4)
    placed[:3, :3] = Rotation.from_euler("z", -yaw_deg, degrees=True).as_matrix()
    placed[:2, 3] = -x_min, -y_min
    return Block(
        body=inside.translate((-x_min, -y_min, 0.0)),
        size_mm=(x_max - x_min, y_max - y_min),
        placed=placed,
        yaw_deg=yaw_deg,
        trimmed_mm=max(off_x, off_y),
    )


def _sides(body: Manifold, below_mm: float, axis: int) -> tuple[float, float, float]:
    """Return the coordinates of the two sides along an axis, and the largest extent of the body beyond them.

    The extent is infinite if there are not two sides.
    """
    low_mm, high_mm = np.reshape(body.bounding_box(), (2, 3))
    levels_mm = np.linspace(-below_mm, 0.9 * low_mm[2], LEVELS)
    lines_mm = np.linspace(low_mm[1 - axis], high_mm[1 - axis], LINES + 2)[1:-1]
    met_mm = np.full((2, LEVELS, LINES), np.inf)
    rays_mm = np.empty((LEVELS, LINES, 2, 3))
    rays_mm[..., 1 - axis], rays_mm[..., 2] = lines_mm[:, None], levels_mm[:, None, None]
    rays_mm[..., axis] = low_mm[axis] - 1, high_mm[axis] + 1
    for level, line in product(range(LEVELS), range(LINES)):
        if hits := body.ray_cast(*rays_mm[level, line]):
            met_mm[:, level, line] = hits[0].position[axis], -hits[-1].position[axis]
    low, high = map(_side, met_mm)
    return low, -high, float(max(low - low_mm[axis], high_mm[axis] + high))


def _side(met_mm: Floats) -> float:
    """Return the coordinate of a side: behind it, all lines on every level have met material.

    ``met_mm``, (levels, lines), is the coordinate at which each line meets material. Lines that meet material far
    behind the others enter a crack and are ignored. The result is infinite if most lines of a level are ignored or meet
    nothing.
    """
    if np.isfinite(usual_mm := float(np.median(met_mm))):
        off_mm = met_mm - usual_mm
        on_side = off_mm <= ROUGH * np.median(np.abs(off_mm)[np.isfinite(off_mm)]) + ROUNDING_MM
        if on_side.mean(axis=1).min() >= 1 - MAX_OPENING:
            side_mm = float(met_mm[on_side].max())
            return side_mm if side_mm == usual_mm else side_mm + TRIM_MM
    return np.inf


def one_surface(vertices_mm: Floats, faces: Integers) -> tuple[Floats, Integers, Facts]:
    """Join equal vertices, drop doubled and degenerate faces, and reverse the faces of a mesh that is inside out.

    Returns vertices, faces and notes. Raises ShapeError if no face is left.
    """
    vertices_mm, faces, alike = welded(vertices_mm, faces, EQUAL_DIGITS)
    if not len(faces):
        raise ShapeError("Mesh has no triangle with three distinct corners.", "Check its units.")
    faces = faces[np.sort(np.unique(alike, return_index=True)[1])]
    if mesh_volume_mm3(vertices_mm, faces) >= 0:
        return vertices_mm, faces, ()
    turned = doubt("mesh.inside-out", "the mesh was inside out, so all its faces were reversed")
    return vertices_mm, faces[:, ::-1], (turned,)


def closed_body(vertices_mm: Floats, faces: Integers) -> tuple[Manifold, Facts]:
    """Return the enclosed body without crumbs and pores, and a note if there were any.

    Raises ShapeError if the mesh is not closed, has no inside, or encloses several bodies.
    """
    body = Manifold(Mesh64(vertices_mm, without_needles(vertices_mm, faces).astype(np.uint64)))
    if body.status() != Error.NoError:
        fault = edge_fault(vertices_mm, faces) or f"Mesh is not a solid ({body.status().name})."
        raise ShapeError(fault, MEND)
    require_whole(body.volume(), mesh_volume_mm3(vertices_mm, faces))
    *others, sample = sorted(body.decompose(), key=Manifold.volume) or [Manifold()]
    if not sample.volume() > 0:
        raise ShapeError("Mesh encloses no volume.", MEND)
    if large := [piece for piece in others if abs(piece.volume()) >= CRUMB_SHARE * sample.volume()]:
        bodies = ", ".join(map(_described, [sample, *reversed(large)]))
        raise ShapeError(f"Mesh has {1 + len(large)} separate bodies: {bodies}.", "Save the sample alone.")
    if not others:
        return sample, ()
    crumbs = f"{len(others)} loose crumbs or closed pores of the mesh were left out"
    return sample, (doubt("mesh.crumbs", crumbs, len(others)),)


def require_whole(parts_mm3: float, whole_mm3: float) -> None:
    """Raise ShapeError if the parts' volume differs from the whole.

    The library Manifold may move triangles whose height is below its rounding, and so lose volume.
    """
    if abs(parts_mm3 - whole_mm3) > LOST * abs(whole_mm3):
        wrong = "Mesh cannot be cut without loss: it crosses itself, or has triangles without height."
        raise ShapeError(wrong, MEND)


def _described(body: Manifold) -> str:
    low_mm, high_mm = np.reshape(body.bounding_box(), (2, 3))
    size = " x ".join(f"{side:.4g}" for side in high_mm - low_mm)
    return f"{size} mm around ({', '.join(f'{middle:.4g}' for middle in (low_mm + high_mm) / 2)})"
