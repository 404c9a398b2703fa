"""Packed neighbour lists of fluid that is denser than they have room for."""

import numpy as np
import pytest

from tests.fluids import engine_with, lattice, listed_fluid, positions_mm, slot


@pytest.mark.parametrize("solver", [{"viscosity_solve": "implicit"}, {"viscosity_solve": "explicit"}])
def test_lists_that_grow_on_the_way_are_those_with_room_from_the_start(monkeypatch, solver):
    """Seen to fail with lists that stay as short as they are."""
    points = lattice(np.array([0.2, -1.3, -12]), np.array([5.8, 1.3, -2]), 0.69)
    ends = []
    for entries in (84, 20):
        monkeypatch.setattr("simulate.setup.cell_grid.ENTRIES", entries)
        engine = engine_with(points, slot(), weights=(30.0, 0.3), **solver)
        room = engine.lists.room
        for _ in range(10):
            engine.step()
        assert (engine.lists.room > room) == (entries == 20)
        assert min(map(len, listed_fluid(engine))) > 0
        ends.append(positions_mm(engine))
    assert np.array_equal(*ends)
