"""How far each station's readings scatter: its own few repeats, weighed with those of all the others."""

from functools import cache

import numpy as np

from sealtwin.records import Floats

UNEVEN = 0.5
"""How uneven stations may be before anything is read: the scale of a half-normal prior of the standard deviation of
ln(scatter). The usual one for a spread of logarithms (Röver et al. 2021, Res. Synth. Methods 12:448): at 0.5 two
stations in three are within a factor of 1.65 of the middle one; three times that is taken for hardly possible."""
SPREADS = np.arange(0.025, 3 * UNEVEN, 0.05)
"""Of ln(scatter), at which it is examined: the prior has 0.3 % beyond; no dozen stations tell 0.05 from nothing."""
AROUND = np.arange(-5.0, 10.5, 0.5)
"""Levels of the scatter, in standard deviations from the likeliest: few repeats leave a long tail upwards."""
SETS = 4_000
"""Of scatters that are drawn: a tail of 5 % has 200 of them."""


def possible_scatter_mm(squares_mm2: Floats, freedom: Floats) -> Floats:
    """Standard deviations of a single reading at each station, (SETS, n): each row as likely as any other.

    From each station's sum of squares about its mean and its degrees of freedom, (n,) each, not all of them 0; from a
    fixed seed. Variances are taken for draws of an inverse chi-square (Smyth 2004, Stat. Appl. Genet. Mol. Biol. 3:3),
    so that each is better known by all the others, the more the more alike they are. Smyth fits that distribution; a
    dozen stations do not fix it, and bands that take the fitted one for known are too narrow. Here it is averaged over
    all that the repeats leave possible.
    """
    behind = _freedoms_behind()[:, None]
    log_level, width = _likeliest(squares_mm2, freedom)
    level_mm2 = np.exp(log_level[:, None] + width[:, None] * AROUND)
    chance = _log_chance(level_mm2[:, :, None], behind[:, :, None], squares_mm2, freedom)
    chance += np.log(width)[:, None] - (SPREADS[:, None] / UNEVEN) ** 2 / 2
    chance = np.exp(chance - chance.max())
    # A stream of its own: the errors that are drawn of these scatters come from others.
    random = np.random.default_rng(3)
    drawn = random.choice(chance.size, SETS, p=chance.ravel() / chance.sum())
    spread, level = np.divmod(drawn, len(AROUND))
    known_mm2 = behind[spread] * level_mm2[spread, level][:, None] + squares_mm2
    return np.sqrt(known_mm2 / random.chisquare(behind[spread] + freedom))


def _log_chance(level_mm2: Floats, behind: Floats, squares_mm2: Floats, freedom: Floats) -> Floats:
    """Log likelihood of the stations' squares, over the last axis, but for what no level and no spread changes."""
    from scipy.special import gammaln

    both = behind + freedom
    one = gammaln(both / 2) - gammaln(behind / 2) - freedom / 2 * np.log(behind * level_mm2)
    return (one - both / 2 * np.log1p(squares_mm2 / (behind * level_mm2))).sum(axis=-1)


def _likeliest(squares_mm2: Floats, freedom: Floats) -> tuple[Floats, Floats]:
    """For each spread, log of the likeliest level of the variances, and the width of its peak: Newton's method."""
    behind = _freedoms_behind()[:, None]
    log_level = np.full(len(behind), np.log(squares_mm2.sum() / freedom.sum()))
    curve = np.ones(len(behind))
    for _ in range(30):
        share = squares_mm2 / (behind * np.exp(log_level[:, None]) + squares_mm2)
        slope = ((behind + freedom) * share - freedom).sum(axis=1) / 2
        curve = ((behind + freedom) * share * (1 - share)).sum(axis=1) / 2
        # Far from the peak the curve is flat, and a whole step leads beyond it.
        log_level = log_level + np.clip(slope / curve, -1.0, 1.0)
    return log_level, 1 / np.sqrt(curve)


@cache
def _freedoms_behind() -> Floats:
    """Degrees of freedom of an inverse chi-square whose ln(scatter) spreads by each of SPREADS, (len(SPREADS),)."""
    from scipy.optimize import brentq
    from scipy.special import polygamma

    # ln(variance) is twice ln(scatter), and its variance the trigamma function of half the freedom.
    return np.array(
        [
            brentq(lambda freedom, wanted=4 * spread**2: polygamma(1, freedom / 2) - wanted, 0.1, 1e5)
            for spread in SPREADS
        ]
    )
