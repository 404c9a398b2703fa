"""Walls at a glance: traced on a smaller copy of the photo, to be seen until the photo's own are measured."""

from contextlib import suppress
from dataclasses import replace

import cv2
import numpy as np

from digitise.finding.crack_path import CrackPath
from digitise.outline import MIN_WIDTH_PX, trace_outline
from digitise.photo import Photo
from digitise.scaling.lens import Lens
from digitise.scaling.view import View
from sealtwin.errors import InputError
from sealtwin.records import Floats, Outline

GLANCE_WIDTH_PX = 2 * MIN_WIDTH_PX
"""Width of the crack in the smaller copy: there walls lie within a tenth of a millimetre of the final ones, on a
specimen 3.1 mm wide, and its time falls as the copy shrinks.
"""


def glance(photo: Photo, path: CrackPath, edge_fraction: float = 0.5) -> Outline | None:
    """The outline as a smaller copy of the photo shows it; its ``_px`` count in that copy.

    None where the crack is too narrow for a copy, or its walls are not found there: the photo itself decides.
    """
    shrinks = int(np.log2(path.width_px / GLANCE_WIDTH_PX)) if path.width_px >= GLANCE_WIDTH_PX else 0
    if shrinks == 0 or photo.drawn is not None:
        return None
    factor = 2**shrinks
    narrow = replace(path, points_px=_placed(path.points_px, factor), width_px=path.width_px / factor)
    with suppress(InputError):
        return trace_outline(shrunk(photo, factor), narrow, edge_fraction)
    return None


def shrunk(photo: Photo, factor: int) -> Photo:
    """The same view in pixels ``factor`` times as large; the coloured image stays as it is."""
    offset = (factor - 1) / 2
    to_photo_px = np.array([[factor, 0, offset], [0, factor, offset], [0, 0, 1.0]])
    lens = photo.view.lens
    height, width = photo.brightness.shape
    whole = photo.brightness[: height // factor * factor, : width // factor * factor]
    size = (width // factor, height // factor)
    return replace(
        photo,
        brightness=np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_AREA), dtype=np.float32),
        view=View(
            mm_from_px=photo.view.mm_from_px @ to_photo_px,
            lens=lens and Lens(_placed(lens.centre_px, factor), lens.bend_px2 * factor**2),
        ),
        mm_per_px=photo.mm_per_px * factor,
        markers_px=tuple(_placed(corners, factor) for corners in photo.markers_px),
    )


def _placed(points_px: Floats, factor: int) -> Floats:
    """Where pixels of the photo lie in the copy; both count from the centre of their first pixel."""
    return (points_px - (factor - 1) / 2) / factor
