"""Straighten the photo along a line: sample the brightness on rays across it."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import Box, depth_inside, left_normals, nearest_side, places_beside, tangents
from digitise.image.raster import Map, blurred, sampled
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats

SPREAD = 0.6  # Crack widths to each side of the line within which rays do not meet
MOST_OBLIQUE = 8.0  # Greatest cotangent of the angle to the edge, 7 degrees, at which rays follow it
BLUR_PX = 0.8  # Gaussian sigma of the brightness before it is sampled, which quiets grain and keeps a straight edge
RIM_PX = 8  # Margin of a patch: the softening reaches four of its sigmas
EDGE_PX = 1.5  # Distance from the edge of the face within which brightness mixes with that of the surroundings
FINEST_PX, COARSEST_PX = 0.5, 1.5  # Bounds on the spacing of samples across, px of the photo: a blurred edge is 3
LEAST_WIDTH_PX = 6.0  # Least width of a crack to begin with
SAMPLES = 48  # Samples across one crack width; more cost time and show nothing


@dataclass(frozen=True)
class Crossing:
    """Place where a line meets the edge of the face."""

    s_mm: float
    inward: Floats  # Unit normal of that edge, onto the face


Crossings = tuple[Crossing | None, Crossing | None]  # Crossings at the first end and at the last, where these are open


def edge_crossings(line_mm: Floats, face_mm: Box) -> Crossings:
    """Return the crossings nearest to the line's middle, before it and after it; None if there is none."""
    s_mm, depth_mm, crossings = arc_length(line_mm), depth_inside(line_mm, face_mm), list[Crossing | None]()
    outside, middle = np.flatnonzero(depth_mm < 0), len(line_mm) // 2
    for beyond, step in ((outside[outside < middle][::-1], 1), (outside[outside > middle], -1)):
        if len(beyond) == 0 or depth_mm[middle] < 0:
            crossings.append(None)
            continue
        inner, out = beyond[0] + step, beyond[0]
        fraction = depth_mm[inner] / (depth_mm[inner] - depth_mm[out])
        place_mm = line_mm[inner] + fraction * (line_mm[out] - line_mm[inner])
        inward = np.array([[1, 0], [0, 1], [-1, 0], [0, -1.0]])[nearest_side(place_mm, face_mm)]
        crossings.append(Crossing(float(s_mm[inner] + fraction * (s_mm[out] - s_mm[inner])), inward))
    return crossings[0], crossings[1]


def rays_across(line_mm: Floats, width_mm: float, crossings: Crossings) -> Floats:
    """Return rays to the left of a line, (n, 2), that reach 1 mm square to it. At open ends they follow the edge."""
    s_mm, along, normal = arc_length(line_mm), tangents(line_mm), left_normals(line_mm)
    shear, turned = np.zeros((2, len(line_mm)))
    for crossing in crossings:
        if crossing is None:
            continue
        sine = along @ crossing.inward
        sine = np.copysign(np.maximum(np.abs(sine), 1e-6), sine)
        to_edge = np.clip(-(normal @ crossing.inward) / sine, -MOST_OBLIQUE, MOST_OBLIQUE)
        oblique = abs(float(np.interp(crossing.s_mm, s_mm, to_edge)))
        # The edge cuts off a normal's wall within half a width times the cotangent. The rays turn back over more than
        # as much again, so that they do not meet within the crack.
        reaches = np.abs(s_mm - crossing.s_mm) / max(SPREAD * width_mm * oblique, 1e-9)
        share = np.clip(2 - reaches, 0, 1)
        shear, turned = shear + share * to_edge, turned + share
    return normal + (shear / np.maximum(turned, 1))[:, None] * along


