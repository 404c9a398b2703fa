import json
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from digitise.polyline import signed_area
from digitise.specimen import PAPER, Recipe, Specimen, make_specimen, mean_width_mm
from sealtwin.records import arc_length

FIXTURE = Path(__file__).parent.parent / "fixtures" / "paper-trial"


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


def test_a_mirrored_specimen_is_the_mirror_image(paper):
    mirrored = make_specimen(1, Recipe(mirrored=True))
    for one_mm, other_mm in (
        (mirrored.centreline_mm, paper.centreline_mm),
        (mirrored.left_wall_mm, paper.right_wall_mm),
        (mirrored.right_wall_mm, paper.left_wall_mm),
    ):
        assert one_mm == pytest.approx(np.column_stack([160 - other_mm[:, 0], other_mm[:, 1]]))


def test_a_seed_is_a_picture_and_another_seed_another():
    small = Recipe(face_mm=(60, 40), length_mm=44, mm_per_px=0.2)
    assert make_specimen(2, small).jpeg == make_specimen(2, small).jpeg
    assert make_specimen(2, small).jpeg != make_specimen(4, small).jpeg


def test_a_closed_crack_ends_in_two_tips():
    closed = make_specimen(1, Recipe(ends="closed", length_mm=60, mm_per_px=0.2))
    assert arc_length(closed.centreline_mm)[-1] == pytest.approx(60, abs=1e-6)
    assert mean_width_mm(closed.centreline_mm, closed.width_mm) == pytest.approx(3.1, rel=5e-3)
    assert closed.width_mm[[0, -1]] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    ("recipe", "says"),
    [
        (Recipe(length_mm=300), "does not fit"),
        (Recipe(length_mm=39), "too short"),
        (Recipe(ends="closed", length_mm=100), "does not fit"),
    ],
)
def test_a_crack_that_does_not_fit_its_face_is_refused(recipe, says):
    with pytest.raises(ValueError, match=says):
        make_specimen(1, recipe)


def test_the_module_is_a_command(tmp_path, paper):
    subprocess.run([sys.executable, "-m", "digitise.specimen", str(tmp_path)], check=True)
    assert (tmp_path / "photo.jpg").read_bytes() == paper.jpeg
    assert json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))["seed"] == 1


def test_the_default_recipe_is_the_paper_s():
    assert (PAPER.face_mm, PAPER.length_mm, PAPER.width_mm, PAPER.ends) == ((160, 40), 80, 3.1, "open")
