"""Levels that the posterior predicts of a trial's readings, and how they compare."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sealtwin.core.records import DataKind, Floats
from validate.calibration.emulator import Emulator
from validate.calibration.posterior import ReadLevels

SHARE = 0.95


@dataclass(frozen=True)
class Prediction:
    """A trial's readings beside the band that the posterior has for them; all heights are (n,)."""

    trial: str
    role: Literal["calibrated", "held out"]
    data: DataKind  # Origin of the readings
    s_mm: Floats
    read_mm: Floats
    error_mm: Floats  # Half the 95 % interval of a reading
    mean_mm: Floats
    half_mm: Floats  # Half the 95 % band of a reading, with the scatter of runs and the errors of readings in it

    @property
    def rms_mm(self) -> float:
        return float(np.sqrt(np.mean((self.mean_mm - self.read_mm) ** 2)))

    @property
    def flat_rms_mm(self) -> float:
        """Root mean square distance of the readings from their own mean, as a baseline."""
        return float(self.read_mm.std())

    @property
    def held(self) -> float:
        """Share of the stations whose reading lies in the band."""
        return float(np.mean(np.abs(self.mean_mm - self.read_mm) <= self.half_mm))


def predicted_by_emulator(emulator: Emulator, evidence: ReadLevels, draws: Floats) -> tuple[Floats, Floats]:
    """Return mean and half the band, (n,) each, of a trial whose runs the emulator was fitted to."""
    from scipy.special import ndtri

    levels_mm = emulator.levels_mm(draws)
    open_mm2 = emulator.processes.at(draws)[1].mean(axis=0) @ emulator.basis_mm**2
    relative = emulator.scatter.relative(draws).mean()
    noise_mm2 = (relative * emulator.run_noise_mm2 + evidence.covariance_mm2).diagonal()
    return levels_mm.mean(axis=0), ndtri((1 + SHARE) / 2) * np.sqrt(levels_mm.var(axis=0) + open_mm2 + noise_mm2)


def predicted_by_runs(levels_mm: Floats, evidence: ReadLevels) -> tuple[Floats, Floats]:
    """Return the same from runs of draws of the posterior with seeds of their own, (m, n)."""
    from scipy.special import stdtrit

    runs = len(levels_mm)
    spread_mm2 = levels_mm.var(axis=0, ddof=1) * (1 + 1 / runs) + evidence.covariance_mm2.diagonal()
    return levels_mm.mean(axis=0), stdtrit(runs - 1, (1 + SHARE) / 2) * np.sqrt(spread_mm2)
