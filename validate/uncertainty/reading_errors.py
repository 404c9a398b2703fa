"""Budget of readings: errors that repeats or a scan show, errors that they do not show, and gaps between stations."""

from functools import cache

import numpy as np

from sealtwin.core.arrays import midpoints
from sealtwin.core.facts import Fact
from sealtwin.core.records import Booleans, Floats, Profile
from sealtwin.core.scan_figures import Scan
from validate.sentences import assumed, doubted
from validate.settings import DIGIT_MM, OF_THE_READINGS, Readings, Uncertainty
from validate.uncertainty.budget import (
    DRAWS,
    FEW_STATIONS,
    UNDECLARED_MM,
    Budget,
    Component,
    Source,
    draws_for,
    linear_weights,
    normals,
    uniforms,
)
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.repeats import RESOLUTION_LIMIT, passes_error, repeats_of, without_passes

OUTLIER = 6.0  # Distance of an outlier in robust standard deviations
STEPS_MM = (10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.02)
INCHES = (1 / 4, 1 / 8, 1 / 16, 1 / 32, 1 / 64, 0.01, 0.005)
FEWEST_LEVELS = 5
"""Smallest number of different levels that identifies a step. By chance, this number of levels are all multiples of
0.05 mm in one of 600 sheets."""
ARCH_RATIO = 2.4
"""Largest arch (deviation of the level from the line between two stations), divided by the arch of a parabola with the
curvature at the stations. The smallest ratio is 0. For a level with a corner, the ratio is 0 if the corner is at a
station, 2 if it is in the middle of a gap, and 1 on average."""

SCANNER_MM = 0.05
"""Size in mm that the table of undeclared errors assumes: the stated accuracy of usual desktop scanners."""
LIMIT = "limit of error of the scanner"

STATIONS_FOR_STEPS = 12
"""Smallest number of stations that resolves steps of the level. Without an allowance for steps, the interval of the
mean error contains the true value in 94 % of trials with 12 stations, 85 % with 10 and 50 % with 5."""
STEP = 1 / 8
"""Mean distance of the level from the line between two stations, divided by a step between them. It is 1/4 if the step
is sharp, in the middle and equal to the whole difference in height, and half of that on average."""


