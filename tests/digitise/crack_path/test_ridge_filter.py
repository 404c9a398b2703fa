"""The filters: two-sided, the same in every direction and contrast, and patient along a way."""

import numpy as np
import pytest

from digitise.crack_path.ridge_filter import strength, support

SIZE = 160
EVERYWHERE = np.ones((SIZE, SIZE), dtype=bool)


def noise(seed=0, size=0.05):
    return (1 + size * np.random.default_rng(seed).standard_normal((SIZE, SIZE))).astype(np.float32)


def across(angle_deg, offset=0.0):
    """Distance from a line through the middle of the picture."""
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    angle = np.radians(angle_deg)
    return y * np.cos(angle) - x * np.sin(angle) - offset


def line(angle_deg=0.0, sigma_px=1.0, depth=0.3):
    return (depth * np.exp(-((across(angle_deg) / sigma_px) ** 2) / 2)).astype(np.float32)


def on_line(value, angle_deg=0.0):
    """Away from the border."""
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    return value[(np.abs(across(angle_deg)) < 0.6) & (np.hypot(x, y) < 50)]


@pytest.mark.parametrize("angle_deg", [0, 11.25, 22.5, 60, 90, 135])
def test_a_line_answers_alike_in_every_direction(angle_deg):
    """Eight directions, the worst place half-way between two; 15 % by the shape of the filter, and noise."""
    level = np.median(on_line(strength(noise() - line(0), EVERYWHERE), 0))
    turned = np.median(on_line(strength(noise() - line(angle_deg), EVERYWHERE), angle_deg))
    assert turned == pytest.approx(level, rel=0.25)


def test_an_edge_is_half_a_line_at_most():
    """Dark against one side only."""
    edge = 0.3 * (across(30) > 0).astype(np.float32)
    answer = on_line(strength(noise() - edge, EVERYWHERE), 30)
    assert np.median(answer) < 0.5 * np.median(on_line(strength(noise() - line(30), EVERYWHERE), 30))


def test_support_goes_on_over_a_gap_and_no_further():
    """28 px, twice what the longest filter looks to one side; 60 px are two cracks. 2.7 lets a crack go on."""
    for gap_px, goes_on in ((28, True), (60, False)):
        crack = line()
        crack[:, 80 - gap_px // 2 : 80 + gap_px // 2] = 0
        picture = noise() - crack
        middle = np.s_[79:82, 78:82]
        assert strength(picture, EVERYWHERE)[middle].max() < 3
        assert (support(picture, EVERYWHERE)[middle].max() > 2.7) == goes_on
