"""Parts of a comparison between a simulated and a measured level, as ``validate.result`` joins them.

The docstring of a figure is its description in the published schema of report.json.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, with_config

from sealtwin.core.facts import Fact
from sealtwin.core.record_files import Amount, Positive
from sealtwin.core.records import DataKind, JsonRecord, Numbers
from sealtwin.core.run_figures import Known
from validate.settings import Role

PART = ConfigDict(extra="forbid")


def in_unit(unit: str) -> Any:
    """Return a field with a unit for the published schema. Use it for a field whose name does not end with a unit."""
    return Field(json_schema_extra={"unit": unit})


@with_config(PART)
@dataclass(frozen=True)
class ErrorBin:
    """Mean absolute error over a stretch of the crack."""

    from_mm: float
    """Position at which the stretch begins, along the crack from the end at which the nozzle starts."""
    to_mm: float
    """Position at which the stretch ends, along the crack from the end at which the nozzle starts."""
    covered_mm: float
    """Length of the part of the stretch that both curves cover."""
    mean_error_mm: float | None
    """Mean absolute error over the covered length; None if nothing is covered."""


@dataclass(frozen=True)
class ErrorFigures:
    """Exact errors of a simulated level over its common stretch with the readings. ``LevelMetrics`` explains them."""

    mean_error_mm: float
    bias_mm: float
    worst_error_mm: float
    worst_at_mm: float
    share_under_1_mm: float
    flat_level_mm: float
    flat_level_error_mm: float


@dataclass(frozen=True)
class Basis:
    """Stations and coverage of a set of readings. ``LevelMetrics`` explains the fields."""

    stations_used: int
    coverage: float
    widest_gap_mm: float
    enough_readings: bool


class ReadingsScatter(JsonRecord):
    """Scatter of repeated readings, pooled over the stations."""

    stations: int
    """Number of stations."""
    readings: int
    """Number of single readings."""
    degrees_of_freedom: int
    """Number of single readings minus number of stations."""
    repeatability_sd_mm: float | None
    """Standard deviation of a single reading; None if no station was read repeatedly."""


@with_config(PART)
@dataclass(frozen=True)
class Baseline:
    """A simpler level, compared with the same readings over the same stretch."""

    name: str
    """Name of the level, in words."""
    numbers: int
    """Number of coefficients that were fitted to these readings; 0 for a level made without them."""
    mean_error_mm: float
    """Mean error of the level against the readings."""


class LevelMetrics(JsonRecord):
    """Figures of simulated minus measured level over the stretch that both curves cover; the integrals are exact."""

    model_config = ConfigDict(allow_inf_nan=False)

    mean_error_mm: Amount
    """Mean absolute error: the area between the simulated and the measured level, divided by the covered length."""
    worst_error_mm: Amount
    """Largest absolute error."""
    worst_at_mm: float
    """Position of the largest error along the crack."""
    covered_from_mm: float
    """Position along the crack at which the comparison begins."""
    covered_to_mm: float
    """Position along the crack at which the comparison ends."""
    covered_length_mm: Positive
    """Length of the compared stretch."""
    coverage: float
    """Compared share of the crack's length."""
    length_mm: float
    """Length of the crack along its centreline."""
    stations_compared: int
    """Number of stations on the stretch that both curves cover."""
    stations_beyond_mm: Numbers
    """Positions of the stations outside the stretch that both curves cover."""
    stations_used: int
    """Number of stations that define the measured line on the compared stretch, with the next one beyond each end."""
    widest_gap_mm: float
    """Largest distance from one station to the next."""
    enough_readings: bool
    """True if the readings allow a verdict: enough stations, close enough, over enough of the crack."""
    escaped_particles: int
    """Number of particles that passed through a wall. If it is not 0, the figures are invalid."""
    area_mm2: float
    """Exact area between the two levels."""
    area_similaritymeasures_mm2: float
    """Area between the two levels, computed by the library that the paper used."""
    area_difference_mm2: float
    """Exact area minus the area computed by the library."""
    bias_mm: float
    """Mean of simulated minus measured level."""
    rmse_mm: float
    """Root mean square error."""
    p95_error_mm: float
    """95th percentile of the absolute error over the length."""
    share_under_1_mm: float
    """Share of the covered length with an error below 1 mm."""
    frechet_mm: float
    """Fréchet distance of the two levels."""
    error_by_bin: tuple[ErrorBin, ...]
    """Mean absolute error in each 10 mm of the crack, as in the report's histogram."""
    start_zone_error_mm: Known
    """Mean absolute error in the first part of ``error_by_bin``; None if nothing in it is covered."""
    end_zone_error_mm: Known
    """Mean absolute error in the last part of ``error_by_bin``; None if nothing in it is covered."""
    flat_level_mm: float
    """Constant level with the smallest mean error against the readings: a baseline."""
    flat_level_error_mm: float
    """Mean error of the constant level ``flat_level_mm`` against the readings."""
    beats_flat_level: bool
    """True if the mean error is smaller than that of the constant level."""
    baselines: tuple[Baseline, ...] = ()
    """Simpler levels: best curves through calibration readings; and, made without these readings, the dispensed volume
    lying flat and, after extra runs of particles, the fast model."""
    beats_baseline: bool | None = None
    """True if the mean error is smaller than the mean error of every baseline that has at most as many coefficients as
    settings were fitted; None if there is no such baseline."""
    scatter: ReadingsScatter
    """Scatter of the repeated readings."""
    role: Role
    """Use of the readings: calibration of the fluid, or held out."""
    fitted: tuple[str, ...] | None = None
    """Dotted names of the settings that were fitted to these readings; empty if none was fitted, None if undeclared."""
    readings_data: DataKind
    """Origin of the readings; only measured data can validate."""
    readings_dialect: str
    """A sentence on how the sheet of readings was interpreted."""
    photo_data: DataKind
    """Origin of the photo or the mesh."""
    simulated_underfill_mm3: float
    """Unfilled volume between the simulated level and the mouth, over the covered length."""
    simulated_overfill_mm3: float
    """Volume above the mouth and below the simulated level, over the covered length."""
    simulated_sealant_mm3: float
    """Sealant under the simulated level, over the covered length."""
    simulated_fill_ratio: float
    """Share of the cavity that is below the simulated level, over the covered length."""
    measured_underfill_mm3: float
    """Unfilled volume between the measured level and the mouth, over the covered length."""
    measured_overfill_mm3: float
    """Volume above the mouth and below the measured level, over the covered length."""
    measured_sealant_mm3: float
    """Sealant under the measured level, over the covered length."""
    measured_fill_ratio: float
    """Share of the cavity that is below the measured level, over the covered length."""


