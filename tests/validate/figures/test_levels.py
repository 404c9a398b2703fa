"""The curves show the numbers that they are made of, every axis with its unit."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from sealtwin.core.records import Sections
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


def test_levels_are_those_of_simulation_means_and_every_reading(drawn, evidence):
    figure = drawn["levels"]
    assert np.array_equal(heights(curve(figure, "simulated")), evidence.profile.level_mm)
    assert np.array_equal(heights(curve(figure, "caliper")), slope(STATIONS_MM))
    (axes,) = axes_of(figure)
    marks_mm = np.concatenate([heights(line) for line in axes.lines if line.get_marker() == "_"])
    assert np.sort(marks_mm) == pytest.approx(np.sort(evidence.readings.repeats_mm.ravel()))


def test_the_floor_is_drawn_where_it_is(evidence):
    """A floor that rises from 10 to 4 mm half way along; the ground below it reaches the end of the plot."""
    sections = Sections(np.array([0.0, 20.0, 40.0]), np.array([10.0, 10.0, 4.0]), np.full(3, 1.0))
    axes = theme.plate(3.4).add_subplot()
    draw_levels(axes, evidence.profile, sections, None, None)
    (ground,) = axes.collections
    corner_mm = np.array(ground.get_paths()[0].vertices)
    along = np.isclose(corner_mm[:, 0], 30.0, atol=0.11)
    assert corner_mm[along, 1].max() == pytest.approx(-7.0, abs=0.05)
    assert corner_mm[:, 1].min() == pytest.approx(axes.get_ylim()[0]) == -11.5


def test_bars_are_the_bins_of_the_comparison(drawn):
    (axes,) = axes_of(drawn["histogram"])
    bars = [bar.get_extents().transformed(axes.transData.inverted()).bounds for bar in axes.patches]
    assert bars == [pytest.approx((10.0 * i, 0.0, 10.0, 0.5)) for i in range(4)]
    assert {str(line.get_label()) for line in axes.lines} == {"mean error 0.50 mm", "gate for the mean, 1 mm"}
    assert [text.get_text() for text in axes.texts] == ["0.50"] * 4


def test_the_distribution_of_an_error_that_grows_evenly_is_a_straight_line(evidence):
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


def test_readings_alone_are_drawn_without_a_band_or_a_floor(evidence):
    """Readings that nobody took are called so in the legend."""
    figure = Figure()
    draw_levels(figure.add_subplot(), None, None, replace(evidence.readings, data="reconstructed"), None)
    caliper = curve(figure, "caliper")
    assert np.array_equal(heights(caliper), slope(STATIONS_MM))
    assert "RECONSTRUCTED" in str(caliper.get_label())
    assert not axes_of(figure)[0].collections
