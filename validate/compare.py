"""Compare a simulated level with a measured one: errors, intervals, baselines and the verdict."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sealtwin.core.records import DataKind, Floats, Outline, Profile, Solid
from validate.comparison import Baseline, Comparison, CurveDistances, ReadingsScatter, VolumeComparison
from validate.intervals import ErrorUncertainty, InputDrawsRecord, SizeStudy, StationBands, StationError, StationErrors
from validate.metrics.curve_distances import (
    alignment,
    compared_stations,
    error_bins,
    error_figures,
    frechet_mm,
    level_difference,
)
from validate.metrics.verdict import ALWAYS, POOL, basis_of, beaten, best_curves, with_verdict
from validate.metrics.volumes import balance_profile, fill_volumes, gained_level_mm, mass_balance
from validate.result import Evidence
from validate.sentences import stated
from validate.settings import Gate, Readings, Role, Uncertainty
from validate.uncertainty import validation
from validate.uncertainty.budget import Budget, Curve, Kind
from validate.uncertainty.computed import Spread, size_series
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.reading_errors import budget_of
from validate.uncertainty.repeats import contradicted, repeats_of
from validate.uncertainty.validation import COVERAGE

AT_A_STATION_MM = 0.05  # An error closer to a station than this counts as at the station, since s is printed to 0.1 mm
AREAS_AGREE = 1e-9  # Largest relative difference that rounding may cause between the two computations of the area


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
    fitted: tuple[str, ...] | None = None,
    screening: bool = False,
    unseen: Sequence[Baseline] = (),
    exceeded: Sequence[str] = (),
) -> Comparison:
    """Compare two levels over the stretch of s that both cover, and judge the error.

    A positive error means that the simulated level is too high. Both levels are straight between stations, so the
    integrals are exact. If a particle escaped, the comparison fails. Without ``uncertainty``, the verdict has no
    interval. ``screening`` marks a level from a screening model, which gets no verdict. The headline names the
    settings ``fitted`` to the readings and the baselines. ``unseen`` are the baselines that were made without the
    readings, and ``exceeded`` sentences about declared errors that the readings exceed. Raises InputError if the
    two curves do not overlap.
    """
    error = level_difference(simulated, measured)
    area_mm2, area_library_mm2 = error.area, error.area_by_similaritymeasures()
    if abs(area_mm2 - area_library_mm2) > AREAS_AGREE * max(1.0, area_mm2):
        raise RuntimeError(f"The two computations of the area differ: {area_mm2!r} and {area_library_mm2!r} mm².")
    from_mm, to_mm = float(error.x[0]), float(error.x[-1])
    stretch = outline, solid, from_mm, to_mm
    count = None if fitted is None else len(fitted)
    # Without fitted settings the simulation uses no more of the readings than they do.
    baselines = () if role == "calibrated-on" and count != 0 else tuple(unseen)
    if role != "held-out":
        baselines += best_curves(measured, from_mm, to_mm, (*ALWAYS, *([count] if count else [])))
    comparison = Comparison(
        errors=error_figures(error, measured),
        distances=CurveDistances(
            area_mm2=area_mm2,
            area_similaritymeasures_mm2=area_library_mm2,
            rmse_mm=error.rms(),
            p95_error_mm=error.size.quantile(0.95),
            frechet_mm=frechet_mm(simulated, measured, from_mm, to_mm),
            by_bin=error_bins(simulated, measured, outline.length_mm),
        ),
        basis=basis_of(measured.s_mm, from_mm, to_mm, outline.length_mm),
        stations=compared_stations(simulated, measured),
        simulated_volumes=fill_volumes(simulated, *stretch),
        measured_volumes=fill_volumes(measured, *stretch),
        baselines=baselines,
        beats_baseline=beaten(error.mean_error, baselines, role, count),
        scatter=repeatability(measured),
        scan=measured.scan and measured.scan.figures,
        role=role,
        fitted=fitted,
        readings_data=measured.data,
        readings_dialect=measured.dialect,
        readings_remarks=(*measured.doubts, *exceeded),
        photo_data=photo_data,
        escaped_particles=escaped_particles,
        uncertainty=uncertainty,
    )
    return with_verdict(comparison, gate, edited, screening=screening)


def assess(
    evidence: Evidence,
    settings: Readings,
    declared: Uncertainty,
    spread: Spread | None,
    gate: Gate | None = None,
) -> Comparison:
    """Compare the level of a trial with its readings and judge it, with intervals, baselines and the mass balance.

    A comparison in ``evidence`` is ignored. ``spread`` contains the results of extra runs, if there are any.
    """
    simulated, measured, outline, solid = evidence.profile, evidence.readings, evidence.outline, evidence.solid
    if measured is None:
        raise ValueError(f"{evidence.name}: there are no readings to compare with.")
    gained_mm = gained_level_mm(evidence.run, simulated, outline, solid, evidence.volume_ratio)
    mouth = Mouth.of(outline, solid, evidence.run.density_kg_m3)
    pool = balance_profile(evidence.run.dispensed_volume_mm3, outline, solid)
    pool_error_mm = level_difference(pool, measured).mean_error
    unseen = [Baseline(POOL, 0, pool_error_mm)]
    if spread is not None and spread.fast_mm is not None:
        fast = level_difference(Profile(spread.s_mm, spread.fast_mm), measured)
        unseen.append(Baseline("the fast model", 0, fast.mean_error))
    comparison = compare(
        simulated,
        measured,
        outline,
        solid,
        role=settings.role,
        photo_data=evidence.photo_data,
        gate=gate,
        escaped_particles=evidence.run.escaped_particles,
        uncertainty=error_uncertainty(simulated, measured, mouth, settings, declared, spread, gained_mm),
        edited=evidence.edited,
        fitted=settings.fitted,
        screening=not evidence.run.has_particles,
        exceeded=contradicted(measured, settings, declared),
        unseen=unseen,
    )
    volumes = VolumeComparison(
        volume_balance_level_mm=float(pool.level_mm.max()),
        volume_balance_error_mm=pool_error_mm,
        beats_volume_balance=comparison.mean_error_mm < pool_error_mm,
        mass_balance=mass_balance(
            evidence.run, solid, evidence.volume_ratio, comparison.measured_volumes.sealant_mm3, settings
        ),
    )
    return comparison.model_copy(update={"volumes": volumes})


def repeatability(measured: Profile) -> ReadingsScatter:
    """Return the scatter of repeated readings, pooled over the stations."""
    repeats_mm, residual_mm = repeats_of(measured)
    count = (~np.isnan(repeats_mm)).sum(axis=1)
    freedom = int((count - 1).sum())
    squares_mm2 = np.nansum(residual_mm**2)
    return ReadingsScatter(
        stations=len(count),
        readings=int(count.sum()),
        degrees_of_freedom=freedom,
        repeatability_sd_mm=float(np.sqrt(squares_mm2 / freedom)) if freedom else None,
    )


def error_uncertainty(
    simulated: Profile,
    measured: Profile,
    mouth: Mouth,
    settings: Readings,
    declared: Uncertainty,
    spread: Spread | None = None,
    volume_level_mm: float | None = None,
) -> ErrorUncertainty:
    """Return the intervals of the error that result from the readings, the numerics and the declared inputs.

    ``volume_level_mm`` is the change of level due to volume that the numerics gained. The change is None if it is
    unknown.
    """
    of_readings = budget_of(measured, settings, declared, mouth)
    error = level_difference(simulated, measured)
    curve = Curve.of(error.x, error.value, measured.s_mm)
    calibrated, screening = settings.role == "calibrated-on", spread is not None and spread.sizes is None
    spread = spread or Spread(measured.s_mm, None, (), None, None)
    budget = replace(of_readings, components=(*of_readings.components, *spread.errors(measured.s_mm, volume_level_mm)))
    inputs, together = spread.inputs_at(error.x).reported(error.x)

    def standard_mm(*kinds: Kind) -> float:
        return budget.of_kind(*kinds).mean_mm(curve.weights()) / COVERAGE

    bias_mm, half_mm = error.mean(), of_readings.mean_mm(curve.weights())
    overall = validation.mean_level_budget(
        error_mm=bias_mm,
        validation_mm=standard_mm("readings", "numerics", "inputs"),
        data_mm=standard_mm("readings"),
        numerics_mm=standard_mm("numerics") if budget.of_kind("numerics").components else None,
        inputs_mm=standard_mm("inputs") if inputs else None,
        inputs_waiting=bool(declared.moved.keys() - {part.name for part in inputs}),
        volume_level_mm=volume_level_mm,
    )
    stations, summary = _station_errors(simulated, measured, budget), budget.summary(curve)
    missing = [part.name for part in summary.missing]
    return ErrorUncertainty(
        mean_error_interval_mm=of_readings.mean_error_interval(curve),
        bias_interval_mm=(bias_mm - half_mm, bias_mm + half_mm),
        bias_systematic_mm=of_readings.where(lambda component: component.shared).mean_mm(curve.weights()) / COVERAGE,
        levels=StationBands(
            s_mm=measured.s_mm, band_95_mm=of_readings.band_mm, profile_band_95_mm=of_readings.profile_band_mm
        ),
        budget=summary,
        mean_level=overall,
        stations=stations,
        worst_at_a_station=worst_at_a_station(stations, float(error.x[np.argmax(np.abs(error.value))])),
        findings=(
            *validation.level_findings(overall, stations, summary.parts, calibrated=calibrated, screening=screening),
            *((stated("validation.missing", len(missing), names=missing),) if missing else ()),
        ),
        alignment=alignment(simulated, measured),
        numerics=_numerics(spread, measured, error.x),
        inputs=inputs,
        input_draws=spread.draws
        and InputDrawsRecord(runs=len(spread.draws.moved_mm), together=together, unfit=spread.unfit),
        inputs_left_out=declared.left_out,
        effect_scatter_mm=spread.effect_scatter_mm,
        design_radius_mm=spread.design_radius_mm,
    )


def worst_at_a_station(stations: StationErrors, worst_at_mm: float) -> StationError | None:
    """Return the largest error at a station.

    Returns None if there are no stations, or if the overall largest error is at a station.
    """
    if not len(stations.s_mm) or np.abs(stations.s_mm - worst_at_mm).min() < AT_A_STATION_MM:
        return None
    worst = int(np.argmax(np.abs(stations.error_mm)))
    return StationError(abs(float(stations.error_mm[worst])), float(stations.s_mm[worst]))


def _station_errors(simulated: Profile, measured: Profile, budget: Budget) -> StationErrors:
    """Return the error at each compared station, with its standard uncertainties."""
    stations = compared_stations(simulated, measured)
    covered = budget.at_stations(np.isin(measured.s_mm, stations.s_mm))
    kinds: set[Kind] = {component.kind for component in budget.components}
    parts = {kind: covered.of_kind(kind).band_mm / COVERAGE for kind in kinds}
    return StationErrors(
        s_mm=stations.s_mm,
        error_mm=stations.error_mm,
        data_mm=parts["readings"],
        numerics_mm=parts.get("numerics"),
        inputs_mm=parts.get("inputs"),
        validation_mm=covered.band_mm / COVERAGE,
        profile_mm=covered.profile_band_mm,
        by_chance=covered.by_chance,
    )


def _numerics(spread: Spread, measured: Profile, x: Floats) -> SizeStudy | None:
    """Return the mean level and mean error over the covered stretch at each particle size.

    Returns None if there are no extra runs of particles.
    """
    replicates = spread.sizes_at(x)
    if spread.sizes is None or replicates is None:
        return None
    radii_mm = replicates.radii_mm
    means_mm = [np.trapezoid(runs, x) / (x[-1] - x[0]) for runs in replicates.runs]
    errors_mm = [
        [level_difference(Profile(spread.s_mm, level_mm), measured).mean_error for level_mm in size.levels_mm]
        for size in spread.sizes
    ]
    return SizeStudy(tuple(radii_mm), size_series(means_mm, radii_mm), size_series(errors_mm, radii_mm))
