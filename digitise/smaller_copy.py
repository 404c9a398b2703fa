"""Copies of a photo with fewer pixels."""

from dataclasses import replace

import numpy as np

from digitise.image.raster import shrunk
from digitise.photo import Photo
from digitise.scale.view import Lens, View
from sealtwin.core.records import Floats


def smaller(photo: Photo, factor: int) -> Photo:
    """Return the photo with brightness and view in pixels ``factor`` times as wide. Its colours do not change."""
    offset = (factor - 1) / 2
    to_photo_px = np.array([[factor, 0, offset], [0, factor, offset], [0, 0, 1.0]])
    lens = photo.view.lens
    width, height = (side // factor for side in photo.size_px)
    whole = photo.brightness[: height * factor, : width * factor]
    return replace(
        photo,
        brightness=shrunk(whole, (width, height)),
        view=View(
            mm_from_px=photo.view.mm_from_px @ to_photo_px,
            lens=lens and Lens(in_copy(lens.centre_px, factor), lens.bend_px2 * factor**2),
        ),
        mm_per_px=photo.mm_per_px * factor,
        markers_px=tuple(in_copy(corners, factor) for corners in photo.markers_px),
    )


def in_copy(points_px: Floats, factor: int) -> Floats:
    """Map pixels of the photo to pixels of the copy. The origin of each is the centre of its first pixel."""
    return (points_px - (factor - 1) / 2) / factor