def budget_of(measured: Profile, settings: Readings, declared: Uncertainty, mouth: Mouth) -> Budget:
    """Return the budget for readings of a crack with this mouth."""
    if measured.scan is not None:
        return budget_of_scan(measured.scan, settings.limit_mm)
    s_mm, stations = measured.s_mm, len(measured.s_mm)
    draws = draws_for(stations)
    repeats_mm, residual_mm = repeats_of(measured)
    count = (~np.isnan(repeats_mm)).sum(axis=1).astype(np.float64)
    digit_mm = settings.resolution_mm or DIGIT_MM
    resolution_mm = max(digit_mm, resolution_of(repeats_mm))
    digit_of: Source = "detected" if resolution_mm > digit_mm else "declared" if settings.resolution_mm else "assumed"
    own_mm, shapes, per_pass = without_passes(residual_mm, s_mm, declared.pass_mm)
    far, robust_mm = _far(own_mm, count, resolution_mm)
    notes = list[Fact]()
    if places := s_mm[far.any(axis=1)].tolist():
        parts = {"places": places, "outlier": OUTLIER, "robust_mm": robust_mm}
        notes.append(doubted("readings.outlier", len(places), **parts))
    # Of two readings, either may be the outlier.
    alone = far & (count > 2)[:, None]
    used_mm, count = np.where(alone, np.nan, own_mm), count - alone.sum(axis=1)
    middle_mm = np.nanmean(used_mm, axis=1)
    freedom = (count - 1) * (1 - shapes.shape[1] / stations)
    squares_mm2 = np.nansum((used_mm - middle_mm[:, None]) ** 2, axis=1)
    components: list[Component] = []
    has_scatter = bool(freedom.sum()) or declared.repeatability_mm is not None
    pooled_mm = declared.repeatability_mm or 0.0
    if freedom.sum():
        pooled_mm = float(np.sqrt(squares_mm2.sum() / freedom.sum()))
    last_digit = f"last digit, {resolution_mm:g} mm"
    if freedom.sum():
        rounded_mm2 = squares_mm2 + freedom * resolution_mm**2 / 12
        sets_mm = possible_scatter_mm(rounded_mm2, freedom, draws) / np.sqrt(count)
        draws_mm = sets_mm * normals("scatter", stations, draws) - middle_mm
        components.append(Component("scatter of the repeats", "repeats", draws_mm))
    elif has_scatter:
        draws_mm = pooled_mm * normals("scatter", stations, draws)
        components.append(
            Component("scatter of the readings", "declared", draws_mm, setting="uncertainty.repeatability_mm")
        )
    # Repeats that round to the same number have the same error of rounding.
    independent = 1.0 if resolution_mm > RESOLUTION_LIMIT * pooled_mm else count
    rounding_mm = resolution_mm * (uniforms("digit", stations, draws) - 0.5) / np.sqrt(independent)
    components.append(Component(last_digit, digit_of, rounding_mm, setting="readings.resolution_mm"))
    if shapes.shape[1]:
        noise_mm2 = (pooled_mm**2 + resolution_mm**2 / 12) / (shapes**2).sum(axis=0)
        components.append(passes_error(declared.pass_mm, per_pass, noise_mm2, shapes, ~np.isnan(repeats_mm)))
    present, missing = _hidden_errors(measured, settings, declared, mouth, resolution_mm)
    limit_mm, limit_of = (CALIPER_MM, "assumed") if settings.limit_mm is None else (settings.limit_mm, "declared")
    limit_mm = limit_mm * np.ones(stations) * (2 * uniforms("limit", 1, draws) - 1)
    components += [
        Component("limit of error of the caliper", limit_of, limit_mm, shared=True, setting="readings.limit_mm"),
        *present,
        _arches(s_mm, measured.level_mm),
    ]
    if touching := s_mm[mouth.at_mm(s_mm) <= (settings.probe_mm or -1)].tolist():
        notes.append(doubted("readings.probe-touches", len(touching), probe_mm=settings.probe_mm, places=touching))
    if settings.rounding not in (None, "nearest"):
        notes.append(doubted("readings.rounded", resolution_mm, "mm", rounding=settings.rounding))
    steps_mm = _steps_mm(s_mm, measured.level_mm)
    if steps_mm:
        notes.append(assumed("readings.few-stations", steps_mm, "mm", fewest=STATIONS_FOR_STEPS))
    return Budget(
        stations=stations,
        components=tuple(components),
        missing=missing,
        scatter_known=has_scatter,
        notes=tuple(notes),
        steps_mm=steps_mm,
    )


def budget_of_scan(scan: Scan, limit_mm: float | None) -> Budget:
    """Return the budget of a scan. ``limit_mm`` is the limit of the scanner's error, or None if it is undeclared."""
    stations = len(scan.covariance_mm2)
    draws = draws_for(stations)
    values, vectors = np.linalg.eigh(scan.covariance_mm2)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws_mm = normals("scan", stations, draws) @ root.T
    component = Component("position and noise of the scan", "detected", draws_mm, shared=True)
    size_mm = SCANNER_MM if limit_mm is None else limit_mm
    limit_draws_mm = size_mm * np.ones(stations) * (2 * uniforms("limit", 1, draws) - 1)
    limit = Component(LIMIT, "declared", limit_draws_mm, shared=True, setting="readings.limit_mm")
    if limit_mm is None:
        return Budget(stations=stations, components=(component,), missing=(limit,))
    return Budget(stations=stations, components=(component, limit))


def resolution_of(repeats_mm: Floats) -> float:
    """Return the largest usual step, in mm or fractions of an inch, that divides all readings. Returns 0 if none does.

    The readings may have a common offset, such as the height of a datum.
    """
    read_mm = np.unique(np.round(repeats_mm[~np.isnan(repeats_mm)], 6))
    if len(read_mm) < FEWEST_LEVELS:
        return 0.0
    steps_mm = np.array([*STEPS_MM, *(25.4 * part for part in INCHES)])
    times = (read_mm - read_mm[0])[:, None] / steps_mm
    whole = (np.abs(times - np.round(times)) * steps_mm < 1e-4).all(axis=0)
    return float(steps_mm[whole].max()) if whole.any() else 0.0


