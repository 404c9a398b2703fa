import json
import subprocess
import sys
from dataclasses import asdict, replace

import cv2
import numpy as np
import pytest

from digitise.geometry.polyline import left_normals, rectangle, signed_area
from digitise.specimens.fracture import mean_width_mm
from digitise.specimens.lighting import DIFFUSE, STRONG_LAMP, Look
from digitise.specimens.recipe import PAPER, Recipe, SideCrack
from digitise.specimens.rendering import coverage
from digitise.specimens.specimen import Specimen, make_specimen
from sealtwin.records import arc_length
from tests.pictures import SMALL_FACE, distance_to
from tests.places import FIXTURE

SHARP = {
    **SMALL_FACE,
    "pores": 0,
    "roughness_mm": 0.0,
    "look": Look(light=0.0, grain=0.0, blur_px=0.9, noise=0.0, jpeg_quality=100),
}
"""A recipe's part that leaves nothing in the photo but edges and the camera."""
QUICK = {**SMALL_FACE, "mm_per_px": 0.2}


@pytest.fixture(scope="module")
def paper() -> Specimen:
    return make_specimen(seed=1)


def pixels(jpeg: bytes) -> np.ndarray:
    return np.asarray(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR), dtype=float)


def test_the_committed_photo_is_what_the_generator_draws(paper):
    committed = (FIXTURE / "photo.jpg").read_bytes()
    assert len(committed) < 1_200_000
    assert np.abs(pixels(committed) - pixels(paper.jpeg)).max() <= 2


def test_the_committed_truth_is_what_the_generator_knows(paper):
    committed = json.loads((FIXTURE / "truth.json").read_text(encoding="utf-8"))
    assert "SYNTHETIC" in committed["about"]
    assert np.array(committed["centreline_mm"]) == pytest.approx(np.array(paper.truth()["centreline_mm"]), abs=1e-3)
    assert committed["recipe"] == json.loads(json.dumps(asdict(PAPER)))
    assert np.array(committed["ends_px"]) == pytest.approx(np.array(paper.ends_px), abs=1e-3)


def test_the_paper_s_crack_has_the_paper_s_length_width_and_angle(paper):
    """3.1 mm wide, 80 mm long, across 40 mm at 30 degrees: the wander makes the straight way a little shorter."""
    first, last = paper.centreline_mm[[0, -1]]
    assert arc_length(paper.centreline_mm)[-1] == pytest.approx(80, abs=1e-6)
    assert mean_width_mm(paper.centreline_mm, paper.width_mm) == pytest.approx(3.1, rel=1e-3)
    assert (first[1], last[1]) == pytest.approx((0, 40), abs=1e-6)
    assert np.degrees(np.arctan2(*(last - first)[::-1])) == pytest.approx(30, abs=2)


def test_both_walls_run_from_edge_to_edge(paper):
    for wall_mm in (paper.left_wall_mm, paper.right_wall_mm):
        assert wall_mm[[0, -1], 1] == pytest.approx([0, 40], abs=1e-9)
    assert signed_area(paper.outline_mm) == pytest.approx(80 * 3.1, rel=0.02)  # and so counter-clockwise


def test_the_photo_shows_the_truth(paper):
    """By pixels alone: dark on the centreline, bright beside the walls, half-way on them.

    The half-way point moves by its slope, 0.4 a pixel, so the tolerance stands for 0.15 px. Shifting the truth by one
    pixel on purpose, it is missed by 0.3.
    """
    light = (pixels(paper.jpeg)[..., 1] / 255) ** 2.2

    def seen(points_mm: np.ndarray) -> float:
        x, y = paper.to_px(points_mm).astype(np.float32).T
        return float(np.mean(cv2.remap(light, x, y, cv2.INTER_LINEAR)))

    inner = np.abs(paper.centreline_mm[:, 1] - 20) < 15
    dark = seen(paper.centreline_mm[inner])
    for wall_mm, side in ((paper.left_wall_mm, 1), (paper.right_wall_mm, -1)):
        wall_mm = wall_mm[np.abs(wall_mm[:, 1] - 20) < 15]
        bright = seen(wall_mm + side * 0.8 * np.array([-0.5, 0.87]))
        assert bright > 5 * dark
        assert (seen(wall_mm) - dark) / (bright - dark) == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize(
    "recipe",
    [
        Recipe(**SHARP),
        Recipe(**{**SHARP, "face_mm": (140, 40)}, lens_k1=-0.2, camera_mm=262, tilt_deg=10, offset_mm=40),
        Recipe(**SHARP, mirrored=True),
    ],
    ids=["plain", "lens and tilt", "mirrored"],
)
def test_half_contrast_lies_on_the_true_walls(recipe):
    """Within 0.02 px where nothing lights the wall, 0.06 px where even diffuse light does (UNLIT_RIM).

    Drawn through a straight lens on purpose, the crack is missed by 1.5 px; pixels counted from their corners, by 0.4.
    """
    truth = make_specimen(4, recipe)
    light = (pixels(truth.jpeg)[..., 1] / 255) ** 2.2
    off_px = [
        float(np.sqrt(np.mean(_half_contrast_px(truth, light, wall_mm, side) ** 2)))
        for wall_mm, side in ((truth.left_wall_mm, 1), (truth.right_wall_mm, -1))
    ]
    assert off_px == pytest.approx([0, 0], abs=0.08)


