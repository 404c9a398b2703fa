"""The face of an imported mesh, and the rectangular block below it."""

from dataclasses import dataclass

import cv2
import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from digitise.geometry.mesh_topology import normals
from digitise.geometry.polyline import Box
from digitise.geometry.region import box_region
from digitise.mesh_import.repair import RepairedSurface
from sealtwin.core.errors import ShapeError
from sealtwin.core.records import Floats


@dataclass(frozen=True)
class BlockSearch:
    """Limits of the search for a sample's face and sides.

    Each line states what its value rests on. Most fields only accept or refuse a mesh: stricter ones refuse rougher
    samples, looser ones take another part of the mesh for the block.
    """

    samples: int = 20_000  # Random points on the upward surface
    tries: int = 300  # Planes through three of them: all miss a face once in 10^17 meshes
    steepest_deg: float = 45.0  # Largest slope of a face or a floor: steeper is a wall, or another axis points up
    roughest_mm: float = 1.0  # Largest distance of grain and warp from the face's plane: coarse asphalt has 1 mm
    refinements: int = 2  # Least-squares fits of the plane: a third turns a rough scan's by under 0.0001 degrees
    least_share: float = 0.5  # Least share of the upward surface in one plane that makes it a face
    level_rad: float = 1e-6  # Slope of a level face, 0.2 µm over 160 mm: turning it would only cost exact coordinates
    below_mm: float = 0.05  # Depth of the mouth under the face: walls at 11 degrees move by 0.01 mm over it
    below_roughness: float = 4.0  # The same in RMS of a rough face: all but 60 in a million of its points are higher
    levels: int = 8  # Sections, from the face to the underside, in which a side must be in material
    lines: int = 400  # Lines across each section, one for every 0.4 mm of the paper's sample
    rough: float = 5.0  # Distance behind the median that is a side's roughness, in median deviations
    deep: float = 20.0  # Distance behind that roughness that is a crack, in median deviations
    opening_mm: float = 1.0  # Distance behind that roughness that is a crack in every side, however rough
    rounding_mm: float = 1e-6  # Distance behind the median that is rounding of a plane side
    most_opening: float = 0.5  # Largest share of a side's lines that may meet a crack
    most_off: float = 0.25  # Largest share of the body's extent outside the block: dams, chamfers, rough sides are less
    trim_mm: float = 0.01  # Depth cut off a side that is not plane, so that the cut is in material without slivers
    cut_tolerance: float = 1e-7  # Largest share of a body's volume that a cut in two may lose


SEARCH = BlockSearch()


@dataclass(frozen=True)
class FacePlane:
    """Plane of the face, and its flatness."""

    normal: Floats  # Unit vector out of the face
    place_mm: Floats  # Point on the plane, (3,)
    roughness_mm: float  # RMS distance of the face from its plane

    @property
    def tilt_deg(self) -> float:
        """Angle of the plane from level."""
        return float(np.degrees(np.arccos(min(1.0, self.normal[2]))))

    @property
    def below_mm(self) -> float:
        """Depth under the face at which the mouth is cut."""
        return max(SEARCH.below_mm, SEARCH.below_roughness * self.roughness_mm)

    def height_mm(self, points_mm: Floats) -> Floats:
        """Return the height of the plane at each x and y, (n,)."""
        x, y, z = self.normal
        return self.place_mm[2] - (points_mm - self.place_mm[:2]) @ np.array([x, y]) / z

    @property
    def to_level(self) -> Floats:
        """Transform (4, 4) that turns the plane level by the smallest rotation, and moves it to z = 0."""
        x, y, z = self.normal
        turn = np.eye(3)
        if np.hypot(x, y) > SEARCH.level_rad:
            # Rodrigues' formula from the normal to the z axis.
            across = -x * y / (1 + z)
            turn = np.array([[z + y * y / (1 + z), across, -x], [across, z + x * x / (1 + z), -y], [x, y, z]])
        placed = np.eye(4)
        placed[:3, :3] = turn
        placed[2, 3] = -(turn @ self.place_mm)[2]
        return placed


def find_face(surface: RepairedSurface) -> FacePlane:
    """Find the plane of most of the upward surface by random samples (Fischler and Bolles 1981) and least squares."""
    points_mm = _upward_points(surface)
    rng = np.random.default_rng(0)
    a, b, c = points_mm[rng.integers(len(points_mm), size=(3, SEARCH.tries))]
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    normal *= (np.sign(normal[:, 2]) / np.where(length > 0, length, 1.0))[:, None]
    upright = normal[:, 2] >= np.cos(np.radians(SEARCH.steepest_deg))
    if not upright.any():
        raise _no_face(0.0)
    planes = zip(a[upright], normal[upright], strict=True)
    place_mm, up = max(planes, key=lambda plane: (np.abs((points_mm - plane[0]) @ plane[1]) < SEARCH.roughest_mm).sum())
    reach_mm, away_mm = SEARCH.roughest_mm, points_mm @ up
    for _ in range(SEARCH.refinements):
        near_mm = points_mm[np.abs((points_mm - place_mm) @ up) <= reach_mm]
        place_mm = near_mm.mean(axis=0)
        up = np.linalg.svd(near_mm - place_mm, full_matrices=False)[2][2]
        up *= np.sign(up[2])
        away_mm = (near_mm - place_mm) @ up
        # The median is the face's roughness even if the points include the edge of a crack.
        reach_mm = min(SEARCH.roughest_mm, max(4.5 * float(np.median(np.abs(away_mm))), 1e-9))
    if (share := float((np.abs((points_mm - place_mm) @ up) <= SEARCH.roughest_mm).mean())) < SEARCH.least_share:
        raise _no_face(share)
    return FacePlane(up, place_mm, float(np.sqrt(np.mean(away_mm**2))))


