"""The budget of caliper readings: errors that repeats show, their last digit, and the bed between stations."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats, Profile
from validate.settings import Readings, Uncertainty
from validate.uncertainty.budget import (
    DRAWS,
    Budget,
    Component,
    Source,
    draws_for,
    normals,
    uniforms,
)
from validate.uncertainty.contradictions import (
    COARSE,
    passes_error,
    refuse_contradicted,
    repeats_of,
    unused_repeatability,
    without_passes,
)
from validate.uncertainty.hidden_errors import hidden_errors
from validate.uncertainty.meniscus import Mouth
from validate.units import counted

OUTLIER = 6.0  # Distance of an outlier in robust standard deviations
STEPS_MM = (10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.02)
INCHES = (1 / 4, 1 / 8, 1 / 16, 1 / 32, 1 / 64, 0.01, 0.005)
FEWEST_LEVELS = 5
"""Smallest number of different levels that identifies a step. By chance, so many levels are all multiples of 0.05 mm
once in 600 sheets."""
BENT = 2.4
"""Largest arch between two stations, as a multiple of the arch of the parabola with their curvature; the smallest is 0.
For a bed with a corner it is 0 if the corner is at a station, 2 if it is in the middle of a gap, and 1 on average."""

STATIONS_FOR_STEPS = 12
"""Smallest number of stations that resolves steps of the bed. With the arches alone, the mean error's interval contains
the truth in 94 % of trials with 12 stations, 85 % with 10 and 50 % with 5."""
STEP = 1 / 8
"""Mean distance of the bed from the line between two stations, as a share of a step between them: 1/4 if the step is
sharp, in the middle and all of their difference in height, and half of it on average."""


def budget_of(measured: Profile, settings: Readings, declared: Uncertainty, mouth: Mouth) -> Budget:
    """Return the budget of a set of readings of a crack with this mouth.

    Raises InputError for a declared error that the readings contradict.
    """
    refuse_contradicted(measured, settings, declared)
    s_mm, stations = measured.s_mm, len(measured.s_mm)
    draws = draws_for(stations)
    repeats_mm, residual_mm = repeats_of(measured)
    count = (~np.isnan(repeats_mm)).sum(axis=1).astype(np.float64)
    resolution_mm = max(settings.resolution_mm, resolution_of(repeats_mm))
    origin: Source = "detected" if resolution_mm > settings.resolution_mm else "declared"
    own_mm, shapes, per_pass = without_passes(residual_mm, s_mm, declared.pass_mm)
    far, robust_mm = _far(own_mm, count, resolution_mm)
    unused = unused_repeatability(measured, declared, resolution_mm)
    notes = list[Fact]()
    if places := s_mm[far.any(axis=1)].tolist():
        text = (
            f"At {counted(len(places), 'station')} (s = {_listed(places)} mm) a reading is more than {OUTLIER:g} "
            f"robust standard deviations (of {robust_mm:.2g} mm) away from the others. The mean includes it; the "
            "intervals do not if the station has at least three readings."
        )
        notes.append(doubt("readings.outlier", text, len(places)))
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
    if has_scatter and resolution_mm > COARSE * pooled_mm and count.max() > 1:
        draws_mm = rounded_errors_mm(np.where(alone, np.nan, repeats_mm), resolution_mm, draws) - middle_mm
        components.append(Component(f"scatter and {last_digit}", origin, draws_mm))
    else:
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
        rounding_mm = resolution_mm * (uniforms("digit", stations, draws) - 0.5) / np.sqrt(count)
        components.append(Component(last_digit, origin, rounding_mm, setting="readings.resolution_mm"))
    if shapes.shape[1]:
        noise_mm2 = (pooled_mm**2 + resolution_mm**2 / 12) / (shapes**2).sum(axis=0)
        components.append(passes_error(declared.pass_mm, per_pass, noise_mm2, shapes, ~np.isnan(repeats_mm)))
    present, missing = hidden_errors(measured, settings, declared, mouth, resolution_mm)
    limit_mm = settings.limit_mm * np.ones(stations) * (2 * uniforms("limit", 1, draws) - 1)
    components += [
        Component("limit of error of the caliper", "declared", limit_mm, shared=True, setting="readings.limit_mm"),
        *present,
        _arches(s_mm, measured.level_mm),
    ]
    if touching := s_mm[mouth.at_mm(s_mm) <= (settings.probe_mm or -1)].tolist():
        text = (
            f"The probe ({settings.probe_mm:g} mm) is not narrower than the crack at "
            f"{counted(len(touching), 'station')} (s = {_listed(touching)} mm), so it touches the walls there and "
            "reads too high by an unknown amount."
        )
        notes.append(doubt("readings.probe-touches", text, len(touching)))
    if settings.rounding not in (None, "nearest"):
        text = (
            f'The readings are rounded to one side (readings.rounding = "{settings.rounding}"), by up to '
            f"{resolution_mm:g} mm. The intervals include it; the measured level is not corrected."
        )
        notes.append(doubt("readings.rounded", text, resolution_mm, "mm"))
    steps_mm = _steps_mm(s_mm, measured.level_mm)
    if steps_mm:
        text = (
            f"The interval of the mean error includes {steps_mm:.2f} mm for steps of the bed between stations, which "
            f"fewer than {STATIONS_FOR_STEPS} stations cannot show."
        )
        notes.append(doubt("readings.few-stations", text, steps_mm, "mm"))
    return Budget(
        stations=stations,
        components=tuple(components),
        missing=missing,
        scatter_known=has_scatter,
        notes=tuple(notes),
        unused=unused,
        steps_mm=steps_mm,
    )


def resolution_of(repeats_mm: Floats) -> float:
    """Return the largest usual step, in mm or in fractions of an inch, that divides all readings; 0 if there is none.

    A common offset, such as that of a datum, is allowed.
    """
    read_mm = np.unique(np.round(repeats_mm[~np.isnan(repeats_mm)], 6))
    if len(read_mm) < FEWEST_LEVELS:
        return 0.0
    steps_mm = np.array([*STEPS_MM, *(25.4 * part for part in INCHES)])
    times = (read_mm - read_mm[0])[:, None] / steps_mm
    whole = (np.abs(times - np.round(times)) * steps_mm < 1e-4).all(axis=0)
    return float(steps_mm[whole].max()) if whole.any() else 0.0


def _arches(s_mm: Floats, level_mm: Floats) -> Component:
    """Draw the height of the straight line above the bed in the middle between two stations.

    Each station shows a curvature; the part of it in the neighbouring gaps is drawn for each station (``BENT``).
    """
    gap_mm = np.diff(s_mm)
    turn = np.diff(np.diff(level_mm) / gap_mm) / ((gap_mm[:-1] + gap_mm[1:]) / 2)
    curvature = np.pad(turn, 1, mode="edge") if len(turn) else np.zeros(len(s_mm))
    drawn = curvature * BENT * uniforms("arch", len(s_mm), draws_for(len(s_mm)))
    draws_mm = (drawn[:, :-1] + drawn[:, 1:]) / 2 * gap_mm**2 / 8
    return Component("the bed's shape between stations", "assumed", draws_mm, shared=True, between=True)


def _steps_mm(s_mm: Floats, level_mm: Floats) -> float:
    """Return the mean distance along the crack of the bed from the line through few stations, due to steps.

    A gap shows a step by a slope unlike that of a neighbouring gap. By the triangle inequality the mean of |error|
    changes by at most that distance; the mean level need not change.
    """
    if not 2 < len(s_mm) < STATIONS_FOR_STEPS:
        return 0.0
    gap_mm = np.diff(s_mm)
    unlike = np.abs(np.diff(np.diff(level_mm) / gap_mm))
    unlike = np.maximum(np.append(unlike, 0.0), np.append(0.0, unlike))
    # To a micrometre: a straight bed has none.
    return round(float(STEP * gap_mm @ (unlike * gap_mm) / np.ptp(s_mm)), 3)


def _far(own_mm: Floats, count: Floats, resolution_mm: float) -> tuple[NDArray[np.bool_], float]:
    """Return which readings are outliers of their station, and the robust standard deviation, in mm.

    A station has at most one outlier: two outliers count as its scatter. The scatter is at least that of the last
    digit, even if most repeats are equal.
    """
    again = count > 1
    scaled_mm = np.nan_to_num(np.abs(own_mm)) / np.sqrt(1 - 1 / np.maximum(count, 2))[:, None]
    read = ~np.isnan(own_mm[again])
    median_mm = float(np.median(scaled_mm[again][read])) if again.any() else 0.0
    robust_mm = max(1.4826 * median_mm, resolution_mm / np.sqrt(12))
    largest = np.arange(own_mm.shape[1]) == scaled_mm.argmax(axis=1)[:, None]
    return largest & (scaled_mm > OUTLIER * robust_mm) & (robust_mm > 0), robust_mm


def _listed(places: list[float]) -> str:
    return ", ".join(f"{s:g}" for s in places[:5]) + (" ..." if len(places) > 5 else "")


UNEVEN = 0.5
"""Scale of the half-normal prior of the standard deviation of ln(scatter) among stations, the usual one for a spread of
logarithms (Röver et al. 2021, Res. Synth. Methods 12:448): at 0.5 two stations in three are within a factor of 1.65 of
the middle one, and three times that is hardly possible."""
SPREADS = np.arange(0.025, 3 * UNEVEN, 0.05)
"""Grid of the spread of ln(scatter): 0.3 % of the prior are beyond it, and a dozen stations do not resolve 0.05."""
AROUND = np.arange(-5.0, 10.5, 0.5)
"""Grid of the scatter's level, in standard deviations from the likeliest; few repeats leave a long upper tail."""


