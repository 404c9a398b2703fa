"""Curves of levels and of errors, compared with the numbers that they show."""

import numpy as np
import pytest

from tests.support.evidence import STATIONS_MM, axes_of, heights, make_evidence, slope
from tests.support.shapes import level_floor
from validate.figures import theme
from validate.figures.levels import draw_histogram, draw_levels
from validate.settings import Gate


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    return make_evidence(tmp_path_factory.mktemp("evidence"), gate=Gate(mean_error_mm=1.0), error_mm=0.5)


@pytest.fixture
def drawn(evidence):
    profile, readings, comparison = evidence.profile, evidence.readings, evidence.comparison
    with theme.themed():
        levels = draw_levels(theme.plate(3.4).add_subplot(), profile, level_floor(10.0), readings, comparison)
    return {"levels": levels, "histogram": draw_histogram(comparison)}


def curve(figure, label: str):
    (axes,) = axes_of(figure)
    return next(line for line in axes.lines if str(line.get_label()).startswith(label))


def test_the_figure_of_levels_shows_simulation_means_and_every_reading(drawn, evidence):
    figure = drawn["levels"]
    assert np.array_equal(heights(curve(figure, "simulated")), evidence.profile.level_mm)
    assert np.array_equal(heights(curve(figure, "caliper")), slope(STATIONS_MM))
    (axes,) = axes_of(figure)
    marks_mm = np.concatenate([heights(line) for line in axes.lines if line.get_marker() == "_"])
    assert np.sort(marks_mm) == pytest.approx(np.sort(evidence.readings.repeats_mm.ravel()))
