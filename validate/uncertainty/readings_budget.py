"""The budget of the readings' errors: each part, and whether it averages out along the crack.

scipy.stats has no hierarchical model of variances, and its Bartlett test takes samples, not variances to which that of
the last digit is added.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from sealtwin.core.comparison import Alignment, BudgetPart, BudgetSummary, ReadingsScatter, ShiftedError
from sealtwin.core.records import Floats, Profile
from validate.metrics.curve_distances import level_difference
from validate.settings import Readings, Uncertainty
from validate.units import counted


def repeatability(measured: Profile) -> ReadingsScatter:
    """Return the scatter of repeated readings, pooled over the stations, and the 95 % band of their means."""
    # scipy.stats, which has these by name, takes half a second to import.
    from scipy.special import stdtrit

    count, residual_mm = _repeats(measured)
    freedom = int((count - 1).sum())
    deviation_mm = float(np.sqrt(np.nansum(residual_mm**2) / freedom)) if freedom else None
    return ReadingsScatter(
        stations=len(count),
        readings=int(count.sum()),
        degrees_of_freedom=freedom,
        repeatability_sd_mm=deviation_mm,
        band_95_mm=None if deviation_mm is None else float(stdtrit(freedom, 0.975)) * deviation_mm / np.sqrt(count),
    )


def _repeats(measured: Profile) -> tuple[Floats, Floats]:
    """Return the number of readings at each station, (n,), and each reading's distance from their mean, (n, r)."""
    repeats_mm = measured.repeats_mm if measured.repeats_mm is not None else measured.level_mm[:, None]
    return (~np.isnan(repeats_mm)).sum(axis=1).astype(float), repeats_mm - np.nanmean(repeats_mm, axis=1, keepdims=True)


CHOICE = "s from the first end given, on both curves; neither is shifted to fit the other"
SHIFTS_MM = (-2.0, -1.0, 0.0, 1.0, 2.0)  # Shifts by which a station set by hand, or the end of a crack, may be off


def alignment(simulated: Profile, measured: Profile) -> Alignment:
    """Return mean error and bias with the readings moved along the crack by each of the shifts."""
    errors = [level_difference(simulated, replace(measured, s_mm=measured.s_mm + shift_mm)) for shift_mm in SHIFTS_MM]
    shifts = [
        ShiftedError(shift_mm=shift_mm, mean_error_mm=error.mean_error, bias_mm=error.mean())
        for shift_mm, error in zip(SHIFTS_MM, errors, strict=True)
    ]
    return Alignment(choice=CHOICE, shifts=tuple(shifts))


def station_effect_mm(simulated: Profile, s_mm: Floats, standard_mm: float) -> Floats:
    """Return the effect of a standard uncertainty of the stations' s on E at each station, (n,), by the slope there."""
    before, after = (np.interp(s_mm + by, simulated.s_mm, simulated.level_mm) for by in (-standard_mm, standard_mm))
    return (after - before) / 2


UNEVEN = 0.5
"""Scale of the half-normal prior of the standard deviation of ln(scatter) among stations, the usual one for a spread of
logarithms (Röver et al. 2021, Res. Synth. Methods 12:448): at 0.5 two stations in three are within a factor of 1.65
of the middle one, and three times that is hardly possible."""
SPREADS = np.arange(0.025, 3 * UNEVEN, 0.05)
"""Grid of the spread of ln(scatter): 0.3 % of the prior are beyond it, and a dozen stations do not resolve 0.05."""
AROUND = np.arange(-5.0, 10.5, 0.5)
"""Grid of the scatter's level, in standard deviations from the likeliest; few repeats leave a long upper tail."""
SETS = 4_000  # Number of sets of scatters that are drawn: a tail of 5 % has 200 of them


def possible_scatter_mm(squares_mm2: Floats, freedom: Floats) -> Floats:
    """Draw standard deviations of a single reading at each station, (SETS, n), every row equally likely.

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
    drawn = random.choice(chance.size, SETS, p=chance.ravel() / chance.sum())
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


DISAGREE = 0.01
"""Probability of Bartlett's test below which the stations' scatters are not pooled. A false alarm is costly: three
repeats alone have t = 4.30 where 17 stations together have 2.03."""


@dataclass(frozen=True)
class ErrorPart:
    """An error of the readings whose size is declared and does not show in their scatter."""

    name: str
    standard_mm: Floats  # (n,)
    shared: bool
    """True for an error that all stations share, each with its own size, which does not average out along the crack."""
    shape: Literal["normal", "rectangular"]


@dataclass(frozen=True)
class Budget:
    """All errors of the stations' means, (n,) each."""

    scatter_mm: Floats | None
    """Standard uncertainty of each mean by the scatter of its repeats, for sums over the stations; None where it is not
    known."""
    freedom: Floats  # Degrees of freedom of each of them; infinite where it was declared
    pooled: bool  # True where all of them come from one estimate, that of all stations
    bartlett_p: float | None
    """Probability of variances as unequal as these, were all equal; None where fewer than two stations have repeats."""
    own_mm: Floats | None
    """Standard uncertainty of each mean by itself, (k, n): k equally likely sets, 1 where it was declared. A sum over
    stations takes the mean of their variances, which pooled repeats give best; a single station takes its own."""
    parts: tuple[ErrorPart, ...] = ()
    cautions: tuple[str, ...] = ()  # Sentences on errors that are not included

    @property
    def standard_mm(self) -> Floats:
        """Standard uncertainty of each station by all parts together, (n,)."""
        known = [part.standard_mm for part in self.parts]
        scatter = [] if self.own_mm is None else [np.median(self.own_mm, axis=0)]
        return np.sqrt(np.sum(np.square([*scatter, *known]), axis=0))

    def summary(self) -> BudgetSummary:
        """Return the budget part by part, each the root mean square over the stations."""
        parts = [
            BudgetPart(name=part.name, standard_mm=rms(part.standard_mm), shared=part.shared, shape=part.shape)
            for part in self.parts
        ]
        if self.scatter_mm is not None:
            scatter = BudgetPart(
                name="scatter of the repeats",
                standard_mm=rms(self.scatter_mm),
                shared=False,
                shape="Student's t",
                freedom=float(self.freedom.min()),
            )
            parts.insert(0, scatter)
        return BudgetSummary(
            parts=tuple(parts),
            scatter_known=self.scatter_mm is not None,
            pooled=self.pooled,
            bartlett_p=self.bartlett_p,
            cautions=self.cautions,
        )


