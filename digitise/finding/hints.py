"""Refuse ends, points between them and regions that no crack in a photo can have."""

import numpy as np

from digitise.finding.crack_path import listed
from digitise.geometry.polyline import crossings, depth_inside
from digitise.photo import Photo
from digitise.settings import Pixel
from sealtwin.errors import InputError
from sealtwin.records import Floats

SNAP_PX = 15.0
"""How far a point may be clicked beside its crack, in the photo; or one crack width, if that is more."""
LEAST_REGION_PX = 32.0
"""Sides of a region of interest: in a smaller one there is no crack of any length."""


def check_hints(photo: Photo, ends_px: tuple[Pixel, Pixel], via_px: tuple[Pixel, ...] = ()) -> None:
    """Raises InputError where a point is outside the photo or the face, or neighbours are too close together."""
    named = [("end", point) for point in ends_px] + [("via point", point) for point in via_px]
    width, height = photo.size_px
    for name, (x, y) in named:
        if not (0 <= x <= width - 1 and 0 <= y <= height - 1):
            raise InputError(
                f"{photo.file}: the {name} ({x:g}, {y:g}) lies outside the photo of {width} x {height} px; "
                "x runs right and y down, from 0."
            )
    _check_apart(photo, ends_px, via_px)
    if photo.face_mm is None:
        return
    outside_mm = -depth_inside(photo.to_mm(np.array([point for _, point in named])), photo.face_mm)
    for (name, (x, y)), beside_mm in zip(named, outside_mm, strict=True):
        if beside_mm > SNAP_PX * photo.mm_per_px:
            raise InputError(
                f"{photo.file}: the {name} ({x:g}, {y:g}) lies {beside_mm:.1f} mm outside the face; "
                "give the place where the crack meets its edge."
            )


def _check_apart(photo: Photo, ends_px: tuple[Pixel, Pixel], via_px: tuple[Pixel, ...]) -> None:
    apart_px = float(np.linalg.norm(np.subtract(*ends_px)))
    if apart_px < SNAP_PX:
        found = "the same place" if apart_px == 0 else f"only {apart_px:.2g} px apart"
        raise InputError(
            f"{photo.file}: the two ends {listed(np.array(ends_px))} px are {found}; an end may be clicked "
            f"{SNAP_PX:g} px beside its crack, so they must be farther apart than that. Check ends_px."
        )


def region_px(photo: Photo, roi_px: tuple[Pixel, ...]) -> Floats:
    """Corners of the region of interest, (n, 2): of a box, where two opposite ones are given.

    Raises InputError where it holds too little of the photo, or its sides cross.
    """
    corners = np.array(roi_px, dtype=float)
    if len(corners) == 2:
        (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
        corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    if crossed := crossings(corners, closed=True):
        sides = [listed(corners[[side, (side + 1) % len(corners)]]) for side in crossed[0]]
        raise InputError(
            f"{photo.file}: roi_px crosses itself: its side {sides[0]} and its side {sides[1]} px; give its corners in "
            "the order in which they go round."
        )
    low = np.maximum(corners.min(axis=0), 0)
    high = np.minimum(corners.max(axis=0), np.array(photo.size_px) - 1)
    if np.any(high - low < LEAST_REGION_PX):
        width, height = photo.size_px
        raise InputError(
            f"{photo.file}: roi_px holds {max(high[0] - low[0], 0):.0f} x {max(high[1] - low[1], 0):.0f} px of the "
            f"photo of {width} x {height} px; each side needs {LEAST_REGION_PX:g}. Give two opposite corners of a box, "
            "or the corners of a polygon, in px."
        )
    return corners
