"""Comparison of a simulated with a measured level: errors, intervals, baselines and the verdict."""

from dataclasses import replace
from typing import Any

import numpy as np

from sealtwin.core.comparison import (
    Comparison,
    ErrorUncertainty,
    InputEffect,
    LevelMetrics,
    Role,
    SizeStudy,
    StationBands,
    StationErrors,
    VolumeComparison,
)
from sealtwin.core.records import DataKind, Floats, Outline, Profile, Solid
from validate.metrics.curve_distances import CLOSE_MM, PiecewiseLinear, error_bins, frechet_mm, level_difference
from validate.metrics.verdict import basis_of, judged
from validate.metrics.volumes import balance_profile, fill_volumes, mass_balance, mouth_widths_mm
from validate.report_input import Evidence
from validate.settings import Gate, Readings, Uncertainty
from validate.uncertainty import validation
from validate.uncertainty.intervals import bands_mm, doubt_of, hats, mean_error_interval, mean_weights
from validate.uncertainty.readings_budget import Budget, alignment, budget_of, repeatability, rms, station_effect_mm
from validate.uncertainty.validation import Effect, Spread, root_sum

AREAS_AGREE = 1e-9  # Largest relative difference, by rounding, of the two computations of one area


def compare(
    simulated: Profile,
    measured: Profile,
    outline: Outline,
    solid: Solid,
    *,
    role: Role,
    photo_data: DataKind,
    gate: Gate | None = None,
    escaped_particles: int = 0,
    uncertainty: ErrorUncertainty | None = None,
    edited: tuple[str, ...] = (),
) -> Comparison:
    """Compare two levels over their common stretch of s and judge the error.

    A positive error means that the simulated level is too high; between stations both are straight, so the integrals
    are exact. With an escaped particle nothing passes, and without ``uncertainty`` the verdict has no interval. Raises
    InputError where the two curves do not overlap.
    """
    error = level_difference(simulated, measured)
    area_mm2, area_library_mm2 = error.area, error.area_by_similaritymeasures()
    if abs(area_mm2 - area_library_mm2) > AREAS_AGREE * max(1.0, area_mm2):
        raise RuntimeError(f"The two area computations disagree: {area_mm2!r} and {area_library_mm2!r} mm².")
    from_mm, to_mm = float(error.x[0]), float(error.x[-1])
    worst = int(np.argmax(np.abs(error.value)))
    bins = error_bins(simulated, measured, outline.length_mm)
    # The constant nearest to a level is its median over the length.
    flat_level_mm = error.base.quantile(0.5)
    flat_error_mm = level_difference(Profile(error.x[[0, -1]], np.full(2, flat_level_mm)), measured).mean_error
    basis = basis_of(measured.s_mm, from_mm, to_mm, outline.length_mm)
    beyond = (measured.s_mm < from_mm) | (measured.s_mm > to_mm)
    volumes: dict[str, Any] = {
        f"{name}_{key}": value
        for name, profile in (("simulated", simulated), ("measured", measured))
        for key, value in fill_volumes(profile, outline, solid, from_mm, to_mm).items()
    }
    metrics = LevelMetrics(
        mean_error_mm=error.mean_error,
        worst_error_mm=abs(error.value[worst]),
        worst_at_mm=error.x[worst],
        covered_from_mm=from_mm,
        covered_to_mm=to_mm,
        covered_length_mm=error.length_mm,
        coverage=basis.coverage,
        length_mm=outline.length_mm,
        stations_compared=int((~beyond).sum()),
        stations_beyond_mm=measured.s_mm[beyond],
        stations_used=basis.stations,
        widest_gap_mm=basis.widest_gap * outline.length_mm,
        enough_readings=basis.suffices,
        escaped_particles=escaped_particles,
        area_mm2=area_mm2,
        area_similaritymeasures_mm2=area_library_mm2,
        area_difference_mm2=area_mm2 - area_library_mm2,
        bias_mm=error.mean(),
        rmse_mm=error.rms(),
        p95_error_mm=error.size.quantile(0.95),
        share_under_1_mm=error.size.share_below(CLOSE_MM),
        frechet_mm=frechet_mm(simulated, measured, from_mm, to_mm),
        error_by_bin=bins,
        start_zone_error_mm=bins[0].mean_error_mm,
        end_zone_error_mm=bins[-1].mean_error_mm,
        flat_level_mm=flat_level_mm,
        flat_level_error_mm=flat_error_mm,
        beats_flat_level=error.mean_error < flat_error_mm,
        readings=repeatability(measured),
        role=role,
        readings_data=measured.data,
        readings_dialect=measured.dialect,
        photo_data=photo_data,
        **volumes,
    )
    return judged(metrics, None if gate is None else gate.mean_error_mm, uncertainty, edited)


def assess(
    evidence: Evidence, settings: Readings, declared: Uncertainty, spread: Spread | None, gate: Gate | None = None
) -> Comparison:
    """Compare the level of a trial with its readings, with intervals, baselines and the mass balance, and judge it.

    The comparison that ``evidence`` holds is not used; ``spread`` holds the results of extra runs, if there were any.
    """
    simulated, measured, outline, solid = evidence.profile, evidence.readings, evidence.outline, evidence.solid
    if measured is None:
        raise ValueError(f"{evidence.name}: has no readings to compare with.")
    comparison = compare(
        simulated,
        measured,
        outline,
        solid,
        role=settings.role,
        photo_data=evidence.photo_data,
        gate=gate,
        escaped_particles=evidence.run.escaped_particles,
        uncertainty=error_uncertainty(simulated, measured, outline, solid, settings, declared, spread),
        edited=evidence.edited,
    )
    metrics = comparison.metrics
    baseline = balance_profile(evidence.run.dispensed_volume_mm3, evidence.trajectory, outline, solid)
    baseline_error_mm = level_difference(baseline, measured).mean_error
    volumes = VolumeComparison(
        volume_balance_level_mm=float(baseline.level_mm.max()),
        volume_balance_error_mm=baseline_error_mm,
        beats_volume_balance=metrics.mean_error_mm < baseline_error_mm,
        mass_balance=mass_balance(evidence.run, solid, evidence.volume_ratio, metrics.measured_sealant_mm3, settings),
    )
    return replace(comparison, volumes=volumes)


