"""Small outputs of validate: a comparison with its intervals and volumes, earlier trials, a prediction by runs."""

import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.core.files import as_json
from sealtwin.core.records import Profile
from tests.evidence import make_evidence, slope
from tests.stage_record.sampled import Nudge, Outputs, sampled
from validate.calibration.emulator import Emulator
from validate.calibration.posterior import ReadLevels, reach_of
from validate.calibration.summary import predicted_by_runs
from validate.compare import assess
from validate.readings.read_readings import read_readings
from validate.result import EarlierTrial
from validate.settings import Readings, Uncertainty
from validate.uncertainty.computed import Effect, SizeRuns, Spread
from validate.uncertainty.earlier_trials import expect

S_MM = np.linspace(0, 40, 81)
SHEET = "s_mm,level_1_mm,level_2_mm,level_3_mm\n" + "".join(
    f"{s},{-8 + 0.2 * s + a:.2f},{-8 + 0.2 * s + b:.2f},{-8 + 0.2 * s + c:.2f}\n"
    for s, a, b, c in [
        (1, 0.1, -0.13, 0.02), (5, -0.08, 0.21, 0.05), (10, 0.17, 0.04, -0.11), (15, -0.2, -0.06, 0.03),
        (20, 0.07, 0.12, -0.05), (25, 0.0, -0.14, 0.19), (30, -0.09, 0.08, 0.11), (35, 0.23, -0.02, -0.12),
    ]
)  # fmt: skip


def outputs(nudge: Nudge) -> Outputs:
    found = {**_compared(nudge), **_expected(nudge), **_calibrated(nudge)}
    return {name: sampled(values) for name, values in found.items()}


def _compared(nudge: Nudge) -> dict[str, Any]:
    settings = Readings(file=Path("caliper.csv"), data="measured", role="held-out")
    declared = Uncertainty(volume_ml=0.02, station_mm=0.5)
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "caliper.csv").write_text(SHEET, encoding="utf-8")
        readings = read_readings(Path(place) / "caliper.csv", settings, 40.0, 10.0)
        evidence = make_evidence(Path(place))
    level_mm = nudge(slope(S_MM) + 0.4 * np.sin(S_MM / 5) + 0.2)
    evidence = replace(evidence, profile=Profile(S_MM, level_mm, source="simulation"), readings=readings)
    comparison = assess(evidence, settings, declared, _spread(nudge))
    return _figures("comparison", json.loads(as_json(comparison.model_dump())))


def _figures(name: str, value: Any) -> dict[str, Any]:
    """Return the numbers of a comparison by their place in it, lists of them whole."""
    if isinstance(value, dict):
        return {key: one for inner in value for key, one in _figures(f"{name}: {inner}", value[inner]).items()}
    if isinstance(value, list) and not all(isinstance(one, float | int) for one in value):
        return _figures(name, dict(enumerate(value)))
    return {name: value} if isinstance(value, list | float | int) and value != [] else {}


def _spread(nudge: Nudge) -> Spread:
    sizes = (
        SizeRuns(radius_mm, np.array([nudge(slope(S_MM) + z_mm + off_mm) for off_mm in (-0.03, 0.0, 0.02)]))
        for radius_mm, z_mm in ((0.4, 0.45), (0.5, 0.5), (0.65, 0.6))
    )
    fine, middle, coarse = sizes
    return Spread(S_MM, (fine, middle, coarse), (Effect("volume_ml", 0.02, np.full(81, 0.3)),), 0.02, 0.65)


def _expected(nudge: Nudge) -> dict[str, Any]:
    errors_mm = nudge([0.5, 0.7, 0.2, 0.9])
    trials = [
        EarlierTrial(
            name=f"P{number}",
            level_error_mm=error_mm,
            computed_fill_ratio=0.9,
            read_fill_ratio=0.9 - 0.05 * error_mm,
            computed_heap_mm2=0.2 * error_mm,
            read_heap_mm2=0.1,
        )
        for number, error_mm in enumerate(errors_mm.tolist())
    ]
    earlier = expect(trials, {"mean_level_mm": -4.0, "fill_ratio": 0.8, "heap_mm2": 0.5})
    assert earlier is not None
    return {f"earlier: {one.quantity}": [one.expected, *one.expected_95] for one in earlier.expectations}


def _calibrated(nudge: Nudge) -> dict[str, Any]:
    """A prediction by runs, and an emulator of runs whose level two settings move."""
    points = np.random.default_rng(3).random((20, 2))
    s_mm = np.linspace(0, 30, 11)
    shape = np.outer(points[:, 0], np.cos(s_mm / 10)) + np.outer(points[:, 1] ** 2, s_mm / 30)
    levels_mm = nudge(-5 + shape)
    evidence = ReadLevels(s_mm, -5 + 0.4 * np.cos(s_mm / 10) + 0.25 * s_mm / 30, 0.01 * np.eye(11))
    mean_mm, half_mm = predicted_by_runs(levels_mm, evidence)
    tried = np.array([[0.3, 0.6], [0.8, 0.2]])
    reach = reach_of(points, levels_mm, evidence)
    return {
        "prediction by runs": [*mean_mm, *half_mm],
        "calibration: reach": [reach.components, reach.residual_mm, reach.noise_mm],
        "calibration: emulated level": Emulator.fitted(points, levels_mm, 2).levels_mm(tried),
    }
