"""A comparison with all that it allows one to say: intervals, baselines, balance, and what the error may come from."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from sealtwin.records import Comparison, Floats, Profile
from validate.comparison.balance import mass_balance, when_dispensed_mm3
from validate.comparison.curves import Difference
from validate.comparison.distances import area_between
from validate.comparison.verdict import judged
from validate.comparison.volumes import balance_profile, mouth_widths_mm
from validate.evidence import Evidence
from validate.settings import Readings
from validate.uncertainty.alignment import CHOICE, shifted_errors_mm, station_effect_mm
from validate.uncertainty.design import Effect, together
from validate.uncertainty.intervals import Interval, bands_mm, doubt_of, hats, mean_error_interval, mean_weights
from validate.uncertainty.readings import Budget, budget_of
from validate.uncertainty.settings import Uncertainty
from validate.uncertainty.spread import Spread
from validate.uncertainty.validation import Comparand, station_sentence


def assess(evidence: Evidence, settings: Readings, declared: Uncertainty, spread: Spread | None) -> Comparison:
    """The comparison of ``evidence``, its metrics completed and judged by all of them.

    Args:
        evidence: A trial with readings and their comparison.
        settings: How the readings were taken.
        declared: How well the inputs are known.
        spread: What the extra runs left; None where there were none.
    """
    comparison, measured = evidence.comparison, evidence.readings
    assert comparison is not None, "there are readings"
    assert measured is not None, "they are what was compared"
    mouth_mm = mouth_widths_mm(measured.s_mm, evidence.outline, evidence.solid)
    budget = budget_of(measured, settings, declared, mouth_mm)
    added = {
        **_volume_balance(evidence, comparison, measured),
        "mass_balance": _mass_balance(evidence, comparison, settings),
        "uncertainty": _uncertainty(evidence.profile, measured, budget, declared, spread),
    }
    return judged(replace(comparison, metrics=comparison.metrics | added), evidence.edited)


def _volume_balance(evidence: Evidence, comparison: Comparison, measured: Profile) -> dict[str, Any]:
    """The second baseline: the level that follows from volume, crack and path alone."""
    baseline = balance_profile(evidence.run.dispensed_volume_mm3, evidence.trajectory, evidence.outline, evidence.solid)
    covered_mm = Difference(baseline.s_mm, baseline.level_mm, measured.s_mm, measured.level_mm).length_mm
    error_mm = area_between(baseline.s_mm, baseline.level_mm, measured.s_mm, measured.level_mm) / covered_mm
    return {
        "volume_balance_level_mm": float(baseline.level_mm.max()),
        "volume_balance_error_mm": error_mm,
        "beats_volume_balance": comparison.mean_error_mm < error_mm,
    }


def _mass_balance(evidence: Evidence, comparison: Comparison, settings: Readings) -> dict[str, Any]:
    read_mm3 = comparison.metrics["measured_sealant_mm3"]
    return {
        **asdict(mass_balance(evidence.run, evidence.solid, evidence.volume_ratio)),
        "readings_mm3": read_mm3,
        "readings_state": settings.state,
        "shrinkage_percent": settings.shrinkage_percent,
        "readings_when_dispensed_mm3": when_dispensed_mm3(read_mm3, settings.shrinkage_percent),
    }


def _uncertainty(
    simulated: Profile, measured: Profile, budget: Budget, declared: Uncertainty, spread: Spread | None
) -> dict[str, Any]:
    error = Difference(simulated.s_mm, simulated.level_mm, measured.s_mm, measured.level_mm)
    hat = hats(error.x, measured.s_mm)
    mean = doubt_of(budget, mean_weights(error.x, hat))
    bias_mm, half_mm = error.mean(), mean.half_width_mm
    held = (measured.s_mm >= error.x[0]) & (measured.s_mm <= error.x[-1])
    s_mm = measured.s_mm[held]
    errors_mm = np.interp(s_mm, simulated.s_mm, simulated.level_mm) - measured.level_mm[held]
    effects = _effects(simulated, error.x, declared, spread)
    overall = Comparand(
        error_mm=bias_mm,
        data_mm=mean.standard_mm,
        numerics_mm=None if spread is None else spread.converged(_means(spread, error.x)).standard,
        inputs_mm=float(np.sqrt(sum(_mean(error.x, one.level_mm) ** 2 for one in effects))) if effects else None,
        inputs_waiting=bool(declared.moved.keys() - {one.name for one in effects}),
    )
    data_mm = budget.standard_mm[held]
    numerics_mm = None if spread is None else _level_doubt_mm(spread, s_mm)
    inputs_mm = np.interp(s_mm, error.x, together(effects)) if effects else None
    known = [part for part in (data_mm, numerics_mm, inputs_mm) if part is not None]
    validation_mm = np.sqrt(np.sum(np.square(known), axis=0))
    return {
        "mean_error_mm": _ends(mean_error_interval(error.x, error.value, hat, budget)),
        "bias_mm": _ends(Interval(bias_mm - half_mm, bias_mm + half_mm)),
        "bias_systematic_mm": mean.systematic_mm,
        "levels": {"s_mm": measured.s_mm, "band_95_mm": bands_mm(budget)},
        "readings": _told(budget),
        "mean_level": {**asdict(overall), "validation_mm": overall.validation_mm, "resolved": overall.resolved},
        "stations": {
            "s_mm": s_mm,
            "error_mm": errors_mm,
            "data_mm": data_mm,
            "numerics_mm": numerics_mm,
            "inputs_mm": inputs_mm,
            "validation_mm": validation_mm,
        },
        "sentences": [overall.sentence, station_sentence(errors_mm, validation_mm, overall.left_out)],
        "alignment": {"choice": CHOICE, "shifts": shifted_errors_mm(simulated, measured)},
        "numerics": None if spread is None else _numerics(spread, measured, error.x),
        "inputs": [
            {"name": one.name, "standard": one.standard, "mean_level_mm": _mean(error.x, one.level_mm),
             "largest_mm": float(np.abs(one.level_mm).max())}
            for one in effects
        ],
        "inputs_left_out": sorted(name for name, value in declared if value is None and name != "repeatability_mm"),
        "effect_scatter_mm": None if spread is None else spread.effect_scatter_mm,
        "design_radius_mm": None if spread is None else spread.design_radius_mm,
    }  # fmt: skip


def _effects(simulated: Profile, x: Floats, declared: Uncertainty, spread: Spread | None) -> list[Effect]:
    """On the error at ``x``. Where the stations are needs no run: the slope of the level tells it."""
    runs = () if spread is None else spread.effects
    found = [Effect(one.name, one.standard, np.interp(x, _grid(spread), one.level_mm)) for one in runs]
    if declared.station_mm is not None:
        moved_mm = station_effect_mm(simulated, x, declared.station_mm)
        found.append(Effect("station_mm", declared.station_mm, moved_mm))
    return found


def _grid(spread: Spread | None) -> Floats:
    assert spread is not None, "its effects are read"
    return spread.s_mm


def _means(spread: Spread, x: Floats) -> list[float]:
    """Mean level over the covered stretch, of each size."""
    return [_mean(x, np.interp(x, spread.s_mm, size.level_mm)) for size in spread.sizes]


def _level_doubt_mm(spread: Spread, s_mm: Floats) -> Floats:
    """The same at all stations, (n,): three runs may agree at one place by chance, and disagree beside it."""
    levels_mm = np.array([np.interp(s_mm, spread.s_mm, size.level_mm) for size in spread.sizes])
    return np.full(len(s_mm), _rms(np.array([spread.converged(three).standard for three in levels_mm.T])))


def _numerics(spread: Spread, measured: Profile, x: Floats) -> dict[str, Any]:
    """How mean level and mean error go with the particles' size."""
    errors_mm = []
    for size in spread.sizes:
        curves = spread.s_mm, size.level_mm, measured.s_mm, measured.level_mm
        errors_mm.append(area_between(*curves) / Difference(*curves).length_mm)
    means_mm = _means(spread, x)
    return {
        "radii_mm": [size.radius_mm for size in spread.sizes],
        "mean_level_mm": {"values": means_mm, **asdict(spread.converged(means_mm))},
        "mean_error_mm": {"values": errors_mm, **asdict(spread.converged(errors_mm))},
    }


def _told(budget: Budget) -> dict[str, Any]:
    """Sizes as root mean squares over the stations."""
    parts: list[dict[str, Any]] = [
        {"name": part.name, "standard_mm": _rms(part.standard_mm), "shared": part.shared, "shape": part.shape}
        for part in budget.parts
    ]
    if budget.scatter_mm is not None:
        scatter = {"name": "scatter of the repeats", "standard_mm": _rms(budget.scatter_mm), "shared": False}
        parts.insert(0, {**scatter, "shape": "Student's t", "freedom": float(budget.freedom.min())})
    return {
        "parts": parts,
        "scatter_known": budget.scatter_mm is not None,
        "pooled": budget.pooled,
        "bartlett_p": budget.bartlett_p,
        "cautions": list(budget.cautions),
    }


def _ends(interval: Interval) -> list[float]:
    return [interval.low, interval.high]


def _mean(x: Floats, value: Floats) -> float:
    return float(np.trapezoid(value, x) / (x[-1] - x[0]))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
