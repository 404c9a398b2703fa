"""Compare a painted mask with its photo: a crack is darker than what lies beside it, and painted as an area.

The limits of place were set on 64 real masks, of which none is refused or doubted, and on 258 that were turned,
mirrored, shifted or of another photo, of which 253 are refused. A line a few pixels wide, or one stretch long, may
pass. Those of width were set on 39 drawn photos: of 89 masks up to 1.5 times as wide as the crack none is doubted, of
39 three times as wide 38 are.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes

from digitise.crack_path.profiles import Profiles, median_known, profiles_across, row_medians
from digitise.crack_path.standing_out import band_px, is_wider
from digitise.image.raster import Map, sampled, widened
from digitise.photo import Photo
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

OWN, BESIDE, RIM_PX = 1.2, 2.0, 2  # Widths from the middle that are this crack's; reach; px that blur mixes
LEAST_BESIDE_PX = 12.0  # Least reach beside the paint, beyond its widths
DARKER = 0.97  # Light in the paint over that beside it, below which a stretch is darker
FEW, SOME = 0.65, 0.75
"""Shares of darker stretches below which a mask is refused, if it is no darker in all; and is doubted."""
NO_DARKER = 0.88  # Median of that light ratio above which a mask with few darker stretches is refused
HOLLOW, HOLE_DARK = 0.5, 0.8
"""Least area of an outline's holes over that of its paint, and largest light in them over that outside."""
SLENDER = 5.0  # Least length over width of paint whose place is compared with the photo's
ASIDE, LEAST_ASIDE_PX, MUCH_DARKER = 0.35, 3.0, 0.08  # Widths, and px, that sound paint is aside; gain of light there
THIRDS_OF = 9  # Stretches of a line whose thirds are compared by themselves
NEARLY_DARK, NEARLY_GROUND = 0.25, 0.75  # Shares of the contrast between which a broken edge or a shadow may be
AROUND = 8  # Cells around an outline whose light is compared


def judge_paint(
    photo: Photo, drawn: NDArray[np.bool_], line_px: Floats, width_px: float, confirmed: bool
) -> tuple[str, ...]:
    """Return a warning if the paint is hardly darker than what lies beside it; raise InputError if it clearly is not.

    ``confirmed`` is a mask on which the user gave both ends: it is warned about only.
    """
    width_px = max(width_px, 2.0)
    seen = profiles_across(photo, line_px, width_px, BESIDE * width_px + LEAST_BESIDE_PX)
    painted = sampled(drawn.astype(np.uint8) * 255, seen.place_px) > 127
    away_px = np.abs(seen.offset_px)
    clear = ~widened(painted, RIM_PX)
    inside = seen.mean(painted & (away_px <= OWN * width_px))
    sides = [seen.mean(clear & (side * seen.offset_px > 0)) for side in (1, -1)]
    beside = row_medians(np.stack(sides, axis=1))
    ratio = inside / np.maximum(beside, 1e-6)
    known = np.isfinite(ratio)
    if not known.any():
        return ()
    darker, usual = float(np.mean(ratio[known] < DARKER)), float(np.median(ratio[known]))
    if darker >= SOME:
        return _shifted(seen, width_px) or _another_width(photo, seen, width_px)
    first, last = seen.line_px[[0, -1]]
    said = (
        f"photo.mask: the painted area from ({first[0]:.0f}, {first[1]:.0f}) to ({last[0]:.0f}, {last[1]:.0f}) px is "
        f"darker than the photo beside it along {darker:.0%} of its length only, and has {usual:.2f} times its light"
    )
    causes = (
        "Is the mask of another photo, mirrored, shifted, or turned because a program ignored the photo's EXIF turn? "
        "Paint it over the photo as it is shown upright"
    )
    if confirmed or not (darker < FEW and usual > NO_DARKER):
        return (f"{said}. {causes}",)
    raise InputError(
        f"{photo.file}: {said}. {causes}. If it is right, as on a crack filled with something light, give ends_px, its "
        "two ends on the paint."
    )


