"""A blurred box of known width, darkness and blur is found in its profile; doubt is where the profile says nothing."""

import numpy as np
import pytest
from scipy.special import ndtr

from digitise.walls.thin_crack import BoxFit, fit_box
from sealtwin.core.records import Floats

PLACES_PX = 0.5 * np.arange(-30, 31, dtype=float)


def profiles(
    width_px: Floats, darkness: float, blur_px: float, seed: int, noise: float = 0.02
) -> tuple[Floats, Floats]:
    """Windows across a crack, up to 0.3 px beside the line, and windows of plain ground."""
    rng = np.random.default_rng(seed)
    beside_px = rng.uniform(-0.3, 0.3, len(width_px))[:, None]
    left, right = ((PLACES_PX - beside_px + side * width_px[:, None] / 2) / blur_px for side in (1, -1))
    grain = 1 + noise * rng.standard_normal((3, len(width_px), len(PLACES_PX)))
    crack = 0.4 * (1 + 0.01 * PLACES_PX) * (1 - darkness * (ndtr(left) - ndtr(right))) * grain[0]
    return crack, 0.4 * grain[1:].reshape(-1, len(PLACES_PX))


def fitted(width_px: float, darkness: float = 0.9, blur_px: float = 1.0, seed: int = 1) -> BoxFit:
    widths_px = width_px * np.linspace(0.7, 1.3, 60)
    return fit_box(*profiles(widths_px, darkness, blur_px, seed), PLACES_PX, 1.3 * width_px)


@pytest.mark.parametrize(("width_px", "within"), [(2, 0.1), (4, 0.04), (8, 0.02)])
def test_the_mean_width_is_found(width_px, within):
    """Of a crack whose inside has a tenth of the ground's light; the start is 30 % too wide."""
    fit = fitted(width_px)
    assert fit.mean_px == pytest.approx(width_px, rel=within)
    assert fit.interval_px[0] < width_px < fit.interval_px[1]
    assert fit.widths_px == pytest.approx(width_px * np.linspace(0.7, 1.3, 60), rel=0.15, abs=0.2)


def test_doubt_about_the_darkness_is_in_the_interval_of_a_hairline():
    """In a perfect profile: of the darkness between 0.8 and 1 nothing is known at 1.5 px, nearly all at 8 px."""
    half_widths = []
    for width_px in (1.5, 8):
        light, ground = profiles(np.full(60, float(width_px)), 0.9, 1.5, 2, noise=0.005)
        low_px, high_px = fit_box(light, ground, PLACES_PX, width_px).interval_px
        half_widths.append((high_px - low_px) / 2 / width_px)
    assert half_widths[0] > 0.05
    assert half_widths[1] < 0.03


def test_the_tone_curve_is_in_the_interval():
    """With an exponent a twentieth lower or higher, the same stored values are those of another width."""
    light, ground = profiles(np.full(20, 3.0), 0.9, 1.0, 3)
    widths_px = [fit_box(light**power, ground**power, PLACES_PX, 3).mean_px for power in (1 / 1.05, 1.05)]
    low_px, high_px = fit_box(light, ground, PLACES_PX, 3).interval_px
    assert low_px < widths_px[0] < widths_px[1] - 0.1
    assert widths_px[1] < high_px


def test_a_dirty_edge_widens_the_interval_down_to_the_crack_without_it():
    light, ground = profiles(np.full(60, 4.0), 0.9, 1.0, 4)
    dirty = 1 - 0.4 * np.exp(-np.maximum(np.abs(PLACES_PX) - 2.0, 0.0) / 3.5)
    fit = fit_box(light * dirty, ground, PLACES_PX, 4.0)
    assert fit.mean_px > 4.2
    assert fit.interval_px[0] < 4.0 < fit.interval_px[1]