def _arches(s_mm: Floats, level_mm: Floats) -> Component:
    """Draw the height of the straight line above the sealant, in the middle between two stations.

    The level has a curvature at each station. Each draw applies a random multiple of it, from 0 to ``ARCH_RATIO``, to
    the neighbouring gaps.
    """
    gap_mm = np.diff(s_mm)
    turn = np.diff(np.diff(level_mm) / gap_mm) / midpoints(gap_mm)
    curvature = np.pad(turn, 1, mode="edge") if len(turn) else np.zeros(len(s_mm))
    drawn = curvature * ARCH_RATIO * uniforms("arch", len(s_mm), draws_for(len(s_mm)))
    draws_mm = (drawn[:, :-1] + drawn[:, 1:]) / 2 * gap_mm**2 / 8
    return Component("the level's shape between stations", "assumed", draws_mm, shared=True, between=True)


def _steps_mm(s_mm: Floats, level_mm: Floats) -> float:
    """Return the distance between sealant and line through few stations due to steps, averaged along the crack.

    A gap with a step has a slope that differs from the slope of a neighbouring gap. By the triangle inequality, the
    mean of |error| changes by at most this distance. The mean level need not change.
    """
    if not 2 < len(s_mm) < STATIONS_FOR_STEPS:
        return 0.0
    gap_mm = np.diff(s_mm)
    unlike = np.abs(np.diff(np.diff(level_mm) / gap_mm))
    unlike = np.maximum(np.append(unlike, 0.0), np.append(0.0, unlike))
    # Rounded to a micrometre, so that a straight level gives 0.
    return round(float(STEP * gap_mm @ (unlike * gap_mm) / np.ptp(s_mm)), 3)


def _far(own_mm: Floats, count: Floats, resolution_mm: float) -> tuple[Booleans, float]:
    """Return which readings are outliers of their station, (n, r), and the robust standard deviation in mm.

    A station has at most one outlier, because two outliers count as its scatter. The scatter is at least the rounding
    error of the last digit, even if most repeats are equal.
    """
    again = count > 1
    scaled_mm = np.nan_to_num(np.abs(own_mm)) / np.sqrt(1 - 1 / np.maximum(count, 2))[:, None]
    read = ~np.isnan(own_mm[again])
    median_mm = float(np.median(scaled_mm[again][read])) if again.any() else 0.0
    robust_mm = max(1.4826 * median_mm, resolution_mm / np.sqrt(12))
    largest = np.arange(own_mm.shape[1]) == scaled_mm.argmax(axis=1)[:, None]
    return largest & (scaled_mm > OUTLIER * robust_mm) & (robust_mm > 0), robust_mm


ALIKE_MM = 15.0
"""Correlation length, in mm, of an error that is the same for all repeats: the length over which a level rises and
falls."""
SLOPE_ERROR = 0.8
"""Standard deviation of the slope at a station, divided by the mean change of slope at the station and its neighbours.
With this value, bands for tips of 2 to 4 mm contain 94 to 99 % of stations."""
CALIPER_MM = 0.02  # Limit of error of a digital caliper up to 150 mm
USUAL_SIZES = {"readings.probe_mm": 2.0, "readings.limit_mm": 0.02}
"""Sizes of undeclared errors: the width of a tip in mm, and the relative error of a gauge's scale."""
OF_READINGS = ("datum_error_mm", "probe_mm")
ROUNDING = "readings.rounding"


def _hidden_errors(
    measured: Profile, settings: Readings, declared: Uncertainty, mouth: Mouth, step_mm: float
) -> tuple[list[Component], tuple[Component, ...]]:
    """Return the declared and the undeclared errors. Undeclared errors get a usual size or ``UNDECLARED_MM``.

    ``step_mm`` is the last digit of the readings.
    """
    sizes_mm = {
        **{f"readings.{name}": getattr(settings, name) for name in OF_READINGS},
        **{f"uncertainty.{name}": getattr(declared, name) for name in OF_THE_READINGS},
    }
    if settings.limit_mm is None:
        sizes_mm["readings.limit_mm"] = None
    height_mm, stations = measured.level_mm - (settings.datum_level_mm or 0.0), len(measured.s_mm)
    present, missing = list[Component](), list[Component]()
    for name, value in sizes_mm.items():
        size_mm = USUAL_SIZES.get(name, UNDECLARED_MM) if value is None else value
        (missing if value is None else present).append(_error(name, size_mm, measured.s_mm, height_mm))
    if settings.rounding != "nearest":
        # The error of the last digit covers the rest of the rounding. Rounding toward zero leaves a level at the datum
        # unchanged.
        toward = {"down": 1.0 if measured.is_depth else -1.0, "toward_zero": -np.sign(height_mm)}
        shift_mm = step_mm / 2 * toward[settings.rounding] if settings.rounding else UNDECLARED_MM
        draws_mm = shift_mm * np.ones((draws_for(stations), stations))
        component = Component("one-sided rounding", "declared", draws_mm, shared=True, setting=ROUNDING)
        (missing if settings.rounding is None else present).append(component)
    tension_n_m = declared.surface_tension_n_m
    if (meniscus := mouth.meniscus(measured.s_mm, measured.level_mm, tension_n_m, "readings")) is not None:
        (missing if tension_n_m is None else present).append(meniscus)
    return present, tuple(missing)


