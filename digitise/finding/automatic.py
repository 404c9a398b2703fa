"""Find the crack by itself: the most crack-like line of a photo, where one stands out."""

from dataclasses import replace

import numpy as np

from digitise.finding.beside import unlike_length_px
from digitise.finding.crack_path import CrackPath, listed
from digitise.finding.cracks import Crack, CrackMap, cracks_on
from digitise.finding.hints import SNAP_PX
from digitise.finding.livewire import LiveWire
from digitise.geometry.polyline import depth_inside
from digitise.photo import Photo
from digitise.scaling.face import see_face
from digitise.settings import Pixel
from sealtwin.errors import InputError
from sealtwin.records import Floats, arc_length

EDGES_SEEN = (
    "the crack was searched for inside the edges of the sample, which the photo shows; "
    "give face_mm, its size, to have the crack open where it meets them"
)
LEAST_MARGIN = 0.02
"""Of the photo's shorter side, around a face that is seen: what reaches the border is a board, or part of a sample."""
EDGE_WIDTHS, EDGE_SHARE = 3.0, 0.05
"""In widths and in shares of the line: a stretch with unlike sides that is longer than both is told of."""
LEAST_LENGTH = 0.12
"""Of the photo's diagonal; shorter lines are pores and scratches."""
LEAST_SLENDERNESS = 5.0
"""Length over width of whatever may be called a crack."""
RUNNER_UP = 0.5
"""A second line with more than this share of the first one's score makes the choice the user's."""


def automatic_path(photo: Photo, roi_px: tuple[Pixel, ...] | None = None) -> CrackPath:
    """Along the one crack that stands out, from left to right: a proposal until somebody has looked at it.

    Raises InputError where no crack is found or two compete.
    """
    seen_px = _seen_face_px(photo)
    wire = LiveWire(photo, roi_px, seen_px)
    warnings = [] if seen_px is None else [EDGES_SEEN]
    found = cracks_on(wire.field, photo)
    long = _long(found, photo)
    if not long and found.straight_px:
        long = _long(cracks_on(wire.field, photo, straight_too=True), photo)
        warnings.append(
            f"a line from {listed(found.straight_px[0])} px is as straight as a joint, and there is no other"
        )
    elif found.straight_px:
        warnings.append(f"a line from {listed(found.straight_px[0])} px was left out: it is as straight as a joint")
    if not long:
        where = "" if seen_px is None else " inside the edges of the sample"
        raise InputError(f"{photo.file}: no crack found{where}: nothing dark, thin and long stands out; give ends_px.")
    ends_px = long[0].line_px[[0, -1]]
    if len(long) > 1 and long[1].score > RUNNER_UP * long[0].score:
        first, second = long[:2]
        raise InputError(
            f"{photo.file}: two cracks compete, {listed(ends_px)} px with a score of {first.score:.0f} and "
            f"{listed(second.line_px[[0, -1]])} px with {second.score:.0f} ({second.score / first.score:.0%} of it); "
            "choose with ends_px."
        )
    path = _way_between(wire, ends_px, photo)
    unlike_px = unlike_length_px(photo, path.points_px, path.width_px)
    if unlike_px > max(EDGE_WIDTHS * path.width_px, EDGE_SHARE * float(arc_length(path.points_px)[-1])):
        warnings.append(
            f"along {unlike_px * photo.mm_per_px:.0f} mm of the line that was found, one side is far brighter than the "
            "other, as at the sample's edge, where no nozzle must go: look at overlay.png, and give ends_px or face_mm"
        )
    return replace(path, source="automatic", warnings=tuple(warnings))


def _way_between(wire: LiveWire, ends_px: Floats, photo: Photo) -> CrackPath:
    """The crack's way between the ends of the line that was found: nobody gave them, so no hint of theirs is wrong."""
    if np.linalg.norm(ends_px[0] - ends_px[1]) < max(_least_length_px(photo), SNAP_PX):
        raise InputError(
            f"{photo.file}: no crack found: the most crack-like line comes back to where it begins, at "
            f"{listed(ends_px[:1])} px, as the rim of a stain does; give ends_px."
        )
    (start_x, start_y), (end_x, end_y) = ends_px
    try:
        return wire.path(((start_x, start_y), (end_x, end_y)))
    except InputError as refusal:
        raise InputError(
            f"{photo.file}: no crack found: the most crack-like line, from {listed(ends_px)} px, is none all along; "
            "give ends_px."
        ) from refusal


def _seen_face_px(photo: Photo) -> Floats | None:
    """Corners of a face of unknown size: the shadow around a sample is the longest dark line in its photo.

    None where the face is known, or the photo does not show all four edges.
    """
    corners_px = see_face(photo.brightness) if photo.face_px is None else None
    if corners_px is None:
        return None
    width, height = photo.size_px
    inside_px = depth_inside(corners_px, (0, 0, width - 1, height - 1)).min()
    return corners_px if inside_px > LEAST_MARGIN * min(width, height) else None


def _long(found: CrackMap, photo: Photo) -> list[Crack]:
    """The cracks that are long enough to be meant."""
    return [
        crack
        for crack in found.cracks
        if arc_length(crack.line_px)[-1] >= max(_least_length_px(photo), LEAST_SLENDERNESS * crack.width_px)
    ]


def _least_length_px(photo: Photo) -> float:
    return LEAST_LENGTH * float(np.hypot(*photo.size_px))
