"""A crack that was painted, as the plainest of photos: what is painted is dark, all else is mortar."""

from dataclasses import replace

import cv2
import numpy as np

from digitise.finding.crack_path import CrackPath
from digitise.photo import Photo

DARK, BRIGHT = 0.05, 0.8
"""Brightness of a deep crack and of light mortar."""
RIM = 0.5
"""Share of that contrast at which the rim of the paint lies, however blurred."""


def painted_photo(photo: Photo, path: CrackPath) -> Photo:
    """The photo with the painted piece that holds the path in place of its brightness.

    Its walls, ends and islands then follow the same rules as those of a crack that was seen.
    """
    assert photo.drawn is not None, "nothing is painted"
    label = cv2.connectedComponents(photo.drawn.astype(np.uint8), connectivity=8)[1]
    x, y = np.clip(np.rint(path.points_px).astype(int), 0, np.array(photo.size_px) - 1).T
    passed = label[y, x]
    piece = label == np.bincount(passed[passed > 0]).argmax()
    return replace(photo, brightness=np.where(piece, DARK, BRIGHT).astype(np.float32))
