import numpy as np
import pytest

from digitise.geometry.polyline import rectangle
from digitise.scaling.camera import Camera, camera_above
from tests.pictures import distance_to

FACE_MM = (120.0, 40.0)


def camera(lens_k1: float = 0.0, tilt_deg: float = 0.0) -> Camera:
    return camera_above(FACE_MM, 20.0, 0.1, 262.0, tilt_deg, lens_k1)


def test_an_upright_camera_sees_the_face_in_the_middle_with_y_down():
    corners_px = camera().to_px(rectangle((0, 0, *FACE_MM)))
    assert camera().size_px == (1600, 800)
    # 20 mm of frame are 200 px; half a pixel, since pixels count from their centres.
    assert corners_px == pytest.approx(np.array([[200, 600], [1400, 600], [1400, 200], [200, 200]]) - 0.5)


def test_a_tilted_camera_sees_the_nearer_side_larger():
    left_px, right_px, upper_px, lower_px = (
        np.ptp(camera(tilt_deg=10).to_px(np.array(side, dtype=float)), axis=0).max()
        for side in (
            [[0, 0], [0, 40]],
            [[120, 0], [120, 40]],
            [[0, 40], [120, 40]],
            [[0, 0], [120, 0]],
        )
    )
    # 5 degrees about y over 120 mm, 10 degrees about x over 40 mm.
    assert abs(left_px / right_px - 1) == pytest.approx(120 * np.sin(np.radians(5)) / 262, rel=0.1)
    assert abs(upper_px / lower_px - 1) == pytest.approx(40 * np.sin(np.radians(10)) / 262, rel=0.1)


def test_a_lens_moves_each_place_along_its_ray_by_the_cube_of_its_distance():
    place_mm = np.array([[0.0, 0.0], [40.0, 20.0], [60.0, 20.0]])
    centre_px = (np.array(camera().size_px) - 1) / 2
    straight_px, bent_px = (camera(k1).to_px(place_mm) - centre_px for k1 in (0.0, -0.2))
    r = np.linalg.norm(straight_px, axis=1, keepdims=True) / 2620  # over the focal length, 262 mm at 0.1 mm/px
    assert bent_px == pytest.approx(straight_px * (1 - 0.2 * r**2), abs=1e-9)
    assert straight_px[0] - bent_px[0] == pytest.approx([-7.0, 2.3], abs=0.05)
    assert bent_px[2] == pytest.approx([0, 0], abs=1e-9)


def test_a_ring_has_points_enough_to_follow_the_lens():
    """A side drawn as one straight piece is 2 px off in its middle; in pieces of STRAIGHT_MM, a hundredth."""
    seen = camera(-0.2)
    ring_mm = rectangle((0, 0, *FACE_MM))
    ring_px = seen.ring_px(ring_mm)
    fine_px = seen.to_px(np.column_stack([np.linspace(0, 120, 5001), np.zeros(5001)]))
    assert distance_to(fine_px, np.vstack([ring_px, ring_px[:1]])).max() < 0.01
    assert len(camera().ring_px(ring_mm)) == 4
