"""Packed neighbour lists of fluid that is denser than they have room for."""

from typing import Any

import numpy as np
import pytest

from simulate.fluid.solver import FluidSolver
from tests.support.small_fluids import engine_with, lattice, listed_fluid, positions_mm, slot


def with_entries(entries: int, spacing_mm: float, monkeypatch: pytest.MonkeyPatch, **solver: Any) -> FluidSolver:
    """Fluid whose lists have room for so many entries a row at first."""
    monkeypatch.setattr("simulate.fluid.cell_grid.ENTRIES", entries)
    points = lattice(np.array([0.2, -1.3, -12]), np.array([5.8, 1.3, -2]), spacing_mm)
    return engine_with(points, slot(), weights=(30.0, 0.3), **solver)


@pytest.mark.parametrize("solver", [{"viscosity_solve": "implicit"}, {"viscosity_solve": "explicit"}])
def test_lists_that_grow_on_the_way_are_those_with_room_from_the_start(monkeypatch, solver):
    """Seen to fail with lists that stay as short as they are."""
    ends = []
    for entries in (84, 20):
        engine = with_entries(entries, 0.69, monkeypatch, **solver)
        room = engine.lists.room
        for _ in range(10):
            engine.step()
        assert (engine.lists.room > room) == (entries == 20)
        assert min(map(len, listed_fluid(engine))) > 0
        ends.append(positions_mm(engine))
    assert np.array_equal(*ends)


def test_a_recorded_frame_has_room_for_what_comes_later(monkeypatch):
    """Loose fluid falls together after the first frame, which is the last that may make room.

    Seen to fail with the first frame's room in the recording: rows then lost their walls.
    """
    asking, replayed = (with_entries(20, 0.9, monkeypatch) for _ in range(2))
    replayed.replays = True
    asking.advance(0)
    room = asking.lists.room
    for frame in range(1, 14):
        asking.advance(frame)
    for frame in range(14):
        replayed.advance(frame)
    assert asking.lists.room > room
    assert replayed.recorded
    assert np.array_equal(positions_mm(asking), positions_mm(replayed))


@pytest.mark.parametrize("native", [False, True])
def test_a_list_that_is_cut_holds_nothing_of_what_was_there_before(native, monkeypatch):
    """An entry that no one wrote would be read as a particle, wherever it points.

    Seen to fail with loops that leave out all of sixteen points for which there is less room.
    """
    monkeypatch.setattr("simulate.fluid.cell_grid.ENTRIES", 240)
    points = np.random.default_rng(1).uniform([1, -1, -10], [3, 1, -8], (1500, 3))
    engine = engine_with(points, slot(), native=native)
    engine.lists.store.fill_(-1)
    engine.find_neighbours()
    listed = listed_fluid(engine)
    assert np.mean([len(row) == engine.lists.fluid.shape[1] for row in listed]) > 0.9
    assert min(map(min, listed)) >= 0