def possible_scatter_mm(squares_mm2: Floats, freedom: Floats, draws: int = DRAWS) -> Floats:
    """Draw standard deviations of a single reading at each station, (draws, n); all rows are equally likely.

    Input is each station's sum of squares about its mean and its degrees of freedom, (n,) each and not all 0; the seed
    is fixed. Variances are draws of an inverse chi-square (Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3:3): the
    variance of a station is moved towards those of the others, and more so if all are similar. Smyth fits that
    distribution. With a dozen stations the fit is uncertain and gives bands that are too narrow, so here the
    distribution is averaged over its posterior.
    """
    behind = _freedoms_behind()[:, None]
    log_level, width = _likeliest(squares_mm2, freedom)
    level_mm2 = np.exp(log_level[:, None] + width[:, None] * AROUND)
    chance = _log_chance(level_mm2[:, :, None], behind[:, :, None], squares_mm2, freedom)
    chance += np.log(width)[:, None] - (SPREADS[:, None] / UNEVEN) ** 2 / 2
    chance = np.exp(chance - chance.max())
    # A seed of its own keeps these draws independent of the errors that are drawn with these scatters.
    random = np.random.default_rng(3)
    drawn = random.choice(chance.size, draws, p=chance.ravel() / chance.sum())
    spread, level = np.divmod(drawn, len(AROUND))
    known_mm2 = behind[spread] * level_mm2[spread, level][:, None] + squares_mm2
    return np.sqrt(known_mm2 / random.chisquare(behind[spread] + freedom))


