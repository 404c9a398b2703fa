import numpy as np
import pytest

from digitise.geometry.polyline import clipped_to_box, coverage, crossings, signed_area, smoothed, without_loops


def test_smoothing_keeps_a_wave_eight_times_its_sigma_long_almost_whole():
    """Twicing passes 1 - (1 - g)^2 of it, g = exp(-2 pi^2 / 64): 0.93; a plain Gaussian passes g = 0.73."""
    wave = np.sin(2 * np.pi * np.arange(400) / 40)[:, None]
    passed = np.abs(smoothed(wave, 5.0))[100:300].max()
    assert passed == pytest.approx(1 - (1 - np.exp(-2 * np.pi**2 / 64)) ** 2, abs=0.01)


def test_a_loop_is_pulled_tight_to_its_crossing_point():
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
def test_crossings_are_those_of_all_pairs(closed):
    """Beside a search through all pairs, on random walks with corners on each other's edges."""
    for seed in range(20):
        points = np.cumsum(np.random.default_rng(seed).integers(-3, 4, (25, 2)), axis=0).astype(float)
        ends = np.roll(points, -1, axis=0) if closed else points[1:]
        last = {i: j for j in range(len(ends)) for i in range(j - 1) if cross(points[i], ends[i], points[j], ends[j])}
        # None that begins inside an earlier pair.
        outermost = []
        for pair in sorted(last.items()):
            if not outermost or pair[0] > outermost[-1][1]:
                outermost.append(pair)
        assert crossings(points, closed) == outermost


def test_clipping_keeps_the_area_inside_and_takes_in_a_corner_of_the_box():
    """A diamond over the corner of the unit square: what is inside is half of its quarter."""
    diamond = np.array([[1.5, 1], [1, 1.5], [0.5, 1], [1, 0.5]])
    inside = clipped_to_box(diamond, (0, 0, 1, 1))
    assert signed_area(inside) == pytest.approx(0.125)
    assert any(np.allclose(point, [1, 1]) for point in inside)
    assert len(clipped_to_box(diamond + 5, (0, 0, 1, 1))) == 0


@pytest.mark.parametrize("way", [1, -1])
def test_a_pixel_is_centred_on_whole_numbers(way):
    box = np.array([[2.0, 1.5], [4.25, 1.5], [4.25, 3.5], [2.0, 3.5]])[::way]
    cover = coverage(box, (8, 6))
    assert cover[2] == pytest.approx([0, 0, 0.5, 1, 0.75, 0, 0, 0], abs=1e-6)
    assert cover[1] == pytest.approx(0, abs=1e-6)
