"""Scatter of a single reading at each station, by its own repeats and by those of all the others.

scipy.stats has no hierarchical model of variances.
"""

from functools import cache

import numpy as np

from sealtwin.core.records import Floats
from validate.uncertainty.budget import DRAWS, uniforms

UNEVEN = 0.5
"""Scale of the half-normal prior of the standard deviation of ln(scatter) among stations, the usual one for a spread of
logarithms (Röver et al. 2021, Res. Synth. Methods 12:448): at 0.5 two stations in three are within a factor of 1.65
of the middle one, and three times that is hardly possible."""
SPREADS = np.arange(0.025, 3 * UNEVEN, 0.05)
"""Grid of the spread of ln(scatter): 0.3 % of the prior are beyond it, and a dozen stations do not resolve 0.05."""
AROUND = np.arange(-5.0, 10.5, 0.5)
"""Grid of the scatter's level, in standard deviations from the likeliest; few repeats leave a long upper tail."""


def possible_scatter_mm(squares_mm2: Floats, freedom: Floats, draws: int = DRAWS) -> Floats:
    """Draw standard deviations of a single reading at each station, (draws, n), every row equally likely.

    They follow from each station's sum of squares about its mean and its degrees of freedom, (n,) each and not all 0,
    with a fixed seed. Variances are draws of an inverse chi-square (Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3:3), so
    that each is better known by all the others, the more alike they are. Smyth fits that distribution; a dozen stations
    leave it uncertain, and bands by the fitted one are too narrow. Here it is averaged over its posterior.
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
        # Far from the peak the curve is flat, and a whole step of Newton's method leads beyond it.
        log_level = log_level + np.clip(slope / curve, -1.0, 1.0)
    return log_level, 1 / np.sqrt(curve)


@cache
def _freedoms_behind() -> Floats:
    """Return the degrees of freedom of the inverse chi-squares whose ln(scatter) spreads by SPREADS."""
    from scipy.optimize import brentq
    from scipy.special import polygamma

    # ln(variance) is twice ln(scatter), and its variance the trigamma function of half the freedom.
    return np.array(
        [
            brentq(lambda freedom, wanted=4 * spread**2: polygamma(1, freedom / 2) - wanted, 0.1, 1e5)
            for spread in SPREADS
        ]
    )


STEPS = 121  # Places of a station's true level within the reach of its rounded readings
SPREADS_OF_STEP = np.geomspace(0.02, 1.2, 16)  # Standard deviations of a reading, in steps, from hidden to plain


def rounded_errors_mm(repeats_mm: Floats, step_mm: float, draws: int = DRAWS) -> Floats:
    """Draw the error of each station's mean, (draws, n), where readings are multiples of a step that hides the scatter.

    The likelihood of a reading is the share of a normal distribution that rounds to it. The scatter, even in its
    logarithm beforehand, is the same at all stations, and the true level anywhere near the readings.
    """
    from scipy.special import ndtr

    middle_mm = np.nanmean(repeats_mm, axis=1, keepdims=True)
    off = (repeats_mm - middle_mm) / step_mm
    reach = 0.5 + np.nanmax(np.abs(off), axis=1, keepdims=True) + 2 * SPREADS_OF_STEP.max()
    # The mean's error at (stations, 1, places); readings at (stations, 1, places, repeats).
    error = reach * np.linspace(-1, 1, STEPS)
    away = (off[:, None, None, :] + error[:, None, :, None]) / SPREADS_OF_STEP[:, None, None]
    half = 0.5 / SPREADS_OF_STEP[:, None, None]
    held = np.where(np.isnan(away), 1.0, ndtr(away + half) - ndtr(away - half))
    chance = held.prod(axis=-1)
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
