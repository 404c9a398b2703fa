"""The camera found from known points: its lens, pose and scale, and the uncertainty of the scale."""

import numpy as np
import pytest

from digitise.scale.view import find_tilt, fit_corners, fit_markers
from tests.support.marker_boards import board_around, camera, face_grid_mm, places_mm
from tests.support.photos import rms

RUNS = 30
"""The RMS of this many errors is within 13 % of the truth, and so is every ratio below."""


@pytest.mark.parametrize("k1", [-0.05, -0.2, 0.1])
def test_lens_and_tilt_are_recovered_exactly_from_noise_free_points(k1):
    """The camera is that of the synthetic photos; k1 is divided by the square of the focal length in px."""
    view, true_mm = camera(tilt_deg=12, lens_k1=k1), places_mm(board_around())
    fit = fit_markers(view.to_px(true_mm), true_mm, view.size_px, lens_wanted=True)
    grid_mm = face_grid_mm()
    assert fit.view.to_mm(view.to_px(grid_mm)) == pytest.approx(grid_mm, abs=1e-5)
    assert fit.view.lens is not None
    assert fit.view.lens.bend_px2 * view.focal_px**2 == pytest.approx(k1, abs=1e-6)


def test_the_stated_spread_of_the_scale_agrees_with_its_actual_errors():
    """Both agree within a factor of 2, also if the four corners of a marker share an error.

    Four markers are glued on askew by 0.1 mm. With independent corners the stated error would be a sixth.
    """
    rng = np.random.default_rng(7)
    view, true_mm = camera(), places_mm(board_around(4))
    exact = fit_markers(view.to_px(true_mm), true_mm, view.size_px, lens_wanted=True).view
    grid_px = view.to_px(face_grid_mm())
    stated, errors = [], []
    for _ in range(RUNS):
        glued_px = view.to_px(true_mm + np.repeat(rng.normal(0, 0.1, (4, 2)), 4, axis=0))
        fit = fit_markers(glued_px + rng.normal(0, 0.03, true_mm.shape), true_mm, view.size_px, lens_wanted=True)
        stated.append(fit.spread_of_scale(grid_px))
        errors.append(rms(fit.view.mm_per_px_at(grid_px) / exact.mm_per_px_at(grid_px) - 1))
    assert 0.5 < rms(np.array(stated)) / rms(np.array(errors)) < 2


def test_the_stated_scale_spread_from_clicked_corners_agrees_with_actual_errors():
    """Four corners leave no misfit, so that an error of 1 px a click is assumed. Tolerance: the mapping's curvature."""
    rng = np.random.default_rng(3)
    view, corners_mm = camera(), np.array([[0.0, 0], [160, 0], [160, 40], [0, 40]])
    places_px = view.to_px(face_grid_mm())
    exact = fit_corners(view.to_px(corners_mm), corners_mm, 1.0)
    true = []
    for _ in range(2 * RUNS):
        clicked_px = view.to_px(corners_mm) + rng.normal(0, 1.0, (4, 2))
        fit = fit_corners(clicked_px, corners_mm, 1.0)
        true.append(rms(fit.view.mm_per_px_at(places_px) / exact.view.mm_per_px_at(places_px) - 1))
    stated = exact.spread_of_scale(places_px)
    assert 0.8 < stated / rms(np.array(true)) < 1.25


DISTANCE_MM = 262.0


def pose_of(tilt_deg, noise_px=0.05, by_focal=False, by_distance=False, seed=1) -> tuple[float | None, float | None]:
    """Distance in mm and tilt in degrees."""
    view, true_mm = camera(tilt_deg), places_mm(board_around())
    seen_px = view.to_px(true_mm) + np.random.default_rng(seed).normal(0, noise_px, true_mm.shape)
    middle_px = view.to_px(np.array([[80.0, 20.0]]))[0]
    fit = fit_markers(seen_px, true_mm, view.size_px, lens_wanted=False)
    return find_tilt(fit, middle_px, view.focal_px if by_focal else None, DISTANCE_MM if by_distance else None)


def true_tilt_deg(tilt_deg):
    """The synthetic camera leans about x, and half as much about y."""
    return np.degrees(np.arccos(np.cos(np.radians(tilt_deg)) * np.cos(np.radians(tilt_deg / 2))))


@pytest.mark.parametrize("sources", [{"by_focal": True}, {"by_distance": True}], ids=["focal", "distance"])
@pytest.mark.parametrize("tilt_deg", [0.0, 15.0])
def test_the_tilt_and_distance_of_a_camera_are_recovered_from_markers(tilt_deg, sources):
    """Tolerances: 0.15 degrees or 2.5 % of the tilt, and 2.5 % of the distance; corners have a noise of 0.05 px."""
    distance_mm, seen_deg = pose_of(tilt_deg, **sources)
    assert seen_deg == pytest.approx(true_tilt_deg(tilt_deg), abs=0.15, rel=0.025)
    assert distance_mm == pytest.approx(DISTANCE_MM, rel=0.025)
