"""What it takes before a comparison may say anything."""

import numpy as np
import pytest

from validate.comparison.verdict import Basis, Judgement, basis_of
from validate.settings import Gate

GATE = Gate(mean_error_mm=1.6)


def judged(basis: Basis, escaped_particles: int = 0, gate: Gate | None = GATE) -> Judgement:
    return Judgement(0.1, gate, basis, escaped_particles, "measured", "measured", "held-out")


@pytest.mark.parametrize(
    ("s_mm", "stations", "coverage", "widest_gap"),
    [
        ([0, 20, 40, 60, 80], 5, 1.0, 0.25),
        ([-1, 20, 40, 60, 81], 5, 1.0, 0.25),
        ([-2, -1, 40, 81, 82], 3, 1.0, 0.5),
        ([45, 46], 2, 1 / 80, 1 / 80),
    ],
    ids=["ends", "just outside", "far outside", "pair"],
)
def test_a_basis_is_what_lies_on_the_compared_stretch(s_mm, stations, coverage, widest_gap):
    s_mm = np.array(s_mm, dtype=float)
    basis = basis_of(s_mm, max(0.0, s_mm[0]), min(80.0, s_mm[-1]), 80.0)
    assert basis.stations == stations
    assert (basis.coverage, basis.widest_gap) == pytest.approx((coverage, widest_gap))


@pytest.mark.parametrize(
    ("s_mm", "suffices"),
    [
        ([0, 20, 40, 60, 80], True),
        ([8, 24, 40, 56, 72], True),
        ([8, 24, 40, 56, 71.9], False),
        ([8, 29, 51, 72], False),
        ([0, 0.1, 0.2, 0.3, 80], False),
        ([0, 24, 40, 56, 80], True),
        ([0, 24.1, 40, 56, 80], False),
    ],
    ids=["five even", "80 %", "less", "four", "heap", "30 % apart", "wider"],
)
def test_five_stations_over_four_fifths_none_far_from_the_next(s_mm, suffices):
    judgement = judged(basis_of(np.array(s_mm, dtype=float), s_mm[0], s_mm[-1], 80.0))
    assert judgement.passed is suffices
    assert judgement.verdict.startswith("Validated on" if suffices else "No verdict")


def test_a_share_is_never_rounded_up_to_what_is_needed():
    assert "cover 79 % of" in judged(Basis(5, 0.7999, 0.2)).verdict


def test_a_leak_speaks_before_thin_readings():
    judgement = judged(Basis(2, 0.01, 0.01), escaped_particles=1)
    assert judgement.passed is False
    assert judgement.verdict.startswith("Do not use: 1 particle went through a wall")
