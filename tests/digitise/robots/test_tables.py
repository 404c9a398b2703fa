"""The plain files, read back."""

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from digitise.robots.robot_path import place_path, points_text, table_text
from sealtwin.core.record_files import read_trajectory
from tests.cells import cell, in_cell, placed, random_paths


@settings(max_examples=10, deadline=None)
@given(it=random_paths(), turn=st.floats(-180, 180))
def test_points_are_places_in_their_order(it, turn):
    """Four decimals."""
    text = points_text(place_path(it, cell(turn), "cell.toml"))
    assert np.abs(np.loadtxt(io.StringIO(text)) - in_cell(it.position_mm, turn)).max() < 6e-5


def test_the_table_is_a_trajectory_in_the_robot_s_frame(tmp_path):
    """The same columns as trajectory.csv, so that whatever reads that one reads this."""
    path = placed()
    (tmp_path / "trajectory.csv").write_text(table_text(path), encoding="utf-8")
    again = read_trajectory(tmp_path)
    for name in vars(again):
        assert getattr(again, name) == pytest.approx(getattr(path.trajectory, name), abs=6e-7), name
    assert again.given_mm3.sum() == pytest.approx(4800.0, rel=1e-6)
