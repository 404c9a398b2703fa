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


@pytest.mark.parametrize("sigma_px", [0.7, 1.5, 3, 6])
def test_lines_of_every_width_are_clear(sigma_px):
    """From 2 to 15 px wide, with six times the noise."""
    assert np.median(on_line(strength(noise() - line(30, sigma_px), EVERYWHERE), 30)) > 8


def test_an_edge_is_half_a_line_at_most():
    """Dark against one side only."""
    edge = 0.3 * (across(30) > 0).astype(np.float32)
    answer = on_line(strength(noise() - edge, EVERYWHERE), 30)
    assert np.median(answer) < 0.5 * np.median(on_line(strength(noise() - line(30), EVERYWHERE), 30))


def test_strength_counts_in_noise():
    """Contrast and noise doubled together change nothing."""
    once = strength(noise(size=0.04) - line(depth=0.15), EVERYWHERE)
    twice = strength(noise(size=0.08) - line(depth=0.3), EVERYWHERE)
    assert (np.abs(twice - once) <= np.maximum(0.02 * np.abs(once), 0.02)).all()


def test_noise_is_counted_where_it_is():
    """Ground twice as rough in one half answers alike in both: noise is averaged over 40 of its 240 px."""
    size = np.where(np.arange(480) < 240, 0.06, 0.03)
    picture = (1 + size * np.random.default_rng(1).standard_normal((160, 480))).astype(np.float32)
    answer = strength(picture, np.ones(picture.shape, dtype=bool))
    assert np.median(answer[:, 360:450]) == pytest.approx(np.median(answer[:, 30:120]), rel=0.1)


def test_support_goes_on_over_a_gap_and_no_further():
    """28 px, twice what the longest filter looks to one side; 60 px are two cracks. 2.7 lets a crack go on."""
    for gap_px, goes_on in ((28, True), (60, False)):
        crack = line()
        crack[:, 80 - gap_px // 2 : 80 + gap_px // 2] = 0
        picture = noise() - crack
        middle = np.s_[79:82, 78:82]
        assert strength(picture, EVERYWHERE)[middle].max() < 3
        assert (support(picture, EVERYWHERE)[middle].max() > 2.7) == goes_on


def test_joints_hide_no_crack_beside_them():
    """Two clear lines, and what they reach, fill two fifths of the picture; what starts a crack is 4."""
    x = np.arange(SIZE)
    faint = 0.12 * np.exp(-((x - 80.0) ** 2) / 2)
    joints = 0.6 * (np.exp(-(((x - 20) / 3) ** 2) / 2) + np.exp(-(((x - 140) / 3) ** 2) / 2))
    answer = support((noise() - faint - joints).astype(np.float32), EVERYWHERE)
    assert np.median(answer[30:130, 80]) > 4


def test_what_may_not_be_searched_makes_no_noise():
    """A rough part that is masked leaves ground beyond the reach of the widest filter as clear as without it."""
    rough = np.random.default_rng(2).standard_normal((80, 480)) * np.where(np.arange(480) < 160, 0.3, 0.02)
    quiet = np.where(np.arange(480) < 160, 0, rough)
    masked = np.ones((80, 480), dtype=bool)
    masked[:, :160] = False
    with_mask, without = (strength((1 + grain).astype(np.float32), masked)[:, 250:300] for grain in (rough, quiet))
    assert with_mask == pytest.approx(without, rel=0.02, abs=0.02)