def _slopes(s_mm: Floats, level_mm: Floats) -> tuple[Floats, Floats, Floats]:
    """Return at each station the slope on the steeper side, the mean of both slopes, and the change of slope.

    All three are (n,). The change of slope is averaged over the station and its neighbours.
    """
    slope = np.diff(level_mm) / np.diff(s_mm)
    sides = np.array([np.append(slope[0], slope), np.append(slope, slope[-1])])
    turn = np.abs(np.diff(np.pad(slope, 2, mode="reflect")))
    steeper = sides[np.abs(sides).argmax(axis=0), np.arange(len(s_mm))]
    return steeper, sides.mean(axis=0), np.convolve(turn, np.full(3, 1 / 3), "valid")


def _error(name: str, size_mm: float, s_mm: Floats, height_mm: Floats) -> Component:
    """Return draws of an error of the size ``size_mm``. ``height_mm`` is the height of the level above the datum."""
    slope, mean_slope, turn = _slopes(s_mm, height_mm)
    stations, ones, draws = len(s_mm), np.ones(len(s_mm)), draws_for(len(s_mm))
    common, independent = normals(name, 1, draws), normals(f"{name}, each", stations, draws)
    shared = name not in ("uncertainty.station_each_mm", "uncertainty.common_mm")
    match name:
        case "readings.datum_error_mm" | "uncertainty.operator_mm":
            label = "height of the datum" if name == "readings.datum_error_mm" else "operator's offset"
            draws_mm = size_mm * common * ones
        case "readings.limit_mm":
            label, draws_mm = f"scale of a gauge that is {size_mm:.0%} off", size_mm * common * height_mm
        case "readings.probe_mm":
            # A probe reads the highest point below it. Half of its width meets slopes that the stations do not show.
            label = f"width of a probe of {size_mm:g} mm on a slope"
            draws_mm = size_mm / 2 * np.abs(mean_slope + SLOPE_ERROR * turn * independent)
        case "uncertainty.station_mm":
            label, draws_mm = "common shift of the stations", slope * size_mm * common
        case "uncertainty.station_each_mm":
            # The slope itself is uncertain, due to errors in the stations' positions.
            label = "place of each station"
            unsure = 1 + np.sqrt(2) * size_mm / np.gradient(s_mm) * normals(f"{name}, slope", stations, draws)
            draws_mm = slope * unsure * size_mm * independent
        case "uncertainty.common_mm":
            label = "error that all repeats of a station share"
            # A scan has many stations: the error is interpolated between some of them.
            place_mm = s_mm if stations <= FEW_STATIONS else np.linspace(s_mm[0], s_mm[-1], FEW_STATIONS)
            alike = np.exp(-(((place_mm[:, None] - place_mm) / ALIKE_MM) ** 2) / 2)
            root = np.linalg.cholesky(alike + 1e-9 * np.eye(len(place_mm)))
            draws_mm = size_mm * independent[:, : len(place_mm)] @ root.T @ linear_weights(s_mm, place_mm).T
        case "uncertainty.datum_tilt_mm":
            # The caliper was set to zero at either end. A zero between them gives smaller errors.
            label, position = "tilted datum or bowed face", (s_mm - s_mm[0]) / np.ptp(s_mm)
            zero = np.round(uniforms(f"{name}, zero", 1, draws))
            draws_mm = size_mm * common * (position - zero)
        case _:
            label, draws_mm = "sinking probe", -size_mm * np.abs(common) * ones
    return Component(label, "declared", draws_mm, shared=shared, setting=name)


