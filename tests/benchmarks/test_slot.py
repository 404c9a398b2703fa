"""The slots of the fast model's judgement: the draws that the stored runs of particles belong to."""

import csv

import numpy as np
import pytest

from benchmarks.slot_cases import (
    CASES,
    FIRST,
    FOLDER,
    FRESH,
    HIGH,
    IN_LOGARITHMS,
    LOW,
    SECOND,
    STATIONS_MM,
    Case,
    drawn,
    levels_mm,
)

pytestmark = pytest.mark.usefixtures("kept_of_any_number")
DRAWS = {
    FIRST: Case(4.004, 22.87, 5.044, 2.819, 0.2964, 0.8014, 7.694),
    SECOND: Case(2.599, 25.81, 1.403, 13.51, 4.947, 0.512, 3.252),
    FRESH: Case(5.743, 16.12, 6.987, 14.84, 0.05157, 1.056, 4.294),
}
"""With the first case of each."""


@pytest.mark.parametrize("draw", DRAWS)
def test_a_draw_is_a_latin_hypercube_and_stays_as_it_is(draw):
    """Regression only: another draw would make the stored runs those of other slots."""
    cases = drawn(seed=draw)
    assert cases[0] == DRAWS[draw]
    for name in Case.__dataclass_fields__:
        low, high = getattr(LOW, name), getattr(HIGH, name)
        value = np.array([getattr(case, name) for case in cases])
        logarithmic = name in IN_LOGARITHMS
        share = np.log(value / low) / np.log(high / low) if logarithmic else (value - low) / (high - low)
        # One case in each fortieth of the range; a value has four digits.
        strata = np.sort(share) * CASES - np.arange(CASES)
        assert strata.min() > -0.02
        assert strata.max() < 1.02


@pytest.mark.parametrize("draw", DRAWS)
def test_every_stored_run_is_whole_and_lost_nothing(draw):
    rows = list(csv.DictReader((FOLDER / f"{draw}" / "runs.csv").read_text(encoding="utf-8").splitlines()))
    assert rows
    for row in rows:
        level_mm = levels_mm(draw, int(row["case"]), int(row["seed"]))
        assert level_mm is not None
        assert level_mm.shape == STATIONS_MM.shape
        assert int(row["escaped"]) == 0
