"""The darkest way between clicked points, quickly: the photo's search map is made once, each click only walks on it."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from digitise.finding.crack_path import CrackPath
from digitise.finding.darkness import DarkMap, map_darkness
from digitise.finding.hints import check_hints, region_px
from digitise.finding.lines import support
from digitise.finding.way import Way, leg_margin
from digitise.photo import Photo
from digitise.pictures.raster import Map
from digitise.settings import Pixel
from sealtwin.records import Floats


class LiveWire:
    """Paths along a photo's crack between clicked points.

    Made once for a photo, which is the slow part; safe to ask from several threads.
    """

    def __init__(
        self, photo: Photo, roi_px: tuple[Pixel, ...] | None = None, seen_face_px: Floats | None = None
    ) -> None:
        """``roi_px`` and ``seen_face_px`` bound where paths run. Raises InputError where ``roi_px`` is no region."""
        self._photo = photo
        self.field: DarkMap = map_darkness(photo, None if roi_px is None else region_px(photo, roi_px), seen_face_px)

    def path(self, ends_px: tuple[Pixel, Pixel], via_px: tuple[Pixel, ...] = ()) -> CrackPath:
        """From the first end to the second, past every via point in turn.

        Raises InputError where a point is outside the photo or on no crack, where the crack is broken between them, or
        where the path would have to come back on itself to reach the next point.
        """
        check_hints(self._photo, ends_px, via_px)
        points_px = np.array([ends_px[0], *via_px, ends_px[1]], dtype=float)
        left, top, right, bottom = self._window(points_px)
        field = self.field.window(left, top, right, bottom)
        way = Way(self._photo, field, points_px, lambda: self.support[top:bottom, left:right])
        return replace(way.found(), source="via" if via_px else "ends")

    @cached_property
    def support(self) -> Map:
        """How line-like the best way through each cell is: slow, and asked for in doubt only."""
        return support(self.field.even, self.field.allowed)

    def _window(self, points_px: Floats) -> tuple[int, int, int, int]:
        """Left, top, right, bottom of the cells where a path between the points may run; the last two excluded."""
        work = self.field.to_work(points_px)
        apart = np.linalg.norm(np.diff(work, axis=0), axis=1)
        margin = leg_margin(float(apart.max()), self.field.scale) + 1
        height, width = self.field.dark.shape
        left, top = np.clip(np.floor(work.min(axis=0)) - margin, 0, (width - 1, height - 1)).astype(int).tolist()
        right, bottom = np.clip(np.ceil(work.max(axis=0)) + margin, 0, (width - 1, height - 1)).astype(int).tolist()
        return left, top, right + 1, bottom + 1
