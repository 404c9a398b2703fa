"""Several trials: held-out ones first, and alone in the mean."""

from dataclasses import replace

import pytest

from tests.sides import compared, side
from validate.comparison import ErrorUncertainty, VolumeComparison
from validate.figures.compare_sheet import compare_sheet
from validate.figures.figure_sheet import FigureTable
from validate.figures.side_by_side import held_out_mean_mm


def trial(name: str, role: str, mean_error_mm: float, **figures):
    return replace(side(name, 0.1), comparison=compared(role=role, mean_error_mm=mean_error_mm, **figures))


def held_out_rows(sides):
    (part,) = [part for part in compare_sheet(sides).parts if part.title == "Held out"]
    (table,) = part.items
    assert isinstance(table, FigureTable)
    assert table.numbers is not None
    return [dict(zip(table.numbers.columns, row, strict=True)) for row in table.numbers.rows]


def test_held_out_trials_come_first_and_alone_make_the_mean():
    sides = [trial("a", "calibrated-on", 0.2), trial("b", "held-out", 1.0), trial("c", "held-out", 2.0)]
    assert [row["trial"] for row in held_out_rows(sides)] == ["b", "c", "a"]
    assert held_out_mean_mm(sides) == pytest.approx(1.5)
    assert held_out_mean_mm(sides[:1]) is None


def test_an_interval_is_shown_where_there_is_one():
    uncertainty = ErrorUncertainty.model_construct(mean_error_interval_mm=(0.9, 1.1))
    volumes = VolumeComparison.model_construct(volume_balance_error_mm=0.8, beats_volume_balance=False)
    known = trial("a", "held-out", 1.0, uncertainty=uncertainty, volumes=volumes)
    row, bare = held_out_rows([known, trial("b", "held-out", 1.0)])
    assert (row["low_mm"], row["high_mm"], row["beats_volume_balance"]) == (0.9, 1.1, "no")
    assert (bare["low_mm"], bare["beats_volume_balance"]) == (None, "-")
