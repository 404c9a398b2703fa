import numpy as np
import pytest

from digitise.scale.view import Lens

CENTRE_PX = np.array([2000.0, 1500.0])
FOCAL_PX = 3000.0


def lens_of(k1: float) -> Lens:
    return Lens(CENTRE_PX, k1 / FOCAL_PX**2)


def photo_grid_px() -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0, 4000, 41), np.linspace(0, 3000, 31))
    return np.column_stack([x.ravel(), y.ravel()])


@pytest.mark.parametrize("k1", [-0.2, -0.05, -1e-6, 1e-6, 0.1, 0.4])
def test_straightening_and_bending_undo_each_other_everywhere_in_the_photo(k1):
    """Closed form both ways: rounding at 4000 px leaves 1e-12. The centre is among the points."""
    lens, seen_px = lens_of(k1), photo_grid_px()
    assert lens.bent(lens.straightened(seen_px)) == pytest.approx(seen_px, abs=1e-8)
    assert np.any(np.all(seen_px == CENTRE_PX, axis=1))


def test_a_barrel_draws_the_border_in_and_leaves_the_centre():
    """By x (1 + k1 r²), 1500 px at half the focal length, with k1 = -0.1, are drawn in by 1500 * 0.1 / 4 = 37.5 px."""
    moved_px = lens_of(-0.1).bent(CENTRE_PX + np.array([[1500.0, 0], [0, 0]]))
    assert moved_px == pytest.approx(CENTRE_PX + np.array([[1462.5, 0], [0, 0]]), abs=1e-9)


def test_a_lens_of_no_bend_moves_nothing():
    assert lens_of(0.0).straightened(photo_grid_px()) == pytest.approx(photo_grid_px(), abs=1e-9)


def test_a_barrel_reaches_as_far_as_it_shows_farther_places_farther_out():
    """Beyond, the same pixel would show two places. r (1 - |b| r²) is largest at r = 1 / sqrt(3 |b|)."""
    lens = lens_of(-0.2)
    turning_px = FOCAL_PX / np.sqrt(3 * 0.2)
    at_turn, before, after = (
        np.linalg.norm(lens.bent(CENTRE_PX + np.array([[r, 0.0]])) - CENTRE_PX)
        for r in (turning_px, 0.99 * turning_px, 1.01 * turning_px)
    )
    assert lens.reach_px == pytest.approx(at_turn, rel=1e-12)
    assert max(before, after) < lens.reach_px
    assert lens_of(0.2).reach_px == np.inf