def budget_of(measured: Profile, settings: Readings, declared: Uncertainty, mouth_mm: Floats) -> Budget:
    """Return the budget of a set of readings; ``mouth_mm`` is the crack's width at the face at each station, (n,).

    Limits and resolution are rectangular as in the GUM: limit / sqrt(3), last digit / sqrt(12). A probe reads the
    highest point that it covers, so that on a slope it is too high by up to the slope times half its width.
    """
    ones = np.ones(len(measured.s_mm))
    scatter = _scatter_budget(measured, settings.resolution_mm, declared)
    cautions = list(scatter.cautions)
    parts = [
        # Repeats of a station that agree share the rounding of the last digit.
        ErrorPart("resolution of the caliper", ones * settings.resolution_mm / np.sqrt(12), False, "rectangular"),
        ErrorPart("limit of error of the caliper", ones * settings.limit_mm / np.sqrt(3), True, "rectangular"),
    ]
    if settings.datum_error_mm is None:
        cautions.append("The error of the datum's height is not declared and not included (readings.datum_error_mm).")
    else:
        parts.append(ErrorPart("height of the datum", ones * settings.datum_error_mm, True, "normal"))
    if settings.probe_mm is None:
        cautions.append("The width of the probe is not declared and not included (readings.probe_mm).")
    else:
        too_high_mm = np.abs(np.gradient(measured.level_mm, measured.s_mm)) * settings.probe_mm / 2
        parts.append(ErrorPart("width of the probe on a slope", too_high_mm / np.sqrt(3), True, "rectangular"))
        touched: list[float] = measured.s_mm[mouth_mm <= settings.probe_mm].tolist()
        if touched:
            places = ", ".join(f"{s:g}" for s in touched[:5]) + (" ..." if len(touched) > 5 else "")
            cautions.append(
                f"The probe, {settings.probe_mm:g} mm wide, is no narrower than the crack at "
                f"{counted(len(touched), 'station')} (s = {places} mm): there it touches the walls, and reads too high "
                "by an unknown amount."
            )
    return replace(scatter, parts=tuple(parts), cautions=tuple(cautions))


def rms(values: Floats) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def bartlett(variance: Floats, freedom: Floats) -> float:
    """Return the probability that variances of one population differ as much as these, by Bartlett's test (1937)."""
    from scipy.special import chdtrc

    total = freedom.sum()
    together = (freedom * variance).sum() / total
    statistic = total * np.log(together) - (freedom * np.log(variance)).sum()
    correction = 1 + ((1 / freedom).sum() - 1 / total) / (3 * (len(variance) - 1))
    return float(chdtrc(len(variance) - 1, statistic / correction))


def _scatter_budget(measured: Profile, resolution_mm: float, declared: Uncertainty) -> Budget:
    count, residual_mm = _repeats(measured)
    squares = np.nansum(residual_mm**2, axis=1)
    freedom = count - 1.0
    if freedom.sum() == 0:
        if declared.repeatability_mm is None:
            text = (
                "No station was read twice and no repeatability is declared (uncertainty.repeatability_mm): the "
                "scatter of the readings is not included."
            )
            return Budget(None, np.zeros(len(count)), True, None, None, cautions=(text,))
        scatter_mm = declared.repeatability_mm / np.sqrt(count)
        return Budget(scatter_mm, np.full(len(count), np.inf), True, None, scatter_mm[None])
    # Repeats that agree to the last digit have its variance.
    with_digit = squares + freedom * resolution_mm**2 / 12
    own_mm = possible_scatter_mm(with_digit, freedom) / np.sqrt(count)
    again = freedom > 0
    probability = bartlett(with_digit[again] / freedom[again], freedom[again]) if again.sum() > 1 else None
    pooled_mm = np.sqrt(squares.sum() / freedom.sum())
    if probability is None or probability >= DISAGREE:
        return Budget(pooled_mm / np.sqrt(count), np.full(len(count), freedom.sum()), True, probability, own_mm)
    # A station read once takes the scatter of all, with one degree of freedom.
    scatter_mm = np.where(again, np.sqrt(squares / np.where(again, freedom, 1.0)), pooled_mm)
    text = (
        f"The stations' scatters differ (Bartlett's test, p = {probability:.2g}) and are not pooled: in "
        "the mean error and in the bias each station has only its own repeats."
    )
    freedom = np.where(again, freedom, 1.0)
    return Budget(scatter_mm / np.sqrt(count), freedom, False, probability, own_mm, cautions=(text,))
