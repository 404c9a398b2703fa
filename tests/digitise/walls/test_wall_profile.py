import numpy as np
import pytest

from digitise.geometry.polyline import left_normals
from digitise.image.raster import blurred
from digitise.walls.wall_profile import BLUR_PX, Patch, Walls, find_walls, sample_step_mm, straighten
from tests.support.photos import photo_of_light

MM_PER_PX = 0.1


@pytest.fixture
def walls_of(tmp_path):
    """Walls, in px from the line y = 60, of a crack whose brightness is given, (120, 300)."""

    def find(
        brightness: np.ndarray, mask: np.ndarray | None = None, width_px: float = 20, edge_fraction: float = 0.5
    ) -> Walls:
        photo = photo_of_light(tmp_path, brightness, MM_PER_PX)
        line_mm = photo.to_mm(np.column_stack([np.arange(20, 280, 2.5), np.full(104, 60.0)]))
        mask = np.full(brightness.shape, 255, dtype=np.uint8) if mask is None else mask
        patch = Patch((0, 0), blurred(photo.brightness, BLUR_PX), mask, None, MM_PER_PX)
        width_mm = width_px * MM_PER_PX
        step_mm = sample_step_mm(width_mm, MM_PER_PX)
        strip = straighten(photo, patch, line_mm, left_normals(line_mm), step_mm, 1.5 * width_mm)
        return find_walls(strip, width_mm, edge_fraction)

    return find


def band(upper_px: float, lower_px: float) -> np.ndarray:
    """A dark band between two edges at fractions of a pixel."""
    y = np.arange(120.0)
    inside = np.clip(y - upper_px + 0.5, 0, 1) * np.clip(lower_px - y + 0.5, 0, 1)
    return np.repeat((0.4 - 0.38 * inside)[:, None], 300, axis=1)


@pytest.mark.parametrize("shift", [0.25, 0.5])
def test_a_wall_is_found_to_a_twentieth_of_a_pixel(walls_of, shift):
    walls = walls_of(band(51.0 + shift, 68.0 + shift))
    assert walls.away_mm[0] / MM_PER_PX == pytest.approx(9 - shift, abs=0.05)
    assert walls.away_mm[1] / MM_PER_PX == pytest.approx(8 + shift, abs=0.05)
    assert (walls.clear_step[0].all(), walls.open_line.all()) == (True, True)


@pytest.mark.parametrize("rim_px", [3, 5])
def test_a_lit_rim_is_included_in_the_crack_without_moving_the_other_wall(walls_of, rim_px):
    """The rim is 56 % as bright as mortar, blurred by 1 px, in grain of 5 %. A narrow rim shifts its wall by 0.9 px.

    At half the contrast the wall is drawn on the rim's inner side.
    """
    brightness = band(50.5, 69.0)
    brightness[51 : 51 + rim_px] = 0.02 + 0.56 * 0.38
    brightness = blurred(brightness.astype(np.float32), 1.0).astype(float)
    brightness *= 1 + 0.05 * np.random.default_rng(1).standard_normal(brightness.shape)
    walls = walls_of(brightness, edge_fraction=0.7)
    assert np.median(walls.away_mm[0]) / MM_PER_PX == pytest.approx(9.5, abs=1.0)
    assert np.median(walls.away_mm[1]) / MM_PER_PX == pytest.approx(9, abs=0.1)
    half = walls_of(brightness, edge_fraction=0.5)
    assert np.median(half.away_mm[0]) / MM_PER_PX < 9


LIT = 0.02 + 0.25 * 0.38
"""A quarter of the way from the crack's brightness to the mortar's."""


@pytest.mark.parametrize(
    ("rows", "columns", "times", "level", "stations", "within_px"),
    [
        # Without stiffness the wall jumps to the far side of the pore, 15 px away: that way more is dark than bright.
        ((35, 47), (144, 156), 0, 0.02, slice(None), 0.1),
        # Stains below half the contrast were included if their far edge was near: 10 % too wide.
        ((38, 52), (80, 200), 0.5, 0, slice(35, 60), 0.5),
        ((38, 52), (80, 200), 0.4, 0, slice(35, 60), 0.5),
        # A strip as bright as LIT inside the wall: 5 px of the crack's 18.
        ((52, 57), (0, 300), 0, LIT, slice(None), 0.3),
    ],
    ids=["a pore", "a stain", "a darker stain", "a lit inside"],
)
def test_pores_stains_and_lit_strips_do_not_move_a_wall(walls_of, rows, columns, times, level, stations, within_px):
    brightness = band(51.0, 69.0)
    shown, box = brightness.copy(), (slice(*rows), slice(*columns))
    shown[box] = times * shown[box] + level
    if level != LIT:
        shown[52:68] = brightness[52:68]
    walls = walls_of(shown)
    assert walls.away_mm[0][stations] / MM_PER_PX == pytest.approx(9, abs=within_px)
    assert walls.away_mm[1][stations] / MM_PER_PX == pytest.approx(9, abs=0.2)