def _upward_points(surface: RepairedSurface) -> Floats:
    """Return random points, uniform over the area of all upward facets, (n, 3)."""
    corners_mm = surface.vertices_mm[surface.faces]
    across = normals(corners_mm)
    area = np.linalg.norm(across, axis=1)
    area[across[:, 2] < np.cos(np.radians(SEARCH.steepest_deg)) * area] = 0.0
    if not area.any():
        raise _no_face(0.0)
    rng = np.random.default_rng(0)
    chosen = np.searchsorted(np.cumsum(area), rng.uniform(0, area.sum(), SEARCH.samples), side="right")
    a, b, c = corners_mm[chosen.clip(max=len(area) - 1)].transpose(1, 0, 2)
    u, v = np.sort(rng.uniform(size=(2, SEARCH.samples, 1)), axis=0)
    return u * a + (v - u) * b + (1 - v) * c


def _no_face(share: float) -> ShapeError:
    return ShapeError(
        f"Mesh has no plane face on its upper side: {share:.0%} of the upward surface is in one plane; at least "
        f"{SEARCH.least_share:.0%} is needed.",
        "Check mesh.up, the axis that points out of the cracked face, and crop the mesh to the sample.",
        "face",
    )


@dataclass(frozen=True)
class Block:
    """A sample as one block: its face at z = 0 has one corner at the origin, and its sides are along x and y."""

    body: Manifold  # All of the sample inside the block's sides
    size_mm: tuple[float, float]  # Size of the face along x and y
    placed: Floats  # Transform (4, 4) from the level body to the block's frame
    yaw_deg: float  # Angle of its sides from x and y in the level body
    trimmed_mm: float  # Most material cut off at one of its sides

    @property
    def face_mm(self) -> Box:
        return 0.0, 0.0, *self.size_mm


def cut_block(body: Manifold, below_mm: float) -> Block:
    """Cut the largest block out of a body with a level face at z = 0.

    The sides of the block must be upright from ``below_mm`` below its face downwards.
    """
    blocks = list(filter(None, (_block_at(body, yaw_deg, below_mm) for yaw_deg in _directions_deg(body, below_mm))))
    if not blocks:
        raise ShapeError(
            "Mesh is not a block with four upright sides below its face.",
            "Check mesh.up, the axis that points out of the cracked face, or cut a block around the crack in the "
            "program that made the mesh.",
            "sides",
        )
    # Of equal areas the body itself, not turned, comes first: its coordinates stay exact.
    return max(blocks, key=lambda block: round(block.size_mm[0] * block.size_mm[1]))


def parted(body: Manifold, cutter: Manifold) -> tuple[Manifold, Manifold]:
    """Return the parts of a body inside and outside the cutter. Raises InputError if they do not add up to the body."""
    inside, outside = body.split(cutter)
    whole_mm3 = body.volume()
    # A boolean may move triangles if others are lower than its rounding.
    if abs(inside.volume() + outside.volume() - whole_mm3) > SEARCH.cut_tolerance * whole_mm3:
        raise ShapeError(
            "Mesh cannot be cut without loss: it crosses itself, or has triangles without height.",
            "Repair it in the program that made it.",
            "cut",
        )
    return inside, outside


def _directions_deg(body: Manifold, below_mm: float) -> list[float]:
    """Return candidate directions of the block's sides, from -45 to 45 degrees.

    They are 0, the direction of the longest edge, and that of the smallest rectangle around the body.
    """
    if not len(edges := _edges(body, -below_mm)):
        return [0.0]
    step = edges[:, 1] - edges[:, 0]
    along_x, along_y = step[np.linalg.norm(step, axis=1).argmax()]
    longest_deg = np.degrees(np.arctan2(along_y, along_x))
    (_, _), (_, _), around_deg = cv2.minAreaRect(edges[:, 0].astype(np.float32))
    return list(dict.fromkeys([0.0, *((float(angle) + 45) % 90 - 45 for angle in (longest_deg, around_deg))]))


