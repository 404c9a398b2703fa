import numpy as np
import pytest

from digitise.scale.view import Fit, fit_view
from tests.boards import board_around, camera, face_grid_mm, places_mm
from tests.pictures import rms

RUNS = 30
"""RMS of as many errors is within 13 % of the truth, and with it every ratio below."""


def fitted(rng, count=8, lens=False, noise_px=0.05, placing_mm=0.0, **of_camera) -> tuple[Fit, np.ndarray]:
    """A fit to noisy corners of markers that were glued on askew, and its true errors of local scale over the face."""
    view, board = camera(**of_camera), board_around(count)
    true_mm = places_mm(board)
    glued_mm = true_mm + np.repeat(rng.normal(0, placing_mm, (count, 2)), 4, axis=0)
    seen_px = view.to_px(glued_mm) + rng.normal(0, noise_px, true_mm.shape)
    fit = fit_view(seen_px, true_mm, view.size_px, lens)
    exact = fit_view(view.to_px(true_mm), true_mm, view.size_px, lens=True)
    places_px = view.to_px(face_grid_mm())
    return fit, fit.view.mm_per_px_at(places_px) / exact.view.mm_per_px_at(places_px) - 1


@pytest.mark.parametrize("k1", [0.0, -0.05, -0.2, 0.1])
def test_a_lens_and_a_tilted_plane_are_found_exactly_where_nothing_is_noisy(k1):
    """The camera is that of the synthetic photos: k1 over the square of the focal length in px."""
    view, true_mm = camera(tilt_deg=12, lens_k1=k1), places_mm(board_around())
    fit = fit_view(view.to_px(true_mm), true_mm, view.size_px, lens=True)
    grid_mm = face_grid_mm()
    assert fit.view.to_mm(view.to_px(grid_mm)) == pytest.approx(grid_mm, abs=1e-5)
    assert fit.view.lens is not None
    assert fit.view.lens.bend_px2 * view.focal_px**2 == pytest.approx(k1, abs=1e-6)


def test_without_its_lens_a_barrel_is_off_by_half_a_percent():
    """What the radial term is for: the design note measured 0.36 % at k1 = -0.05."""
    _, error = fitted(np.random.default_rng(1), lens=False, noise_px=0, lens_k1=-0.05)
    assert rms(error) > 0.004


@pytest.mark.parametrize(
    ("lens", "count", "noise_px", "placing_mm", "most"),
    [
        (True, 8, 0.05, 0.0, 2),
        (True, 8, 0.03, 0.1, 2),
        (True, 4, 0.03, 0.1, 2),
        (True, 4, 0.05, 0.0, 5),
        (False, 8, 0.03, 0.1, 2),
        (False, 4, 0.05, 0.0, 5),
    ],
    ids=["8 corners", "8 glued", "4 glued", "4 corners", "8 glued, no lens", "4 corners, no lens"],
)
def test_the_spread_of_the_scale_is_honest(lens, count, noise_px, placing_mm, most):
    """Stated and true errors agree within a factor of 2, also where the four corners of a marker share theirs.

    Taken for independent, corners of markers glued on askew promise half of the error, of four markers a sixth. Of four
    markers, none can be spared to judge the others: where they are perfect, more is promised than is so, and no less.
    """
    rng = np.random.default_rng(7)
    places_px = camera().to_px(face_grid_mm())
    stated, true = [], []
    for _ in range(RUNS):
        fit, error = fitted(rng, count, lens, noise_px, placing_mm)
        stated.append(fit.spread_of_scale(places_px, fit.covariance_by_group(4)))
        true.append(rms(error))
    assert 0.5 < rms(np.array(stated)) / rms(np.array(true)) < most


def test_the_spread_by_clicks_is_honest():
    """Four corners have no misfit to judge by: what is known of clicks stands in. Exact but for curvature."""
    rng = np.random.default_rng(3)
    view, corners_mm = camera(), np.array([[0.0, 0], [160, 0], [160, 40], [0, 40]])
    places_px = view.to_px(face_grid_mm())
    exact = fit_view(view.to_px(corners_mm), corners_mm, view.size_px, lens=False)
    true = []
    for _ in range(4 * RUNS):
        clicked_px = view.to_px(corners_mm) + rng.normal(0, 1.0, (4, 2))
        fit = fit_view(clicked_px, corners_mm, view.size_px, lens=False)
        true.append(rms(fit.view.mm_per_px_at(places_px) / exact.view.mm_per_px_at(places_px) - 1))
    stated = exact.spread_of_scale(places_px, exact.covariance_of_clicks(1.0))
    assert 0.8 < stated / rms(np.array(true)) < 1.25


def test_leaving_out_by_one_step_is_as_good_as_fitting_again():
    """The jackknife's shortcut against its definition; misfits of a hundredth of the photo bend it by 2 %."""
    view, true_mm = camera(), places_mm(board_around())
    seen_px = view.to_px(true_mm) + np.random.default_rng(2).normal(0, 0.3, true_mm.shape)
    place_px = view.to_px(np.array([[20.0, 30.0]]))
    fit = fit_view(seen_px, true_mm, view.size_px, lens=False)
    without = []
    for first in range(0, len(true_mm), 4):
        kept = np.delete(np.arange(len(true_mm)), np.s_[first : first + 4])
        refit = fit_view(seen_px[kept], true_mm[kept], view.size_px, lens=False)
        without.append(refit.view.to_mm(place_px)[0] - fit.view.to_mm(place_px)[0])
    by_refits = np.sqrt(7 / 8 * np.sum(np.square(without), axis=0))
    by_steps = fit.spread(lambda tried: tried.to_mm(place_px)[0], fit.covariance_by_group(4))
    assert by_steps == pytest.approx(by_refits, rel=0.05)
