"""One datum, one set of stations: how far a simulated surface lies from a measured one."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sealtwin.records import Comparison, DataKind, Floats, Outline, Profile, Solid
from validate.comparison.curves import Difference, Pieces, polyline
from validate.comparison.verdict import Judgement, basis_of
from validate.comparison.volumes import fill_volumes
from validate.settings import Gate, Role

BIN_MM = 10.0
"""Of the error histogram along the crack, as in the paper's Fig. 9b; the first and the last are its start and end."""
AREAS_AGREE = 1e-9
CLOSE_MM = 1.0
"""The paper states the share of the crack's length with an error below this."""
FRECHET_MM = 0.5
"""From point to point of the curves that Frechet's distance is taken of: it hangs on them, so they are always these."""
MOST_FRECHET = 400
"""Points: beyond them the time, which grows with their square, would be felt in a sweep."""


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
) -> Comparison:
    """Metrics of simulated minus measured level over their common stretch of s, all of them exact integrals.

    Between stations both curves are straight, so the error is piecewise linear; positive means that the simulation
    stands too high. ``escaped_particles`` are those of the run that was measured: with one, nothing passes.

    Raises InputError where the two curves do not overlap.
    """
    error = Difference(simulated.s_mm, simulated.level_mm, measured.s_mm, measured.level_mm)
    area_mm2 = area_between(simulated.s_mm, simulated.level_mm, measured.s_mm, measured.level_mm)
    area_library_mm2 = area_by_similaritymeasures(simulated.s_mm, simulated.level_mm, measured.s_mm, measured.level_mm)
    if abs(area_mm2 - area_library_mm2) > AREAS_AGREE * max(1.0, area_mm2):
        raise RuntimeError(f"The two area computations disagree: {area_mm2!r} and {area_library_mm2!r} mm².")
    mean_error_mm = area_mm2 / error.length_mm
    worst = int(np.argmax(np.abs(error.value)))
    bins = error_bins(simulated, measured, outline.length_mm)
    flat_level_mm = best_flat_level(error.x, np.interp(error.x, measured.s_mm, measured.level_mm))
    flat_error_mm = (
        area_between(error.x[[0, -1]], np.full(2, flat_level_mm), measured.s_mm, measured.level_mm) / error.length_mm
    )
    basis = basis_of(measured.s_mm, float(error.x[0]), float(error.x[-1]), outline.length_mm)
    metrics: dict[str, Any] = {
        "covered_from_mm": error.x[0],
        "covered_to_mm": error.x[-1],
        "covered_length_mm": error.length_mm,
        "coverage": basis.coverage,
        "stations_compared": basis.stations,
        "widest_gap_mm": basis.widest_gap * outline.length_mm,
        "enough_readings": basis.suffices,
        "escaped_particles": escaped_particles,
        "area_mm2": area_mm2,
        "area_similaritymeasures_mm2": area_library_mm2,
        "area_difference_mm2": area_mm2 - area_library_mm2,
        "bias_mm": error.mean(),
        "rmse_mm": error.rms(),
        "p95_error_mm": error.quantile(0.95),
        "share_under_1_mm": error.share_within(CLOSE_MM),
        "frechet_mm": frechet_mm(simulated, measured, float(error.x[0]), float(error.x[-1])),
        "error_by_bin": bins,
        "start_zone_error_mm": bins[0]["mean_error_mm"],
        "end_zone_error_mm": bins[-1]["mean_error_mm"],
        "flat_level_mm": flat_level_mm,
        "flat_level_error_mm": flat_error_mm,
        "beats_flat_level": mean_error_mm < flat_error_mm,
        "readings": repeatability(measured),
        "role": role,
        "readings_data": measured.data,
        "readings_dialect": measured.dialect,
        "photo_data": photo_data,
    }
    for name, profile in (("simulated", simulated), ("measured", measured)):
        volumes = fill_volumes(profile, outline, solid, float(error.x[0]), float(error.x[-1]))
        metrics |= {f"{name}_{key}": value for key, value in volumes.items()}
    judgement = Judgement(mean_error_mm, gate, basis, escaped_particles, measured.data, photo_data, role)
    return Comparison(
        mean_error_mm=mean_error_mm,
        worst_error_mm=float(abs(error.value[worst])),
        worst_at_mm=float(error.x[worst]),
        metrics=metrics,
        gate={} if gate is None else {"mean_error_mm": gate.mean_error_mm},
        passed=judgement.passed,
        verdict=judgement.verdict,
    )


