"""Check clicked ends, via points and regions, and describe them in messages."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from digitise.geometry.polyline import crossings, depth_inside, rectangle
from digitise.photo import Photo, in_copy
from digitise.settings import Clicks, PixelPair
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts, of_keys
from sealtwin.core.records import Floats, PathSource

# Chosen on 127 photos of benchmarks/real_roads. On the 117 of later sets, a quarter less or a third more refuses one
# more path (benchmarks.line_constants).
#
# Largest distance of a clicked point from its crack: in px, or as a fraction of the photo's longer side if that is more
SNAP_PX, SNAP_SHARE = 15.0, 0.015
MIN_REGION_PX = 32.0  # Minimum side length of a region of interest


@dataclass(frozen=True)
class CrackPath:
    """A rough path that runs along the crack, inside it."""

    points_px: Floats  # (n, 2), x and y in px, from the first end
    width_px: float  # Typical width of the crack along the path
    source: PathSource
    warnings: Facts = ()
    verdict: Mapping[str, float] = field(default_factory=dict)
    """Probability that the path follows the crack, and its inputs. Empty for a painted path."""

    @property
    def doubtful(self) -> bool:
        """True if the crack may be elsewhere, so that a width along the path would mean nothing."""
        return bool(of_keys(self.warnings, "path.doubtful"))

    def in_copy(self, factor: int) -> "CrackPath":
        """Return the path in pixels of ``photo.smaller``, which is ``factor`` times smaller."""
        return replace(self, points_px=in_copy(self.points_px, factor), width_px=self.width_px / factor)


IF_LIGHTER = (
    "if the crack is lighter than the ground, for example because of a filling or a light crust, paint it in "
    "photo.mask, and give ends_px on the paint"
)


def listed(points_px: Floats) -> str:
    """Return points as text, for example "(10, 20) to (30, 40)"."""
    return " to ".join(f"({x:.0f}, {y:.0f})" for x, y in points_px)


def snap_px(photo: Photo) -> float:
    """Return the largest allowed distance of a clicked point from its crack, in px.

    On a screen that shows the whole photo, this distance is the same for all large photos.
    """
    return max(SNAP_PX, SNAP_SHARE * max(photo.size_px))


def too_far(away_px: float, most_px: float) -> str:
    """Return the text "D px away (at most L)" for a distance D that exceeds the limit L.

    D is rounded up, and L down.
    """
    return f"{np.ceil(away_px):.0f} px away (at most {np.floor(most_px):.0f})"


def check_hints(photo: Photo, ends_px: PixelPair, via_px: Clicks = ()) -> None:
    """Raise InputError if a point is outside the photo or the face, or if the two ends are too close together."""
    points_px, names = np.array([*ends_px, *via_px], float), ["end", "end", *("via point" for _ in via_px)]
    width, height = photo.size_px
    for name, point_px in zip(names, points_px, strict=True):
        if photo.depth_px(point_px) < 0:
            raise InputError(
                f"{photo.file}: the {name} {listed(point_px[None])} is outside the photo of {width} x {height} px. x "
                "counts from the left and y from the top."
            )
    apart_px, most_px = float(np.linalg.norm(np.subtract(*ends_px))), snap_px(photo)
    if apart_px < most_px:
        raise InputError(
            f"{photo.file}: the two ends {listed(np.array(ends_px))} px are only {apart_px:.2g} px apart. A click may "
            f"be up to {most_px:.0f} px off its crack, so the ends must be at least that far apart. Check ends_px."
        )
    if photo.face_mm is None:
        return
    for name, point_px in zip(names, points_px, strict=True):
        outside_mm = -float(depth_inside(photo.to_mm(point_px), photo.face_mm))
        if outside_mm > most_px * photo.mm_per_px:
            raise InputError(
                f"{photo.file}: the {name} {listed(point_px[None])} is {outside_mm:.1f} mm outside the face. Give the "
                "point where the crack meets the face's edge. Check that width and height of face_mm, and x and y of "
                "the point, are not exchanged."
            )


def region_px(photo: Photo, roi_px: Clicks) -> Floats:
    """Return the corners of the region of interest in px, (n, 2).

    Raises InputError if the region is too small or its sides cross.
    """
    corners = np.array(roi_px, float)
    if len(corners) == 2:
        (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
        corners = rectangle((left, top, right, bottom))
    if crossed := crossings(corners, closed=True):
        sides = [listed(corners[[side, (side + 1) % len(corners)]]) for side in crossed[0]]
        raise InputError(
            f"{photo.file}: roi_px crosses itself: the side {sides[0]} px crosses the side {sides[1]} px. Give the "
            "corners in order around the region."
        )
    low = np.maximum(corners.min(axis=0), 0)
    high = np.minimum(corners.max(axis=0), np.array(photo.size_px) - 1)
    if np.any(high - low < MIN_REGION_PX):
        width, height = photo.size_px
        raise InputError(
            f"{photo.file}: roi_px covers {max(high[0] - low[0], 0):.0f} x {max(high[1] - low[1], 0):.0f} px of the "
            f"photo of {width} x {height} px. Each side needs at least {MIN_REGION_PX:g} px. Give two opposite "
            "corners of a box, or the corners of a polygon, in px."
        )
    return corners
