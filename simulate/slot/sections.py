"""Sections of a crack square to its centreline: the area below a level, and the length of walls that drag the paste.

A section is a trapezoid from floor to face. Paste above the face is over the mouth, and slumps to both sides as far as
its yield stress tau allows. If the paste is e above the face, a slump is e^2 rho g / (2 tau) wide and has the shape of
a parabola.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sealtwin.core.arrays import midpoints
from sealtwin.core.records import Floats, Outline, Solid

NARROWEST_MM = 0.05  # Smallest width of a section whose walls meet, so that every area has a depth
ROUND_CORNERS = 4 - np.pi
"""Area of unmoved paste in the four square corners of a section and its mirror image, divided by the square of the
corners' radius: a square of side 2, minus its inscribed circle."""
INVERTED, ROUNDING_MM = 20, 1e-9  # Newton steps for a level above the face: largest number, and size of the last step


@dataclass(frozen=True)
class Trapezoids:
    """Sections at the middles of equal cells along a crack. Arrays are (n,)."""

    s_mm: Floats
    floor_mm: Floats
    """Width of the floor."""
    mouth_mm: Floats
    depth_mm: Floats
    slant: Floats
    """Length of both walls together, divided by their height. It is 2 if both walls are upright."""
    bottom_mm: Floats
    """Level of the floor, or of the line at which converging walls meet."""
    reach_per_mm: float
    """Width of a slump on one side, divided by the square of its height: rho g / (2 tau) in 1/mm."""
    reach_mm: float
    """Largest width of a slump on one side."""

    @property
    def step_mm(self) -> float:
        return float(self.s_mm[1] - self.s_mm[0])

    @cached_property
    def opening(self) -> Floats:
        """Increase of the width per millimetre of height, (n,)."""
        return (self.mouth_mm - self.floor_mm) / self.depth_mm

    @cached_property
    def full_mm2(self) -> Floats:
        """Area from floor to face."""
        return (self.floor_mm + self.mouth_mm) / 2 * self.depth_mm

    def area_mm2(self, height_mm: Floats) -> tuple[Floats, Floats]:
        """Return the area below each height above the floor, and the width at this height, (n,) each.

        Heights below 0 are allowed, because Newton steps may try them.
        """
        inside_mm = np.minimum(np.maximum(height_mm, 0.0), self.depth_mm)
        width_mm = self.floor_mm + self.opening * inside_mm
        over_mm = np.maximum(height_mm - self.depth_mm, 0.0)
        beside_mm, grows = self._slump(over_mm)
        area_mm2 = (self.floor_mm + width_mm) / 2 * inside_mm + np.minimum(height_mm, 0.0) * self.floor_mm
        return area_mm2 + self.mouth_mm * over_mm + beside_mm, width_mm + grows

    def _slump(self, over_mm: Floats) -> tuple[Floats, Floats]:
        """Return the area of both slumps beside the mouth, and its derivative with respect to the height, (n,) each."""
        free_mm = self.reach_per_mm * over_mm**2
        bound = free_mm > self.reach_mm
        if not bound.any():
            return 4 / 3 * free_mm * over_mm, 4 * free_mm
        # If a slump has reached the largest width, only its height increases.
        edge_mm = np.sqrt(self.reach_mm / self.reach_per_mm)
        risen_mm = np.maximum(over_mm - edge_mm, 0.0)
        within_mm = np.minimum(over_mm, edge_mm)
        area_mm2 = 4 / 3 * self.reach_per_mm * within_mm**3 + 2 * self.reach_mm * risen_mm
        return area_mm2, np.where(bound, 2 * self.reach_mm, 4 * free_mm)

    def height_mm(self, area_mm2: Floats) -> Floats:
        """Return the height to which each section is filled by an area."""
        opening, floor_mm = self.opening, self.floor_mm
        inside_mm2 = np.clip(area_mm2, 0.0, self.full_mm2)
        # This form of the root has no difference of nearly equal numbers, and is also valid for upright walls.
        height_mm = 2 * inside_mm2 / (floor_mm + np.sqrt(np.maximum(floor_mm**2 + 2 * opening * inside_mm2, 0.0)))
        height_mm += np.minimum(area_mm2, 0.0) / floor_mm
        over = area_mm2 > self.full_mm2
        if over.any():
            height_mm = np.where(over, self.depth_mm + (area_mm2 - self.full_mm2) / self.mouth_mm, height_mm)
            # The area is a convex function of the height, so Newton steps from above never go beyond the root.
            for _ in range(INVERTED):
                there_mm2, width_mm = self.area_mm2(height_mm)
                change_mm = np.where(over, (there_mm2 - area_mm2) / width_mm, 0.0)
                height_mm = height_mm - change_mm
                if np.abs(change_mm).max() < ROUNDING_MM:
                    break
        return height_mm

    def wetted_mm(self, height_mm: Floats) -> Floats:
        """Return the length of floor and walls below a height, (n,). Paste above the mouth is not dragged."""
        return self.floor_mm + self.slant * np.minimum(np.maximum(height_mm, 0.0), self.depth_mm)

    @staticmethod
    def holding_mm(area_mm2: Floats, wetted_mm: Floats) -> Floats:
        """Return the ratio of area to perimeter of the plug that begins to move first, in mm, (n,).

        It is the largest such ratio of any part of the section together with its mirror image at the free surface
        (Mosolov and Miasnikov 1965). The plug is this section with its corners, assumed to be right angles, rounded by
        a radius equal to the ratio.
        """
        half_mm = np.sqrt(np.maximum(wetted_mm**2 - 2 * ROUND_CORNERS * area_mm2, 0.0))
        return 2 * area_mm2 / (wetted_mm + half_mm)


