import numpy as np
import pytest

from digitise.geometry.polyline import coverage, signed_area


def test_coverage_adds_up_to_the_area_of_the_ring():
    """Broken on purpose with cv2.fillPoly, which grows every shape, the sum is 5 % too large."""
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    ring = np.column_stack([20.3 + 11.7 * np.cos(turn), 17.9 + 9.2 * np.sin(turn)])
    cover = coverage(ring, (48, 40))
    assert cover.sum() == pytest.approx(signed_area(ring), rel=1e-3)
    assert cover.min() >= 0
    assert cover.max() <= 1 + 1e-6


@pytest.mark.parametrize("way", [1, -1])
def test_a_pixel_is_centred_on_whole_numbers(way):
    box = np.array([[2.0, 1.5], [4.25, 1.5], [4.25, 3.5], [2.0, 3.5]])[::way]
    cover = coverage(box, (8, 6))
    assert cover[2] == pytest.approx([0, 0, 0.5, 1, 0.75, 0, 0, 0], abs=1e-6)
    assert cover[1] == pytest.approx(0, abs=1e-6)