def _half_contrast_px(truth: Specimen, light: np.ndarray, wall_mm: np.ndarray, side: int) -> np.ndarray:
    """How far outward of a wall, along its normals, brightness is half-way from crack to mortar."""
    inner = np.all((wall_mm > 3) & (wall_mm < np.array(truth.recipe.face_mm) - 3), axis=1)
    foot_mm, outward = wall_mm[inner][::7], side * left_normals(wall_mm)[inner][::7]
    offset_px = np.arange(-8, 8.05, 0.1)
    places_mm = foot_mm[:, None] + (offset_px * truth.recipe.mm_per_px)[:, None] * outward[:, None]
    x, y = truth.to_px(places_mm.reshape(-1, 2)).astype(np.float32).T
    seen = cv2.remap(light, x, y, cv2.INTER_LINEAR).reshape(places_mm.shape[:2])
    half = (np.median(seen[:, :20]) + np.median(seen[:, -20:])) / 2
    rising = (seen[:, :-1] < half) & (seen[:, 1:] >= half)
    nearest = np.argmin(np.where(rising, np.abs(offset_px[:-1]), np.inf), axis=1)
    row = np.arange(len(seen))
    here, there = seen[row, nearest], seen[row, nearest + 1]
    return offset_px[nearest] + 0.1 * (half - here) / (there - here)


def test_two_photos_lit_from_either_side_show_between_them_every_wall_dark():
    """Of the crack's own pixels, a strong lamp makes a tenth look like mortar; the darker of both photos, none."""
    look = Look(light=0.3, grain=0.05, blur_px=0.5, noise=0.0, jpeg_quality=100, lamp=STRONG_LAMP)
    truth = make_specimen(3, Recipe(**SMALL_FACE, look=look, second_photo=True))
    assert truth.second_jpeg is not None
    one, other = (pixels(jpeg)[..., 1] for jpeg in (truth.jpeg, truth.second_jpeg))
    inside = coverage(truth.to_px(truth.outline_mm), truth.camera.size_px) > 0.99
    mortar = np.median(one[coverage(truth.to_px(rectangle((5, 5, 65, 35))), truth.camera.size_px) > 0.99])
    bright = (0.5 ** (1 / 2.2)) * mortar
    shares = [float(np.mean(picture[inside] > bright)) for picture in (one, other, np.minimum(one, other))]
    assert min(shares[:2]) > 0.08
    assert shares[2] < 0.02


def test_side_cracks_are_dark_and_stones_in_the_crack_are_not():
    fork, branch = SideCrack(0.6, "right", 20, 12, 2.0), SideCrack(0.4, "left", 60, 10, 1.2)
    truth = make_specimen(2, Recipe(**QUICK, side_cracks=(fork, branch), stones=2))
    picture = pixels(truth.jpeg)[..., 1]

    def seen(ring_mm: np.ndarray) -> float:
        return float(np.median(picture[coverage(truth.to_px(ring_mm), truth.camera.size_px) > 0.99]))

    crack = seen(truth.outline_mm)
    for ring_mm, line_mm, side in zip(truth.branch_rings_mm, truth.branches_mm, (fork, branch), strict=True):
        assert seen(ring_mm) < 1.3 * crack
        assert signed_area(ring_mm) > 0
        assert np.linalg.norm(line_mm[-1] - line_mm[0]) == pytest.approx(side.length_mm, rel=0.01)
        assert distance_to(line_mm[:1], truth.centreline_mm)[0] < 0.05
    for ring_mm in truth.islands_mm:
        assert seen(ring_mm) > 2 * crack
        assert signed_area(ring_mm) < 0