def _log_chance(level_mm2: Floats, behind: Floats, squares_mm2: Floats, freedom: Floats) -> Floats:
    """Return the log likelihood of the stations' squares, over the last axis, up to a constant."""
    from scipy.special import gammaln

    both = behind + freedom
    one = gammaln(both / 2) - gammaln(behind / 2) - freedom / 2 * np.log(behind * level_mm2)
    return (one - both / 2 * np.log1p(squares_mm2 / (behind * level_mm2))).sum(axis=-1)


def _likeliest(squares_mm2: Floats, freedom: Floats) -> tuple[Floats, Floats]:
    """Return the log of the likeliest level of the variances for each spread, and the width of its peak."""
    behind = _freedoms_behind()[:, None]
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
    """Return the degrees of freedom of the inverse chi-squares with spreads SPREADS of ln(scatter)."""
    from scipy.optimize import brentq
    from scipy.special import polygamma

    # ln(variance) is twice ln(scatter), and its variance the trigamma function of half the freedom.
    return np.array(
        [
            brentq(lambda freedom, wanted=4 * spread**2: polygamma(1, freedom / 2) - wanted, 0.1, 1e5)
            for spread in SPREADS
        ]
    )


STEPS = 121  # Positions of a station's true level within the range of its rounded readings
SPREADS_OF_STEP = np.geomspace(0.02, 1.2, 16)  # Standard deviations of a reading, in steps, from hidden to plain


def rounded_errors_mm(repeats_mm: Floats, step_mm: float, draws: int = DRAWS) -> Floats:
    """Draw the error of each station's mean, (draws, n), for readings in steps that hide the scatter.

    The likelihood of a reading is the share of a normal distribution that rounds to it. The scatter is the same at all
    stations, with a prior that is uniform in its logarithm, and the true level is anywhere near the readings.
    """
    from scipy.special import ndtr

    middle_mm = np.nanmean(repeats_mm, axis=1, keepdims=True)
    off = (repeats_mm - middle_mm) / step_mm
    reach = 0.5 + np.nanmax(np.abs(off), axis=1, keepdims=True) + 2 * SPREADS_OF_STEP.max()
    # The mean's error at (stations, 1, places); readings at (stations, 1, places, repeats).
    error = reach * np.linspace(-1, 1, STEPS)
    away = (off[:, None, None, :] + error[:, None, :, None]) / SPREADS_OF_STEP[:, None, None]
    half = 0.5 / SPREADS_OF_STEP[:, None, None]
    likelihood = np.where(np.isnan(away), 1.0, ndtr(away + half) - ndtr(away - half))
    chance = likelihood.prod(axis=-1)
    by_spread = np.log(chance.sum(axis=-1) * reach + 1e-300).sum(axis=0)
    share = np.cumsum(np.exp(by_spread - by_spread.max()))
    which = np.searchsorted(share / share[-1], uniforms("spread of rounded", 1, draws)[:, 0])
    below = (np.cumsum(chance, axis=-1) - chance / 2) / np.maximum(chance.sum(axis=-1, keepdims=True), 1e-300)
    where = uniforms("rounded", len(repeats_mm), draws)
    drawn = np.empty((draws, len(repeats_mm)))
    for spread in np.unique(which):
        rows = which == spread
        for station in range(len(repeats_mm)):
            drawn[rows, station] = np.interp(where[rows, station], below[station, spread], error[station])
    return drawn * step_mm