class MassBalance(JsonRecord):
    """Volumes of the settled sealant, and the volume below the measured level."""

    dispensed_mm3: float
    """Dispensed volume."""
    in_crack_mm3: float
    """Volume of the settled particles whose centres are at or below the plane of the face."""
    above_mm3: float
    """Volume of the settled particles whose centres are above the plane of the face."""
    spilled_mm3: float
    """Dispensed sealant that ran over the sample's edge."""
    lost_mm3: float
    """Dispensed minus settled minus spilled volume: the volume that the numerics lost. Negative if they gained
    volume."""
    footprint_mm2: float
    """Area of the face outside the mouth that sealant covers."""
    readings_mm3: float
    """Sealant below the measured level, over the covered length."""
    readings_state: Literal["wet", "cured"] | None
    """Declared state of the sealant at the reading; None if not declared."""
    shrinkage_percent: float | None = in_unit("%")
    """Declared shrinkage before the reading; None if not declared."""
    readings_when_dispensed_mm3: float
    """Volume before shrinkage of the sealant below the measured level; ``readings_mm3`` if no shrinkage is declared."""


class VolumeComparison(JsonRecord):
    """Level that the dispensed volume predicts without a simulation, and the balance of volumes of run and readings."""

    volume_balance_level_mm: float
    """Flat level of the dispensed volume in the whole crack: a baseline that needs no readings."""
    volume_balance_error_mm: float
    """Mean error of this flat level against the readings."""
    beats_volume_balance: bool
    """True if the mean error is smaller than that of the flat level."""
    mass_balance: MassBalance
    """Volumes of the settled sealant, and the volume below the measured level."""


