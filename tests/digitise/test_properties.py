"""What must not depend on how the camera was held: a mirror mirrors, a scale scales, a turn turns."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import pytest

from digitise.crack_path.find_path import find_path
from digitise.geometry.polyline import coverage, left_normals, resampled, smoothed
from digitise.image.raster import blurred
from digitise.outline import trace_outline
from digitise.settings import NozzlePath
from digitise.trajectory import plan_trajectory
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Outline
from tests.support.photos import distance_to, evenly_scaled, mortar, rms, write_png

SIZE_PX = (600, 420)
MM_PER_PX = 0.1


def cracked() -> tuple[Floats, Floats]:
    """Brightness of a plain photo with a crooked crack in it, and the crack's ends in px, (2, 2)."""
    rng = np.random.default_rng(1)
    x = np.concatenate([[150], np.sort(rng.uniform(200, 400, 3)), [450]])
    line_px = smoothed(resampled(np.column_stack([x, rng.uniform(150, 270, 5)]), 2.0), 15.0)
    to_tip_px = np.minimum(arc_length(line_px), arc_length(line_px)[::-1])
    width_px = rng.uniform(12, 24) * np.sqrt(np.minimum((to_tip_px + 0.1) / 60, 1))
    across_px = width_px[:, None] / 2 * left_normals(line_px)
    crack = coverage(np.concatenate([line_px + across_px, (line_px - across_px)[::-1]]), SIZE_PX)
    return mortar(SIZE_PX) * (1 - 0.93 * blurred(crack, 0.9)), line_px[[0, -1]]


def digitised(picture: Floats, ends_px: Floats, mm_per_px: float = MM_PER_PX) -> tuple[Outline, dict[str, Floats]]:
    """All that comes out of one photo on the way to the robot."""
    with TemporaryDirectory() as folder:
        photo = evenly_scaled(write_png(Path(folder) / "photo.png", picture), mm_per_px)
    (a, b), (c, d) = ends_px.tolist()
    path = find_path(photo, ((a, b), (c, d)))
    outline = trace_outline(photo, path)
    nozzle_mm = plan_trajectory(outline, NozzlePath(trim_mm=2), 1000.0).position_mm[:, :2]
    walls_mm = {"left": outline.left_wall_mm, "right": outline.right_wall_mm}
    lines_mm = {"path": photo.to_mm(path.points_px), "centreline": outline.centreline_mm, "nozzle": nozzle_mm}
    return outline, walls_mm | lines_mm


@cache
def plain() -> tuple[Outline, dict[str, Floats]]:
    return digitised(*cracked())


def check(
    result: tuple[Outline, dict[str, Floats]],
    moved: Callable[[Floats], Floats],
    mirror: bool = False,
    rms_mm: tuple[float, float, float] = (1e-4, 1e-4, 1e-4),
    sizes: float = 1e-4,
) -> None:
    """Every line lies where that of the plain photo does after ``moved``, and starts where that does.

    A mirror swaps the walls. ``rms_mm`` is how far path, walls and nozzle may lie from there, ``sizes`` how much length
    and mean width may differ, relative. By default it is a thousandth of a pixel: rounding leaves 1e-6 mm.
    """
    (outline, lines_mm), (plain_outline, plain_mm) = result, plain()
    swapped = {"left": "right", "right": "left"} if mirror else {}
    most_mm = {"path": rms_mm[0], "nozzle": rms_mm[2]}
    for name, line_mm in lines_mm.items():
        expected_mm = moved(plain_mm[swapped.get(name, name)])
        assert rms(distance_to(line_mm, expected_mm)) < most_mm.get(name, rms_mm[1]), name
        assert np.linalg.norm(line_mm[0] - expected_mm[0]) < 10 * max(rms_mm[:2]), name
    assert outline.length_mm == pytest.approx(plain_outline.length_mm, rel=sizes)
    assert outline.mean_width_mm == pytest.approx(plain_outline.mean_width_mm, rel=sizes)


def test_a_mirrored_photo_mirrors_path_walls_and_nozzle():
    """With the search map half a pixel off on purpose, the path misses by 0.05 mm.

    With brightness read 0.3 px beside its place, the walls miss by 0.03 mm.
    """
    picture, ends_px = cracked()

    def upside_down(points: Floats, px: float = 1.0) -> Floats:
        return np.where([False, True], px * (np.array(SIZE_PX) - 1.0) - points, points)

    flipped = np.asarray(cv2.flip(picture, 0), dtype=float)
    check(digitised(flipped, upside_down(ends_px)), lambda mm: upside_down(mm, MM_PER_PX), mirror=True)


def test_a_quarter_turn_of_the_photo_turns_everything():
    picture, ends_px = cracked()
    width, height = SIZE_PX
    turned = digitised(np.rot90(picture), np.column_stack([ends_px[:, 1], width - 1 - ends_px[:, 0]]))
    check(turned, lambda mm: np.column_stack([(height - 1) * MM_PER_PX - mm[:, 1], mm[:, 0]]))


def test_the_size_of_the_photo_changes_nothing_in_mm():
    """Resampling moves walls by 0.005 mm; the map on which the path is found has other cells.

    The nozzle's smooth line may stray by half of what it may from the centreline. The origins are the centres of
    pixels of two sizes.
    """
    picture, ends_px = cracked()
    factor = 0.75
    resized = np.asarray(cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA), dtype=float)
    other = digitised(resized, (ends_px + 0.5) * factor - 0.5, MM_PER_PX / factor)
    check(other, lambda mm: mm + 0.5 * MM_PER_PX * (1 - 1 / factor), rms_mm=(0.25, 0.02, 0.05), sizes=0.01)
