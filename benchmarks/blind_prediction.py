"""Blind prediction: bands of the level before the pour, against the fill that followed; twenty trials, EMULATED.

    python -m benchmarks.blind_prediction [--tuning] [--picture FILE]

Paste, cavity and pump of each trial were measured, and nothing was fitted: ``benchmarks.blind_cases`` emulates these
measurements, runs the prediction and the reality, and keeps both, so that judging needs no particles. A caliper with
errors of its own reads the real level three times at 16 stations. The band about the prediction holds the doubt of the
inputs, the numerics of a single run, and that of the readings, each drawn as in a trial's own budget. The numerics are
one number, measured on the trials of another draw (``--tune``): the difference of a run with another radius and seed.
It is not the band of ``sealtwin validate --uncertainty``, which is wider (``benchmarks.blind_own_band``).

The bars of 88 % and 60 % are one-sided and below the nominal 95 %. Stations of one trial share its errors, so that the
interval of the share is by a bootstrap over trials.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks.blind_cases import JUDGED_SEED, STATIONS_MM, TRIALS, TUNING_SEED, finished
from benchmarks.table import Row, run_benchmark
from sealtwin.core.records import Floats, Profile
from validate.settings import Readings, Uncertainty
from validate.uncertainty.budget import Budget, Component, normals
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.reading_errors import budget_of

READ_MM = np.linspace(STATIONS_MM[0] + 2, STATIONS_MM[-1] - 2, 16)
REPEATS, SCATTER_MM, PASS_SD_MM, PLACE_SD_MM = 3, 0.1, 0.1, 0.3
NARROWER = 0.6  # Share of a band's width that must not do
DRAWN_AGAIN = 20_000  # Sets of trials in a bootstrap, whose ends are then known to 0.1 %
LEFT = "particles were not run for the others; python -m benchmarks.blind_cases goes on with them"


@dataclass(frozen=True)
class Judged:
    """Predicted less read level at the stations of a trial, and the halves of 95 % bands, (16,) each."""

    number: int
    error_mm: Floats
    band_mm: Floats
    ahead_mm: Floats  # Without the readings' part
    numerics_mm: Floats  # Of numerics and readings alone

    def held(self, width: float = 1.0) -> float:
        return float(np.mean(np.abs(self.error_mm) <= width * self.band_mm))


def numerics_mm() -> float:
    """RMS difference of two runs with the same inputs, of another radius and seed."""
    runs = finished(TUNING_SEED).values()
    return float(np.sqrt(np.mean([(one["again_mm"] - one["predicted_mm"]) ** 2 for one in runs])))


def read(number: int, real_mm: Floats) -> Profile:
    """Emulate a caliper's readings of a level."""
    random = np.random.default_rng([JUDGED_SEED, number, 3])
    there_mm = READ_MM + random.normal(0, PLACE_SD_MM, len(READ_MM))
    true_mm = np.interp(there_mm, STATIONS_MM, real_mm)[:, None]
    passes_mm = random.normal(0, PASS_SD_MM, REPEATS)
    repeats_mm = np.round(true_mm + passes_mm + random.normal(0, SCATTER_MM, (len(READ_MM), REPEATS)), 2)
    return Profile(READ_MM, repeats_mm.mean(axis=1), data="synthetic", source="caliper", repeats_mm=repeats_mm)


def judge(number: int, levels: dict[str, Floats], numerics: float) -> Judged:
    measured = read(number, levels["real_mm"])
    settings = Readings(file=Path("emulated.csv"), data="synthetic", role="held-out")
    declared = Uncertainty(pass_mm=PASS_SD_MM, station_each_mm=PLACE_SD_MM)
    of_readings = budget_of(measured, settings, declared, Mouth(READ_MM, np.full(len(READ_MM), 3.0), None))
    stations = len(READ_MM)
    of_run = Component("numerics", "computed", numerics * normals("numerics", stations), kind="numerics")
    inputs_mm = np.interp(READ_MM, STATIONS_MM, levels["inputs_mm"])
    of_inputs = Component("inputs", "declared", inputs_mm * normals("inputs", 1), shared=True, kind="inputs")
    band = of_readings.joined(of_run, of_inputs)
    return Judged(
        number,
        np.interp(READ_MM, STATIONS_MM, levels["predicted_mm"]) - measured.level_mm,
        band.band_mm,
        Budget(stations, (of_run, of_inputs)).band_mm,
        of_readings.joined(of_run).band_mm,
    )


