"""Pictures of a solid and its particles: to scale, not mirrored, and with hidden parts hidden."""

import numpy as np
import pytest

from tests.support.evidence import axes_of, heights
from validate.figures.solid_pictures import draw_top_view, render


def test_the_top_view_is_not_mirrored_and_walls_are_clipped_to_the_sample(evidence):
    """Walls are traced past an open end and would be drawn beyond the face."""
    figure = draw_top_view(evidence.run, evidence.outline, evidence.solid, evidence.trajectory)
    axes, bar = axes_of(figure)
    left, right, path = axes.lines[:3]
    assert np.mean(heights(left)) > np.mean(heights(path)) > np.mean(heights(right))
    assert axes.get_xlim()[0] < axes.get_xlim()[1]
    assert axes.get_ylim()[0] < axes.get_ylim()[1]
    assert (axes.get_xlabel(), axes.get_ylabel(), bar.get_xlabel()) == ("x (mm)", "y (mm)", "z (mm)")
    for clip in (left.get_clip_box(), right.get_clip_box()):
        assert clip is not None
        assert axes.transData.inverted().transform_bbox(clip).extents == pytest.approx(evidence.solid.block_mm)


RED, GREEN = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


def square_at(z: float, half: float):
    corners = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


def stacked(low_first: bool):
    """A small red square over a large green square."""
    (low, faces), (high, _) = square_at(0.0, 2.0), square_at(1.0, 1.0)
    vertices = np.vstack([low, high] if low_first else [high, low])
    colour = np.array([GREEN, GREEN, RED, RED] if low_first else [RED, RED, GREEN, GREEN])
    return vertices, np.vstack([faces, faces + 4]), colour


def test_the_nearer_plate_hides_the_farther_plate_in_any_order_of_faces():
    for low_first in (True, False):
        picture = render(*stacked(low_first), azimuth_deg=0, elevation_deg=90, width_px=80)
        assert picture.shape == (80, 80, 4)
        assert picture[40, 40, 0] > 200 > 10 > picture[40, 40, 1]
        assert picture[5, 40, 1] > 200 > 10 > picture[5, 40, 0]
        share = np.mean(picture[..., 0] > 100)
        assert abs(share - 0.25) < 0.01


def test_the_rendered_view_is_upright_and_not_mirrored():
    """Looking along +y, x is to the right and +y is up; turned by 180 degrees, x is to the left."""
    near, faces = square_at(0.0, 1.0)
    both, colour = np.vstack([faces, faces + 4]), np.array([RED, RED, GREEN, GREEN])
    aside, beyond = (np.vstack([near, near + np.array(by)]) for by in ((4.0, 0.0, 0.0), (0.0, 4.0, 0.0)))
    ahead, behind, above = (
        render(vertices, both, colour, *angles_deg, 60)
        for vertices, angles_deg in ((aside, (0, 60)), (aside, (180, 60)), (beyond, (0, 45)))
    )
    middle = ahead.shape[0] // 2
    assert ahead[middle, 5, 0] > 100 > ahead[middle, 5, 1]
    assert behind[middle, 5, 1] > 100 > behind[middle, 5, 0]
    assert (above[3, 30, 1] > 100, above[-4, 30, 0] > 100) == (True, True)
