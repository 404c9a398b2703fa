"""Find the path along a crack that a user has painted, and compare the paint with the photo.

The comparison may miss a painted line that is a few pixels wide, or a single wrong stretch.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.crack_path import medial_axis
from digitise.crack_path.hints import CrackPath, check_hints, listed, snap_px
from digitise.crack_path.profiles import Profiles, dark_width_px, finite_median, profiles_across, row_medians
from digitise.image.raster import sampled, scaled_down, widened
from digitise.photo import Photo
from digitise.settings import PixelPair
from sealtwin.core.errors import InputError, present
from sealtwin.core.facts import Facts, doubt
from sealtwin.core.records import Booleans, Floats

WORK_PX = 2000  # Longer side of the copy on which the middle of the paint is searched for
MIN_COVERED = 0.25  # A cell of that copy is painted if at least this fraction is. A line of one pixel stays whole
PINHOLE = 0.5  # An unpainted spot up to this diameter, in crack widths, is a slip of the brush

# Limits on how a mask may differ from its photo. Widths are in units of the paint's width.
#
# Chosen on 64 real masks and on 258 masks that were rotated, mirrored, shifted or of another photo. Higher values of
# ``SHARE_REFUSED`` and ``SHARE_DOUBTED`` give more refusals and warnings, also for right masks.
# Distances from the middle, in widths: paint up to the first belongs to this crack. Light is compared up to the second
OWN, BESIDE = 1.2, 2.0
MIN_BESIDE_PX = 12.0  # Distance added to ``BESIDE``
RIM_PX = 2  # Distance over which blur mixes paint and ground
DARKER = 0.97  # A stretch counts as darker if its light, divided by the light beside it, is below this
# A mask is refused, or gives a warning, if a smaller fraction of its stretches is darker
SHARE_REFUSED, SHARE_DOUBTED = 0.65, 0.75
NOT_DARKER = 0.88  # A mask with few darker stretches is refused only if the median of that light ratio is above this
# Largest distance of the paint from the darkest band that is as wide as the paint: in widths, or in px if that is more
ASIDE, MIN_ASIDE_PX = 0.35, 3.0
THIRDS_OF = 9  # Each third of a line is checked if it has at least this many stretches
MUCH_DARKER = 0.08  # A band beside the paint counts only if it is darker than the paint by this much
# Paint and dark band have different widths if the ratio and the difference of their widths are above these values
WIDTH_RATIO, WIDER_PX = 2.0, 6.0


def painted_path(photo: Photo, ends_px: PixelPair | None) -> CrackPath:
    """Return the middle of the painted crack.

    The path runs between the ends. If there are none, it runs from left to right along the largest piece of paint.
    Raises InputError if an end is not on the paint, if the two ends are on different pieces, or if the photo shows no
    crack under the paint.
    """
    paint = present(photo.drawn, "the paint")
    label, area = medial_axis.pieces(paint)
    if ends_px is None:
        chosen = int(area.argmax())
    else:
        check_hints(photo, ends_px)
        chosen = _piece_of(photo, label, np.array(ends_px, float))
    left, top, width, height = cv2.boundingRect((label == chosen).astype(np.uint8))
    piece = label[top : top + height, left : left + width] == chosen
    scale = min(1.0, WORK_PX / max(piece.shape))
    region = _without_pinholes(scaled_down(piece.astype(np.float32), scale) > MIN_COVERED)
    if ends_px is None:
        way = medial_axis.without_hooks(medial_axis.longest_line(region), medial_axis.radius(region))
        way = medial_axis.rightward(way)
    else:
        way = medial_axis.along_middle(region, (np.array(ends_px) - (left, top) + 0.5) * scale - 0.5)
    width_px = (2 * float(np.median(medial_axis.radius(region)[tuple(way.T)])) - 1) / scale
    line_px, count = (way[:, ::-1].astype(float) + 0.5) / scale - 0.5 + (left, top), len(area) - 1
    doubts = _judged(photo, paint, line_px, width_px, confirmed=ends_px is not None)
    if count > 1:
        used = (
            f"the mask has {count} pieces. Only the piece from {listed(line_px[[0, -1]])} px, with "
            f"{area[chosen] / area.sum():.0%} of the paint, is used"
        )
        doubts = (doubt("path.mask-in-pieces", used, count), *doubts)
    return CrackPath(line_px, width_px, "mask", doubts)


def _piece_of(photo: Photo, label: NDArray, ends_px: Floats) -> int:
    """Return the number of the piece of paint at both ends. Raises InputError if no single piece is near both ends."""
    numbers, most_px = [], snap_px(photo)
    for x, y in ends_px:
        left, top = max(int(x - most_px), 0), max(int(y - most_px), 0)
        near = label[top : int(y + most_px) + 2, left : int(x + most_px) + 2]
        rows, columns = np.nonzero(near)
        away_px = np.hypot(columns + left - x, rows + top - y)
        if away_px.min(initial=np.inf) > most_px:
            raise InputError(
                f"{photo.file}: the end ({x:g}, {y:g}) is more than {most_px:.0f} px beside the painted crack. Give a "
                "point inside the paint, or paint the crack up to that point."
            )
        nearest = int(np.argmin(away_px))
        numbers.append(int(near[rows[nearest], columns[nearest]]))
    if numbers[0] != numbers[1]:
        raise InputError(
            f"{photo.file}: the two ends are on different pieces of the mask. Paint the gap between them, or give "
            "both ends on one piece."
        )
    return numbers[0]


def _without_pinholes(region: Booleans) -> Booleans:
    # In a strip the median distance from the rim is a quarter of the width.
    hole = PINHOLE * 4 * np.median(medial_axis.radius(region)[region])
    return ~medial_axis.larger_pieces(~region, np.pi / 4 * hole**2, connectivity=4)


def _judged(photo: Photo, drawn: Booleans, line_px: Floats, width_px: float, confirmed: bool) -> Facts:
    """Return a warning if little of the paint is darker than the ground around it.

    Raises InputError if even less is darker. A mask that is ``confirmed``, because the user gave both ends on it, is
    not refused.
    """
    width_px = max(width_px, 2.0)
    profiles = profiles_across(photo, line_px, width_px, BESIDE * width_px + MIN_BESIDE_PX)
    painted = sampled(drawn.astype(np.uint8) * 255, profiles.place_px) > 127
    inside = profiles.mean(painted & (profiles.away_px <= OWN * width_px))
    clear = ~widened(painted, RIM_PX)
    sides = [profiles.mean(clear & (side * profiles.offset_px > 0)) for side in (1, -1)]
    ratio = inside / np.maximum(row_medians(np.stack(sides, axis=1)), 1e-6)
    ratio = ratio[np.isfinite(ratio)]
    if len(ratio) == 0:
        return ()
    darker, usual = float(np.mean(ratio < DARKER)), float(np.median(ratio))
    if darker >= SHARE_DOUBTED:
        return _off_the_band(photo, profiles, width_px)
    fault = (
        f"photo.mask: the painted area from {listed(profiles.line_px[[0, -1]])} px is darker than the photo beside it "
        f"along only {darker:.0%} of its length. Its median brightness is {usual:.2f} times that of the photo beside "
        "it. Does the mask belong to another photo? Is it mirrored, shifted, only an outline, or rotated because a "
        "program ignored the EXIF orientation? Paint the whole crack over the upright photo"
    )
    if confirmed or not (darker < SHARE_REFUSED and usual > NOT_DARKER):
        return (doubt("path.mask-not-dark", fault, darker),)
    raise InputError(
        f"{photo.file}: {fault}. If the mask is right, for example because the crack has a light filling, give "
        "ends_px, the crack's two ends on the paint."
    )


def _off_the_band(photo: Photo, profiles: Profiles, width_px: float) -> Facts:
    """Return a warning if the dark band along the paint is beside it, or far wider or narrower than the paint."""
    light = profiles.mean()
    shares = light / np.maximum(row_medians(light), 1e-6)[:, None]
    # Paint that crosses the band is on each side of it in different thirds of the line.
    parts = [shares, *(np.array_split(shares, 3) if len(shares) >= THIRDS_OF else ())]
    aside_px = max(_aside_px(part, profiles.offset_px, width_px) for part in parts)
    if aside_px:
        text = (
            f"photo.mask: along a part of the crack, the darkest band as wide as the paint ({width_px:.0f} px) is "
            f"{aside_px} px away from the paint. Is the mask shifted or rotated against the photo?"
        )
        return (doubt("path.mask-aside", text, aside_px, "px"),)
    profile, beside = row_medians(shares.T), profiles.away_px > width_px / 2 + RIM_PX
    dark_px = dark_width_px(profile, profiles.offset_px, width_px / 2, finite_median(profile[beside]))
    wide_px, narrow_px = max(width_px, dark_px), max(min(width_px, dark_px), 1.0)
    if wide_px <= WIDTH_RATIO * narrow_px or wide_px - narrow_px <= WIDER_PX:
        return ()
    text = (
        f"photo.mask: the paint is {photo.length(width_px)} wide, but the dark band along it is "
        f"{photo.length(dark_px)} wide. The width of the paint is used. Paint from wall to wall, or leave the mask "
        "out and give ends_px"
    )
    return (doubt("path.mask-other-width", text, width_px, "px"),)


def _aside_px(shares: Floats, offset_px: Floats, width_px: float) -> int:
    """Return the distance in px from the paint to the darkest band that is as wide as the paint.

    Returns 0 if that band is close to the paint or hardly darker than the ground under the paint.
    """
    profile, reach = row_medians(shares.T), int(width_px + MIN_BESIDE_PX / 2)
    asides_px = np.arange(-reach, reach + 1)
    light = np.array([profile[np.abs(offset_px - aside_px) <= width_px / 2].mean() for aside_px in asides_px])
    if not np.isfinite(light).all() or light.min() > light[reach] - MUCH_DARKER:
        return 0
    aside_px = int(abs(asides_px[light.argmin()]))
    return aside_px if aside_px > max(ASIDE * width_px, MIN_ASIDE_PX) else 0
