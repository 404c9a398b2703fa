"""Readings with errors that a lab may not notice: cases of ``stated_intervals``, from a review of 25 November 2026.

The bed is not one that the method's constants were chosen on, but for the steps between few stations. A case passes if
its intervals contain the truth, or if the page names each of its errors among those that no interval includes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sealtwin.core.records import Floats

BED_S_MM = np.linspace(0, 80, 161)
SEED = 20261127  # Not one of those that a constant was chosen on
SHARES = {"bias": 92.0, "mean error": 92.0, "station": 92.0, "whole profile": 90.0}
"""Percent of the trials, or of their stations, of which each interval has to contain the truth."""
NOISE_ALONE = 98.0  # Largest of these percentages, but that of the whole profile, if there is nothing but noise
TILT_MM = 80.0 * np.tan(np.radians(0.5))


@dataclass(frozen=True)
class Sheet:
    """Readings while they are taken: errors are added to them one by one."""

    s_mm: Floats
    slope: Floats  # Of the bed there, (n,)
    read_mm: Floats  # (n, repeats)
    random: np.random.Generator


Error = Callable[[Sheet], Floats]
"""Return the readings with one more error."""


def drift(sd_mm: float, *, shared: bool) -> Error:
    """An operator who drifts from station to station (AR(1) of 0.85), in all repeats alike or in each pass."""

    def add(sheet: Sheet) -> Floats:
        count, repeats = sheet.read_mm.shape
        off_mm = sd_mm * sheet.random.standard_normal((count, 1 if shared else repeats))
        for number in range(1, count):
            off_mm[number] = 0.85 * off_mm[number - 1] + np.sqrt(1 - 0.85**2) * off_mm[number]
        return sheet.read_mm + off_mm

    return add


def sinks(flat_mm: float, per_slope_mm: float) -> Error:
    return lambda sheet: sheet.read_mm - (flat_mm + per_slope_mm * np.abs(sheet.slope))[:, None]


def floor(step_mm: float) -> Error:
    return lambda sheet: np.floor(sheet.read_mm / step_mm) * step_mm


def toward_zero(step_mm: float) -> Error:
    return lambda sheet: np.trunc(sheet.read_mm / step_mm) * step_mm


def nearest(step_mm: float) -> Error:
    return lambda sheet: np.round(sheet.read_mm / step_mm) * step_mm


def last_operator(off_mm: float) -> Error:
    return lambda sheet: sheet.read_mm + off_mm * (np.arange(sheet.read_mm.shape[1]) == sheet.read_mm.shape[1] - 1)


def common(mean_mm: float, sd_mm: float) -> Error:
    """One offset of all readings."""
    return lambda sheet: sheet.read_mm + mean_mm + sd_mm * sheet.random.standard_normal()


def on_slopes(per_slope_mm: float) -> Error:
    return lambda sheet: (
        sheet.read_mm + per_slope_mm * np.abs(sheet.slope)[:, None] * sheet.random.standard_normal(sheet.read_mm.shape)
    )


def outliers(share: float, sd_mm: float) -> Error:
    return lambda sheet: (
        sheet.read_mm
        + (sheet.random.random(sheet.read_mm.shape) < share) * sd_mm * sheet.random.standard_normal(sheet.read_mm.shape)
    )


def students(scale_mm: float) -> Error:
    return lambda sheet: sheet.read_mm + scale_mm * sheet.random.standard_t(3, sheet.read_mm.shape) / np.sqrt(3)


def odd_stations(share: float, off_mm: float) -> Error:
    def add(sheet: Sheet) -> Floats:
        odd = sheet.random.random(len(sheet.s_mm)) < share
        return sheet.read_mm + (odd * off_mm * sheet.random.choice([-1, 1], len(sheet.s_mm)))[:, None]

    return add


def alike_at_a_station(sd_mm: float) -> Error:
    return lambda sheet: sheet.read_mm + sd_mm * sheet.random.standard_normal((len(sheet.s_mm), 1))


def tilted(mean_mm: float, sd_mm: float, zero_mm: float) -> Error:
    """A datum that is right at ``zero_mm`` and off by that much more at 80 mm than at 0."""
    return lambda sheet: (
        sheet.read_mm + (mean_mm + sd_mm * sheet.random.standard_normal()) * (sheet.s_mm[:, None] - zero_mm) / 80
    )


def missing(share: float) -> Error:
    def add(sheet: Sheet) -> Floats:
        lost = sheet.random.random(sheet.read_mm.shape) < share
        lost[:, 0] = False
        return np.where(lost, np.nan, sheet.read_mm)

    return add


@dataclass(frozen=True)
class Faulty:
    """Readings with some errors, and what their trial file declares."""

    name: str
    errors: Sequence[Error] = ()
    stations: int = 17
    repeats: int = 3
    scatter_mm: float = 0.15
    shift_mm: tuple[float, float] = (0.0, 0.0)  # Of all stations: mean and standard deviation
    readings: Mapping[str, Any] = field(default_factory=dict)
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    named: tuple[str, ...] = ()  # Settings of undeclared errors, which the page has to name
    noise_alone: bool = False
    because: str = ""  # Why it fails and is not named

    def draw(self, random: np.random.Generator) -> tuple[Floats, Floats, Floats]:
        """Return the places of the stations, the bed at ``BED_S_MM`` and the readings, (n, repeats)."""
        s_mm, bed_mm = np.linspace(0, 80, self.stations), pour(random)
        at_mm = s_mm + self.shift_mm[0] + self.shift_mm[1] * random.standard_normal()
        level_mm = np.interp(at_mm, BED_S_MM, bed_mm)
        slope = np.interp(s_mm, BED_S_MM, np.gradient(bed_mm, BED_S_MM))
        size = (self.stations, self.repeats)
        limit_mm = 0.02 * random.uniform(-1, 1)
        read_mm = level_mm[:, None] + limit_mm + self.scatter_mm * random.standard_normal(size)
        for add in self.errors:
            read_mm = add(Sheet(s_mm, slope, read_mm, random))
        return s_mm, bed_mm, np.round(read_mm, 2)


def pour(random: np.random.Generator) -> Floats:
    """Return a bed at ``BED_S_MM``: a smooth pour with ripples and a step."""
    smooth_mm = sum(random.uniform(0.3, 1.2) * _wave(random.uniform(50, 90), random) for _ in range(2))
    ripples_mm = 0.25 * _wave(random.uniform(9, 15), random)
    step_mm = 5.0 * np.tanh((BED_S_MM - random.uniform(25, 55)) / 5)
    return -6.0 + smooth_mm + ripples_mm + step_mm


def _wave(length_mm: float, random: np.random.Generator) -> Floats:
    return np.sin(2 * np.pi * (BED_S_MM / length_mm + random.random()))


def declared(**uncertainty: float) -> dict[str, Any]:
    return {"uncertainty": uncertainty}


NO_PASSES = declared(pass_mm=0.0)
DRIFT, SINKS = drift(0.3, shared=True), sinks(0.2, 0.3)
FROM_AN_END, ABOUT_THE_MIDDLE = tilted(TILT_MM, 0.0, 0.0), tilted(0.0, TILT_MM, 40.0)
OF_A_STATION, OF_THE_DATUM, ROUNDED = ("uncertainty.common_mm",), ("readings.datum_error_mm",), ("readings.rounding",)
TOO_SMALL = "the test that contradicts pass_mm = 0 refuses 1 of 100 true declarations, and few with so small an offset"
FAULTS: Sequence[Faulty] = (
    Faulty("pour"),
    Faulty("pour, no passes", **NO_PASSES, noise_alone=True),
    Faulty("pour, t3, no passes", (students(0.15),), scatter_mm=0.0, **NO_PASSES, noise_alone=True),
    Faulty("operator drifts in all repeats", (DRIFT,), named=OF_A_STATION),
    # A drift over 30 mm is partly an offset of all stations.
    Faulty("operator drifts, declared", (DRIFT,), **declared(common_mm=0.3), named=("uncertainty.operator_mm",)),
    Faulty("operator drifts in each pass", (drift(0.3, shared=False),)),
    Faulty("probe sinks", (SINKS,), named=("uncertainty.sinks_mm",)),
    Faulty("probe sinks, declared", (SINKS,), **declared(sinks_mm=0.3)),
    Faulty("probe sinks, its width declared", (SINKS,), readings={"probe_mm": 1.0}, named=("uncertainty.sinks_mm",)),
    Faulty("floor to 0.5", (floor(0.5),), named=ROUNDED),
    Faulty("floor to 0.5, declared", (floor(0.5),), readings={"rounding": "down"}),
    Faulty("floor to 0.5, declared, no passes", (floor(0.5),), readings={"rounding": "down"}, **NO_PASSES),
    Faulty("floor to 0.5, its digit declared", (floor(0.5),), readings={"resolution_mm": 0.5}, named=ROUNDED),
    Faulty("toward zero to 0.5, declared", (toward_zero(0.5),), readings={"rounding": "toward_zero"}),
    Faulty("floor to 0.1", (floor(0.1),)),
    Faulty("nearest 0.5, declared", (nearest(0.5),), readings={"rounding": "nearest"}),
    Faulty("one of three operators +0.3", (last_operator(0.3),)),
    Faulty("one of three operators +0.3, no passes", (last_operator(0.3),), **NO_PASSES),
    Faulty("one operator off in all repeats", (common(0.0, 0.3),), named=("uncertainty.operator_mm",)),
    Faulty("one operator off, declared", (common(0.0, 0.3),), **declared(operator_mm=0.3)),
    Faulty("scatter grows on slopes", (on_slopes(0.3),), scatter_mm=0.1),
    Faulty("stations 1.5 mm off", shift_mm=(0.0, 1.5), named=("uncertainty.station_mm",)),
    Faulty("stations 1.5 mm off, declared", shift_mm=(0.0, 1.5), **declared(station_mm=1.5)),
    Faulty("stations exactly 1.5 mm off, declared", shift_mm=(1.5, 0.0), **declared(station_mm=1.5)),
    Faulty("5 % outliers", (outliers(0.05, 1.5),)),
    Faulty("5 % of the stations 1.5 mm off", (odd_stations(0.05, 1.5),), named=OF_A_STATION),
    Faulty("Student's t of 3", (students(0.15),), scatter_mm=0.0),
    Faulty("5 stations", stations=5),
    Faulty("5 stations x 2", stations=5, repeats=2),
    Faulty("8 stations x 2", stations=8, repeats=2),
    Faulty("2 repeats", repeats=2),
    Faulty("1 repeat", repeats=1),
    Faulty("1 repeat, repeatability declared", repeats=1, **declared(repeatability_mm=0.15)),
    Faulty("40 stations", stations=40),
    Faulty("40 stations x 2, 5 % outliers", (outliers(0.05, 1.5),), stations=40, repeats=2),
    Faulty("30 % missing", (missing(0.3),)),
    Faulty("60 % missing", (missing(0.6),)),
    Faulty("tilt from an end", (FROM_AN_END,), named=("uncertainty.datum_tilt_mm",)),
    Faulty("tilt from an end, declared", (FROM_AN_END,), **declared(datum_tilt_mm=0.7)),
    Faulty("tilt from an end, as its height", (FROM_AN_END,), readings={"datum_error_mm": 0.35}),
    Faulty("tilt about the middle", (ABOUT_THE_MIDDLE,), named=("uncertainty.datum_tilt_mm",)),
    Faulty("tilt about the middle, declared", (ABOUT_THE_MIDDLE,), **declared(datum_tilt_mm=0.7)),
    Faulty("repeats agree falsely", (alike_at_a_station(0.15),), scatter_mm=0.03, named=OF_A_STATION),
    Faulty("read on the meniscus", (common(0.3, 0.0),), named=OF_THE_DATUM),
    Faulty(
        "a bit of all",
        (drift(0.1, shared=True), sinks(0.1, 0.0), outliers(0.02, 1.5), floor(0.05)),
        shift_mm=(0.0, 0.5),
        named=("uncertainty.sinks_mm", "uncertainty.common_mm", "uncertainty.station_mm", "readings.rounding"),
    ),
    Faulty("tilt from an end, sd, declared", (tilted(0.0, TILT_MM, 0.0),), **declared(datum_tilt_mm=0.7)),
    Faulty("operator drifts, with an offset declared", (DRIFT,), **declared(common_mm=0.3, operator_mm=0.2)),
    Faulty("one of three operators +0.15, no passes", (last_operator(0.15),), **NO_PASSES, because=TOO_SMALL),
)
