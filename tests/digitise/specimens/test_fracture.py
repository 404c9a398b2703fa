import numpy as np
import pytest

from digitise.geometry.polyline import signed_area
from digitise.specimens.fracture import Fracture, fracture, mean_width_mm
from digitise.specimens.recipe import Recipe, SideCrack
from sealtwin.records import Floats, arc_length
from tests.pictures import SMALL_FACE, distance_to


def drawn(recipe: Recipe, seed: int = 2) -> Fracture:
    return fracture(recipe, np.random.default_rng([seed, 1]), np.random.default_rng([seed, 3]))


def windings(points: Floats, ring: Floats) -> Floats:
    """How often a ring goes round each point, counter-clockwise, (n,)."""
    away = ring - points[:, None]
    angle = np.arctan2(away[..., 1], away[..., 0])
    turn = np.diff(np.concatenate([angle, angle[:, :1]], axis=1), axis=1)
    return np.rint(((turn + np.pi) % (2 * np.pi) - np.pi).sum(axis=1) / (2 * np.pi))


def test_an_open_crack_runs_on_beyond_the_face_and_a_closed_one_ends_in_tips():
    opened, closed = drawn(Recipe(**SMALL_FACE)), drawn(Recipe(face_mm=(70, 40), length_mm=50, ends="closed"))
    assert opened.line_mm[0, 1] < -5
    assert opened.line_mm[-1, 1] > 45
    for station in (0, -1):
        assert closed.left_mm[station] == pytest.approx(closed.right_mm[station], abs=1e-9)
    assert arc_length(closed.line_mm)[-1] == pytest.approx(50, abs=1e-6)
    width_mm = np.linalg.norm(closed.left_mm - closed.right_mm, axis=1)
    assert mean_width_mm(closed.line_mm, width_mm) == pytest.approx(3.1, rel=5e-3)


def test_an_offset_moves_the_crack_to_the_right():
    there = drawn(Recipe(face_mm=(120, 40), length_mm=50, offset_mm=20))
    here = drawn(Recipe(face_mm=(120, 40), length_mm=50))
    assert there.line_mm == pytest.approx(here.line_mm + np.array([20.0, 0.0]))


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_a_side_crack_leaves_the_middle_of_the_main_one_at_its_angle(side, sign):
    crack = drawn(Recipe(**SMALL_FACE, side_cracks=(SideCrack(0.5, side, 60, 12, 1.5),)))
    (line_mm,), (ring_mm,) = crack.side_lines_mm, crack.side_rings_mm
    nearest = int(np.argmin(np.linalg.norm(crack.line_mm - line_mm[0], axis=1)))
    along = crack.line_mm[nearest + 1] - crack.line_mm[nearest - 1]
    way = line_mm[-1] - line_mm[0]
    turn_deg = np.degrees(np.arctan2(along[0] * way[1] - along[1] * way[0], along @ way))
    assert np.linalg.norm(crack.line_mm[nearest] - line_mm[0]) < 1e-9
    # The wander bends it by some degrees.
    assert turn_deg == pytest.approx(sign * 60, abs=5)
    assert np.linalg.norm(way) == pytest.approx(12, rel=0.01)
    assert signed_area(ring_mm) > 0
    assert windings(line_mm[1:-1:20], ring_mm) == pytest.approx(1)


def test_stones_are_clockwise_rings_inside_the_crack_and_apart():
    crack = drawn(Recipe(**SMALL_FACE, stones=3))
    outline_mm = np.concatenate([crack.right_mm, crack.left_mm[::-1]])
    assert len(crack.stones_mm) == 3
    for ring_mm in crack.stones_mm:
        assert signed_area(ring_mm) < -0.5  # mm2
        assert windings(ring_mm, outline_mm) == pytest.approx(1)
    for one, other in zip(crack.stones_mm, crack.stones_mm[1:], strict=False):
        assert distance_to(one, other).min() > 2


def test_pores_at_the_wall_open_into_the_crack_and_reach_out_of_it():
    crack = drawn(Recipe(**SMALL_FACE, wall_pores=20))
    outline_mm = np.concatenate([crack.right_mm, crack.left_mm[::-1]])
    assert len(crack.wall_pores_mm) == 20
    for ring_mm in crack.wall_pores_mm:
        inside = np.mean(windings(ring_mm, outline_mm) == 1)
        assert 0 < inside < 0.6


def test_a_mirrored_crack_is_the_mirror_image_with_rings_that_turn_the_same_way():
    recipe = Recipe(**SMALL_FACE, side_cracks=(SideCrack(0.5, "left", 60, 12, 1.5),), stones=1, wall_pores=1)
    plain = drawn(recipe)
    mirrored = plain.mirrored(70)

    def flipped(points_mm: Floats) -> Floats:
        return np.column_stack([70 - points_mm[:, 0], points_mm[:, 1]])

    assert mirrored.line_mm == pytest.approx(flipped(plain.line_mm))
    assert mirrored.left_mm == pytest.approx(flipped(plain.right_mm))
    assert mirrored.right_mm == pytest.approx(flipped(plain.left_mm))
    assert signed_area(mirrored.side_rings_mm[0]) == pytest.approx(signed_area(plain.side_rings_mm[0]))
    assert signed_area(mirrored.stones_mm[0]) == pytest.approx(signed_area(plain.stones_mm[0]))
    assert mirrored.side_lines_mm[0] == pytest.approx(flipped(plain.side_lines_mm[0]))


@pytest.mark.parametrize(
    ("recipe", "says"),
    [
        (Recipe(length_mm=300), "does not fit"),
        (Recipe(length_mm=39), "too short"),
        (Recipe(ends="closed", length_mm=100), "does not fit"),
        (Recipe(**SMALL_FACE, width_mm=8), "crosses itself"),
        (
            Recipe(**SMALL_FACE, side_cracks=(SideCrack(0.9, "left", 60, 30, 1.2),)),
            "side crack 30 mm long does not fit",
        ),
    ],
)
def test_a_crack_that_does_not_fit_its_face_is_refused(recipe, says):
    with pytest.raises(ValueError, match=says):
        drawn(recipe, 1)