def error_uncertainty(
    simulated: Profile,
    measured: Profile,
    outline: Outline,
    solid: Solid,
    settings: Readings,
    declared: Uncertainty,
    spread: Spread | None = None,
) -> ErrorUncertainty:
    """Compute the intervals of the error by the readings, the particles' size and the declared inputs."""
    budget = budget_of(measured, settings, declared, mouth_widths_mm(measured.s_mm, outline, solid))
    error = level_difference(simulated, measured)
    hat = hats(error.x, measured.s_mm)
    mean = doubt_of(budget, mean_weights(error.x, hat))
    bias_mm, half_mm = error.mean(), mean.half_width_mm
    effects = []
    if spread is not None:
        effects = [replace(one, level_mm=np.interp(error.x, spread.s_mm, one.level_mm)) for one in spread.effects]
    if declared.station_mm is not None:
        moved_mm = station_effect_mm(simulated, error.x, declared.station_mm)
        effects.append(Effect("station_mm", declared.station_mm, moved_mm))
    inputs = [
        InputEffect(
            name=one.name,
            standard=one.standard,
            mean_level_mm=PiecewiseLinear(error.x, one.level_mm).mean(),
            largest_mm=float(np.abs(one.level_mm).max()),
        )
        for one in effects
    ]
    numerics = None if spread is None else _numerics(spread, measured, error.x)
    overall = validation.mean_level_budget(
        error_mm=bias_mm,
        data_mm=mean.standard_mm,
        numerics_mm=None if numerics is None else numerics.mean_level_mm.standard,
        inputs_mm=float(np.sqrt(sum(one.mean_level_mm**2 for one in inputs))) if inputs else None,
        inputs_waiting=bool(declared.moved.keys() - {one.name for one in inputs}),
    )
    stations = _station_errors(simulated, measured, budget, error.x, effects, spread)
    return ErrorUncertainty(
        mean_error_interval_mm=mean_error_interval(error.x, error.value, hat, budget),
        bias_interval_mm=(bias_mm - half_mm, bias_mm + half_mm),
        bias_systematic_mm=mean.systematic_mm,
        levels=StationBands(s_mm=measured.s_mm, band_95_mm=bands_mm(budget)),
        readings=budget.summary(),
        mean_level=overall,
        stations=stations,
        sentences=(
            validation.mean_level_sentence(overall),
            validation.station_sentence(stations.error_mm, stations.validation_mm, validation.left_out(overall)),
        ),
        alignment=alignment(simulated, measured),
        numerics=numerics,
        inputs=tuple(inputs),
        inputs_left_out=tuple(sorted(name for name, value in declared if value is None and name != "repeatability_mm")),
        effect_scatter_mm=None if spread is None else spread.effect_scatter_mm,
        design_radius_mm=None if spread is None else spread.design_radius_mm,
    )


def _station_errors(
    simulated: Profile, measured: Profile, budget: Budget, x: Floats, effects: list[Effect], spread: Spread | None
) -> StationErrors:
    """Error at each station on the covered stretch ``x``, and the standard uncertainties of it."""
    held = (measured.s_mm >= x[0]) & (measured.s_mm <= x[-1])
    s_mm, data_mm, numerics_mm = measured.s_mm[held], budget.standard_mm[held], None
    if spread is not None:
        levels_mm = np.array([np.interp(s_mm, spread.s_mm, size.level_mm) for size in spread.sizes])
        # One number for all stations: three runs may agree at one place by chance, and disagree beside it.
        doubts_mm = np.array([spread.converged(three).standard for three in levels_mm.T])
        numerics_mm = np.full(len(s_mm), rms(doubts_mm))
    # The inputs are independent of each other.
    inputs_mm = np.interp(s_mm, x, root_sum(*(one.level_mm for one in effects))) if effects else None
    return StationErrors(
        s_mm=s_mm,
        error_mm=np.interp(s_mm, simulated.s_mm, simulated.level_mm) - measured.level_mm[held],
        data_mm=data_mm,
        numerics_mm=numerics_mm,
        inputs_mm=inputs_mm,
        validation_mm=root_sum(data_mm, numerics_mm, inputs_mm),
    )


def _numerics(spread: Spread, measured: Profile, x: Floats) -> SizeStudy:
    """Mean level and mean error over the covered stretch at each particle size."""
    means_mm = [PiecewiseLinear(x, np.interp(x, spread.s_mm, size.level_mm)).mean() for size in spread.sizes]
    errors = [level_difference(Profile(spread.s_mm, size.level_mm), measured) for size in spread.sizes]
    return SizeStudy(
        radii_mm=tuple(size.radius_mm for size in spread.sizes),
        mean_level_mm=spread.converged(means_mm),
        mean_error_mm=spread.converged([error.mean_error for error in errors]),
    )
