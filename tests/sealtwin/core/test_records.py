from dataclasses import replace

import numpy as np
import pytest

from digitise.geometry.polyline import signed_area
from tests.support.shapes import OPEN, straight_slot


def test_mean_width_times_length_is_the_area_of_a_crack_with_oblique_ends():
    """Both ends are at 30 degrees to the crack, and 0.8 mm narrower where the walls of a station first face each other.

    Stations 0.25 mm apart allow 1 %. The width of that station for the whole end would give 5 % too little.
    """
    s_mm = np.linspace(0, 60, 241)
    half_mm = 1.5 + 0.4 * np.cos(2 * np.pi * np.minimum(s_mm, 60 - s_mm) / 12) * (np.minimum(s_mm, 60 - s_mm) < 12)
    turned = np.clip(2 - np.minimum(s_mm, 60 - s_mm) / 3, 0, 1) / np.tan(np.radians(30))
    left_mm, right_mm = (np.column_stack([s_mm + side * turned * half_mm, side * half_mm]) for side in (1, -1))
    lines = {"centreline_mm": np.column_stack([s_mm, 0 * s_mm]), "left_wall_mm": left_mm, "right_wall_mm": right_mm}
    outline = replace(straight_slot(60.0, 3.0, OPEN), **lines)
    area_mm2 = signed_area(np.concatenate([right_mm, left_mm[::-1]]))
    assert outline.mean_width_mm * outline.length_mm == pytest.approx(area_mm2, rel=0.01)
