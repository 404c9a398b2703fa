import numpy as np
import pytest

from digitise.geometry.polyline import meeting
from digitise.scale.corners import fit_line, fit_line_to_most


def along(start, end, count=60):
    return np.linspace(start, end, count)


def distance(point, line):
    (centre, direction) = line
    return abs((point - centre) @ np.array([-direction[1], direction[0]]))


def test_a_line_goes_through_its_points_and_tells_their_distances():
    points = along((3.0, 4.0), (3.0, 90.0))
    points[0] += (0, 2.0)
    line, miss = fit_line(points)
    assert np.abs(miss).max() < 1e-9
    assert distance(np.array([3.0, 200.0]), line) < 1e-9


@pytest.mark.parametrize("where", [slice(0, 14), slice(25, 39), slice(46, 60)], ids=["start", "middle", "end"])
def test_a_quarter_of_the_points_pulled_to_one_side_moves_nothing(where):
    """As by a fleck on an edge. Least squares alone is pulled 2 px off by it, and then keeps the fleck."""
    rng = np.random.default_rng(1)
    points = along((10.0, 20.0), (200.0, 45.0))
    points += rng.normal(0, 0.05, points.shape)
    points[where] += (-1.0, 8.0)
    line, miss = fit_line_to_most(points, least=0.3)
    assert len(miss) == 46
    assert distance(np.array([10.0, 20.0]), line) < 0.05
    assert distance(np.array([200.0, 45.0]), line) < 0.05


def test_lines_meet_where_they_cross():
    first, _ = fit_line(along((0.0, 0.0), (10.0, 10.0)))
    second, _ = fit_line(along((0.0, 6.0), (1.0, 6.0)))
    assert meeting(first, second) == pytest.approx([6.0, 6.0])
