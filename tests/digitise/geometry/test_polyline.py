import numpy as np
import pytest

from digitise.geometry.polyline import crossings, without_loops


def test_the_points_of_a_loop_are_moved_to_its_crossing_point():
    line = np.array([[0.0, 0], [4, 0], [4, 2], [2, 2], [2, -3], [2, -5]])
    tight = without_loops(line)
    assert len(tight) == len(line)
    assert tight[1:4] == pytest.approx(np.array([[2, 0]] * 3))
    assert not crossings(tight)
    assert tight[[0, 4, 5]] == pytest.approx(line[[0, 4, 5]])


def cross(a, b, c, d) -> bool:
    """Whether the side from a to b crosses that from c to d."""
    corners = (a, b, c), (a, b, d), (c, d, a), (c, d, b)
    p, q, r, s = (np.linalg.det([second - first, point - first]) for first, second, point in corners)
    return p * q < -1e-9 and r * s < -1e-9


@pytest.mark.parametrize("closed", [False, True])
def test_crossings_of_a_polyline_equal_those_of_a_search_through_all_pairs(closed):
    """The polylines are random walks with corners on each other's edges."""
    for seed in range(20):
        points = np.cumsum(np.random.default_rng(seed).integers(-3, 4, (25, 2)), axis=0).astype(float)
        ends = np.roll(points, -1, axis=0) if closed else points[1:]
        last = {i: j for j in range(len(ends)) for i in range(j - 1) if cross(points[i], ends[i], points[j], ends[j])}
        # Pairs that begin inside an earlier pair are left out.
        outermost = []
        for pair in sorted(last.items()):
            if not outermost or pair[0] > outermost[-1][1]:
                outermost.append(pair)
        assert crossings(points, closed) == outermost
