from pathlib import Path

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import Photo
from digitise.scale.view import View
from digitise.walls.ends import PathEnd, judge_end
from digitise.walls.wall_profile import patch_around
from sealtwin.core.records import Floats
from tests.support.photos import photo_of_light

RIGHT = np.array([1.0, 0.0])


def photo_of_dark(dark: np.ndarray, face_mm=None) -> Photo:
    """A photo at 1 mm/px, y up from its lower left pixel, black where ``dark``."""
    brightness = np.where(dark, 0.02, 0.4).astype(np.float32)
    image, view = np.zeros((*dark.shape, 3), np.uint8), View(np.array([[1.0, 0, 0], [0, -1, 99], [0, 0, 1]]))
    scale = {"view": view, "face_mm": face_mm, "mm_per_px": 1.0, "scale_source": "test", "scale_residual_mm": None}
    return Photo(file=Path(__file__), image=image, brightness=brightness, **scale)


def judged(dark: np.ndarray, end_px: tuple[float, float], face_mm=None, ahead: Floats = RIGHT) -> PathEnd:
    photo = photo_of_dark(dark, face_mm)
    end = np.array(end_px)
    return judge_end(photo, patch_around(photo, end[None], 60.0), end, ahead, 10.0, 0.2)


def band(rows=slice(0), columns=slice(0)) -> np.ndarray:
    """A crack 10 px wide from the left border to x = 120, in a photo of 200 x 100 px, and a dark box."""
    dark = np.zeros((100, 200), dtype=bool)
    dark[45:55, :121] = dark[rows, columns] = True
    return dark


def shadow(shift: float) -> np.ndarray:
    """The crack and a shadow across its end, along the edge of a sample."""
    rows, columns = np.mgrid[:100, :200]
    return band() | (np.abs(columns - 122 - shift * (rows - 50)) < 3)


FACE_MM = (0.0, 0.0, 121.0, 99.0)
ASLANT = np.array([np.cos(0.1), np.sin(0.1)])


@pytest.mark.parametrize(
    ("dark", "x_px", "options", "kind", "end_x_px"),
    [
        (band(), 90.0, {}, "cut", 90),
        (band(), 112.0, {}, "closed", 120),
        # The end is in the middle, not in the corner that a slightly oblique path reaches last.
        (band(), 112.0, {"ahead": ASLANT}, "closed", 120),
        (band(slice(46, 54), slice(126, 134)), 118.0, {}, "closed", 120),
        (band(), 119.0, {"face_mm": FACE_MM}, "open", None),
        (band(), 60.0, {"face_mm": FACE_MM}, "cut", None),
        (band(slice(45, 55), slice(200)), 195.0, {}, "cut", None),
        # Without the size of the face, a tip along the shadow would be drawn 15 px aside.
        (shadow(0), 118.0, {}, "cut", 118),
        (shadow(0.5), 118.0, {}, "cut", 118),
        (band(), 255.0, {}, "cut", 255),
    ],
    ids=[
        *("goes on", "tip", "aslant", "pore beyond", "edge of the face", "on the face", "border", "shadow", "oblique"),
        "outside the photo",
    ],
)
def test_the_ends_of_a_crack_are_recognised_as_open_closed_or_cut(dark, x_px, options, kind, end_x_px):
    end = judged(dark, (x_px, 50.0), **options)
    assert end.kind == kind
    if end_x_px is not None:
        assert end.place_px == pytest.approx([end_x_px, 50], abs=1.0 if kind == "closed" else 1e-4)


def test_dark_grain_beyond_a_blunt_end_does_not_extend_the_crack(tmp_path):
    """A sum across the crack extended it by 22 px on this ground; the largest error is now 1.8 px."""
    half_px = 20
    grain = cv2.GaussianBlur(np.random.default_rng(1).standard_normal((200, 620)), (0, 0), 6.0)
    picture = 0.35 + 0.06 * grain / grain.std()
    inner = 120 + half_px, 470 - half_px
    cv2.line(picture, (inner[0], 100), (inner[1], 100), 0.02, 2 * half_px)
    for x in inner:
        cv2.circle(picture, (x, 100), half_px, 0.02, -1)
    photo = photo_of_light(tmp_path, picture)
    outline = trace_outline(photo, find_path(photo, ((122.0, 100.0), (468.0, 100.0))))
    assert outline.ends == ("closed", "closed")
    assert outline.centreline_px[[0, -1], 0] == pytest.approx([120, 470], abs=3)
