"""Find the crack in a photo: as painted, the darkest way between given points, or the most crack-like line there is."""

from digitise.finding.automatic import automatic_path
from digitise.finding.crack_path import CrackPath
from digitise.finding.livewire import LiveWire
from digitise.finding.painted import painted_path
from digitise.photo import Photo
from digitise.settings import Pixel

__all__ = ["CrackPath", "find_path"]


def find_path(
    photo: Photo,
    ends_px: tuple[Pixel, Pixel] | None,
    via_px: tuple[Pixel, ...] = (),
    roi_px: tuple[Pixel, ...] | None = None,
) -> CrackPath:
    """Between the given ends, in their order, past the via points in theirs, inside ``roi_px`` only.

    Without ends, along the one crack that stands out, from left to right. Where the user has painted the crack, along
    the middle of the paint.

    Raises InputError where a point is outside the photo or on no crack, where no crack is found or two compete.
    """
    if photo.drawn is not None:
        return painted_path(photo, ends_px)
    if ends_px is None:
        return automatic_path(photo, roi_px)
    return LiveWire(photo, roi_px).path(ends_px, via_px)
