"""The fill in three dimensions: one mesh that a page can turn, and a still picture of the same where nothing turns.

Only what faces the viewer is drawn. The near wall of the crack looks away, into the crack, and is not in the way: one
looks at the sealant as into a doll's house.
"""

import base64
import json
from dataclasses import dataclass
from functools import cached_property

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from sealtwin.records import FaceLabel, Floats, Integers, Run, Solid
from validate.drawing.fluid_surface import MOST_VERTICES, fluid_surface
from validate.drawing.pictures import LABEL_COLOUR, square_on
from validate.drawing.rendering import DARKEST, LIGHT, render, seen_from, view_axes
from validate.drawing.theme import AGES, ON_GROUND

INSIDE = (FaceLabel.WALL, FaceLabel.FLOOR)
"""What is drawn of the sample. A dam at an open end stands in the way of the first look, and is no part of it."""
ASIDE_DEG = 28.0
"""The first view, off the line square to the crack: far enough to see that it has a width."""
DOWN_DEG = 32.0
RIM_MM = 0.35
"""Width of the line round the crack's mouth."""
STILL_PX = (1200, 600)
MARGIN = 0.08
"""Of the picture's width, at least, on each side of the first view: longer things stand there when it is turned."""
STEPS = 65_535
"""Of 16 bits, across the largest extent: 2 µm in a sample of 160 mm."""
MOST_CORNERS = STEPS + 1 - MOST_VERTICES
"""Of walls and rim, since 16 bits number all. The paper's trial has 7,000 of them; a scan may have millions."""
FINEST, COARSER = 1 / 2000, 1.3
"""Of the solid's extent, how close corners are made one where there are too many; and from one try to the next."""


