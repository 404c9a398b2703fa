"""Pictures of the particles: to scale and not mirrored."""

import numpy as np
import pytest

from tests.support.evidence import axes_of, heights
from validate.figures.solid_pictures import draw_top_view


def test_the_top_view_is_not_mirrored_and_walls_are_clipped_to_the_sample(evidence):
    """Walls are traced past an open end and would be drawn beyond the face."""
    figure = draw_top_view(evidence.run, evidence.outline, evidence.solid, evidence.trajectory)
    axes, bar = axes_of(figure)
    left, right, path = axes.lines[:3]
    assert np.mean(heights(left)) > np.mean(heights(path)) > np.mean(heights(right))
    assert axes.get_xlim()[0] < axes.get_xlim()[1]
    assert axes.get_ylim()[0] < axes.get_ylim()[1]
    assert (axes.get_xlabel(), axes.get_ylabel(), bar.get_xlabel()) == ("x (mm)", "y (mm)", "z (mm)")
    for clip in (left.get_clip_box(), right.get_clip_box()):
        assert clip is not None
        assert axes.transData.inverted().transform_bbox(clip).extents == pytest.approx(evidence.solid.block_mm)
