"""The crack as a region: it is cleaned without moving its walls, and each part left out gives a warning."""

import dataclasses

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.footprint import lay_out
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline
from tests.support.shapes import CLOSED, straight_slot, with_ring

VERTICAL = CrackShape(depth_mm=16.0, tilt="vertical")


def test_specks_and_pieces_behind_narrow_necks_give_a_warning():
    """A gap of 0.004 mm is filled; a neck of 0.004 mm separates a crack from its other half, or from a speck."""
    thread = ring_of([(0, 0), (9, 0), (9, 1.0), (9.004, 1.0), (9.004, 0), (20, 0), (20, 3), (0, 3)])
    assert lay_out(thread, VERTICAL, 0.0).crack.area() == pytest.approx(60.0, rel=1e-3)
    start, end = [(0, 0), (10, 0), (10, 1.498), (10.5, 1.498)], [(10.5, 1.502), (10.0, 1.502), (10.0, 3.0), (0.0, 3.0)]
    half, speck = [(10.5, 0), (20, 0), (20, 3), (10.5, 3)], [(10.5, 1.4), (10.7, 1.4), (10.7, 1.6), (10.5, 1.6)]
    for part, pieces, words in (
        (half, 2, "in 2 pieces"),
        (speck, 1, "near (10.6, 1.5) mm was dropped: its area of 0.040 mm²"),
    ):
        footprint = lay_out(ring_of([*start, *part, *end]), VERTICAL, 0.0)
        assert footprint.crack.num_contour() == pieces
        assert any(words in warning.text for warning in footprint.warnings)


def stone(x_mm: float, y_mm: float, radius_mm: float, sides: int = 24) -> Floats:
    """A clockwise polygon, as islands are."""
    turn = -2 * np.pi * np.arange(sides) / sides
    return np.array([x_mm, y_mm]) + radius_mm * np.column_stack([np.cos(turn), np.sin(turn)])


def with_islands(*islands_mm: Floats) -> Outline:
    return dataclasses.replace(straight_slot(20.0, 3.0, CLOSED), islands_mm=islands_mm)


def test_a_warning_gives_the_position_of_a_small_island_that_is_filled():
    footprint = lay_out(with_islands(stone(5.0, 0.2, 0.17), stone(12.0, 0.0, 0.8)), VERTICAL, 0.0)
    assert footprint.crack.num_contour() == 2
    (filled,) = footprint.warnings
    assert filled.key == "solid.island-filled"
    assert "near (5.0, 0.2) mm was filled: its area of 0.090 mm²" in filled.text


def test_islands_that_fill_the_crack_or_have_non_finite_points_are_refused():
    with pytest.raises(InputError, match="outside its islands, which is too little for a crack"):
        lay_out(with_islands(stone(10.0, 0.0, 30.0)), VERTICAL, 0.0)
    with pytest.raises(InputError, match="only finite numbers, for the outline and its islands"):
        lay_out(with_islands(np.full((4, 2), np.nan)), VERTICAL, 0.0)


def test_a_small_loop_of_the_outline_gives_a_warning():
    """The loop has 0.02 mm² where the trace turned back on itself; a user must mend a loop of 0.05 mm²."""
    looped = ring_of([(0, 0), (10.2, 0), (10.0, -0.2), (10.0, 0.2), (10.2, 0.0001), (20, 0), (20, 3), (0, 3)])
    footprint = lay_out(looped, VERTICAL, 0.0)
    assert any("crosses itself near (10.0" in warning.text for warning in footprint.warnings)


def ring_of(points: list[tuple[float, float]]) -> Outline:
    return with_ring(straight_slot(20.0, 3.0, CLOSED), np.array(points))
