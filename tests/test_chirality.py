"""A crack that differs from its mirror image, from photo to profile: a robot would follow a mirrored path."""

import json

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold, Mesh
from matplotlib.path import Path as Polygon

from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import load_photo
from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.record_files import write_solid
from sealtwin.core.records import Floats
from sealtwin.trial.trial_file import load_trial
from simulate.profile import measure_profile
from tests.simulate.test_profile import run_of
from tests.support.paths import FIXTURE

LOW_MM, HIGH_MM = -12.0, -4.0
"""Level of the sealant in the lower left half of the crack, and in the upper right one."""


@pytest.fixture(scope="module")
def truth() -> dict:
    return json.loads((FIXTURE / "truth.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def traced():
    """The fixture's crack runs from the lower left to the upper right of its photo; its mirror image does not."""
    trial = load_trial(FIXTURE / "trial.toml")
    assert trial.photo is not None
    photo = load_photo(trial.photo, FIXTURE)
    outline = trace_outline(photo, find_path(photo, trial.photo.ends_px))
    return outline, build_solid(outline, CrackShape(depth_mm=16.0, tilt="vertical"))


def _ring_mm(truth: dict) -> Floats:
    return np.concatenate([truth["right_wall_mm"], truth["left_wall_mm"][::-1]])


def test_the_crack_in_the_stl_is_not_mirrored(traced, truth, tmp_path):
    write_solid(tmp_path, traced[1])
    stl = trimesh.load_mesh(tmp_path / "crack.stl")
    cut = Manifold(Mesh(np.array(stl.vertices, np.float32), np.array(stl.faces, np.uint32))).slice(-8.0)
    centreline = np.array(truth["centreline_mm"])[20:-20:20]
    assert not _in_material(cut, centreline).any()
    assert _in_material(cut, [0.0, 40.0] + centreline * [1.0, -1.0]).mean() > 0.8


def _in_material(cut: CrossSection, points_mm: Floats) -> Floats:
    """Return whether points are inside an odd number of contours."""
    return np.sum([Polygon(ring).contains_points(points_mm) for ring in cut.to_polygons()], axis=0) % 2 == 1


def test_the_nozzle_path_follows_the_crack_and_not_its_mirror_image(traced, truth):
    path = plan_trajectory(traced[0], NozzlePath(volume_ml=4.8), 1.0)
    crack, image = Polygon(_ring_mm(truth)), Polygon([0.0, 40.0] + _ring_mm(truth) * [1.0, -1.0])
    assert crack.contains_points(path.position_mm[:, :2]).all()
    assert image.contains_points(path.position_mm[:, :2]).mean() < 0.2


def test_the_level_profile_is_not_mirrored_along_the_crack(traced, truth):
    """Particles are placed in the true crack by its coordinates."""
    outline, solid = traced
    plan = np.stack(np.meshgrid(np.arange(0, 160, 0.7), np.arange(0, 40, 0.7)), -1).reshape(-1, 2)
    within = plan[Polygon(_ring_mm(truth)).contains_points(plan, radius=-0.3)]
    height_mm = np.arange(-15.6, 0, 0.7)
    points = np.column_stack([np.repeat(within, len(height_mm), axis=0), np.tile(height_mm, len(within))])
    below = points[:, 2] + 0.35 < np.where(points[:, 0] < 80.0, LOW_MM, HIGH_MM)
    profile = measure_profile(run_of(points[below]), outline, solid)
    expected = np.where(profile.s_mm < np.interp(80.0, outline.centreline_mm[:, 0], outline.s_mm), LOW_MM, HIGH_MM)
    clear = (profile.s_mm > 4) & (profile.s_mm < outline.length_mm - 4) & (np.abs(profile.s_mm - 40) > 4)
    off_mm = np.abs(profile.level_mm - expected)[clear].mean()
    assert off_mm < 0.7  # a lattice of 0.7 mm
