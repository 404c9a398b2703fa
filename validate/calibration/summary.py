"""A calibration in sentences: what it found, what it could not find, and what it must not be used for."""

from dataclasses import dataclass
from functools import cached_property

from sealtwin.core.records import Floats
from validate.calibration.free import Free
from validate.calibration.identified import (
    Combination,
    Marginal,
    combinations_of,
    confounded_pairs,
    marginals_of,
)
from validate.calibration.posterior import BasisReach
from validate.calibration.prediction import Prediction
from validate.units import percent, setting_name

MIXED = 1.1  # Gelman and Rubin's ratio above which draws are no posterior
HELD = 0.8  # Least share of the stations in the 95 % band of a trial that is held out


@dataclass(frozen=True)
class Calibrated:
    """A calibration of one trial or several."""

    name: str
    emulated: bool  # Readings that nobody measured are among them
    frees: tuple[Free, ...]
    draws: Floats | None  # (500, d) in the unit cube; None where no setting makes the readings
    best: Floats  # (d,)
    runs: int  # Of each trial
    unused: tuple[tuple[str, int, str], ...]  # Trial, run and reason of those without a result to trust
    reaches: tuple[tuple[str, BasisReach], ...]
    least_implausibility: float
    mixing: float
    discrepancy_mm: float | None
    run_noise_mm: tuple[float, ...]  # Scatter between seeds in each trial
    predictions: tuple[Prediction, ...]
    radius_mm: tuple[float, ...]
    warned: tuple[str, ...] = ()  # Sentences on the fluids of its runs, and on its readings

    @cached_property
    def marginals(self) -> list[Marginal]:
        return [] if self.draws is None else marginals_of(self.frees, self.draws, self.best)

    @cached_property
    def combinations(self) -> list[Combination]:
        return [] if self.draws is None else combinations_of(self.frees, self.draws)

    @cached_property
    def confounded(self) -> list[tuple[Free, Free, float]]:
        return [] if self.draws is None else confounded_pairs(self.frees, self.draws)

    @property
    def finding(self) -> str:
        if self.draws is None:
            return " ".join(self._impossible)
        told = [
            f"{_capital(one.free.label)}: {one.low:.3g} to {one.high:.3g} (90 %), {_verdict(one)}."
            for one in self.marginals
        ]
        return " ".join([*told, *(_judged(one) for one in self.predictions if one.role == "held out")])

    @property
    def _impossible(self) -> list[str]:
        told = [
            f"{name}: residual {reach.residual_mm:.2g} mm, noise {reach.noise_mm:.2g}: the model cannot reproduce this "
            "trial. No sum of the shapes of its runs makes these readings."
            for name, reach in self.reaches
            if not reach.possible
        ]
        if self.least_implausibility > 1:
            told.append(
                f"No setting of the ranges makes these readings: the nearest misses by {self.least_implausibility:.2g} "
                "times what readings, runs and emulator allow."
            )
        return [*told, "There is no posterior. Widen the ranges, free another setting, or question the readings."]

    @property
    def advice(self) -> list[str]:
        """Sentences on what is not identified, and what would mend it."""
        told = [
            f"{_capital(one.free.label)} is not identified ({one.low:.3g} to {one.high:.3g}): measure it and leave "
            "--free out, or calibrate on a second trial."
            for one in self.marginals
            if not one.identified
        ]
        return told + [
            f"{_capital(setting_name(a.name))} and {setting_name(b.name)} are confounded (correlation {r:.2f}): "
            "measure one of them."
            for a, b, r in self.confounded
        ]

    @property
    def cautions(self) -> list[str]:
        told = [*self.warned]
        if self.emulated:
            told.append(
                "EMULATED: readings that nobody measured are among those that were used. This shows how the method "
                "finds what such readings were made from, and says nothing of a paste."
            )
        if self.mixing > MIXED:
            told.append(
                f"The draws have not mixed (ratio of variances {self.mixing:.2f}, at most {MIXED:g} is sound): the "
                "intervals are not to be trusted."
            )
        if self.unused:
            reasons = "; ".join(sorted({reason for _, _, reason in self.unused})[:3])
            told.append(f"{len(self.unused)} runs are in no emulator. {reasons}")
        told += [
            f"{one.trial}, held out: only {percent(one.held, 0)} of the stations lie in the 95 % band. The material "
            "does not carry over to this trial."
            for one in self.predictions
            if one.role == "held out" and one.held < HELD
        ]
        return told


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _verdict(one: Marginal) -> str:
    share = f"{percent(one.width_over_prior, 0)} of the width beforehand"
    return f"identified, {share}" if one.identified else f"not identified, {share}"


def _judged(one: Prediction) -> str:
    return (
        f"{one.trial}, held out: {one.rms_mm:.2f} mm RMS from the readings (their own mean: {one.flat_rms_mm:.2f} mm), "
        f"{percent(one.held, 0)} of {len(one.s_mm)} stations in the 95 % band."
    )