UNEVEN = 0.5
"""Scale of the half-normal prior for the standard deviation of ln(scatter) among stations. This prior is usual for a
spread of logarithms (Röver et al. 2021, Res. Synth. Methods 12:448). At 0.5, two stations in three are within a factor
of 1.65 of the middle one, and three times 0.5 is hardly possible."""
SPREADS = np.arange(0.025, 3 * UNEVEN, 0.05)
"""Grid of the spread of ln(scatter). Only 0.3 % of the prior is beyond it, and a dozen stations do not resolve 0.05."""
LEVEL_GRID = np.arange(-5.0, 10.5, 0.5)
"""Grid for the logarithm of the scatter, in standard deviations from its most likely value. It extends further upward
because the distribution has a long upper tail if there are few repeats."""


def possible_scatter_mm(squares_mm2: Floats, freedom: Floats, draws: int = DRAWS) -> Floats:
    """Draw possible standard deviations of a single reading at each station, (draws, n). All rows are equally likely.

    The input is each station's sum of squares about its mean and its degrees of freedom, (n,) each and not all 0. The
    seed is fixed. Variances follow an inverse chi-squared distribution (Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3:3).
    The variance of a station is moved towards the others, and more so if all are similar. Smyth fits this distribution.
    With a dozen stations the fit is uncertain and gives bands that are too narrow, so the distribution is averaged over
    its posterior here.
    """
    behind = _freedoms_behind()
    log_level, width = _likeliest(squares_mm2, freedom)
    level_mm2 = np.exp(log_level[:, None] + width[:, None] * LEVEL_GRID)
    chance = _log_chance(level_mm2[:, :, None], behind[:, :, None], squares_mm2, freedom)
    chance += np.log(width)[:, None] - (SPREADS[:, None] / UNEVEN) ** 2 / 2
    chance = np.exp(chance - chance.max())
    # A separate seed keeps these draws independent of the errors that are drawn with these scatters.
    random = np.random.default_rng(3)
    drawn = random.choice(chance.size, draws, p=chance.ravel() / chance.sum())
    spread, level = np.divmod(drawn, len(LEVEL_GRID))
    known_mm2 = behind[spread] * level_mm2[spread, level][:, None] + squares_mm2
    return np.sqrt(known_mm2 / random.chisquare(behind[spread] + freedom))


def _log_chance(level_mm2: Floats, behind: Floats, squares_mm2: Floats, freedom: Floats) -> Floats:
    """Return the log likelihood of the stations' sums of squares, over the last axis, up to a constant."""
    from scipy.special import gammaln

    both = behind + freedom
    log_norm = gammaln(both / 2) - gammaln(behind / 2) - freedom / 2 * np.log(behind * level_mm2)
    return (log_norm - both / 2 * np.log1p(squares_mm2 / (behind * level_mm2))).sum(axis=-1)


def _likeliest(squares_mm2: Floats, freedom: Floats) -> tuple[Floats, Floats]:
    """Return the log of the most likely overall size of the variances, and its peak's width, by spread, (k,) each."""
    behind = _freedoms_behind()
    log_level = np.full(len(behind), np.log(squares_mm2.sum() / freedom.sum()))
    curve = np.ones(len(behind))
    for _ in range(30):
        share = squares_mm2 / (behind * np.exp(log_level[:, None]) + squares_mm2)
        slope = ((behind + freedom) * share - freedom).sum(axis=1) / 2
        curve = ((behind + freedom) * share * (1 - share)).sum(axis=1) / 2
        # Far from the peak the curve is flat, and a full Newton step would overshoot.
        log_level = log_level + np.clip(slope / curve, -1.0, 1.0)
    return log_level, 1 / np.sqrt(curve)


@cache
def _freedoms_behind() -> Floats:
    """Return the degrees of freedom of the inverse chi-squared distributions for each spread in SPREADS, (n, 1)."""
    from scipy.optimize import brentq
    from scipy.special import polygamma

    # ln(variance) is twice ln(scatter), and its variance the trigamma function of half the freedom.
    return np.array(
        [
            [brentq(lambda freedom, wanted=4 * spread**2: polygamma(1, freedom / 2) - wanted, 0.1, 1e5)]
            for spread in SPREADS
        ]
    )
