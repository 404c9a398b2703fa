"""Find the outline of paste in a photo on the printed marker sheet, and area, mean radius and roundness of a blob."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.geometry.polyline import rectangle
from digitise.image.raster import Map, blurred, sampled
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Floats

RAYS = 360  # Rays from the middle along which the edge is searched
STEP_PX = 0.5
REACH = 0.12  # Range around the rough edge in which the exact one is searched, over the blob's radius
LEAST_RADIUS_PX = 40.0  # Below it half a pixel of the edge is over 6 % of the yield stress
LEAST_CONTRAST = 0.06  # Least change of light across the edge, over the sheet's light: blurred grain has a fifth of it
MOST_UNROUND = 0.10  # Largest RMS deviation over the mean radius; more means a sloped plate or a cone pulled aside
LEAST_SEEN, LEAST_SEEN_LONG = 0.8, 0.95
"""Smallest share of rays on which the edge must be found, first for a blob, then for a bead.

A hidden part of a round edge can be interpolated, but the end of a bead cannot."""
EDGE_PX = 0.5  # Standard uncertainty of the edge all around: paste ends in its blur, or on its wet rim


@dataclass(frozen=True)
class SpreadBlob:
    """A round blob in plan view."""

    radius_mm: float  # Radius of the circle of equal area
    radius_error_mm: float  # Standard uncertainty: scale, edge and shape
    unround: float  # Standard deviation of the outline's distance from the middle, over its mean
    diameters_mm: tuple[float, float]  # Least and largest distance of two parallel lines that touch it on both sides
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Rough:
    """Rough shape of the paste: a capsule. Rays from its spine find the edge. The spine of a round blob is a point."""

    middle_px: Floats
    half_spine_px: Floats  # From the middle to the spine's end, (2,)
    radius_px: float
    dark: bool  # True if darker than the sheet

    def rays(self) -> tuple[Floats, Floats]:
        """Return the start of each ray on the spine, and its direction, (RAYS, 2) each."""
        turn = 2 * np.pi * np.arange(RAYS) / RAYS
        rays = np.column_stack([np.cos(turn), np.sin(turn)])
        half = float(np.linalg.norm(self.half_spine_px))
        if half == 0:
            return np.tile(self.middle_px, (RAYS, 1)), rays
        # At even steps around the capsule, from the middle of its right side.
        side, cap = 2 * half, np.pi * self.radius_px
        at = (np.arange(RAYS) + 0.5) / RAYS * 2 * (side + cap)
        turn = np.pi * np.clip((at - half) / cap, 0, 1) + np.pi * np.clip((at - 1.5 * side - cap) / cap, 0, 1)
        along = half * np.interp(at, np.cumsum([0, half, cap, side, cap, half]), [0, 1, 1, -1, -1, 0])
        forth = self.half_spine_px / half
        right = np.array([forth[1], -forth[0]])
        ways = np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * forth
        return self.middle_px + along[:, None] * forth, ways


def measure_spread(settings: PhotoInput, folder: Path) -> SpreadBlob:
    """Find the blob inside the frame of markers and measure it. Raises InputError if there is no round one."""
    return _measured(*paste_edge(settings, folder, long=False))


def paste_edge(settings: PhotoInput, folder: Path, *, long: bool) -> tuple[Photo, Floats]:
    """Return the photo, and the outline of the paste between the markers, (RAYS, 2) in px.

    ``long`` paste is a bead. Raises InputError if no edge is found.
    """
    photo = load_photo(settings, folder)
    if photo.scale_uncertainty is None:
        raise InputError(
            f"{photo.file}: a photo of paste must have its scale from printed markers; give the table of the printed "
            "sheet."
        )
    if settings.markers is not None and settings.face_mm is not None:
        width_mm, height_mm = settings.face_mm
        for marker in settings.markers.markers:
            if 0 < marker.x_mm < width_mm and 0 < marker.y_mm < height_mm:
                raise InputError(
                    f"{photo.file}: face_mm is {width_mm:g} x {height_mm:g}, but marker {marker.id} of the table is "
                    f"inside it, at {marker.x_mm:g}, {marker.y_mm:g} mm: give the size of the opening."
                )
    inside = _opening(photo)
    light = _levelled(photo.brightness, inside)
    return photo, _edge(light, _rough(light, inside, photo.file, long), inside, photo.file)


def _opening(photo: Photo) -> NDArray[np.bool_]:
    """Return the mask of the sheet's free field, which is the opening of the frame less a margin."""
    face_mm = present(photo.face_mm, "the face of a marker sheet")
    ring = np.round(photo.to_px(rectangle(face_mm))).astype(np.int32)
    mask = np.zeros(photo.brightness.shape, dtype=np.uint8)
    cv2.fillPoly(mask, [ring], 1)
    # The cutting line is just inside the opening.
    margin = max(3, round(1.0 / photo.mm_per_px))
    kernel = np.ones((2 * margin + 1,) * 2, np.uint8)
    inside = cv2.erode(mask, kernel, borderType=cv2.BORDER_CONSTANT, borderValue=0) > 0
    if inside.sum() < (2 * LEAST_RADIUS_PX) ** 2:
        raise InputError(
            f"{photo.file}: the field between the markers is too small in the photo; move the camera closer."
        )
    return inside