class StationBands(JsonRecord):
    """Half-widths of the 95 % bands of the measured levels at the stations, (n,) each."""

    s_mm: Numbers
    """Positions of the stations along the crack."""
    band_95_mm: Numbers
    """Half-width of the band of a single station; by chance, one station in twenty is outside its band."""
    profile_band_95_mm: Numbers
    """Half-width of the band that contains all stations at once in 95 % of cases."""


@with_config(PART)
@dataclass(frozen=True)
class BudgetPart:
    """One error of the budget and its standard uncertainties: half the half-width of their 95 % intervals.

    For an undeclared error, which no interval includes, they are computed for a size of 0.2 mm, or for a meniscus of
    water.
    """

    name: str
    """Name of the error, in words."""
    setting: str
    """Key of the trial file that declares the error; empty if there is no such key."""
    source: str
    """Origin of the error's size: repeats, detected, declared, allowed for, assumed or computed."""
    kind: str
    """Kind of the error: readings, numerics or inputs."""
    mean_level_mm: float
    """Standard uncertainty of the mean level, which is also that of the bias."""
    mean_error_mm: float
    """Standard uncertainty of the mean error, provided that the level's error has the same sign with and without it."""
    station_mm: float
    """Standard uncertainty of the level at a station: the root mean square over all stations."""


class BudgetSummary(JsonRecord):
    """All errors of a comparison, part by part."""

    parts: tuple[BudgetPart, ...]
    """Errors included in the intervals, one by one."""
    missing: tuple[BudgetPart, ...]
    """Undeclared errors that the data cannot show, each with the effect that a size of 0.2 mm, or a meniscus of water,
    would have."""
    scatter_known: bool
    """True if stations were read repeatedly, or the repeatability is declared."""
    notes: tuple[Fact, ...]
    """Findings on outliers, rounding to one side, few stations, and stations that the probe cannot read."""


class MeanLevelBudget(JsonRecord):
    """Error of the mean level and its standard uncertainties, after ASME V&V 20."""

    error_mm: float
    """E: simulated minus measured mean level."""
    volume_level_mm: float | None
    """Change of level due to volume that the numerics gained: this volume divided by the area of the fluid's surface,
    negative if volume was lost. E includes it. None if there are no particles."""
    data_mm: float
    """Standard uncertainty due to the readings."""
    numerics_mm: float | None
    """Standard uncertainty due to particle size, scatter of runs and changes of volume; None without runs at three
    particle sizes."""
    inputs_mm: float | None
    """Standard uncertainty due to the declared inputs; None if no input was varied."""
    validation_mm: float
    """Combined standard uncertainty of the available parts; equals u_val if numerics and inputs are included."""
    resolved: bool | None
    """True if |E| exceeds twice u_val, False if the two are consistent; None until numerics and all declared inputs are
    evaluated."""
    inputs_waiting: bool
    """True if a declared input has not been varied by any run yet."""


class StationErrors(JsonRecord):
    """Error of the level at each station and its standard uncertainties, (n,) each."""

    s_mm: Numbers
    """Positions of the stations along the crack."""
    error_mm: Numbers
    """Simulated minus measured level."""
    data_mm: Numbers
    """Standard uncertainty due to the readings."""
    numerics_mm: Numbers | None
    """Standard uncertainty due to the numerics; None if it was not computed."""
    inputs_mm: Numbers | None
    """Standard uncertainty due to the declared inputs; None if no input was varied."""
    validation_mm: Numbers
    """Combined standard uncertainty of the available parts."""
    profile_mm: Numbers
    """Half-width of the combined 95 % band that contains all stations at once."""
    by_chance: float
    """Number of stations that would be outside their own bands by chance if the model were perfect."""

    @property
    def above(self) -> NDArray[np.bool_]:
        """True at stations where |E| exceeds the station's own 95 % band."""
        return np.abs(self.error_mm) > 2 * self.validation_mm

    @property
    def off(self) -> NDArray[np.bool_]:
        """True at stations where |E| exceeds the 95 % band of all stations together."""
        return np.abs(self.error_mm) > self.profile_mm


@with_config(PART)
@dataclass(frozen=True)
class StationError:
    """The error at one station."""

    error_mm: float
    """Absolute error."""
    s_mm: float
    """Position of the station along the crack."""


