"""The figure of the first page: one axis along the crack, errors at the readings, and a section of the solid."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Polygon, Rectangle

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from tests.support.evidence import SEEDS
from validate.compare import assess
from validate.figures.first_figure import NARROW, WIDE
from validate.report.chapters import first_figure
from validate.report.first_page import first_caption
from validate.settings import Readings, Uncertainty
from validate.uncertainty.computed import Effect, Spread
from validate.uncertainty.validation import predict


def test_all_rows_of_the_first_figure_share_the_axis_along_the_crack(evidence):
    shown = first_figure(evidence)
    for layout, rows in ((WIDE, 4), (NARROW, 3)):
        axes = shown.draw(layout).axes
        assert len(axes) == rows
        assert {each.get_xlim() for each in axes[:3]} == {(0.0, evidence.outline.length_mm)}
        bars = [patch for patch in axes[2].patches if isinstance(patch, Rectangle)]
        assert [bar.get_height() for bar in bars] == pytest.approx([0.5] * len(evidence.readings.s_mm))
        middles = [bar.get_x() + bar.get_width() / 2 for bar in bars]
        assert middles == pytest.approx(evidence.readings.s_mm)
    alone = replace(evidence, readings=None, comparison=None)
    assert len(first_figure(alone).draw(NARROW).axes) == 2


def test_the_error_strip_shows_the_largest_error_even_between_readings(evidence):
    """Broken on purpose, with limits from the errors at the readings alone, the largest error is cut off."""
    low = np.where(np.abs(evidence.profile.s_mm - 12.5) < 1.0, -6.0, 0.0)
    profile = replace(evidence.profile, level_mm=evidence.profile.level_mm + low)
    settings = Readings(file=Path("caliper.csv"), data="measured", role="held-out")
    judged = replace(evidence, profile=profile)
    judged = replace(judged, comparison=assess(judged, settings, Uncertainty(), None))
    strip = first_figure(judged).draw(WIDE).axes[2]
    assert strip.get_ylim()[0] < -5.5
    assert "-5.5 mm" in [text.get_text() for text in strip.texts]
    half_mm = judged.comparison.uncertainty.levels.profile_band_95_mm.max()
    tops_mm = [np.asarray(part.get_paths()[0].vertices)[:, 1].max() for part in strip.collections]
    assert any(top_mm == pytest.approx(half_mm) for top_mm in tops_mm)


def test_the_figure_of_a_mean_of_runs_shows_the_band_of_a_further_run(evidence, tmp_path):
    """A prediction is drawn without this band, since its own band includes the scatter."""
    alone = replace(evidence, readings=None, comparison=None, seeds=SEEDS)
    axes = first_figure(alone).draw(NARROW).axes[1]
    (band,) = [each for each in axes.collections if each.get_label() == "one further run, 19 of 20 places"]
    s_mm, level_mm = evidence.profile.s_mm, evidence.profile.level_mm
    ends_mm = np.asarray(band.get_paths()[0].vertices)
    for side in (-1, 1):
        edge = ends_mm[np.argmin(np.hypot(*(ends_mm - (s_mm[5], level_mm[5] + side * SEEDS.band_95_mm)).T))]
        assert edge == pytest.approx((s_mm[5], level_mm[5] + side * 0.75))
    labels = [str(line.get_label()) for line in axes.lines]
    assert "simulated, mean of 3 runs" in labels
    assert "mean of 3 runs, with seeds 0 to 2" in first_caption(alone)
    assert "± 0.75 mm" in first_caption(replace(evidence, seeds=SEEDS))
    spread = Spread(s_mm, None, (Effect("volume_ml", 0.1, np.full(len(s_mm), 0.1)),), 0.0, 0.5)
    predicted = replace(alone, prediction=predict(evidence.profile, spread, Uncertainty(volume_ml=0.1)))
    labels = [str(each.get_label()) for each in first_figure(predicted).draw(NARROW).axes[1].collections]
    assert "19 of 20 means of 3 simulated levels" in labels
    assert "one further run, 19 of 20 places" not in labels
    assert "means of 3 simulated levels" in first_caption(predicted)


def test_the_drawn_section_leans_to_the_same_side_as_the_solid(evidence):
    """Broken on purpose, a section drawn from the wall's angle alone leans to the left."""
    shape = CrackShape(depth_mm=10.0, tilt="lean", wall_angle_deg=20.0, lean_to="right")
    shown = first_figure(replace(evidence, solid=build_solid(evidence.outline, shape)))
    section = shown.draw(WIDE).axes[-1]
    ring = max((patch.get_xy() for patch in section.patches if isinstance(patch, Polygon)), key=len)
    floor = ring[np.isclose(ring[:, 1], -10.0)]
    assert floor[:, 0].mean() == pytest.approx(10 * np.tan(np.radians(20)), rel=0.01)
