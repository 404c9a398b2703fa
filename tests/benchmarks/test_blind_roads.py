"""Blind trials whose cracks vary in width and depth, and their stored particle runs."""

import pytest

from benchmarks.blind_roads import DEPTHS_MM, MIN_RATIO, STATIONS_MM, TRIALS, WANTED, WIDTHS_MM, kept_runs, measured

OFF_MM = 0.4  # Largest error of a width: four standard deviations


def test_a_drawn_crack_is_unchanged_and_varies_within_the_range_of_roads():
    """The first numbers are a regression only: with another draw, the stored runs would belong to other cracks."""
    one = measured(0)
    width_mm, depth_mm = one.real.outline.width_mm, one.real.solid.sections.depth_mm
    assert [width_mm.mean(), depth_mm.mean(), one.truth["angle_deg"]] == pytest.approx([6.896, 25.88, 1.4827], rel=1e-3)
    for value_mm, (low_mm, high_mm), off_mm in ((width_mm, WIDTHS_MM, OFF_MM), (depth_mm, DEPTHS_MM, 1e-9)):
        assert low_mm - off_mm <= value_mm.min() < value_mm.max() <= high_mm + off_mm
        # The least and largest depth may be between two rows of its table, 5 mm apart.
        assert value_mm.max() > 0.9 * MIN_RATIO * value_mm.min()


def test_every_trial_has_its_stored_runs_at_all_stations():
    runs_mm = kept_runs()
    assert {key[0] for key in runs_mm} == set(range(TRIALS))
    assert all(
        runs_mm[number, size, seed].shape == STATIONS_MM.shape for number in range(TRIALS) for size, seed in WANTED
    )
    assert len({level_mm.tobytes() for level_mm in runs_mm.values()}) == len(runs_mm) == TRIALS * len(WANTED)
