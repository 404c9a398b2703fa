"""Measure islands, side cracks and walls along a path, before strokes and lines drawn by hand change them.

Each part is measured when it is first used, so that a stroke on the trace page costs only its own work.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from digitise.crack_path.hints import CrackPath
from digitise.photo import Photo, in_copy, smaller
from digitise.walls.centreline_and_walls import TooThinError, Traced, WallsMissingError
from digitise.walls.dark_region import trace_dark_region
from digitise.walls.islands import RetouchedPhoto, find_islands, photo_of_paint
from digitise.walls.mouths import SideRings, trace_past_mouths
from digitise.walls.side_cracks import SideCracks, find_side_cracks
from digitise.walls.stretches import MIN_WIDTH_PX
from sealtwin.core.records import Floats

RIM = 0.5  # Share of the contrast at the rim of the paint, whatever its blur
GLANCE_WIDTH_PX = 2 * MIN_WIDTH_PX  # Width of the crack in the smaller copy: walls are within 0.1 mm of the final ones


@dataclass(frozen=True, eq=False)
class FollowedWalls:
    """Islands, side cracks and walls along a path, which may be painted."""

    photo: Photo
    path: CrackPath
    edge_fraction: float

    def main(self, insisted: bool) -> tuple[Traced, SideRings]:
        """Return the main crack and the rims of its side cracks.

        Raises WallsMissingError if its walls are not found, and TooThinError if blur would decide its width. If
        ``insisted``, it is then the dark region along the path, without side cracks.
        """
        if not isinstance(self._followed, Exception):
            return self._followed
        if insisted:
            return self._region, ((),) * len(self.sides.lines)
        raise self._followed

    @property
    def islands_mm(self) -> tuple[Floats, ...]:
        return self._islands[0]

    @cached_property
    def sides(self) -> SideCracks:
        return find_side_cracks(self._islands[1], self.path, self._wall_share)

    @cached_property
    def glanced(self) -> "FollowedWalls | None":
        """The same in a smaller copy of the photo; None for a crack that is narrow or painted."""
        if self.path.width_px < 2 * GLANCE_WIDTH_PX or self.photo.drawn is not None:
            return None
        factor = 2 ** int(np.log2(self.path.width_px / GLANCE_WIDTH_PX))
        points_px = in_copy(self.path.points_px, factor)
        narrow = replace(self.path, points_px=points_px, width_px=self.path.width_px / factor)
        return FollowedWalls(smaller(self.photo, factor), narrow, self.edge_fraction)

    @property
    def _wall_share(self) -> float:
        return RIM if self.path.source == "mask" else self.edge_fraction

    @cached_property
    def _islands(self) -> tuple[tuple[Floats, ...], RetouchedPhoto]:
        """Return the islands, and the photo without them."""
        painted = self.path.source == "mask"
        shown = photo_of_paint(self.photo, self.path) if painted else self.photo
        return find_islands(shown, self.path, self._wall_share)

    @cached_property
    def _followed(self) -> tuple[Traced, SideRings] | WallsMissingError | TooThinError:
        try:
            return trace_past_mouths(self._islands[1], self.path, self.sides)
        except (WallsMissingError, TooThinError) as fault:
            return fault

    @cached_property
    def _region(self) -> Traced:
        return trace_dark_region(self.photo, self.path, self._wall_share, insisted=True)


Follow = Callable[[Photo, CrackPath, float], FollowedWalls]


@dataclass
class LastWalls:
    """Remembers the walls along the last path of a photo."""

    _last: FollowedWalls | None = field(default=None, init=False)

    def along(self, photo: Photo, path: CrackPath, edge_fraction: float) -> FollowedWalls:
        last = self._last
        if last is None or last.photo is not photo or last.path is not path or last.edge_fraction != edge_fraction:
            last = self._last = FollowedWalls(photo, path, edge_fraction)
        return last
