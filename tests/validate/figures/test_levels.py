"""Curves of levels and of errors, compared with the numbers that they show."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.evidence import STATIONS_MM, axes_of, heights, make_evidence, slope
from tests.support.shapes import level_floor
from validate.figures import theme
from validate.figures.levels import draw_distribution, draw_histogram, draw_levels
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


def test_the_figure_of_levels_shows_the_simulation_the_means_and_every_reading(drawn, evidence):
    figure = drawn["levels"]
    assert np.array_equal(heights(curve(figure, "simulated")), evidence.profile.level_mm)
    assert np.array_equal(heights(curve(figure, "caliper")), slope(STATIONS_MM))
    (axes,) = axes_of(figure)
    marks_mm = np.concatenate([heights(line) for line in axes.lines if line.get_marker() == "_"])
    assert np.sort(marks_mm) == pytest.approx(np.sort(evidence.readings.repeats_mm.ravel()))


def test_the_distribution_of_a_linearly_growing_error_is_a_straight_line(evidence):
    readings, profile = evidence.readings, evidence.profile
    s_mm = np.array([readings.s_mm[0], readings.s_mm[-1]])
    measured = replace(readings, s_mm=s_mm, level_mm=np.array([-1.0, -1.0]), repeats_mm=None)
    simulated = replace(profile, s_mm=s_mm, level_mm=np.array([-1.0, 1.0]))
    comparison = evidence.comparison.model_copy(
        update={"errors": replace(evidence.comparison.errors, worst_error_mm=2.0)}
    )
    (axes,) = axes_of(draw_distribution(simulated, measured, comparison))
    within_mm, percent = (np.asarray(values) for values in axes.lines[0].get_data())
    assert percent == pytest.approx(50 * within_mm, abs=0.1)
    assert [line.get_label() for line in axes.lines[1:]] == ["50 % within 1.00 mm", "95 % within 1.90 mm"]
