"""Slots on which the fast model is judged, and their stored particle runs."""

import csv

import numpy as np
import pytest

from benchmarks.kept_runs import KeptRuns
from benchmarks.slot_cases import CASES, FOLDER, HIGH, IN_LOGARITHMS, LOW, STATIONS_MM, Case, drawn, kept_levels_mm


@pytest.fixture(autouse=True)
def kept_of_any_number(monkeypatch):
    """Let kept results be read whatever solver computed them: tests of the code judge none of their figures."""
    monkeypatch.setattr(KeptRuns, "require", lambda self: None)


def test_the_drawn_slots_are_an_unchanged_latin_hypercube():
    """The numbers are a regression only: with another draw, the stored runs would belong to other slots."""
    cases = drawn()
    assert cases[0] == Case(5.743, 16.12, 6.987, 14.84, 0.05157, 1.056, 4.294)
    for name in Case.__dataclass_fields__:
        low, high = getattr(LOW, name), getattr(HIGH, name)
        value = np.array([getattr(case, name) for case in cases])
        logarithmic = name in IN_LOGARITHMS
        share = np.log(value / low) / np.log(high / low) if logarithmic else (value - low) / (high - low)
        # One case in each fortieth of the range; a value has four digits.
        strata = np.sort(share) * CASES - np.arange(CASES)
        assert strata.min() > -0.02
        assert strata.max() < 1.02


def test_every_stored_run_has_all_stations_and_no_escaped_particle():
    rows = list(csv.DictReader((FOLDER / "runs.csv").read_text(encoding="utf-8").splitlines()))
    levels_mm = kept_levels_mm()
    assert rows
    for row in rows:
        assert levels_mm[int(row["case"]), int(row["seed"])].shape == STATIONS_MM.shape
        assert int(row["escaped"]) == 0
