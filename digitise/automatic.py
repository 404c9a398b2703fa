"""Find the crack by itself: the most crack-like line of a photo, where one stands out."""

from dataclasses import replace

from digitise.beside import unlike_length_px
from digitise.crack_path import CrackPath, listed
from digitise.face import see_face
from digitise.livewire import LiveWire
from digitise.photo import Photo
from digitise.settings import Pixel
from digitise.skeleton import longest_lines
from sealtwin.errors import InputError
from sealtwin.records import arc_length

EDGES_SEEN = (
    "the crack was searched for inside the edges of the sample, which the photo shows; "
    "give face_mm, its size, to have the crack open where it meets them"
)
EDGE_WIDTHS, EDGE_SHARE = 3.0, 0.05
"""In widths and in shares of the line: a stretch with unlike sides that is longer than both is told of."""
RUNNER_UP = 0.5
"""A second line with more than this share of the first one's score makes the choice the user's."""


def automatic_path(photo: Photo, roi_px: tuple[Pixel, ...] | None = None) -> CrackPath:
    """Along the one crack that stands out, from left to right: a proposal until somebody has looked at it.

    Raises InputError where no crack is found or two compete.
    """
    # The shadow around a sample is the longest dark line in its photo.
    seen_px = see_face(photo.brightness) if photo.face_px is None else None
    wire = LiveWire(photo, roi_px, seen_px)
    lines = longest_lines(wire.field)
    if not lines:
        where = "" if seen_px is None else " inside the edges of the sample"
        raise InputError(f"{photo.file}: no crack found{where}: nothing dark, thin and long stands out; give ends_px.")
    ends_px, score = wire.field.to_photo(lines[0][0][[0, -1], ::-1]), lines[0][1]
    if len(lines) > 1 and lines[1][1] > RUNNER_UP * score:
        rival_px = wire.field.to_photo(lines[1][0][[0, -1], ::-1])
        raise InputError(
            f"{photo.file}: two cracks compete, {listed(ends_px)} and {listed(rival_px)} px (the second has "
            f"{lines[1][1] / score:.0%} of the first one's score); choose with ends_px."
        )
    (start_x, start_y), (end_x, end_y) = ends_px[::-1] if ends_px[0, 0] > ends_px[1, 0] else ends_px
    path = wire.path(((start_x, start_y), (end_x, end_y)))
    warnings = () if seen_px is None else (EDGES_SEEN,)
    unlike_px = unlike_length_px(photo, path.points_px, path.width_px)
    if unlike_px > max(EDGE_WIDTHS * path.width_px, EDGE_SHARE * float(arc_length(path.points_px)[-1])):
        warnings = (
            *warnings,
            f"along {unlike_px * photo.mm_per_px:.0f} mm of the line that was found, one side is far brighter than the "
            "other, as at the sample's edge, where no nozzle must go: look at overlay.png, and give ends_px or face_mm",
        )
    return replace(path, source="automatic", warnings=warnings)
