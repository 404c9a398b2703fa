"""What a photo of known places tells of the camera: its lens, its pose, its scale and how sure that is."""

from typing import NamedTuple

import numpy as np
import pytest

from digitise.scale.view import MOST_SPREAD_DEG, Fit, Lens, find_tilt, fit_corners, fit_markers
from tests.support.marker_boards import board_around, camera, face_grid_mm, places_mm
from tests.support.photos import rms

RUNS = 30
"""RMS of as many errors is within 13 % of the truth, and with it every ratio below."""


def fitted(rng, count=8, lens=False, noise_px=0.05, placing_mm=0.0, **of_camera) -> tuple[Fit, np.ndarray]:
    """A fit to noisy corners of markers that were glued on askew, and its true errors of local scale over the face."""
    view, board = camera(**of_camera), board_around(count)
    true_mm = places_mm(board)
    glued_mm = true_mm + np.repeat(rng.normal(0, placing_mm, (count, 2)), 4, axis=0)
    seen_px = view.to_px(glued_mm) + rng.normal(0, noise_px, true_mm.shape)
    fit = fit_markers(seen_px, true_mm, view.size_px, lens)
    exact = fit_markers(view.to_px(true_mm), true_mm, view.size_px, lens_wanted=True)
    places_px = view.to_px(face_grid_mm())
    return fit, fit.view.mm_per_px_at(places_px) / exact.view.mm_per_px_at(places_px) - 1


@pytest.mark.parametrize("k1", [-0.05, -0.2, 0.1])
def test_a_lens_and_a_tilted_plane_are_found_exactly_where_nothing_is_noisy(k1):
    """The camera is that of the synthetic photos: k1 over the square of the focal length in px."""
    view, true_mm = camera(tilt_deg=12, lens_k1=k1), places_mm(board_around())
    fit = fit_markers(view.to_px(true_mm), true_mm, view.size_px, lens_wanted=True)
    grid_mm = face_grid_mm()
    assert fit.view.to_mm(view.to_px(grid_mm)) == pytest.approx(grid_mm, abs=1e-5)
    assert fit.view.lens is not None
    assert fit.view.lens.bend_px2 * view.focal_px**2 == pytest.approx(k1, abs=1e-6)


@pytest.mark.parametrize(
    ("lens", "count", "noise_px", "placing_mm", "most"),
    [
        (True, 8, 0.03, 0.1, 2),
        (True, 4, 0.03, 0.1, 2),
    ],
    ids=["8 glued", "4 glued"],
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
        stated.append(fit.spread_of_scale(places_px))
        true.append(rms(error))
    assert 0.5 < rms(np.array(stated)) / rms(np.array(true)) < most


def test_the_spread_by_clicks_is_honest():
    """Four corners have no misfit to judge by: what is known of clicks stands in. Exact but for curvature."""
    rng = np.random.default_rng(3)
    view, corners_mm = camera(), np.array([[0.0, 0], [160, 0], [160, 40], [0, 40]])
    places_px = view.to_px(face_grid_mm())
    exact = fit_corners(view.to_px(corners_mm), corners_mm, 1.0)
    true = []
    for _ in range(4 * RUNS):
        clicked_px = view.to_px(corners_mm) + rng.normal(0, 1.0, (4, 2))
        fit = fit_corners(clicked_px, corners_mm, 1.0)
        true.append(rms(fit.view.mm_per_px_at(places_px) / exact.view.mm_per_px_at(places_px) - 1))
    stated = exact.spread_of_scale(places_px)
    assert 0.8 < stated / rms(np.array(true)) < 1.25


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


DISTANCE_MM = 262.0


class Pose(NamedTuple):
    distance_mm: float | None
    tilt_deg: float | None


def pose_of(tilt_deg, noise_px=0.05, by_focal=False, by_distance=False, seed=1) -> Pose:
    view, true_mm = camera(tilt_deg), places_mm(board_around())
    seen_px = view.to_px(true_mm) + np.random.default_rng(seed).normal(0, noise_px, true_mm.shape)
    middle_px = view.to_px(np.array([[80.0, 20.0]]))[0]
    fit = fit_markers(seen_px, true_mm, view.size_px, lens_wanted=False)
    return Pose(*find_tilt(fit, middle_px, view.focal_px if by_focal else None, DISTANCE_MM if by_distance else None))


def true_tilt_deg(tilt_deg):
    """The synthetic camera leans about x, and half as much about y."""
    return np.degrees(np.arccos(np.cos(np.radians(tilt_deg)) * np.cos(np.radians(tilt_deg / 2))))


@pytest.mark.parametrize("sources", [{"by_focal": True}, {"by_distance": True}], ids=["focal", "distance"])
@pytest.mark.parametrize("tilt_deg", [0.0, 5.0, 15.0])
def test_tilt_and_distance_of_a_camera_are_found(tilt_deg, sources):
    """To 0.15 degrees at up to 5, and 2.5 % of the distance; corners are seen to 0.05 px."""
    pose = pose_of(tilt_deg, **sources)
    assert pose.tilt_deg == pytest.approx(true_tilt_deg(tilt_deg), abs=0.15, rel=0.025)
    assert pose.distance_mm == pytest.approx(DISTANCE_MM, rel=0.025)


def test_a_tilt_is_not_stated_without_a_distance_or_if_noise_hides_it():
    assert pose_of(5.0) == (None, None)
    assert pose_of(5.0, noise_px=30.0, by_distance=True) == (DISTANCE_MM, None)
    sure = [pose_of(5.0, noise_px=1.0, by_focal=True, seed=seed).tilt_deg for seed in range(10)]
    assert max(abs(tilt_deg - true_tilt_deg(5.0)) for tilt_deg in sure if tilt_deg) < 2 * MOST_SPREAD_DEG
