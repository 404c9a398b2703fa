"""Runs to be set side by side, without any fluid run."""

from dataclasses import replace
from typing import Any

from sealtwin.core.records import DataKind, Profile
from sealtwin.study.run_comparison import Side
from tests.support.mapped_study import S_MM, line, make_readings
from validate.comparison import Baseline, Basis, Comparison, CurveDistances, ErrorFigures, FilledVolumes

COMPARISON = Comparison.model_construct(
    errors=ErrorFigures(*[0.5] * 3, worst_at_mm=3.0, share_under_1_mm=1.0, flat_level_mm=-4.0, flat_level_error_mm=4.0),
    distances=CurveDistances.model_construct(rmse_mm=0.5, frechet_mm=0.5), beats_baseline=True,
    basis=Basis.model_construct(stations_compared=5), simulated_volumes=FilledVolumes.model_construct(fill_ratio=0.9),
    baselines=(Baseline("a flat level of the dispensed volume", 0, 4.0),), role="held-out", readings_data="measured",
)  # fmt: skip


def compared(*, mean_error_mm: float = 0.5, **figures: Any) -> Comparison:
    errors = replace(COMPARISON.errors, mean_error_mm=mean_error_mm)
    return COMPARISON.model_copy(update={"errors": errors, **figures})


def side(
    name: str, above_mm: float, *, lowered_mm: float = 0.0, data: DataKind = "measured", settings: Any = ()
) -> Side:
    """A run that stands ``above_mm`` too high; it and its readings lie ``lowered_mm`` lower than others."""
    readings = make_readings()
    readings = replace(readings, level_mm=readings.level_mm - lowered_mm, data=data)
    profile = Profile(S_MM, line(S_MM) - lowered_mm + above_mm)
    return Side(name, {"fluid.U": 30.0, **dict(settings)}, profile, readings, COMPARISON, 1.0)
