"""What is known of the readings' own error, part by part, and which of it averages out along the crack."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sealtwin.records import Floats, Profile
from validate.settings import Readings
from validate.uncertainty.scatter import possible_scatter_mm
from validate.uncertainty.settings import Uncertainty
from validate.wording import counted

DISAGREE = 0.01
"""Probability of Bartlett's test below which the stations' scatters are not pooled. A false alarm costs much: three
repeats alone have t = 4.30 where 17 stations together have 2.03."""


@dataclass(frozen=True)
class Part:
    """An error of the readings whose size is declared, not seen in their scatter."""

    name: str
    standard_mm: Floats  # (n,)
    shared: bool
    """All stations are off together, each by its own size: it does not average out along the crack."""
    shape: Literal["normal", "rectangular"]


@dataclass(frozen=True)
class Budget:
    """All errors of the stations' means, (n,) each."""

    scatter_mm: Floats | None
    """Standard uncertainty of each mean by the scatter of its repeats, as it counts in sums over the stations; None
    where nothing tells it."""
    freedom: Floats
    """Degrees of freedom behind each of them; infinite where it was declared."""
    pooled: bool
    """Whether one estimate, that of all stations, stands behind all of them."""
    bartlett_p: float | None
    """Probability of variances as unequal as these, were they one; None where fewer than two stations have repeats."""
    own_mm: Floats | None
    """The same of each station for itself, (k, n): k sets that are equally likely, 1 where it was declared. A sum over
    stations needs the mean of their variances, which pooled repeats know best; a station needs its own."""
    parts: tuple[Part, ...]
    cautions: tuple[str, ...]
    """What no number stands for."""

    @property
    def standard_mm(self) -> Floats:
        """All parts together, of each station for itself, (n,)."""
        known = [part.standard_mm for part in self.parts]
        scatter = [] if self.own_mm is None else [np.median(self.own_mm, axis=0)]
        return np.sqrt(np.sum(np.square([*scatter, *known]), axis=0))


def budget_of(measured: Profile, settings: Readings, declared: Uncertainty, mouth_mm: Floats) -> Budget:
    """Of readings as they were taken; ``mouth_mm`` is the crack's width at the face at each station, (n,).

    Limits and resolution are rectangular, as the GUM has it: limit / sqrt(3), last digit / sqrt(12). A probe reads the
    highest point that it covers, so that on a slope it stands too high by up to the slope times half of its width.
    """
    ones = np.ones(len(measured.s_mm))
    scatter_mm, freedom, pooled, bartlett_p, cautions = _scatter(measured, settings.resolution_mm, declared)
    parts = [
        # The last digit hides the same from all repeats of a station that agree.
        Part("resolution of the caliper", ones * settings.resolution_mm / np.sqrt(12), False, "rectangular"),
        Part("limit of error of the caliper", ones * settings.limit_mm / np.sqrt(3), True, "rectangular"),
    ]
    if settings.datum_error_mm is not None:
        parts.append(Part("height of the datum", ones * settings.datum_error_mm, True, "normal"))
    else:
        cautions.append("The error of the datum's height is not declared and not included (readings.datum_error_mm).")
    if settings.probe_mm is not None:
        too_high_mm = np.abs(np.gradient(measured.level_mm, measured.s_mm)) * settings.probe_mm / 2
        parts.append(Part("width of the probe on a slope", too_high_mm / np.sqrt(3), True, "rectangular"))
        cautions += _too_wide(settings.probe_mm, measured.s_mm, mouth_mm)
    else:
        cautions.append("The width of the probe is not declared and not included (readings.probe_mm).")
    own_mm = _own(measured, settings.resolution_mm, scatter_mm)
    return Budget(scatter_mm, freedom, pooled, bartlett_p, own_mm, tuple(parts), tuple(cautions))


def bartlett(variance: Floats, freedom: Floats) -> float:
    """Probability that variances of one population differ as much as these, by Bartlett's test (1937)."""
    from scipy.stats import chi2

    total = freedom.sum()
    together = (freedom * variance).sum() / total
    statistic = total * np.log(together) - (freedom * np.log(variance)).sum()
    correction = 1 + ((1 / freedom).sum() - 1 / total) / (3 * (len(variance) - 1))
    return float(chi2.sf(statistic / correction, len(variance) - 1))


def _scatter(
    measured: Profile, resolution_mm: float, declared: Uncertainty
) -> tuple[Floats | None, Floats, bool, float | None, list[str]]:
    count, squares = _repeats(measured)
    freedom = count - 1.0
    if freedom.sum() == 0:
        if declared.repeatability_mm is None:
            text = (
                "No station was read twice and no repeatability is declared (uncertainty.repeatability_mm): the "
                "scatter of the readings is not included."
            )
            return None, np.zeros(len(count)), True, None, [text]
        return declared.repeatability_mm / np.sqrt(count), np.full(len(count), np.inf), True, None, []
    again = freedom > 0
    probability = None
    if again.sum() > 1:
        probability = bartlett(_seen(squares, freedom, resolution_mm)[again] / freedom[again], freedom[again])
    if probability is None or probability >= DISAGREE:
        deviation_mm = np.sqrt(squares.sum() / freedom.sum())
        return deviation_mm / np.sqrt(count), np.full(len(count), freedom.sum()), True, probability, []
    own_mm = np.sqrt(squares / np.where(again, freedom, 1.0))
    # A station read once takes the scatter of all, which is more than nothing and no better known.
    own_mm[~again], freedom[~again] = np.sqrt(squares.sum() / freedom.sum()), 1.0
    text = (
        f"The stations' scatters differ (Bartlett's test, p = {probability:.2g}) and are not pooled: in "
        "the mean error and in the bias each station has only its own repeats."
    )
    return own_mm / np.sqrt(count), freedom, False, probability, [text]


def _own(measured: Profile, resolution_mm: float, scatter_mm: Floats | None) -> Floats | None:
    count, squares = _repeats(measured)
    freedom = count - 1.0
    if freedom.sum() == 0:
        return None if scatter_mm is None else scatter_mm[None]
    return possible_scatter_mm(_seen(squares, freedom, resolution_mm), freedom) / np.sqrt(count)


def _repeats(measured: Profile) -> tuple[Floats, Floats]:
    """How many each station has, and the sum of their squares about its mean, (n,) each."""
    repeats_mm = measured.repeats_mm if measured.repeats_mm is not None else measured.level_mm[:, None]
    squares = np.nansum((repeats_mm - np.nanmean(repeats_mm, axis=1, keepdims=True)) ** 2, axis=1)
    return (~np.isnan(repeats_mm)).sum(axis=1).astype(float), squares


def _seen(squares: Floats, freedom: Floats, resolution_mm: float) -> Floats:
    """Repeats that agree to the last digit have a variance all the same: that of the digit."""
    return squares + freedom * resolution_mm**2 / 12


def _too_wide(probe_mm: float, s_mm: Floats, mouth_mm: Floats) -> list[str]:
    touched: Sequence[float] = s_mm[mouth_mm <= probe_mm].tolist()
    if not touched:
        return []
    return [
        f"The probe, {probe_mm:g} mm wide, is no narrower than the crack at {counted(len(touched), 'station')} (s = "
        f"{', '.join(f'{s:g}' for s in touched[:5])}{' ...' if len(touched) > 5 else ''} mm): there it touches the "
        "walls, and reads too high by what nobody knows."
    ]
