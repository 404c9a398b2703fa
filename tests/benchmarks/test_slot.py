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


@pytest.mark.parametrize(
    ("draw", "ends"),
    [
        (
            FIRST,
            (
                Case(4.004, 22.87, 5.044, 2.819, 0.2964, 0.8014, 7.694),
                Case(6.516, 10.6, 2.718, 4.574, 0.0736, 0.5907, 3.804),
            ),
        ),
        (
            SECOND,
            (
                Case(2.599, 25.81, 1.403, 13.51, 4.947, 0.512, 3.252),
                Case(5.826, 22.91, 0.7748, 44.35, 0.275, 0.8947, 3.512),
            ),
        ),
        (
            FRESH,
            (
                Case(5.743, 16.12, 6.987, 14.84, 0.05157, 1.056, 4.294),
                Case(3.795, 21.05, 3.588, 41.8, 0.3191, 0.4894, 7.755),
            ),
        ),
    ],
)
def test_a_draw_is_a_latin_hypercube_and_stays_as_it_is(draw: int, ends: tuple[Case, Case]):
    """Regression only: another draw would make the stored runs those of other slots."""
    cases = drawn(seed=draw)
    assert (cases[0], cases[-1]) == ends
    for name in Case.__dataclass_fields__:
        low, high = getattr(LOW, name), getattr(HIGH, name)
        value = np.array([getattr(case, name) for case in cases])
        logarithmic = name in IN_LOGARITHMS
        share = np.log(value / low) / np.log(high / low) if logarithmic else (value - low) / (high - low)
        # One case in each fortieth of the range; a value has four digits.
        strata = np.sort(share) * CASES - np.arange(CASES)
        assert strata.min() > -0.02
        assert strata.max() < 1.02


@pytest.mark.parametrize("draw", [FIRST, SECOND, FRESH])
def test_every_stored_run_is_whole_and_lost_nothing(draw: int):
    with (FOLDER / f"{draw}" / "runs.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert rows
    for row in rows:
        level_mm = levels_mm(draw, int(row["case"]), int(row["seed"]))
        assert level_mm is not None
        assert level_mm.shape == STATIONS_MM.shape
        assert int(row["escaped"]) == 0
