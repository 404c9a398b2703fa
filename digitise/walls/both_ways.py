"""Trace a crack by following its walls or, on ground too coarse for that, by the dark region along its path."""

from digitise.crack_path.hints import CrackPath
from digitise.photo import Photo
from digitise.walls.centreline_and_walls import Traced, WallsMissingError, trace
from digitise.walls.dark_region import trace_dark_region
from sealtwin.core.errors import InputError


def trace_either_way(photo: Photo, path: CrackPath, wall_share: float) -> Traced:
    """Return the walls along ``path``. Raises InputError if neither way finds them.

    Raises TooThinError if blur would decide the crack's width.
    """
    try:
        return trace(photo, path, wall_share)
    except WallsMissingError as unclear:
        try:
            return trace_dark_region(photo, path, wall_share)
        except InputError as neither:
            why = str(neither).removeprefix(f"{photo.file}: ")
            raise WallsMissingError(f"{unclear} A second way was tried: {why}") from None