@dataclass(frozen=True)
class Turntable:
    """A mesh that stands for itself from every side: no facet needs to be seen from its back."""

    vertices_mm: Floats  # (v, 3)
    faces: Integers  # (f, 3), counter-clockwise seen from outside
    normal: Floats  # (v, 3)
    colour: Floats  # (v, 3), 0 to 1
    azimuth_deg: float
    elevation_deg: float
    oldest_s: float
    """Age at the end of the colours' scale, which begins at 0."""

    @cached_property
    def still(self) -> NDArray[np.uint8]:
        """RGBA, from where the page begins."""
        shown = self.faces[self._seen()]
        colour, normal = (values[shown].mean(axis=1) for values in (self.colour, self.normal))
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        normal /= np.where(size > 0, size, 1.0)
        width_mm, _ = self._extent_mm()
        width_px = round(STILL_PX[0] * width_mm / self._across_mm())
        picture = render(
            self.vertices_mm, shown, colour, self.azimuth_deg, self.elevation_deg, width_px, face_normal=normal
        )
        still = np.zeros((STILL_PX[1], STILL_PX[0], 4), np.uint8)
        top, left = ((room - size) // 2 for room, size in zip(still.shape, picture.shape[:2], strict=False))
        still[top : top + picture.shape[0], left : left + picture.shape[1]] = picture
        return still

    def packed(self) -> str:
        """JSON for the page's script; the mesh in base64, little-endian.

        A vertex is 12 bytes: place as three 16-bit numbers in units of ``step_mm`` from ``low_mm``, normal as three
        signed bytes, colour as three bytes. A facet is three 16-bit numbers of vertices.
        """
        low_mm, high_mm = self.vertices_mm.min(axis=0), self.vertices_mm.max(axis=0)
        step_mm = float((high_mm - low_mm).max()) / STEPS
        vertex = np.empty(len(self.vertices_mm), [("place", "<u2", 3), ("normal", "i1", 3), ("colour", "u1", 3)])
        vertex["place"] = np.round((self.vertices_mm - low_mm) / step_mm)
        vertex["normal"] = np.round(127 * self.normal)
        vertex["colour"] = np.round(255 * self.colour)
        return json.dumps(
            {
                "low_mm": np.round(low_mm, 6).tolist(),
                "step_mm": step_mm,
                "middle_mm": np.round(self._middle_mm(), 6).tolist(),
                "across_mm": round(self._across_mm(), 6),
                "reach_mm": round(float(np.linalg.norm(high_mm - low_mm)), 6),
                "azimuth_deg": round(self.azimuth_deg, 3),
                "elevation_deg": self.elevation_deg,
                "light": LIGHT.tolist(),
                "darkest": DARKEST,
                "vertices": base64.b64encode(vertex.tobytes()).decode(),
                "faces": base64.b64encode(self.faces.astype("<u2").tobytes()).decode(),
            }
        )

    def _seen(self) -> NDArray[np.bool_]:
        return seen_from(self.vertices_mm, self.faces, self.azimuth_deg, self.elevation_deg)

    def _on_picture(self) -> Floats:
        """Corners of what is seen at first, to the right and up in the picture, (n, 2)."""
        right, up, _ = view_axes(self.azimuth_deg, self.elevation_deg)
        return self.vertices_mm[np.unique(self.faces[self._seen()])] @ np.column_stack([right, up])

    def _extent_mm(self) -> Floats:
        return np.ptp(self._on_picture(), axis=0)

    def _across_mm(self) -> float:
        """From the picture's left edge to its right one."""
        width_mm, height_mm = self._extent_mm()
        return float(max(width_mm, height_mm * STILL_PX[0] / STILL_PX[1])) / (1 - 2 * MARGIN)

    def _middle_mm(self) -> Floats:
        """What lies in the middle of the first view and about which all turns."""
        place = self._on_picture()
        right_mm, up_mm = (place.min(axis=0) + place.max(axis=0)) / 2
        right, up, toward = view_axes(self.azimuth_deg, self.elevation_deg)
        depth_mm = float((self.vertices_mm.min(axis=0) + self.vertices_mm.max(axis=0)) @ toward / 2)
        return right_mm * right + up_mm * up + depth_mm * toward


def build_turntable(run: Run, solid: Solid) -> Turntable:
    """The crack's walls and floor, a line round its mouth, and the sealant on the sample, coloured by age."""
    stays = ~run.spilled
    oldest_s = max(float(run.age_s.max(initial=0.0)), 0.1)
    fluid = fluid_surface(run.position_mm[stays], run.particle_volume_mm3, run.age_s[stays])
    ages = matplotlib.colormaps[AGES](np.clip(fluid.value / oldest_s, 0.0, 1.0))[:, :3]
    walls = _coarse(solid)
    parts = [_inside(walls), _rim(walls), (fluid.vertices_mm, fluid.faces, fluid.normal, ages)]
    before = np.cumsum([0, *(len(vertices_mm) for vertices_mm, *_ in parts)])
    vertices_mm, normal, colour = (np.vstack([part[field] for part in parts]) for field in (0, 2, 3))
    return Turntable(
        vertices_mm=vertices_mm,
        faces=np.vstack([part[1] + first for part, first in zip(parts, before, strict=False)]),
        normal=normal,
        colour=colour,
        azimuth_deg=square_on(solid) - ASIDE_DEG,
        elevation_deg=DOWN_DEG,
        oldest_s=oldest_s,
    )


Part = tuple[Floats, Integers, Floats, Floats]
"""Vertices (v, 3), faces (f, 3), normals (v, 3) and colours (v, 3)."""


@dataclass(frozen=True)
class _Walls:
    """A solid's facets with their labels."""

    vertices_mm: Floats
    faces: Integers
    label: Integers

    @property
    def inside(self) -> NDArray[np.bool_]:
        return np.isin(self.label, INSIDE)

    @property
    def rim(self) -> Integers:
        """Edges of the face that a wall shares, (n, 2), the face to their left."""
        edges = _directed_edges(self.faces[self.label == FaceLabel.TOP])
        back = _directed_edges(self.faces[self.inside])[:, ::-1]
        count = len(self.vertices_mm)
        return edges[np.isin(edges @ [count, 1], back @ [count, 1])]

    @property
    def corners(self) -> int:
        """That are drawn: no facet shares its own, and a ribbon has four."""
        return 3 * int(self.inside.sum()) + 4 * len(self.rim)


def _coarse(solid: Solid) -> _Walls:
    """As fine as can be carried: near corners become one of them, and facets between those are gone."""
    walls = _Walls(solid.vertices_mm, solid.faces, solid.face_label)
    cell_mm = FINEST * float(np.ptp(solid.vertices_mm, axis=0).max())
    while walls.corners > MOST_CORNERS:
        cells = np.round(solid.vertices_mm / cell_mm).astype(np.int64)
        _, first, cell = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        faces = first[cell.ravel()][solid.faces]
        kept = (faces != faces[:, [1, 2, 0]]).all(axis=1)
        walls = _Walls(solid.vertices_mm, faces[kept], solid.face_label[kept])
        cell_mm *= COARSER
    return walls


def _inside(walls: _Walls) -> Part:
    """The cavity's own facets, flat."""
    corner, label = walls.vertices_mm[walls.faces[walls.inside]], walls.label[walls.inside]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    size = np.linalg.norm(normal, axis=1)
    corner, label, normal = corner[size > 0], label[size > 0], normal[size > 0] / size[size > 0, None]
    colour = np.array([to_rgb(LABEL_COLOUR[each]) for each in FaceLabel])[label]
    faces = np.arange(3 * len(corner)).reshape(-1, 3)
    return corner.reshape(-1, 3), faces, np.repeat(normal, 3, axis=0), np.repeat(colour, 3, axis=0)


def _rim(walls: _Walls) -> Part:
    """A ribbon on the face along each edge between the face and a wall."""
    begin_mm, end_mm = walls.vertices_mm[walls.rim.T]
    ahead = (end_mm - begin_mm)[:, :2]
    ahead = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    onto_face = RIM_MM * np.column_stack([-ahead[:, 1], ahead[:, 0], np.zeros(len(ahead))])
    corner = np.stack([begin_mm, end_mm, end_mm + onto_face, begin_mm + onto_face], axis=1).reshape(-1, 3)
    faces = (4 * np.arange(len(ahead))[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    count = len(corner)
    return corner, faces, np.tile([0.0, 0.0, 1.0], (count, 1)), np.tile(to_rgb(ON_GROUND), (count, 1))


def _directed_edges(faces: Integers) -> Integers:
    return np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