@dataclass(frozen=True)
class Patch:
    """A window of the photo. Places are (..., 2)."""

    offset_px: tuple[int, int]  # The window's first pixel in the photo: x, y
    soft: Map  # Brightness, blurred by ``BLUR_PX``
    clear: NDArray[np.uint8]  # 255 outside markers and hidden pixels, 0 on them
    face_mm: Box | None
    mm_per_px: float

    def light(self, places_px: Floats) -> Floats:
        """Brightness at each place. Beyond the patch it is that of the patch's border."""
        return sampled(self.soft, places_px - self.offset_px, cv2.INTER_CUBIC).astype(float)

    def on_sample(self, places_px: Floats, places_mm: Floats) -> NDArray[np.bool_]:
        """Return True for places, given in both units, that show the sample and nothing else."""
        shown = sampled(self.clear, places_px - self.offset_px, beyond=cv2.BORDER_CONSTANT) >= 254
        if self.face_mm is None:
            return shown
        return shown & (depth_inside(places_mm, self.face_mm) >= EDGE_PX * self.mm_per_px)


def patch_around(photo: Photo, points_px: Floats, reach_px: float, hidden: NDArray[np.uint8] | None = None) -> Patch:
    """Return the part of the photo around some points, ``reach_px`` larger than their box on every side.

    Pixels that are ``hidden``, as markers are, do not count as sample.
    """
    margin = reach_px + RIM_PX
    left, top = np.maximum(np.floor(points_px.min(axis=0) - margin), 0).astype(int)
    right, bottom = np.minimum(np.ceil(points_px.max(axis=0) + margin) + 1, photo.size_px).astype(int)
    soft = blurred(photo.brightness[top:bottom, left:right], BLUR_PX)
    clear = np.full(soft.shape, 255, np.uint8) if hidden is None else 255 - hidden[top:bottom, left:right]
    offset_px = int(left), int(top)
    photo.blank_markers(clear, offset_px)
    return Patch(offset_px, soft, clear, photo.face_mm, photo.mm_per_px)


@dataclass(frozen=True)
class Strip:
    """Brightness on both sides of a line, (stations, offsets)."""

    line_mm: Floats
    ray: Floats  # Rays to the left, (stations, 2), that reach 1 mm square to the line
    offset_mm: Floats  # Evenly spaced distances square to the line, positive to the left, 0 in the middle
    light: Floats
    valid: NDArray[np.bool_]  # Samples on the face and in the photo
    mm_per_px: float

    @property
    def sample_px(self) -> float:
        """Spacing of samples across."""
        return float(self.offset_mm[1] - self.offset_mm[0]) / self.mm_per_px

    @property
    def station_px(self) -> float:
        """Spacing of stations along."""
        return float(arc_length(self.line_mm)[-1]) / (len(self.line_mm) - 1) / self.mm_per_px

    @property
    def middle(self) -> int:
        """Column of the line itself."""
        return len(self.offset_mm) // 2

    def places_mm(self, offset_mm: Floats) -> Floats:
        """Return the place at a distance on each ray, (stations, 2)."""
        return self.line_mm + offset_mm[:, None] * self.ray


def straighten(photo: Photo, patch: Patch, line_mm: Floats, ray: Floats, step_mm: float, reach_mm: float) -> Strip:
    """Sample the photo every ``step_mm`` up to ``reach_mm`` to either side of the line."""
    count = int(np.ceil(reach_mm / step_mm))
    offset_mm = np.arange(-count, count + 1.0) * step_mm
    place_mm = places_beside(line_mm, offset_mm, ray)
    place_px = photo.to_px(place_mm.reshape(-1, 2)).reshape(place_mm.shape)
    return Strip(line_mm, ray, offset_mm, patch.light(place_px), patch.on_sample(place_px, place_mm), photo.mm_per_px)


def sample_step_mm(width_mm: float, mm_per_px: float) -> float:
    """Spacing of samples across a crack about ``width_mm`` wide."""
    return float(np.clip(width_mm / SAMPLES, FINEST_PX * mm_per_px, COARSEST_PX * mm_per_px))
