"""The width of a crack along its path, measured in the photo."""

import cv2
import numpy as np
import pytest

from digitise.crack_path.profiles import width_along
from tests.support.photos import distance_to, mortar, photo_of_light

LINE = np.array([(20.0, 150.0), (160, 130), (300, 170), (480, 140)])


def cracked(folder, width_px, times=1.0):
    """A crack of exactly this width: the pixels nearer to the line than half the width."""
    picture = mortar(size_px=(round(500 * times), round(300 * times)))
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
    points = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    away = np.concatenate([distance_to(part, LINE * times) for part in np.array_split(points, len(points) // 100_000)])
    cover = np.clip(width_px / 2 + 0.5 - away.reshape(picture.shape), 0, 1)
    picture *= 1 - 0.93 * cv2.GaussianBlur(cover, (0, 0), 1.0)
    return photo_of_light(folder, picture)


@pytest.mark.parametrize("width_px", [6, 9, 14, 30, 60])
def test_the_crack_width_is_measured_despite_a_wrong_first_estimate(tmp_path, width_px):
    """A coarse map may show half the width. Tolerance: 3 %, and the third of a pixel that blur adds to 6 px."""
    photo = cracked(tmp_path, width_px)
    for wrong in (0.4, 1.0, 2.0):
        assert width_along(photo, LINE, wrong * width_px) == pytest.approx(width_px, rel=0.03, abs=0.5)