def rows(judged: Sequence[Judged], numerics: float) -> list[Row]:
    def pooled(width: float) -> float:
        return 100 * float(np.mean([one.held(width) for one in judged]))

    errors_mm, bands_mm = (np.concatenate([getattr(one, name) for one in judged]) for name in ("error_mm", "band_mm"))
    ahead_mm, bare_mm = (np.concatenate([getattr(one, name) for one in judged]) for name in ("ahead_mm", "numerics_mm"))
    shares = 100 * np.array([one.held() for one in judged])
    low, high = over_trials(shares)
    return [
        Row("EMULATED trials judged", len(judged), "", TRIALS, TRIALS, "all", because=LEFT),
        Row("stations that 95 % bands hold", pooled(1), "%", 88, 100, "95"),
        Row("the same, 95 % by a bootstrap over trials: from", low, "%"),
        Row("the same, 95 % by a bootstrap over trials: to", high, "%"),
        Row("the same in the trial that has fewest", shares.min(), "%", 60, 100, "80"),
        Row("trials with all stations in their bands", int((shares == 100).sum()), ""),
        Row("half of the band, median", float(np.median(bands_mm)), "mm", 0, 1.0, "0.6"),
        Row("bands of 0.6 of that width hold", pooled(NARROWER), "%", 0, 90, "75"),
        Row("half of the band before it is read, median", float(np.median(ahead_mm)), "mm"),
        Row("bands of numerics and readings alone hold", 100 * float(np.mean(np.abs(errors_mm) <= bare_mm)), "%"),
        Row("standard uncertainty of the numerics, one number", numerics, "mm"),
        Row("predicted less read level, RMS", float(np.sqrt(np.mean(errors_mm**2))), "mm"),
        Row("predicted less read level, mean", float(errors_mm.mean()), "mm"),
    ]


def over_trials(shares: Floats) -> Floats:
    """Return the ends of the 95 % interval of a mean over trials, (2,), if trials are drawn again."""
    drawn = np.random.default_rng(0).choice(shares, (DRAWN_AGAIN, len(shares)))
    return np.quantile(drawn.mean(axis=1), (0.025, 0.975))


def draw(judged: Sequence[Judged], path: Path) -> None:
    """Draw each trial's errors in its band."""
    import matplotlib.pyplot as plt

    across = 5
    figure, panels = plt.subplots(-(-len(judged) // across), across, figsize=(11, 8), sharex=True, sharey=True)
    for one, panel in zip(judged, np.ravel(panels), strict=False):
        panel.fill_between(READ_MM, -one.band_mm, one.band_mm, color="0.85")
        panel.plot(READ_MM, -one.error_mm, "o", markersize=3)
        panel.set_title(f"trial {one.number}", fontsize=8)
    figure.supxlabel("s, mm")
    figure.supylabel("EMULATED reading less prediction, mm, and the 95 % band")
    figure.tight_layout()
    figure.savefig(path)


def main(
    tuning: Annotated[bool, Option(help="show the trials that the numerics were measured on")] = False,
    picture: Annotated[Path | None, Option(help="file for a picture of errors and bands")] = None,
) -> list[Row]:
    numerics = numerics_mm()
    trials = finished(TUNING_SEED if tuning else JUDGED_SEED)
    judged = [judge(number, levels, numerics) for number, levels in trials.items()]
    for one in judged:
        off = f"mean {one.error_mm.mean():+.2f} mm, RMS {np.sqrt(np.mean(one.error_mm**2)):.2f} mm"
        share = f"{100 * one.held():3.0f} % held"
        print(f"trial {one.number:2d}: {share}, {off}, half of the band {np.median(one.band_mm):.2f} mm")
    if picture:
        draw(judged, picture)
    return rows(judged, numerics)


if __name__ == "__main__":
    run_benchmark(main)
