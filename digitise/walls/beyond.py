"""Measure how far a crack continues beyond a clicked end, and warn that only a part of it was traced."""

import cv2
import numpy as np
from numpy.typing import NDArray

from digitise.crack_path.hints import listed
from digitise.crack_path.medial_axis import radius
from digitise.crack_path.profiles import finite_median, profiles_across
from digitise.crack_path.sample_mask import sample_mask
from digitise.geometry.polyline import depth_inside, unit
from digitise.image.raster import blurred, shrunk
from digitise.photo import Photo
from sealtwin.core.arc_length import arc_length
from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats
from sealtwin.core.solid_figures import EndKind

MOST_BEYOND = 0.05  # Share of the traced length by which a crack may continue without a warning
LEAST_BEYOND, LEAST_BEYOND_PX = 2.0, 30.0  # The same in widths and px: a blunt end, and grain that touches it
AT_BORDER = 2.0  # Widths, plus twice as many px, from the photo's border within which a crack leaves the photo
WORK_PX, LARGEST_PX = 6.0, 2500  # Width of the crack in the copy that is searched, and longest side of the copy
LAST = 8.0  # Widths of the crack before an end that give its darkness and direction
BESIDE = (1.0, 3.0)  # Widths from the line between which the ground's light is read
SWELLING = 1.5  # Widths above which a dark place is not crack but a shadow, a stain or the table
BODY = 1.5  # Widths across which the traced crack is removed
NEAR = 1.5  # Widths from the end within which the rest of the crack must begin


def judge_beyond(photo: Photo, line_px: Floats, kinds: tuple[EndKind, EndKind], width_px: float) -> list[Fact]:
    """Return a doubt for each end that a click cut, if the photo shows much more of the crack beyond it."""
    length_px = float(arc_length(line_px)[-1])
    last_px, warnings = np.array(photo.size_px) - 1, list[Fact]()
    for kind, inward_px in zip(kinds, (line_px, line_px[::-1]), strict=True):
        if kind != "cut" or depth_inside(inward_px[:1], (0, 0, *last_px))[0] < AT_BORDER * (width_px + 2):
            continue
        beyond_px = _beyond_px(photo, inward_px, max(width_px, 2.0))
        if beyond_px > max(MOST_BEYOND * length_px, LEAST_BEYOND * width_px, LEAST_BEYOND_PX):
            beyond_mm = beyond_px * photo.mm_per_px
            text = (
                f"the crack continues beyond the end {listed(inward_px[:1])} px for about "
                f"{photo.length(beyond_px)}, which are not part of the result: give the crack's real end in ends_px to "
                "include them"
            )
            warnings.append(doubt("path.continues", text, beyond_mm, "mm"))
    return warnings


def _beyond_px(photo: Photo, inward_px: Floats, width_px: float) -> float:
    """Return the length of the dark band that continues from the line's first point, away from the line."""
    part_px = inward_px[: max(2, int(np.searchsorted(arc_length(inward_px), LAST * width_px)))]
    profiles = profiles_across(photo, part_px, width_px, BESIDE[1] * width_px + 4)
    away_px = np.abs(profiles.offset_px)
    ground = finite_median(profiles.light[:, away_px > BESIDE[0] * width_px + 2])
    threshold = (ground + finite_median(profiles.light[:, away_px <= max(width_px / 4, 1.0)])) / 2
    factor = max(1, int(width_px / WORK_PX), -(-max(photo.size_px) // LARGEST_PX))
    size = (photo.size_px[0] // factor, photo.size_px[1] // factor)
    whole = np.s_[: size[1] * factor, : size[0] * factor]
    light = blurred(shrunk(photo.brightness[whole], size) if factor > 1 else photo.brightness, 0.8)
    sample = sample_mask(photo)[whole][::factor, ::factor] > 0
    width, cells = width_px / factor, (inward_px + 0.5) / factor - 0.5
    dark = (light < threshold) & sample
    # Regions far wider than the crack are no crack.
    thick, reach = radius(dark) > SWELLING * width / 2 + 1, 2 * int(SWELLING * width / 2 + 1) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    dark = dark.astype(np.uint8) & (1 - cv2.dilate(thick.astype(np.uint8), disc))
    cv2.polylines(dark, [np.rint(cells).astype(np.int32)], False, 0, max(1, round(BODY * width)))
    return factor * _farthest(dark, cells[0], unit(part_px[0] - part_px[-1]), width)


def _farthest(dark: NDArray[np.uint8], end: Floats, ahead: Floats, width: float) -> float:
    """Return the distance of the farthest dark cell that is connected to a place ahead of the end."""
    _, label = cv2.connectedComponents(dark, connectivity=8)
    rows, columns = np.nonzero(label)
    number, away = label[rows, columns], np.column_stack([columns, rows]) - end
    near = (np.abs(away) <= NEAR * width + 2).all(axis=1) & (away @ ahead > 0)
    if not near.any():
        return 0.0
    start = np.flatnonzero(near)[np.argmax(away[near] @ ahead)]
    return float(np.linalg.norm(away[number == number[start]], axis=1).max())