def _shifted(seen: Profiles, width_px: float) -> tuple[str, ...]:
    """Return a warning if the darkest band as wide as the paint is beside it, by more than a third of its width.

    It is so along the whole line, or along a third of one: paint that crosses the band is on both sides of it.
    """
    if len(seen.line_px) < SLENDER * width_px:
        return ()
    shares = _shares(seen)
    where = "along the paint,"
    aside_px = _aside_px(shares, seen.offset_px, width_px)
    if not aside_px and len(shares) >= THIRDS_OF:
        thirds_px = [_aside_px(third, seen.offset_px, width_px) for third in np.array_split(shares, 3)]
        farthest = int(np.argmax(thirds_px))
        aside_px = thirds_px[farthest]
        x, y = seen.line_px[(2 * farthest + 1) * len(seen.line_px) // 6]
        where = f"along a third of the paint, about ({x:.0f}, {y:.0f}),"
    if not aside_px:
        return ()
    return (
        f"photo.mask: the darkest band {where} which is {width_px:.0f} px wide, is {aside_px} px beside it: "
        "is the mask shifted or turned against the photo?",
    )


def _aside_px(shares: Floats, offset_px: Floats, width_px: float) -> int:
    """Return how far the darkest band as wide as the paint is from it; 0 if that is near, or hardly darker."""
    profile = _usual(shares)
    reach = int(width_px + LEAST_BESIDE_PX / 2)
    asides_px = np.arange(-reach, reach + 1)
    light = np.array([profile[np.abs(offset_px - aside_px) <= width_px / 2].mean() for aside_px in asides_px])
    if not np.isfinite(light).all():
        return 0
    aside_px, own = int(abs(asides_px[light.argmin()])), float(light[reach])
    near = aside_px <= max(ASIDE * width_px, LEAST_ASIDE_PX) or light.min() > own - MUCH_DARKER
    return 0 if near else aside_px


def _another_width(photo: Photo, seen: Profiles, width_px: float) -> tuple[str, ...]:
    """Return a warning if the paint is over twice as wide as what is dark under it, or less than half as wide."""
    if is_wider(width_px, _dark_px(seen, width_px, NEARLY_GROUND)):
        dark_px, wrong = _dark_px(seen, width_px, 0.5), "the ground beside the crack is painted too"
    elif is_wider(dark_px := band_px(photo, seen.line_px, width_px, NEARLY_DARK), width_px):
        wrong = "a part of the crack is not painted"
    else:
        return ()
    painted_mm, dark_mm = width_px * photo.mm_per_px, dark_px * photo.mm_per_px
    return (
        f"photo.mask: the paint is {painted_mm:.2g} mm wide ({width_px:.0f} px), and what is dark along it "
        f"{dark_mm:.2g} mm ({dark_px:.0f} px): {wrong}? The width is the paint's. Paint from wall to wall, or leave "
        "the mask out and give ends_px",
    )


def _dark_px(seen: Profiles, width_px: float, level: float) -> float:
    """Width in px of what is dark under the paint, at a share of its contrast to what lies just beside the paint."""
    light, offset_px = _usual(_shares(seen)), seen.offset_px
    beside = (np.abs(offset_px) > width_px / 2 + RIM_PX) & (np.abs(offset_px) < width_px + LEAST_BESIDE_PX)
    painted = np.abs(offset_px) <= width_px / 2
    middle = int(np.argmin(np.where(painted & np.isfinite(light), light, np.inf)))
    left, right = (median_known(light[beside & (side * offset_px > 0)]) for side in (-1, 1))
    ground = np.where(offset_px < offset_px[middle], left, right)
    bright = np.flatnonzero(light >= light[middle] + level * (ground - light[middle]))
    return float(bright[bright > middle].min(initial=len(light)) - bright[bright < middle].max(initial=-1) - 1)


def _shares(seen: Profiles) -> Floats:
    """Light over the median of its stretch, (n, m)."""
    return seen.mean() / np.maximum(row_medians(seen.mean()), 1e-6)[:, None]


def _usual(shares: Floats) -> Floats:
    """Median at each distance from the line, (m,)."""
    return np.array([median_known(column) for column in shares.T])


def require_filled(photo: Photo, region: NDArray[np.bool_], light: Map) -> None:
    """Raise InputError for paint round a dark area; ``region`` and ``light`` are of one size, a part of the photo's."""
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