def test_pores_at_the_wall_leave_the_truth_and_the_rest_of_the_photo_alone():
    plain, spoilt = (make_specimen(2, Recipe(**SMALL_FACE, wall_pores=number)) for number in (0, 12))
    assert np.array_equal(plain.outline_mm, spoilt.outline_mm)
    changed = np.abs(pixels(plain.jpeg) - pixels(spoilt.jpeg)).max(axis=2) > 40
    y, x = np.nonzero(changed)
    ring_px = plain.to_px(np.vstack([plain.outline_mm, plain.outline_mm[:1]]))
    assert len(x) > 100
    # A pore is 1.8 mm across at most, 18 px.
    assert distance_to(np.column_stack([x, y]).astype(float), ring_px).max() < 20


@pytest.mark.parametrize(
    ("recipe", "low", "high"),
    [
        (Recipe(**QUICK, stain=0.4), 0.55, 0.65),
        (Recipe(**QUICK, look=replace(DIFFUSE, shadow=0.4)), 0.55, 0.65),
    ],
    ids=["stain", "shadow"],
)
def test_a_stain_and_a_shadow_take_the_light_that_they_say(recipe, low, high):
    """Held against the same photo without. A fifth to a half of the face lies in it, the rest does not change."""
    clean = make_specimen(2, Recipe(**QUICK))
    face = coverage(clean.to_px(rectangle((2, 2, 68, 38))), clean.camera.size_px) > 0.99
    before, after = ((pixels(jpeg)[..., 1][face] / 255) ** 2.2 for jpeg in (clean.jpeg, make_specimen(2, recipe).jpeg))
    ratio = after / np.maximum(before, 0.1)
    ratio = ratio[before > 0.2]
    assert low < np.quantile(ratio, 0.1) < high
    assert np.quantile(ratio, 0.9) == pytest.approx(1, abs=0.05)
    assert 0.15 < np.mean(ratio < 0.8) < 0.5


def test_a_dark_board_keeps_white_round_its_markers():
    truth = make_specimen(2, Recipe(**QUICK, board=0.05, dictionary="apriltag_36h11"))
    picture = pixels(truth.jpeg)[..., 1]
    beside_px = np.rint(truth.to_px(np.array([[-14.0 + 9, -14.0], [-14.0, -14.0 + 13]]))).astype(int)
    white, dark = picture[beside_px[:, 1], beside_px[:, 0]]
    assert white > 150
    assert dark < 90


def test_a_mirrored_specimen_is_the_mirror_image(paper):
    mirrored = make_specimen(1, Recipe(mirrored=True))
    for one_mm, other_mm in (
        (mirrored.centreline_mm, paper.centreline_mm),
        (mirrored.left_wall_mm, paper.right_wall_mm),
        (mirrored.right_wall_mm, paper.left_wall_mm),
    ):
        assert one_mm == pytest.approx(np.column_stack([160 - other_mm[:, 0], other_mm[:, 1]]))


def test_a_seed_is_a_picture_and_another_seed_another():
    small = Recipe(**QUICK)
    assert make_specimen(2, small).jpeg == make_specimen(2, small).jpeg
    assert make_specimen(2, small).jpeg != make_specimen(3, small).jpeg


def test_a_closed_crack_ends_in_two_tips():
    closed = make_specimen(1, Recipe(ends="closed", length_mm=60, mm_per_px=0.2))
    assert arc_length(closed.centreline_mm)[-1] == pytest.approx(60, abs=1e-6)
    assert mean_width_mm(closed.centreline_mm, closed.width_mm) == pytest.approx(3.1, rel=5e-3)
    assert closed.width_mm[[0, -1]] == pytest.approx(0, abs=1e-6)


def test_the_module_is_a_command(tmp_path, paper):
    subprocess.run([sys.executable, "-m", "digitise.specimens.specimen", str(tmp_path)], check=True)
    assert (tmp_path / "photo.jpg").read_bytes() == paper.jpeg
    assert json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))["seed"] == 1


def test_the_default_recipe_is_the_paper_s():
    assert (PAPER.face_mm, PAPER.length_mm, PAPER.width_mm, PAPER.ends) == ((160, 40), 80, 3.1, "open")
