"""Compare a painted mask with its photo: a crack must be darker than the ground around it and painted as an area.

A painted line a few pixels wide, or one wrong stretch, may not be noticed.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes

from digitise.crack_path.profiles import Profiles, finite_median, profiles_across, row_medians
from digitise.crack_path.standing_out import band_px, is_wider
from digitise.image.raster import Map, sampled, widened
from digitise.photo import Photo
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

# Limits on how a mask may differ from its photo. Widths are in units of the paint's width.
#
# The limits on position were set on 64 real masks and on 258 masks that were turned, mirrored, shifted or of another
# photo. None of the 64 is refused or doubted, and 253 of the 258 are refused. The limits on width were set on 39
# drawn photos. None of 89 masks up to 1.5 times as wide as the crack is doubted, and 38 of 39 masks three times as
# wide are. Higher values of ``FEW`` and ``SOME`` refuse and doubt more masks, including right ones.
OWN = 1.2  # Widths from the middle that are this crack's
BESIDE = 2.0  # Widths from the middle up to which light is compared
LEAST_BESIDE_PX = 12.0  # Distance that is added to these widths
RIM_PX = 2  # Distance over which blur mixes paint and ground
DARKER = 0.97  # Light in the paint over the light next to it, below which a stretch is darker
FEW = 0.65  # Share of darker stretches below which a mask is refused, if it is not darker as a whole
SOME = 0.75  # Share of darker stretches below which a mask is doubted
NOT_DARKER = 0.88  # Median of that light ratio above which a mask with few darker stretches is refused
HOLLOW = 0.5  # Least area of an outline's holes over that of its paint
HOLE_DARK = 0.8  # Largest light in the holes of an outline over that around it
SLENDER = 5.0  # Least length over width of paint for a check of its place
ASIDE = 0.35  # Widths by which sound paint may be off the darkest band
LEAST_ASIDE_PX = 3.0  # Distance by which it may be off in any case
MUCH_DARKER = 0.08  # Least difference of light between the paint and a darker band
THIRDS_OF = 9  # Least number of stretches for a check of each third
NEARLY_DARK = 0.25  # Share of the contrast that a broken edge or a shadow has at least
NEARLY_GROUND = 0.75  # Share of the contrast that it has at most
AROUND = 8  # Width in cells of the ground around an outline that its holes are compared with


def judge_paint(
    photo: Photo, drawn: NDArray[np.bool_], line_px: Floats, width_px: float, confirmed: bool
) -> tuple[str, ...]:
    """Return a warning if the paint is hardly darker than the ground around; raise InputError if it is not darker.

    A mask is ``confirmed`` if the user gave both ends on it: it is never refused.
    """
    width_px = max(width_px, 2.0)
    profiles = profiles_across(photo, line_px, width_px, BESIDE * width_px + LEAST_BESIDE_PX)
    painted = sampled(drawn.astype(np.uint8) * 255, profiles.place_px) > 127
    away_px = np.abs(profiles.offset_px)
    clear = ~widened(painted, RIM_PX)
    inside = profiles.mean(painted & (away_px <= OWN * width_px))
    sides = [profiles.mean(clear & (side * profiles.offset_px > 0)) for side in (1, -1)]
    beside = row_medians(np.stack(sides, axis=1))
    ratio = inside / np.maximum(beside, 1e-6)
    ratio = ratio[np.isfinite(ratio)]
    if len(ratio) == 0:
        return ()
    darker, usual = float(np.mean(ratio < DARKER)), float(np.median(ratio))
    if darker >= SOME:
        return _shifted(profiles, width_px) or _another_width(photo, profiles, width_px)
    first, last = profiles.line_px[[0, -1]]
    fault = (
        f"photo.mask: the painted area from ({first[0]:.0f}, {first[1]:.0f}) to ({last[0]:.0f}, {last[1]:.0f}) px is "
        f"darker than the photo beside it along only {darker:.0%} of its length; its median brightness is {usual:.2f} "
        "times that of the photo beside it"
    )
    causes = (
        "Is the mask of another photo, mirrored, shifted, or turned because a program ignored the EXIF orientation? "
        "Paint it over the photo as it is shown upright"
    )
    if confirmed or not (darker < FEW and usual > NOT_DARKER):
        return (f"{fault}. {causes}",)
    raise InputError(
        f"{photo.file}: {fault}. {causes}. If the mask is right, for example because the crack has a light filling, "
        "give ends_px, the crack's two ends on the paint."
    )


def _shifted(profiles: Profiles, width_px: float) -> tuple[str, ...]:
    """Return a warning if the darkest band as wide as the paint is off the paint by more than a third of its width.

    Both the whole line and its thirds are checked, since paint that crosses the band is on both sides of it.
    """
    if len(profiles.line_px) < SLENDER * width_px:
        return ()
    shares = _shares(profiles)
    where = "along the paint"
    aside_px = _aside_px(shares, profiles.offset_px, width_px)
    if not aside_px and len(shares) >= THIRDS_OF:
        thirds_px = [_aside_px(third, profiles.offset_px, width_px) for third in np.array_split(shares, 3)]
        farthest = int(np.argmax(thirds_px))
        aside_px = thirds_px[farthest]
        x, y = profiles.line_px[(2 * farthest + 1) * len(profiles.line_px) // 6]
        where = f"along a third of the paint, about ({x:.0f}, {y:.0f}) px"
    if not aside_px:
        return ()
    return (
        f"photo.mask: {where}, the darkest band as wide as the paint ({width_px:.0f} px) is {aside_px} px away from "
        "the paint. Is the mask shifted or turned relative to the photo?",
    )


def _aside_px(shares: Floats, offset_px: Floats, width_px: float) -> int:
    """Return the distance of the darkest band as wide as the paint; 0 if it is near the paint or hardly darker."""
    profile = _usual(shares)
    reach = int(width_px + LEAST_BESIDE_PX / 2)
    asides_px = np.arange(-reach, reach + 1)
    light = np.array([profile[np.abs(offset_px - aside_px) <= width_px / 2].mean() for aside_px in asides_px])
    if not np.isfinite(light).all():
        return 0
    aside_px, own = int(abs(asides_px[light.argmin()])), float(light[reach])
    near = aside_px <= max(ASIDE * width_px, LEAST_ASIDE_PX) or light.min() > own - MUCH_DARKER
    return 0 if near else aside_px


def _another_width(photo: Photo, profiles: Profiles, width_px: float) -> tuple[str, ...]:
    """Return a warning if the paint is over twice as wide as the dark band under it, or under half as wide."""
    if is_wider(width_px, _dark_px(profiles, width_px, NEARLY_GROUND)):
        dark_px, wrong = _dark_px(profiles, width_px, 0.5), "the ground beside the crack is painted too"
    elif is_wider(dark_px := band_px(photo, profiles.line_px, width_px, NEARLY_DARK), width_px):
        wrong = "a part of the crack is not painted"
    else:
        return ()
    painted_mm, dark_mm = width_px * photo.mm_per_px, dark_px * photo.mm_per_px
    return (
        f"photo.mask: the paint is {painted_mm:.2g} mm wide ({width_px:.0f} px), but the dark band along it is "
        f"{dark_mm:.2g} mm wide ({dark_px:.0f} px): perhaps {wrong}. The width is that of the paint. Paint from wall "
        "to wall, or leave the mask out and give ends_px",
    )


def _dark_px(profiles: Profiles, width_px: float, level: float) -> float:
    """Width in px of the dark band under the paint, at a share ``level`` of its contrast to the ground around."""
    light, offset_px, away_px = _usual(_shares(profiles)), profiles.offset_px, np.abs(profiles.offset_px)
    beside = (away_px > width_px / 2 + RIM_PX) & (away_px < width_px + LEAST_BESIDE_PX)
    painted = away_px <= width_px / 2
    middle = int(np.argmin(np.where(painted & np.isfinite(light), light, np.inf)))
    left, right = (finite_median(light[beside & (side * offset_px > 0)]) for side in (-1, 1))
    ground = np.where(offset_px < offset_px[middle], left, right)
    bright = np.flatnonzero(light >= light[middle] + level * (ground - light[middle]))
    return float(bright[bright > middle].min(initial=len(light)) - bright[bright < middle].max(initial=-1) - 1)


def _shares(profiles: Profiles) -> Floats:
    """Light divided by the median of its stretch, (n, m)."""
    light = profiles.mean()
    return light / np.maximum(row_medians(light), 1e-6)[:, None]


def _usual(shares: Floats) -> Floats:
    """Median over the stretches at each distance from the line, (m,)."""
    return np.array([finite_median(column) for column in shares.T])


def require_filled(photo: Photo, region: NDArray[np.bool_], light: Map) -> None:
    """Raise InputError if the paint is the outline of a dark area. ``region`` and ``light`` have the same size."""
    holes = np.asarray(binary_fill_holes(region)) & ~region
    if holes.sum() < HOLLOW * region.sum():
        return
    whole = region | holes
    around = widened(whole, AROUND) & ~widened(whole, RIM_PX)
    if around.any() and np.median(light[holes]) < HOLE_DARK * np.median(light[around]):
        raise InputError(
            f"{photo.file}: photo.mask paints the outline of a dark area, not the area: fill it, so that the whole "
            "crack is white."
        )