def area_between(x_a: ArrayLike, y_a: ArrayLike, x_b: ArrayLike, y_b: ArrayLike) -> float:
    """Integral of |a - b| over the common support of two polylines, exact. Units of x times units of y.

    Points may come in any order. Raises InputError for NaN, repeated x, fewer than two points or no common support.
    """
    difference = Difference(x_a, y_a, x_b, y_b)
    return float(np.sum(np.diff(difference.x) * (np.abs(difference.value[:-1]) + np.abs(difference.value[1:])) / 2))


def area_by_similaritymeasures(x_a: ArrayLike, y_a: ArrayLike, x_b: ArrayLike, y_b: ArrayLike) -> float:
    """The same area by the library that the paper used, given what it needs to be right.

    Its ``area_between_two_curves`` pairs points by their index, not by x, and does not see a crossing inside a pair:
    fed 17 against 801 stations it is off by a factor of 3. It is exact on one common grid with every crossing in it.
    """
    import similaritymeasures

    difference = Difference(x_a, y_a, x_b, y_b)
    base = np.interp(difference.x, *polyline(x_b, y_b))
    # At a crossing both curves get one common value; rounding would else leave a sliver that drops a triangle.
    return float(
        similaritymeasures.area_between_two_curves(
            np.column_stack([difference.x, base + difference.value]), np.column_stack([difference.x, base])
        )
    )


def error_bins(simulated: Profile, measured: Profile, length_mm: float) -> list[dict[str, float]]:
    """Mean |error| in each 10 mm of the crack's length, over what is covered of it; NaN where nothing is.

    The last bin takes a remainder of up to 5 mm, or ends by as much earlier.
    """
    edges_mm = np.arange(max(1, round(length_mm / BIN_MM)) + 1) * BIN_MM
    edges_mm[-1] = length_mm
    bins = []
    for begin_mm, end_mm in pairwise(edges_mm):
        low = max(begin_mm, simulated.s_mm[0], measured.s_mm[0])
        high = min(end_mm, simulated.s_mm[-1], measured.s_mm[-1])
        mean_mm = np.nan
        if high > low:
            part = (_clipped(profile, low, high) for profile in (simulated, measured))
            mean_mm = area_between(*(axis for curve in part for axis in curve)) / (high - low)
        bins.append(
            {
                "from_mm": float(begin_mm),
                "to_mm": float(end_mm),
                "covered_mm": float(max(high - low, 0.0)),
                "mean_error_mm": float(mean_mm),
            }
        )
    return bins


def frechet_mm(simulated: Profile, measured: Profile, from_mm: float, to_mm: float) -> float:
    """Discrete Frechet distance of two curves over a stretch of s, both read at the same even points of it.

    The shortest leash of a walk along both, forward only: unlike an area it forgives a step that comes early, and
    counts it along the crack. It takes s and level for the same kind of millimetre.
    """
    import similaritymeasures

    points = min(MOST_FRECHET, max(2, round((to_mm - from_mm) / FRECHET_MM) + 1))
    s_mm = np.linspace(from_mm, to_mm, points)
    first, second = (np.column_stack([s_mm, np.interp(s_mm, one.s_mm, one.level_mm)]) for one in (simulated, measured))
    return float(similaritymeasures.frechet_dist(first, second))


def best_flat_level(x: Floats, y: Floats) -> float:
    """The constant with the smallest mean distance from a polyline: its median over the length."""
    return Pieces(x, y).quantile(0.5)


def repeatability(measured: Profile) -> dict[str, Any]:
    """Scatter of repeated readings, pooled over the stations, and the 95 % band of their means."""
    from scipy.stats import t

    repeats_mm = measured.repeats_mm if measured.repeats_mm is not None else measured.level_mm[:, None]
    count = (~np.isnan(repeats_mm)).sum(axis=1)
    freedom = int((count - 1).sum())
    summary: dict[str, Any] = {"stations": len(count), "readings": int(count.sum()), "degrees_of_freedom": freedom}
    if freedom == 0:
        return summary | {"repeatability_sd_mm": None, "band_95_mm": None}
    residual_mm = repeats_mm - np.nanmean(repeats_mm, axis=1, keepdims=True)
    deviation_mm = float(np.sqrt(np.nansum(residual_mm**2) / freedom))
    band_mm = float(t.ppf(0.975, freedom)) * deviation_mm / np.sqrt(count)
    return summary | {"repeatability_sd_mm": deviation_mm, "band_95_mm": band_mm}


def _clipped(profile: Profile, low: float, high: float) -> tuple[Floats, Floats]:
    """Stations and levels of a part of a profile, its ends interpolated."""
    inner = profile.s_mm[(profile.s_mm > low) & (profile.s_mm < high)]
    s_mm = np.concatenate([[low], inner, [high]])
    return s_mm, np.interp(s_mm, profile.s_mm, profile.level_mm)
