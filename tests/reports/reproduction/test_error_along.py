"""The claims on the error along the crack, on beds whose verdict is known."""

import numpy as np
import pytest

from reports.reproduction.claims import ERROR_CLAIMS
from reports.reproduction.judging import Finding, judge
from reports.reproduction.surface import Surface, along
from sealtwin.core.records import Profile
from tests.charts import S_MM, STATIONS_MM, line

AS_THE_PAPER = (4.0, 0.6, 0.6, 0.6, 0.6, 0.1, 0.6, 0.6)
"""Errors in mm in each 10 mm of the crack."""


def finding(name: str, bins_mm: tuple[float, ...], spread_mm: float) -> Finding:
    """Of a bed that is off by so much in each 10 mm; draws of the readings are up to ``spread_mm`` lower or higher."""
    (claim,) = [each for each in ERROR_CLAIMS if each.name.startswith(name)]
    piece = np.minimum((S_MM / 10).astype(int), len(bins_mm) - 1)
    bed = Profile(S_MM, line(S_MM) + np.array(bins_mm)[piece], source="simulation")

    def surface(by_mm: float) -> Surface:
        readings = Profile(STATIONS_MM, line(STATIONS_MM) + by_mm, data="reconstructed", source="test")
        none = np.zeros(0)
        return Surface(none, none, none, none, along(bed, readings), none)

    return judge(claim, surface(0.0), [surface(by_mm) for by_mm in np.linspace(-spread_mm, spread_mm, 41)])


@pytest.mark.parametrize(
    ("name", "bins_mm", "spread_mm", "judgement"),
    [
        ("less than 1 mm all the way", AS_THE_PAPER, 0.2, "agrees"),
        ("less than 1 mm all the way", (4.0, 0.6, 0.6, 0.95, 0.6, 0.1, 0.6, 0.6), 0.2, "open"),
        # Three quarters of the length are closer than 1 mm, and not in one piece.
        ("less than 1 mm all the way", (0.6, 0.6, 0.6, 3.0, 0.6, 0.1, 0.6, 2.0), 0.2, "disagrees"),
        # Of the bed between its steps: a number never agrees.
        ("least error of a bin", AS_THE_PAPER, 0.03, "open"),
        ("least error of a bin", (4.0, 0.6, 0.6, 0.6, 0.6, 0.5, 0.6, 0.6), 0.03, "disagrees"),
        ("where that least is", AS_THE_PAPER, 0.2, "agrees"),
        ("where that least is", (4.0, 0.6, 0.6, 0.6, 0.6, 0.10, -0.12, 0.6), 0.2, "open"),
        ("where that least is", (4.0, 0.6, 0.6, 0.6, 0.6, 0.6, 0.6, 0.1), 0.2, "disagrees"),
        ("drop of the error", AS_THE_PAPER, 0.2, "agrees"),
        ("drop of the error", (2.0, 1.0, 0.6, 0.6, 0.6, 0.1, 0.6, 0.6), 0.2, "open"),
        ("drop of the error", (2.0, 1.8, 0.6, 0.6, 0.6, 0.1, 0.6, 0.6), 0.2, "disagrees"),
        # It drops to a quarter, and is worse later.
        ("drop of the error", (2.0, 0.5, 0.6, 3.0, 0.6, 0.1, 0.6, 0.6), 0.2, "disagrees"),
    ],
)
def test_a_bed_is_judged_as_it_was_made(name, bins_mm, spread_mm, judgement):
    assert finding(name, bins_mm, spread_mm).judgement == judgement