def _block_at(body: Manifold, yaw_deg: float, below_mm: float) -> Block | None:
    turned = body.rotate((0.0, 0.0, -yaw_deg)) if yaw_deg else body
    bottom_mm, top_mm = turned.bounding_box()[2], turned.bounding_box()[5]
    levels = np.linspace(-below_mm, 0.9 * bottom_mm, SEARCH.levels)
    sections = [edges for edges in (_edges(turned, level) for level in levels) if len(edges)]
    across_x, across_y = (_sides(sections, axis) if sections else None for axis in (0, 1))
    if across_x is None or across_y is None:
        return None
    (x_min, x_max, off_x), (y_min, y_max, off_y) = across_x, across_y
    sides = box_region((x_min, y_min, x_max, y_max))
    shaft = sides.extrude(top_mm - bottom_mm + 2).translate((0.0, 0.0, bottom_mm - 1))
    yaw = np.radians(yaw_deg)
    placed = np.eye(4)
    placed[:2, :2] = [[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]]
    placed[:2, 3] = -x_min, -y_min
    inside, _ = parted(turned, shaft)
    return Block(
        body=inside.translate((-x_min, -y_min, 0.0)),
        size_mm=(x_max - x_min, y_max - y_min),
        placed=placed,
        yaw_deg=yaw_deg,
        trimmed_mm=max(off_x, off_y),
    )


def _edges(body: Manifold, level_mm: float) -> Floats:
    """Return the edges of a horizontal section, (n, 2, 2)."""
    rings = [np.asarray(ring, dtype=float) for ring in body.slice(level_mm).to_polygons()]
    edges = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    return np.concatenate([np.empty((0, 2, 2)), *edges])


def _sides(sections: list[Floats], axis: int) -> tuple[float, float, float] | None:
    """Return the coordinates of both sides along an axis, and the largest excess beyond; None unless both exist."""
    every = np.concatenate(sections)
    lines = np.linspace(every[..., 1 - axis].min(), every[..., 1 - axis].max(), SEARCH.lines + 2)[1:-1]
    met = [_first_and_last(edges, axis, lines) for edges in sections]
    low, high = _side([first for first, _ in met]), _side([-last for _, last in met])
    if low is None or high is None:
        return None
    off = max(low - every[..., axis].min(), every[..., axis].max() + high)
    return (low, -high, off) if off <= SEARCH.most_off * np.ptp(every[..., axis]) else None


def _first_and_last(edges: Floats, axis: int, lines: Floats) -> tuple[Floats, Floats]:
    """Return the first and last coordinate of a section on each line along ``axis``, (n,); infinite if it misses."""
    start, end = edges[:, 0], edges[:, 1]
    low, high = np.sort(edges[..., 1 - axis], axis=1).T
    step = lines[1] - lines[0]
    from_line = np.clip(np.ceil((low - lines[0]) / step), 0, SEARCH.lines).astype(int)
    count = np.maximum(np.clip(np.floor((high - lines[0]) / step), -1, SEARCH.lines - 1).astype(int) - from_line + 1, 0)
    edge = np.repeat(np.arange(len(edges)), count)
    line = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + from_line[edge]
    rise = (end - start)[edge, 1 - axis]
    # An edge along the line counts by the ends of its neighbours.
    share = np.divide(lines[line] - start[edge, 1 - axis], rise, out=np.zeros_like(rise), where=rise != 0)
    place = start[edge, axis] + share * (end - start)[edge, axis]
    first, last = np.full(SEARCH.lines, np.inf), np.full(SEARCH.lines, -np.inf)
    np.minimum.at(first, line, place)
    np.maximum.at(last, line, place)
    return first, last


def _side(met: list[Floats]) -> float | None:
    """Return the coordinate beyond which all lines on every level have met material, except those into a crack."""
    outermost, plane = [], True
    for places in met:
        usual = float(np.median(places))
        if not np.isfinite(usual):
            return None
        scatter = float(np.median(np.abs(places - usual)[np.isfinite(places)]))
        on_side = places[~_into_crack(places - usual, scatter)]
        if len(on_side) < (1 - SEARCH.most_opening) * SEARCH.lines:
            return None
        outermost.append(float(on_side.max()))
        plane &= usual == outermost[-1] == outermost[0]
    return max(outermost) + (0.0 if plane else SEARCH.trim_mm)


def _into_crack(off_mm: Floats, scatter_mm: float) -> NDArray[np.bool_]:
    """Return True for each line into a crack.

    Such lines are neighbours beyond the side's roughness, and at least one of them is deep. An oblique crack recedes
    from the side slowly at first, and a thin crack is deep nowhere: its first lines are as near as the chips of a rough
    edge.
    """
    rough_mm = SEARCH.rough * scatter_mm
    beyond = off_mm > rough_mm + SEARCH.rounding_mm
    number = np.cumsum(np.diff(beyond, prepend=False))
    opening_mm = min(SEARCH.opening_mm, SEARCH.deep * scatter_mm + SEARCH.rounding_mm)
    deep = np.bincount(number, off_mm > rough_mm + opening_mm) > 0
    return beyond & deep[number]
