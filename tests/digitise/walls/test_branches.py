from dataclasses import replace

import numpy as np
import pytest
from manifold3d import CrossSection, FillRule

from digitise.geometry.polyline import crossings, signed_area
from digitise.outline import trace_outline
from digitise.path import find_path
from digitise.settings import CrackShape
from digitise.solid import build_solid
from digitise.specimens.recipe import Recipe, SideCrack
from digitise.specimens.specimen import make_specimen
from tests.pictures import SMALL_FACE, evenly_scaled, mortar, photo_of, with_crack, write_png

FORK = SideCrack(at=0.35, side="left", angle_deg=35, length_mm=14, width_mm=1.8)
BRANCH = SideCrack(at=0.65, side="right", angle_deg=70, length_mm=12, width_mm=1.4)
HAIR = SideCrack(at=0.65, side="right", angle_deg=70, length_mm=12, width_mm=0.5)


def scene_of(folder, *sides):
    """A specimen, its photo, and the path that knows its side cracks."""
    truth = make_specimen(1, Recipe(**SMALL_FACE, side_cracks=sides))
    photo = photo_of(truth, folder)
    path = find_path(photo, truth.ends_px)
    return truth, photo, replace(path, branches_px=tuple(truth.to_px(line) for line in truth.branches_mm))


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return scene_of(tmp_path_factory.mktemp("branches"), FORK, BRANCH)


@pytest.fixture(scope="module")
def kept(scene):
    _, photo, path = scene
    return trace_outline(photo, path, keep_branches=True)


@pytest.fixture(scope="module")
def dropped(scene):
    _, photo, path = scene
    return trace_outline(photo, path)


def test_kept_side_cracks_add_their_own_area(scene, kept, dropped):
    """2 % of the outline: measured 0.2 %; without one of the two at least 5 % would be missing."""
    truth, *_ = scene
    whole = CrossSection([truth.outline_mm, *truth.branch_rings_mm], FillRule.Positive)
    traced = CrossSection([kept.outline_mm], FillRule.Positive)
    assert traced.area() == pytest.approx(whole.area(), rel=0.02)
    # What one has and the other has not: 0.05 mm on either side of some 140 mm of walls.
    assert (traced - whole).area() + (whole - traced).area() < 14
    assert signed_area(dropped.outline_mm) < 0.92 * whole.area()
    assert kept.branches_kept
    assert not crossings(kept.outline_mm, closed=True)


def test_walls_and_centreline_stay_those_of_the_main_crack(kept, dropped):
    for name in ("centreline_mm", "left_wall_mm", "right_wall_mm"):
        assert np.array_equal(getattr(kept, name), getattr(dropped, name))


def test_side_cracks_left_out_are_named(scene, dropped):
    truth, *_ = scene
    warning = '2 side cracks (14 and 12 mm) are left out; branches = "keep" keeps them'
    assert warning in dropped.warnings
    assert not dropped.branches_kept
    assert len(dropped.branches_mm) == 2
    # Through a lens found from markers: their scale's residual.
    assert dropped.branches_mm[0] == pytest.approx(truth.branches_mm[0], abs=0.05)


def test_kept_side_cracks_become_part_of_the_solid(kept, dropped):
    shape = CrackShape(depth_mm=8.0, tilt="vertical")
    with_them, without = build_solid(kept, shape), build_solid(dropped, shape)
    added_mm2 = signed_area(kept.outline_mm) - signed_area(dropped.outline_mm)
    # The solid's outline is simplified to 0.003 mm.
    assert with_them.cavity_volume_mm3 - without.cavity_volume_mm3 == pytest.approx(8 * added_mm2, rel=0.01)


def test_a_side_crack_too_narrow_to_measure_is_left_out_and_said(tmp_path):
    _, photo, path = scene_of(tmp_path, FORK, HAIR)
    outline = trace_outline(photo, path, keep_branches=True)
    alone = trace_outline(photo, replace(path, branches_px=path.branches_px[:1]), keep_branches=True)
    assert np.array_equal(outline.outline_mm, alone.outline_mm)
    assert any(warning.startswith("1 side crack (12 mm) cannot be measured") for warning in outline.warnings)
    assert not any("cannot be measured" in warning for warning in alone.warnings)


def test_ground_closed_in_by_a_side_crack_stands_as_an_island(tmp_path):
    main, loop = [(-20, 200), (520, 200)], [(150, 200), (200, 110), (300, 110), (350, 200)]
    picture = with_crack(with_crack(mortar(), main, width_px=24), loop, width_px=14)
    photo = evenly_scaled(write_png(tmp_path / "photo.png", picture))
    path = replace(find_path(photo, ((60.0, 200.0), (440.0, 200.0))), branches_px=(np.array(loop, dtype=float),))
    outline = trace_outline(photo, path, keep_branches=True)
    (island,) = outline.islands_mm
    # What OpenCV draws is a pixel wider than it was told: one pixel of its 370 px rim is 3.7 mm².
    inner = CrossSection([np.array([*loop, loop[0]][::-1], dtype=float)], FillRule.NonZero).offset(-7)
    inner -= CrossSection.square((500, 24)).translate((0, 188))
    assert -signed_area(island) == pytest.approx(inner.area() / 100, abs=3.7)
