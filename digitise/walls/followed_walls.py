"""Measure islands, side cracks and walls along a path, before a user's lines change them.

Each part is measured when it is first used, so that a stroke on the trace page costs only its own work.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

from digitise.crack_path.hints import CrackPath
from digitise.photo import Photo
from digitise.walls.centreline_and_walls import MIN_WIDTH_PX, TooThinError, WallsMissingError, trace
from digitise.walls.dark_region import trace_dark_region
from digitise.walls.ends import Traced
from digitise.walls.islands_and_side_cracks import Surroundings, find_surroundings, photo_of_paint
from sealtwin.core.errors import InputError

RIM = 0.5  # Share of the contrast at the rim of the paint, whatever its blur


@dataclass(frozen=True, eq=False)
class FollowedWalls:
    """Islands, side cracks and walls along a path. The photo of a painted path is its paint, dark on bright."""

    photo: Photo
    path: CrackPath
    edge_fraction: float
    least_px: float = MIN_WIDTH_PX

    def traced(self, insisted: bool) -> Traced:
        """Return the main crack by its walls or, on ground too coarse to follow them, by its dark region.

        Raises WallsMissingError if neither is found and nobody ``insisted``, and TooThinError if blur would decide its
        width.
        """
        if insisted and isinstance(self._followed, WallsMissingError):
            return self._region(insisted=True)
        if isinstance(self._followed, InputError):
            raise self._followed
        return self._followed

    @cached_property
    def around(self) -> Surroundings:
        return find_surroundings(self._shown, self.path, self._wall_share)

    @property
    def _wall_share(self) -> float:
        return RIM if self.path.source == "mask" else self.edge_fraction

    @cached_property
    def _shown(self) -> Photo:
        return photo_of_paint(self.photo, self.path) if self.path.source == "mask" else self.photo

    @cached_property
    def _followed(self) -> Traced | WallsMissingError | TooThinError:
        try:
            return trace(self._shown, self.path, self._wall_share, self.around.hidden, self.least_px)
        except TooThinError as fault:
            return fault
        except WallsMissingError as unclear:
            try:
                return self._region(insisted=False)
            except InputError as neither:
                why = str(neither).removeprefix(f"{self.photo.file}: ")
                return WallsMissingError(f"{unclear} A second way was tried: {why}")

    def _region(self, insisted: bool) -> Traced:
        return trace_dark_region(self._shown, self.path, self._wall_share, self.around.hidden, insisted)


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