def _levelled(brightness: Map, inside: NDArray[np.bool_]) -> Map:
    """Divide by the light on the sheet. The logarithm of that light is a plane, fitted to the rim of the field."""
    distance = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, 3)
    rim = inside & (distance < 0.06 * float(distance.max()) + 2)
    y, x = np.nonzero(rim)
    light = np.log(np.maximum(blurred(brightness, 1.0)[rim], 1e-4)).astype(float)
    height, width = brightness.shape
    axes = np.column_stack([np.ones(len(x)), x / width, y / height])
    inliers, plane = np.ones(len(x), dtype=bool), np.zeros(3)
    for _ in range(4):
        plane = np.linalg.lstsq(axes[inliers], light[inliers], rcond=None)[0]
        miss = light - axes @ plane
        inliers = np.abs(miss) <= max(0.02, 2.5 * float(np.median(np.abs(miss))))
    rows, columns = np.mgrid[0:height, 0:width]
    return np.asarray(brightness / np.exp(plane[0] + plane[1] * columns / width + plane[2] * rows / height), np.float32)


def _rough(light: Map, inside: NDArray[np.bool_], file: Path, long: bool) -> Rough:
    """Return the largest blob unlike the sheet or, if ``long``, the capsule with its area and second moment."""
    soft = blurred(light, 2.0)
    best: tuple[float, NDArray[np.bool_], bool] | None = None
    for dark in (True, False):
        values = (1 - soft if dark else soft - 1)[inside]
        high = float(np.quantile(values, 0.99))
        if high < LEAST_CONTRAST:
            continue
        blob = (((1 - soft if dark else soft - 1) > high / 2) & inside).astype(np.uint8)
        opened = cv2.morphologyEx(blob, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
        blob = _filled(np.asarray(opened, np.uint8))
        count, labels, stats, _ = cv2.connectedComponentsWithStats(blob)
        if count < 2:
            continue
        largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
        area = float(stats[largest, cv2.CC_STAT_AREA])
        if best is None or area > best[0]:
            best = area, np.asarray(labels) == largest, dark
    if best is None:
        raise InputError(
            f"{file}: no blob stands out between the markers: take the photo in even light, with paste that is darker "
            "or lighter than the sheet, or put a coloured film under it."
        )
    area, blob, dark = best
    places = np.argwhere(blob)[:, ::-1].astype(float)
    middle_px = places.mean(axis=0)
    radius_px, half_spine_px = float(np.sqrt(area / np.pi)), np.zeros(2)
    if long:
        spread, axes = np.linalg.eigh(np.cov((places - middle_px).T))
        # Across a long capsule the second moment is r^2 / 3; its length then follows from its area.
        radius_px = float(min(radius_px, np.sqrt(3 * spread[0])))
        half_spine_px = axes[:, 1] * max(0.0, (area / radius_px - np.pi * radius_px) / 4)
    if radius_px < LEAST_RADIUS_PX:
        raise InputError(
            f"{file}: the paste is {radius_px:.0f} px in {'half its width' if long else 'radius'}; at least "
            f"{LEAST_RADIUS_PX:g} are needed. Take the photo from closer."
        )
    return Rough(middle_px, half_spine_px, radius_px, dark)


def _filled(blob: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Fill the glints inside blobs."""
    rings, _ = cv2.findContours(blob, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros_like(blob)
    cv2.drawContours(filled, rings, -1, 1, cv2.FILLED)
    return np.asarray(filled, dtype=np.uint8)


def _edge(light: Map, rough: Rough, inside: NDArray[np.bool_], file: Path) -> Floats:
    """Return the outline, (n, 2) in px: on each ray, the outermost crossing of half the contrast across the edge."""
    soft = blurred(light, 0.8)
    begins, rays = rough.rays()
    rough_px = rough.radius_px
    away = np.arange(0.3 * rough_px, 1.8 * rough_px, STEP_PX)
    places = begins[:, None] + away[None, :, None] * rays[:, None]
    light_at = np.asarray(sampled(soft, places), dtype=float)
    unlike = 1 - light_at if rough.dark else light_at - 1
    free = np.asarray(sampled(inside.astype(np.float32), places), dtype=float) > 0.99
    unlike = np.where(free, unlike, 0.0)
    paste = float(np.median(unlike[:, : len(away) // 6]))
    radius = np.full(RAYS, np.nan)
    for ray, (values, allowed) in enumerate(zip(unlike, free, strict=True)):
        beyond = np.flatnonzero(values > paste / 2)
        if len(beyond) == 0 or beyond[-1] + 1 >= len(values) or not allowed[beyond[-1] + 1]:
            continue
        last = beyond[-1]
        # Half way between the paste inside this edge and the sheet outside: light differs around the blob.
        span = max(6, round(REACH * rough_px / STEP_PX))
        near, far = values[max(0, last - span) : max(1, last - span // 2)], values[last + span // 2 : last + span]
        if len(near) == 0 or len(far) == 0:
            continue
        half = (float(np.median(near)) + float(np.median(far))) / 2
        crossing = np.flatnonzero((values[:-1] >= half) & (values[1:] < half))
        if len(crossing) == 0:
            continue
        at = crossing[np.abs(crossing - last).argmin()]
        share = (values[at] - half) / max(values[at] - values[at + 1], 1e-9)
        radius[ray] = away[at] + share * STEP_PX
    measured, number = np.isfinite(radius), np.arange(RAYS)
    least = LEAST_SEEN_LONG if rough.half_spine_px.any() else LEAST_SEEN
    if measured.mean() >= least:
        # A drop or a scratch at the edge affects few rays.
        filled = np.interp(number, number[measured], radius[measured], period=RAYS)
        usual = np.array([np.median(np.roll(filled, 8 - k)[:17]) for k in range(RAYS)])
        measured &= np.abs(filled - usual) < max(2.0, 0.03 * rough_px)
    if measured.mean() < least:
        raise InputError(
            f"{file}: the paste's edge is visible on only {measured.mean():.0%} of its circumference; {least:.0%} are "
            "needed. Keep the paste between the markers and away from them, and avoid shadows and smears at its edge."
        )
    radius = np.interp(number, number[measured], radius[measured], period=RAYS)
    return begins + radius[:, None] * rays


def _measured(photo: Photo, outline_px: Floats) -> SpreadBlob:
    outline_mm = photo.to_mm(outline_px)
    start, end = outline_mm, np.roll(outline_mm, -1, axis=0)
    cross = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    area_mm2 = abs(float(cross.sum())) / 2
    middle = ((start + end) * cross[:, None]).sum(axis=0) / (3 * cross.sum())
    radius_mm = float(np.sqrt(area_mm2 / np.pi))
    away_mm = np.linalg.norm(outline_mm - middle, axis=1)
    unround = float(away_mm.std() / away_mm.mean())
    if unround > MOST_UNROUND:
        raise InputError(
            f"{photo.file}: the blob is not round: its outline deviates from a circle by {unround:.0%} of its radius "
            f"(RMS); {MOST_UNROUND:.0%} are allowed. Level the plate, lift the cone straight up, and measure again."
        )
    ways = np.radians(np.arange(0, 180, 2.0))
    across = outline_mm @ np.array([np.cos(ways), np.sin(ways)])
    wide_mm = across.max(axis=0) - across.min(axis=0)
    # The circle of its area and that of its mean radius differ by half the square of unround.
    scale_mm, shape_mm = (photo.scale_uncertainty or 0.0) * radius_mm, unround**2 * radius_mm
    error_mm = float(np.sqrt(scale_mm**2 + (EDGE_PX * photo.mm_per_px) ** 2 + shape_mm**2))
    return SpreadBlob(radius_mm, error_mm, unround, (float(wide_mm.min()), float(wide_mm.max())), photo.warnings)