def sections_of(outline: Outline, solid: Solid, cells: int, *, reach_per_mm: float) -> Trapezoids:
    """Return the sections of equal cells, from the traced walls, the depth and the areas of the solid's sections.

    A trapezoid has the area of its section and one of its widths: the floor's if the walls flare, and the mouth's
    otherwise. If walls meet above the floor, the section ends at the line where they meet.
    """
    s_mm = (np.arange(cells) + 0.5) * outline.length_mm / cells
    width_mm = np.maximum(_means(s_mm, outline.s_mm, outline.width_mm), NARROWEST_MM)
    area_mm2 = _means(s_mm, solid.sections.s_mm, solid.sections.area_mm2)
    depth_mm = _means(s_mm, solid.sections.s_mm, solid.sections.depth_mm)
    area_mm2 = np.maximum(area_mm2, NARROWEST_MM * depth_mm)
    if solid.tilting.floor_traced:
        floor_mm = np.minimum(width_mm, area_mm2 / depth_mm)
        mouth_mm = 2 * area_mm2 / depth_mm - floor_mm
    else:
        closes_mm = np.minimum(depth_mm, 2 * area_mm2 / (width_mm + NARROWEST_MM))
        mouth_mm, depth_mm = width_mm, closes_mm
        floor_mm = np.maximum(2 * area_mm2 / depth_mm - mouth_mm, NARROWEST_MM)
    if solid.tilt == "modelled":
        slant = 2 * np.hypot(1.0, (mouth_mm - floor_mm) / 2 / depth_mm)
    else:
        slant = np.full(cells, (1 / np.cos(np.radians(solid.wall_angles_deg))).sum())
    x_min, y_min, x_max, y_max = solid.block_mm
    reach_mm = max(0.0, (min(x_max - x_min, y_max - y_min) - float(mouth_mm.mean())) / 2)
    return Trapezoids(s_mm, floor_mm, mouth_mm, depth_mm, slant, -depth_mm, reach_per_mm, reach_mm)


def _means(s_mm: Floats, known_mm: Floats, values: Floats) -> Floats:
    """Return the means of ``values`` over cells around ``s_mm``, (n,). Values are linear between ``known_mm``."""
    half_mm = (s_mm[1] - s_mm[0]) / 2
    edges_mm = np.append(s_mm - half_mm, s_mm[-1] + half_mm)
    grid_mm = np.unique(np.concatenate([edges_mm, known_mm.clip(edges_mm[0], edges_mm[-1])]))
    on_grid = np.interp(grid_mm, known_mm, values)
    sums = np.cumulative_sum(midpoints(on_grid) * np.diff(grid_mm), include_initial=True)
    return np.diff(np.interp(edges_mm, grid_mm, sums)) / np.diff(edges_mm)
