"""What must not depend on how the camera was held: a mirror mirrors, a scale scales, a turn turns."""

from collections.abc import Callable
from dataclasses import dataclass
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
from digitise.photo import load_photo
from digitise.settings import NozzlePath, PhotoInput, Pixel
from digitise.trajectory import plan_trajectory
from sealtwin.core.arc_length import arc_length
from sealtwin.core.records import Floats, Outline, Trajectory
from tests.support.photos import distance_to, mortar, rms, write_png

SIZE_PX = (600, 420)
MM_PER_PX = 0.1


@dataclass(frozen=True)
class Digitised:
    """All that comes out of one photo on the way to the robot."""

    path_mm: Floats
    outline: Outline
    trajectory: Trajectory

    @property
    def lines_mm(self) -> dict[str, Floats]:
        return {
            "path": self.path_mm,
            "centreline": self.outline.centreline_mm,
            "left wall": self.outline.left_wall_mm,
            "right wall": self.outline.right_wall_mm,
            "nozzle": self.trajectory.position_mm[:, :2],
        }


def digitised(settings: PhotoInput, folder: Path) -> Digitised:
    photo = load_photo(settings, folder)
    path = find_path(photo, settings.ends_px)
    outline = trace_outline(photo, path)
    trajectory = plan_trajectory(outline, NozzlePath(trim_mm=2), 1000.0)
    return Digitised(photo.to_mm(path.points_px), outline, trajectory)


def cracked() -> tuple[Floats, Floats]:
    """Brightness of a plain photo with a crooked crack in it, and the crack's ends in px, (2, 2)."""
    rng = np.random.default_rng(1)
    x = np.concatenate([[150], np.sort(rng.uniform(200, 400, 3)), [450]])
    corners = np.column_stack([x, rng.uniform(150, 270, 5)])
    line_px = smoothed(resampled(corners, 2.0), 15.0)
    to_tip_px = np.minimum(arc_length(line_px), arc_length(line_px)[::-1])
    width_px = rng.uniform(12, 24) * np.sqrt(np.minimum((to_tip_px + 0.1) / 60, 1))
    across_px = width_px[:, None] / 2 * left_normals(line_px)
    crack = coverage(np.concatenate([line_px + across_px, (line_px - across_px)[::-1]]), SIZE_PX)
    return mortar(SIZE_PX) * (1 - 0.93 * blurred(crack, 0.9)), line_px[[0, -1]]


def of_picture(picture: Floats, ends_px: Floats, mm_per_px: float = MM_PER_PX) -> Digitised:
    with TemporaryDirectory() as folder:
        file = write_png(Path(folder) / "photo.png", picture)
        settings = PhotoInput(file=file, data="synthetic", mm_per_px=mm_per_px, ends_px=pair(ends_px))
        return digitised(settings, file.parent)


@cache
def plain() -> Digitised:
    """What all others are compared with."""
    return of_picture(*cracked())


def pair(ends_px: Floats) -> tuple[Pixel, Pixel]:
    (a, b), (c, d) = ends_px.tolist()
    return (a, b), (c, d)


@dataclass(frozen=True)
class Apart:
    """How far lines may lie from where they should, RMS in mm."""

    path: float
    walls: float
    nozzle: float = 0.05
    """Half of what its smooth line may stray from the centreline: which way turns on a hundredth of a pixel."""
    sizes: float = 0.01
    """Of length and mean width, relative: the walls of a crack 2 mm wide, each 0.01 mm off."""


EXACT = Apart(path=1e-4, walls=1e-4, nozzle=1e-4, sizes=1e-4)
"""A thousandth of a pixel: where no pixel is resampled, rounding leaves 1e-6 mm."""


def check(
    result: Digitised, expected: Digitised, moved: Callable[[Floats], Floats], mirror: bool, apart: Apart = EXACT
) -> None:
    """Every line of ``result`` lies where that of ``expected`` does after ``moved``, and starts where that does.

    A mirror swaps the walls.
    """
    swapped = {"left wall": "right wall", "right wall": "left wall"} if mirror else {}
    limits_mm = {"path": apart.path, "nozzle": apart.nozzle}
    for name, line_mm in result.lines_mm.items():
        there_mm = moved(expected.lines_mm[swapped.get(name, name)])
        assert rms(distance_to(line_mm, there_mm)) < limits_mm.get(name, apart.walls), name
        assert np.linalg.norm(line_mm[0] - there_mm[0]) < 10 * max(apart.path, apart.walls), name
    assert result.outline.length_mm == pytest.approx(expected.outline.length_mm, rel=apart.sizes)
    assert result.outline.mean_width_mm == pytest.approx(expected.outline.mean_width_mm, rel=apart.sizes)


def upside_down_px(points_px: Floats) -> Floats:
    return np.where([False, True], np.array(SIZE_PX) - 1.0 - points_px, points_px)


def test_a_mirrored_photo_mirrors_path_walls_and_nozzle():
    """To a thousandth of a pixel: no pixel is resampled, so that rounding alone leaves 1e-6 mm.

    With the search map half a pixel off on purpose, the path misses by 0.05 mm; with brightness read 0.3 px beside
    its place, the walls by 0.03 mm.
    """
    picture, ends_px = cracked()
    turned = of_picture(np.asarray(cv2.flip(picture, 0), dtype=float), upside_down_px(ends_px))
    check(turned, plain(), lambda mm: upside_down_px(mm / MM_PER_PX) * MM_PER_PX, True)


def test_a_quarter_turn_of_the_photo_turns_everything():
    """Again nothing is resampled, and 1e-6 mm are left."""
    picture, ends_px = cracked()
    width, height = SIZE_PX
    x, y = ends_px.T
    turned = of_picture(np.rot90(picture), np.column_stack([y, width - 1 - x]))

    def moved(points_mm: Floats) -> Floats:
        x, y = points_mm.T
        return np.column_stack([(height - 1) * MM_PER_PX - y, x])

    check(turned, plain(), moved, False)


def test_the_size_of_the_photo_changes_nothing_in_mm():
    """Resampling moves walls by 0.005 mm; the map on which the path is found has other cells."""
    picture, ends_px = cracked()
    factor = 0.75
    resized = np.asarray(cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA), dtype=float)
    other = of_picture(resized, (ends_px + 0.5) * factor - 0.5, MM_PER_PX / factor)
    # The origins are the centres of pixels of two sizes.
    check(other, plain(), lambda mm: mm + 0.5 * MM_PER_PX * (1 - 1 / factor), False, Apart(path=0.25, walls=0.02))