@with_config(PART)
@dataclass(frozen=True)
class ShiftedError:
    """The comparison with the readings shifted along the crack."""

    shift_mm: float
    """Shift of the readings along the crack."""
    mean_error_mm: float
    """Mean error with the readings shifted by ``shift_mm``."""
    bias_mm: float
    """Bias with the readings shifted by ``shift_mm``."""


class Alignment(JsonRecord):
    """Convention for s = 0, and the errors that other conventions would give."""

    choice: str
    """Convention for s = 0, in a sentence."""
    shifts: tuple[ShiftedError, ...]
    """Errors with the readings shifted along the crack, since s = 0 is a convention."""


class SizeSeries(JsonRecord):
    """One figure, computed at three particle sizes."""

    values: tuple[float, ...] = in_unit("mm")
    """Mean over the runs of each size."""
    runs: tuple[int, ...]
    """Number of runs at each size, with different seeds."""
    scatter: float = in_unit("mm")
    """Standard deviation of a single run."""
    order_95: tuple[float, float]
    """Ends of the 95 % range of the order of convergence, within 0.5 to 2."""
    band: float = in_unit("mm")
    """Half-width of the 95 % interval of the discretisation error at the middle size. It does not include the scatter
    of single runs."""


@with_config(PART)
@dataclass(frozen=True)
class SizeStudy:
    """Mean level and mean error at three particle sizes, from the finest to the coarsest."""

    radii_mm: tuple[float, ...]
    """Radii of the particles; the trial's own is in the middle."""
    mean_level_mm: SizeSeries
    """Mean of the simulated level over the covered length."""
    mean_error_mm: SizeSeries
    """Mean absolute error against the readings over the covered length."""


class InputEffect(JsonRecord):
    """Change of the simulated level if an input is larger by its standard uncertainty."""

    name: str
    """Key of the input in the table [uncertainty]."""
    standard: float = in_unit("that of the name")
    """Declared standard uncertainty, in the unit that the name ends with."""
    mean_level_mm: float
    """Change of the mean simulated level."""
    largest_mm: float
    """Largest absolute change of the simulated level along the crack."""
    share: float
    """First-order index: share of the mean level's variance, due to all inputs, that this input causes by itself."""
    model: str
    """Model that computed the effect: particles, or slot for the fast model."""


class InputDrawsRecord(JsonRecord):
    """Runs of the fast model with all inputs drawn at once."""

    runs: int
    """Number of runs, not counting the one with unchanged inputs."""
    together: float
    """Share of the mean level's variance that is due to interactions of the inputs."""
    unfit: tuple[Fact, ...]
    """Reasons why the case is outside the fast model's domain."""


class ErrorUncertainty(JsonRecord):
    """Intervals of the error, and their parts."""

    mean_error_interval_mm: tuple[float, float]
    """Ends of the 95 % interval of the mean error that is due to the readings."""
    bias_interval_mm: tuple[float, float]
    """Ends of the 95 % interval of the bias that is due to the readings."""
    bias_systematic_mm: float
    """Systematic standard uncertainty of the bias: more stations would not reduce it."""
    levels: StationBands
    budget: BudgetSummary
    mean_level: MeanLevelBudget
    stations: StationErrors
    worst_at_a_station: StationError | None
    """Worst error at a station; None if the worst error overall is at a station."""
    findings: tuple[Fact, ...]
    """Findings: the conclusions that ASME V&V 20 allows, or on why it is not assessed, and on errors that no
    interval includes."""
    unused: tuple[Fact, ...] = ()
    """Findings on declared errors that the readings contradict. The intervals do not include these errors."""
    alignment: Alignment
    numerics: SizeStudy | None
    """Mean level and mean error at three particle sizes; None if only one size was run."""
    inputs: tuple[InputEffect, ...]
    """Effects of the inputs that were varied."""
    input_draws: InputDrawsRecord | None
    """Runs of the fast model with all inputs drawn at once; None if the inputs were varied with particles, or not at
    all."""
    inputs_left_out: tuple[str, ...]
    """Names of the inputs without a declared uncertainty."""
    effect_scatter_mm: float | None
    """Standard deviation of an effect due to the scatter of single runs; None if it was not computed."""
    design_radius_mm: float | None
    """Particle radius of the runs that computed the effects of the inputs; None if there are no such runs."""
