"""How often the stated 95 % intervals hold the truth, on synthetic trials whose truth is known.

    python benchmarks/stated_intervals.py [--draws 5000] [--only NAME]

Each trial draws a bed, a simulation of it that is off by a smooth error, and readings with all the errors that their
sheet declares: scatter, last digit, the caliper's limit, the datum, the probe on a slope. Held against the truth are
the intervals of the bias, of the mean error and of the stations' levels. The true level is straight between stations,
as the intervals take it; what a bed does between them no reading tells.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.table import Row, finish
from sealtwin.core.records import Floats, Profile
from validate.metrics.curve_distances import Difference
from validate.settings import Readings, Uncertainty
from validate.uncertainty.intervals import bands_mm, doubt_of, hats, mean_absolute, mean_error_interval, mean_weights
from validate.uncertainty.readings_budget import budget_of

LENGTH_MM, WIDTH_MM = 80.0, 3.1
FINE_MM = np.linspace(0, LENGTH_MM, 41)
BED_MM, ROLLING_MM = 3.0, 15.0
"""Height and length over which a bed rises and falls: the paper's goes from -16 to 1 mm in 40 mm."""
WANDERING_MM = 10.0
"""Length over which a simulation is off alike."""


@dataclass(frozen=True)
class Design:
    """A way to read a sample."""

    name: str
    stations: int
    repeats: int
    error_mm: float = 1.0
    """Of the simulation, root mean square; the paper's is 1.26 on average."""
    scatter_mm: float = 0.15
    """Of a single reading, as in the fixture."""
    limit_mm: float = 0.02
    datum_mm: float | None = None
    probe_mm: float | None = None
    scatter_grows: float = 1.0
    """From one end of the crack to the other, as a factor."""

    @property
    def readings(self) -> Readings:
        return Readings(
            file=Path("sheet.csv"),
            data="synthetic",
            role="held-out",
            limit_mm=self.limit_mm,
            datum_error_mm=self.datum_mm,
            probe_mm=self.probe_mm,
        )

    @property
    def declared(self) -> Uncertainty:
        """A lab that reads each station once knows its repeatability from elsewhere, or not at all."""
        return Uncertainty(repeatability_mm=self.scatter_mm) if self.repeats == 1 else Uncertainty()


DESIGNS: Sequence[Design] = (
    Design("17 stations, 3 repeats", 17, 3),
    Design("17 stations, 2 repeats", 17, 2),
    Design("17 stations, read once", 17, 1),
    Design("5 stations, 3 repeats", 5, 3),
    Design("5 stations, read once", 5, 1),
    Design("33 stations, 3 repeats", 33, 3),
    Design("33 stations, read once", 33, 1),
    Design("17 x 3, datum 0.2 mm", 17, 3, datum_mm=0.2),
    Design("9 x 2, quiet hand, limit 0.1 mm", 9, 2, scatter_mm=0.03, limit_mm=0.1),
    Design("17 x 3, datum, probe of 0.5 mm", 17, 3, datum_mm=0.05, probe_mm=0.5),
    Design("17 x 3, scatter grows fourfold", 17, 3, scatter_grows=4.0),
    Design("17 x 3, error as small as 0.3 mm", 17, 3, error_mm=0.3),
)


@dataclass(frozen=True)
class Coverage:
    """Shares of the trials, or of all their stations, whose interval held the truth."""

    bias: float
    mean_error: float
    level: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=5000)
    parser.add_argument("--only", choices=[design.name for design in DESIGNS])
    asked = parser.parse_args()
    rows = []
    for design in DESIGNS:
        if asked.only in (None, design.name):
            found = coverage_of(design, asked.draws)
            for what, share in (("bias", found.bias), ("mean error", found.mean_error), ("level", found.level)):
                rows.append(Row(f"{design.name}: {what}", 100 * share, "%", 94.0, 96.0, "95"))
            print(f"{design.name}: done", flush=True)
    finish(rows)


def coverage_of(design: Design, draws: int, seed: int = 0) -> Coverage:
    random = np.random.default_rng(seed)
    s_mm = np.linspace(0, LENGTH_MM, design.stations)
    held = np.array([_held(design, s_mm, random) for _ in range(draws)])
    return Coverage(*held.mean(axis=0).tolist())


def _held(design: Design, s_mm: Floats, random: np.random.Generator) -> tuple[float, float, float]:
    """Of one trial: whether each interval holds its truth, and for which share of the stations."""
    true_mm = np.interp(s_mm, FINE_MM, -4.0 + BED_MM * _wave(ROLLING_MM, random))
    simulated_mm = np.interp(FINE_MM, s_mm, true_mm) + design.error_mm * _wave(WANDERING_MM, random)
    repeats_mm = _read(design, s_mm, true_mm, random)
    measured = Profile(s_mm, repeats_mm.mean(axis=1), repeats_mm)
    budget = budget_of(measured, design.readings, design.declared, np.full(len(s_mm), WIDTH_MM))
    found = Difference(FINE_MM, simulated_mm, s_mm, measured.level_mm)
    truth = Difference(FINE_MM, simulated_mm, s_mm, true_mm)
    hat = hats(found.x, s_mm)
    half_mm = doubt_of(budget, mean_weights(found.x, hat)).half_width_mm
    low_mm, high_mm = mean_error_interval(found.x, found.value, hat, budget)
    return (
        float(abs(found.mean() - truth.mean()) <= half_mm),
        float(low_mm <= float(mean_absolute(truth.x, truth.value)) <= high_mm),
        float((np.abs(measured.level_mm - true_mm) <= bands_mm(budget)).mean()),
    )


def _read(design: Design, s_mm: Floats, true_mm: Floats, random: np.random.Generator) -> Floats:
    """(n, repeats), to the caliper's last digit."""
    settings = design.readings
    shared_mm = np.full(len(s_mm), settings.limit_mm * random.uniform(-1, 1))
    shared_mm += (design.datum_mm or 0.0) * random.standard_normal()
    shared_mm += np.abs(np.gradient(true_mm, s_mm)) * (design.probe_mm or 0.0) / 2 * random.uniform(-1, 1)
    own_mm = design.scatter_mm * np.linspace(1, design.scatter_grows, len(s_mm))
    noise_mm = own_mm[:, None] * random.standard_normal((len(s_mm), design.repeats))
    read_mm = (true_mm + shared_mm)[:, None] + noise_mm
    return np.round(read_mm / settings.resolution_mm) * settings.resolution_mm


def _wave(length_mm: float, random: np.random.Generator) -> Floats:
    """A smooth random curve of unit height over FINE_MM: a Gaussian process, its covariance a bell of that length."""
    shapes = _shapes(length_mm)
    return shapes @ random.standard_normal(shapes.shape[1])


@cache
def _shapes(length_mm: float) -> Floats:
    values, vectors = np.linalg.eigh(np.exp(-(((FINE_MM[:, None] - FINE_MM) / length_mm) ** 2) / 2))
    return vectors * np.sqrt(np.maximum(values, 0.0))


if __name__ == "__main__":
    main()
