"""Sentences about a calibration, and the bands that its posterior predicts for readings."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from sealtwin.core.arrays import rms
from sealtwin.core.records import DataKind, Floats
from validate.calibration.emulator import Emulator
from validate.calibration.posterior import (
    BasisReach,
    Free,
    Marginal,
    ReadLevels,
    confounded_pairs,
    marginals_of,
)
from validate.units import percent, setting_name

MIXED = 1.1  # Gelman-Rubin ratio above which the draws have not converged
SHARE = 0.95
MIN_IN_BAND = 0.8  # Smallest fraction of a held-out trial's stations that must be in the 95 % band


@dataclass(frozen=True)
class Prediction:
    """Readings of a trial, and the band that the posterior predicts for them. All arrays are (n,)."""

    trial: str
    role: Literal["calibrated", "held out"]
    data: DataKind  # Origin of the readings
    s_mm: Floats
    read_mm: Floats
    error_mm: Floats  # Half-width of the 95 % interval of a reading
    mean_mm: Floats
    half_mm: Floats  # Half-width of the 95 % band for a reading, with the scatter of runs and the errors of readings

    @property
    def rms_mm(self) -> float:
        return rms(self.mean_mm - self.read_mm)

    @property
    def flat_rms_mm(self) -> float:
        """Root mean square distance of the readings from their mean, as a baseline."""
        return float(self.read_mm.std())

    @property
    def share_inside(self) -> float:
        """Fraction of the stations whose reading is inside the 95 % band."""
        return float(np.mean(np.abs(self.mean_mm - self.read_mm) <= self.half_mm))

    @property
    def coverage_sentence(self) -> str:
        """Sentence on the distance of the readings from the predicted mean, and on the fraction inside the band."""
        return (
            f"RMS error {self.rms_mm:.2f} mm (best flat level: {self.flat_rms_mm:.2f} mm); "
            f"{percent(self.share_inside, 0)} of {len(self.s_mm)} stations are in the 95 % band."
        )


def predicted_by_emulator(emulator: Emulator, evidence: ReadLevels, draws: Floats) -> tuple[Floats, Floats]:
    """Return the mean and half-width of the 95 % band, (n,) each, for the trial whose runs the emulator fits."""
    from scipy.special import ndtri

    levels_mm = emulator.levels_mm(draws)
    open_mm2 = emulator.processes.predicted(draws)[1].mean(axis=0) @ emulator.basis_mm**2
    relative = emulator.scatter.relative(draws).mean()
    noise_mm2 = (relative * emulator.run_noise_mm2 + evidence.covariance_mm2 + evidence.smooth_mm2).diagonal()
    return levels_mm.mean(axis=0), ndtri((1 + SHARE) / 2) * np.sqrt(levels_mm.var(axis=0) + open_mm2 + noise_mm2)


def predicted_by_runs(levels_mm: Floats, evidence: ReadLevels) -> tuple[Floats, Floats]:
    """Return the mean and half-width of the 95 % band, (n,) each, from the levels of runs at posterior draws, (m, n).

    Each run has its own seed.
    """
    from scipy.special import stdtrit

    runs = len(levels_mm)
    spread_mm2 = levels_mm.var(axis=0, ddof=1) * (1 + 1 / runs)
    spread_mm2 += (evidence.covariance_mm2 + evidence.smooth_mm2).diagonal()
    return levels_mm.mean(axis=0), stdtrit(runs - 1, (1 + SHARE) / 2) * np.sqrt(spread_mm2)


@dataclass(frozen=True)
class Calibrated:
    """Result of a calibration of one trial or several trials."""

    name: str
    emulated: bool  # True if some readings were computed, not measured
    frees: tuple[Free, ...]
    draws: Floats | None  # (500, d) in the unit cube. None if no setting reproduces the readings.
    best: Floats  # (d,)
    runs: int  # Number of runs of each trial
    unused: tuple[tuple[str, int, str], ...]  # Trial, run and reason, for each run without a valid result
    reaches: tuple[tuple[str, BasisReach], ...]
    least_implausibility: float
    mixing: float
    discrepancy_mm: float | None
    run_noise_mm: tuple[float, ...]  # Scatter between seeds in each trial
    predictions: tuple[Prediction, ...]
    radius_mm: tuple[float, ...]
    drafts: tuple[int, ...]  # Number of drafts among the runs of each trial
    warned: tuple[str, ...] = ()  # Sentences about the fluids of the runs, and about the readings

    @cached_property
    def marginals(self) -> list[Marginal]:
        return [] if self.draws is None else marginals_of(self.frees, self.draws, self.best)

    @cached_property
    def confounded(self) -> list[tuple[Free, Free, float]]:
        return [] if self.draws is None else confounded_pairs(self.frees, self.draws)

    @property
    def finding(self) -> str:
        if self.draws is None:
            return " ".join(self._impossible)
        identified = sum(marginal.identified for marginal in self.marginals)
        sentences = [f"Identified settings: {identified} of {len(self.marginals)}."]
        sentences += [
            f"{_capital(marginal.free.label)}: 90 % interval {marginal.low:.3g} to {marginal.high:.3g}, "
            f"{'' if marginal.identified else 'not '}identified, {percent(marginal.width_over_prior, 0)} of the prior "
            "width."
            for marginal in self.marginals
        ]
        sentences += [
            f"{prediction.trial}, held out: {prediction.coverage_sentence}"
            for prediction in self.predictions
            if prediction.role == "held out"
        ]
        return " ".join(sentences)

    @property
    def _impossible(self) -> list[str]:
        sentences = [
            f"{name}: the model cannot reproduce these readings: the best combination of its runs leaves a residual of "
            f"{reach.residual_mm:.2g} mm, too much for a noise of {reach.noise_mm:.2g} mm."
            for name, reach in self.reaches
            if not reach.possible
        ]
        if self.least_implausibility > 1:
            sentences.append(
                "No setting within the ranges reproduces these readings: the error of the best one is "
                f"{self.least_implausibility:.2g} times what the uncertainty of readings, runs and emulator allows."
            )
        return [*sentences, "No setting was calibrated. Widen the ranges, free another setting, or check the readings."]

    @property
    def advice(self) -> list[str]:
        """Sentences that name the settings which are not identified, and state what to do about them."""
        sentences = [
            f"{_capital(marginal.free.label)} is not identified ({marginal.low:.3g} to {marginal.high:.3g}): measure "
            "it and remove it from --free, or calibrate on a further trial at half or twice the speed as well."
            for marginal in self.marginals
            if not marginal.identified
        ]
        return sentences + [
            f"{_capital(setting_name(a.name))} and {setting_name(b.name)} are confounded (correlation {r:.2f}): "
            "measure one of them."
            for a, b, r in self.confounded
        ]

    @property
    def cautions(self) -> list[str]:
        sentences = [*self.warned]
        if self.emulated:
            sentences.append(
                "EMULATED: some of these readings were computed, not measured. The result shows how well the method "
                "recovers the settings of such a computation. It is no evidence about a paste."
            )
        if self.mixing > MIXED:
            sentences.append(
                f"The intervals are unreliable, because the draws have not converged (Gelman-Rubin ratio "
                f"{self.mixing:.2f}, at most {MIXED:g} is allowed)."
            )
        if self.unused:
            reasons = "; ".join(sorted({reason for _, _, reason in self.unused})[:3])
            sentences.append(f"The emulator does not use {len(self.unused)} runs. {reasons}")
        sentences += [
            f"{prediction.trial}, held out: only {percent(prediction.share_inside, 0)} of the stations are in the 95 % "
            "band. The calibrated material does not fit this trial."
            for prediction in self.predictions
            if prediction.role == "held out" and prediction.share_inside < MIN_IN_BAND
        ]
        return sentences


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
