"""How sound a run's numbers were, drawn."""

import numpy as np
import pytest

from tests.evidence import axes_of
from validate.figures.snapshots import draw_health


def test_health_shows_per_cent_and_the_zero_of_what_must_stay_zero(health):
    compression, _, lost, *_ = axes_of(draw_health(health))
    assert np.nanmax(np.asarray(compression.lines[0].get_ydata(), float)) == pytest.approx(3.0)
    assert compression.get_ylabel() == "compression (%)"
    assert lost.get_ylim() == (0.0, 1.0)
