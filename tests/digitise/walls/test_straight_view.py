"""The straightened photo: s to the right, the left of the crack up, and the same size of a pixel both ways."""

from dataclasses import replace

import numpy as np
import pytest

from digitise.drawing.given_lines import outline_of_line
from digitise.walls.overlay import straight_view

X_MM = np.linspace(0.0, 60.0, 121)
LINE_MM = np.column_stack([X_MM, 8 * np.sin(X_MM / 15)])


def test_a_bent_crack_becomes_a_straight_band_with_its_left_side_up():
    outline, photo = outline_of_line(LINE_MM, np.array([[0.0, 3.0]]), None, "line")
    # A white spot 3 mm to the left of the crack's middle at s = 20 mm.
    at = int(np.argmin(np.abs(outline.s_mm - 20.0)))
    ahead = outline.centreline_mm[at + 1] - outline.centreline_mm[at]
    left = np.array([-ahead[1], ahead[0]]) / np.linalg.norm(ahead)
    column, row = photo.to_px((outline.centreline_mm[at] + 3.0 * left)[None])[0].round().astype(int)
    image = photo.image.copy()
    image[row - 2 : row + 3, column - 2 : column + 3] = 255
    straight = straight_view(replace(photo, image=image), outline)
    height, width, _ = straight.shape
    mm_per_px = outline.length_mm / (width - 1)
    dark = straight[:, :, 0] < 120
    inside = slice(width // 20, -width // 20)
    assert dark[:, inside].sum(axis=0) * mm_per_px == pytest.approx(3.0, abs=0.25)
    middle = np.array([np.flatnonzero(each).mean() for each in dark[:, inside].T])
    assert (middle - (height - 1) / 2) * mm_per_px == pytest.approx(0.0, abs=0.15)
    rows, columns = np.nonzero(straight[:, :, 0] > 240)
    assert columns.mean() * mm_per_px == pytest.approx(20.0, abs=0.3)
    assert ((height - 1) / 2 - rows.mean()) * mm_per_px == pytest.approx(3.0, abs=0.3)


def test_what_is_outside_the_photo_is_white():
    outline, photo = outline_of_line(LINE_MM, np.array([[0.0, 3.0]]), None, "line")
    left, top = photo.to_px(outline.centreline_mm).min(axis=0)
    cut = photo.image[int(top) :]
    view = replace(photo.view, mm_from_px=photo.view.mm_from_px @ np.array([[1, 0, 0], [0, 1, int(top)], [0, 0, 1.0]]))
    straight = straight_view(replace(photo, image=cut, view=view), outline)
    assert left > 0
    assert (straight == 255).all(axis=2).any()
