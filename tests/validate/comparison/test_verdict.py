"""What it takes before a comparison may say anything."""

import numpy as np
import pytest

from validate.comparison.verdict import Basis, Judgement, basis_of
from validate.settings import Gate

GATE = Gate(mean_error_mm=1.6)


ENOUGH = Basis(17, 1.0, 1 / 16)


def judged(basis: Basis = ENOUGH, escaped_particles: int = 0, gate: Gate | None = GATE, **more) -> Judgement:
    found_mm = more.pop("mean_error_mm", 0.1)
    return Judgement(found_mm, gate, basis, escaped_particles, "measured", "measured", "held-out", **more)


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
    assert judgement.verdict.startswith("Validated to 1.6 mm on" if suffices else "No verdict")


def test_a_share_is_never_rounded_up_to_what_is_needed():
    assert "cover 79 % of" in judged(Basis(5, 0.7999, 0.2)).verdict


def test_a_leak_speaks_before_thin_readings():
    judgement = judged(Basis(2, 0.01, 0.01), escaped_particles=1)
    assert judgement.passed is False
    assert judgement.verdict.startswith("Do not use: 1 particle went through a wall")


@pytest.mark.parametrize(
    ("found_mm", "interval_mm", "outcome", "passed", "starts"),
    [
        (1.5, (1.41, 1.59), "passed", True, "Validated to 1.6 mm on held-out readings: mean error 1.500 mm (1.41 to"),
        (1.5, (1.39, 1.61), "undecided", True, "The readings cannot tell whether the gate is kept: mean error 1.500"),
        (1.7, (1.59, 1.81), "undecided", False, "The readings cannot tell whether the gate is kept: mean error 1.700"),
        (1.7, (1.61, 1.79), "failed", False, "Not validated to 1.6 mm on held-out readings: mean error 1.700 mm"),
    ],
)
def test_what_the_readings_cannot_tell_is_neither_passed_nor_failed(found_mm, interval_mm, outcome, passed, starts):
    """The gate itself is on what was found, and keeps its exit code; the colour is on what can be known."""
    judgement = judged(mean_error_mm=found_mm, interval_mm=interval_mm)
    assert (judgement.outcome, judgement.passed) == (outcome, passed)
    assert judgement.verdict.startswith(starts)
    assert "95 % by the readings)" in judgement.verdict


def test_an_interval_without_the_readings_scatter_says_so():
    judgement = judged(mean_error_mm=1.0, interval_mm=(0.98, 1.02), scatter_known=False)
    assert "(0.98 to 1.02 mm, 95 % by the readings, their scatter not known)" in judgement.verdict


@pytest.mark.parametrize("gate", [GATE, None])
def test_what_somebody_edited_gets_no_verdict(gate):
    judgement = judged(gate=gate, interval_mm=(0.05, 0.15), edited=("profile.csv",))
    assert judgement.verdict == "Edited by hand since (profile.csv): no verdict."
    assert judgement.outcome == "undecided"
    assert judgement.passed is (None if gate is None else False)


def test_too_few_readings_and_no_gate_are_told_apart():
    assert judged(Basis(4, 1.0, 0.3)).outcome == "undecided"
    assert judged(gate=None).outcome == "open"
    assert judged(escaped_particles=1, edited=("profile.csv",)).outcome == "failed"
