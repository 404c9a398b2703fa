"""The filter: two-sided, the same in every direction, and with a width; and what lies beyond a sample."""

import numpy as np
import pytest

from digitise.crack_path.line_map import map_lines, surroundings
from digitise.image.raster import DISPLAY_GAMMA
from tests.support.photos import photo_of_light

SIZE = 160
Y, X = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2


def mapped(folder, dark):
    """The map of a photo in which this share of the displayed brightness is missing, with a little noise."""
    noise = 0.02 * np.random.default_rng(0).standard_normal((SIZE, SIZE))
    shown = 0.6 * (1 + noise) * (1 - dark)
    return map_lines(photo_of_light(folder, shown.astype(np.float32) ** DISPLAY_GAMMA))


def across(angle_deg):
    """Distance from a line through the middle of the picture."""
    angle = np.radians(angle_deg)
    return Y * np.cos(angle) - X * np.sin(angle)


def line(angle_deg=0.0, sigma_px=1.5, depth=0.3):
    return depth * np.exp(-((across(angle_deg) / sigma_px) ** 2) / 2)


def on_line(values, angle_deg=0.0):
    """Away from the border."""
    return values[(np.abs(across(angle_deg)) < 0.6) & (np.hypot(X, Y) < 50)]


@pytest.mark.parametrize("angle_deg", [11.25, 22.5, 60, 90, 135])
def test_a_line_is_as_clear_in_every_direction(tmp_path, angle_deg):
    """Eight directions, the worst one half-way between two; 15 % by the shape of the filter, and noise."""
    level = np.median(on_line(mapped(tmp_path, line()).clear))
    turned = np.median(on_line(mapped(tmp_path, line(angle_deg)).clear, angle_deg))
    assert turned == pytest.approx(level, rel=0.25)


def with_box(dark, rows=slice(220, 300), columns=slice(0, 500)):
    shown = np.full((300, 500), 0.6, dtype=np.float32)
    shown[rows, columns] *= dark
    return shown


def test_black_cloth_is_beyond_the_sample():
    around = surroundings(with_box(0.15))
    assert around[221:].all()
    assert not around[:215].any()


@pytest.mark.parametrize(
    "shown",
    [
        with_box(0.5),
        with_box(0.15, slice(100, 160), slice(100, 160)),
        with_box(0.15, slice(290, 300), slice(0, 100)),
        # A wide crack was taken for the cloth around the sample: clicks in it were "outside the searched area".
        with_box(0.15, slice(120, 170), slice(0, 500)),
        with_box(0.15, slice(120, 170), slice(60, 500)),
    ],
    ids=["a hard shadow", "a hole inside", "a corner of a hole", "a crack right through", "a crack to one edge"],
)
def test_shadows_holes_and_cracks_that_leave_the_photo_are_part_of_it(shown):
    assert not surroundings(shown).any()
