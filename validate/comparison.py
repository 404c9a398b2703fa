"""Parts of a comparison between a simulated and a measured level, as ``validate.result`` joins them.

The docstring of a figure is its description in the published schema of report.json.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, with_config

from sealtwin.core.record_files import Amount, Positive
from sealtwin.core.records import DataKind, JsonRecord, Numbers
from sealtwin.core.run_figures import Known
from validate.settings import Role

PART = ConfigDict(extra="forbid")


def in_unit(unit: str) -> Any:
    """Return a field whose unit its name does not end with, for the published schema."""
    return Field(json_schema_extra={"unit": unit})


@with_config(PART)
@dataclass(frozen=True)
class ErrorBin:
    """Mean absolute error over a stretch of the crack."""

    from_mm: float
    """Beginning of the stretch, along the crack from the end where the nozzle starts."""
    to_mm: float
    """End of the stretch."""
    covered_mm: float
    """Length of the stretch that both curves cover."""
    mean_error_mm: float | None
    """Mean absolute error over the covered length; None if nothing is covered."""


@dataclass(frozen=True)
class ErrorFigures:
    """Errors of a simulated level, exact over its common stretch with the readings, as ``LevelMetrics`` has them."""

    mean_error_mm: float
    bias_mm: float
    worst_error_mm: float
    worst_at_mm: float
    share_under_1_mm: float
    flat_level_mm: float
    flat_level_error_mm: float


class ReadingsScatter(JsonRecord):
    """Scatter of repeated readings, pooled over the stations."""

    stations: int
    """Number of stations."""
    readings: int
    """Number of single readings."""
    degrees_of_freedom: int
    """Readings less stations."""
    repeatability_sd_mm: float | None
    """Standard deviation of a single reading; None without repeats."""


@with_config(PART)
@dataclass(frozen=True)
class Baseline:
    """A level along the crack that no simulation made, compared with the same readings over the same stretch."""

    name: str
    """Name in words."""
    numbers: int
    """Number of its coefficients that were fitted to these readings; 0 for a level that has not seen them."""
    mean_error_mm: float
    """Mean error of that level."""


class LevelMetrics(JsonRecord):
    """Figures of simulated minus measured level over the stretch that both curves cover, all exact integrals."""

    model_config = ConfigDict(allow_inf_nan=False)

    mean_error_mm: Amount
    """Area between the simulated and the measured level over the covered length."""
    worst_error_mm: Amount
    """Largest absolute error."""
    worst_at_mm: float
    """Place of the largest error along the crack."""
    covered_from_mm: float
    """Place along the crack where the comparison begins."""
    covered_to_mm: float
    """Place along the crack where the comparison ends."""
    covered_length_mm: Positive
    """Length that is compared."""
    coverage: float
    """Share of the crack's length that is compared."""
    length_mm: float
    """Length of the crack along its centreline."""
    stations_compared: int
    """Number of stations on the stretch that both curves cover."""
    stations_beyond_mm: Numbers
    """Places of the stations beyond that stretch."""
    stations_used: int
    """Number of stations that shape the readings' line there, one just beyond either end included."""
    widest_gap_mm: float
    """Largest distance from one station to the next."""
    enough_readings: bool
    """True if the readings allow a verdict: enough stations, close enough, over enough of the crack."""
    escaped_particles: int
    """Number of particles that went through a wall; with one, no figure counts."""
    area_mm2: float
    """Area between the two levels, exact."""
    area_similaritymeasures_mm2: float
    """Area between the two levels by the library that the paper used."""
    area_difference_mm2: float
    """Exact area less the library's."""
    bias_mm: float
    """Mean of simulated minus measured level."""
    rmse_mm: float
    """Root mean square error."""
    p95_error_mm: float
    """Error that 95 % of the length stay below."""
    share_under_1_mm: float
    """Share of the covered length with an error below 1 mm."""
    frechet_mm: float
    """Fréchet distance of the two levels."""
    error_by_bin: tuple[ErrorBin, ...]
    """Mean absolute error in each 10 mm of the crack, as in the report's histogram."""
    start_zone_error_mm: Known
    """Mean error over the first bin."""
    end_zone_error_mm: Known
    """Mean error over the last bin."""
    flat_level_mm: float
    """Constant level that is nearest to the readings: a baseline."""
    flat_level_error_mm: float
    """Mean error of that constant level."""
    beats_flat_level: bool
    """True if the mean error is smaller than that of the constant level."""
    baselines: tuple[Baseline, ...] = ()
    """Levels without a simulation: of readings that were calibrated on, the best curves through them; of held-out ones,
    levels that have not seen them."""
    beats_baseline: bool | None = None
    """True if the mean error is smaller than that of each baseline with no more numbers than settings were fitted; None
    without such a baseline."""
    scatter: ReadingsScatter
    """Scatter of the repeated readings."""
    role: Role
    """Use of the readings: the fluid was calibrated on them, or they were held out."""
    fitted: tuple[str, ...] | None = None
    """Settings that were fitted to these readings, by dotted name: empty if none was, None if nobody declared it."""
    lab_searched: bool = False
    """True if a lab's catalogue was searched, and names no study or calibration with held-out readings."""
    readings_data: DataKind
    """Origin of the readings; only measured data can validate."""
    readings_dialect: str
    """Format of the sheet as it was understood, in a sentence."""
    photo_data: DataKind
    """Origin of the photo or the mesh."""
    simulated_underfill_mm3: float
    """Room between the simulated level and the mouth, over the covered length."""
    simulated_overfill_mm3: float
    """Heap between the mouth and the simulated level, over the covered length."""
    simulated_sealant_mm3: float
    """Sealant under the simulated level, over the covered length."""
    simulated_fill_ratio: float
    """Share of the cavity filled over the covered length, simulated."""
    measured_underfill_mm3: float
    """Room between the measured level and the mouth, over the covered length."""
    measured_overfill_mm3: float
    """Heap between the mouth and the measured level, over the covered length."""
    measured_sealant_mm3: float
    """Sealant under the measured level, over the covered length."""
    measured_fill_ratio: float
    """Share of the cavity filled over the covered length, measured."""


class MassBalance(JsonRecord):
    """Volumes of the settled sealant beside that of the readings."""

    dispensed_mm3: float
    """Dispensed volume."""
    in_crack_mm3: float
    """Space that the settled particles fill, the part with centres at or below the face's plane."""
    above_mm3: float
    """Space that the settled particles fill, the part with centres above the face's plane."""
    spilled_mm3: float
    """Dispensed sealant over the sample's edge."""
    lost_mm3: float
    """Dispensed less filled space less spilled sealant: volume lost by the numerics; below 0, gained."""
    footprint_mm2: float
    """Area of the face beside the mouth that is under sealant."""
    readings_mm3: float
    """Sealant below the measured level, over the covered length."""
    readings_state: Literal["wet", "cured"] | None
    """Declared state of the sealant when it was read; None if nobody declared it."""
    shrinkage_percent: float | None = in_unit("%")
    """Declared shrinkage until it was read; None if nobody declared it."""
    readings_when_dispensed_mm3: float
    """The same before the sealant shrank, if that is declared."""


class VolumeComparison(JsonRecord):
    """The readings beside the volumes of the run: the level that its volume alone would have, and the mass balance."""

    volume_balance_level_mm: float
    """Level at which the dispensed volume would lie flat in the whole crack: a baseline that needs no readings."""
    volume_balance_error_mm: float
    """Mean error of that level."""
    beats_volume_balance: bool
    """True if the mean error is smaller than that of that level."""
    mass_balance: MassBalance
    """Volumes of the settled sealant beside that of the readings."""


class StationBands(JsonRecord):
    """Half-widths of 95 % bands of the stations' levels by the readings, (n,) each."""

    s_mm: Numbers
    """Places of the stations along the crack."""
    band_95_mm: Numbers
    """Half-width for each station by itself; of twenty stations, one lies outside by chance."""
    profile_band_95_mm: Numbers
    """Half-width for all stations together, which holds at all of them at once in 95 %."""


@with_config(PART)
@dataclass(frozen=True)
class BudgetPart:
    """One error of the budget, and its standard uncertainty of three figures: half the half-width of 95 % by it alone.

    What is not declared has that of 0.2 mm of it.
    """

    name: str
    """Name in words."""
    setting: str
    """Key of the trial file that declares it; empty for an error that none declares."""
    source: str
    """Origin of its size: repeats, detected, declared, allowed for, assumed or computed."""
    kind: str
    """readings, numerics or inputs."""
    mean_level_mm: float
    """Standard uncertainty of the mean level, and so of the bias."""
    mean_error_mm: float
    """Standard uncertainty of the mean error, if the error keeps its sign."""
    station_mm: float
    """Standard uncertainty of the level at one station, root mean square over them."""


class BudgetSummary(JsonRecord):
    """All errors of a comparison, part by part."""

    parts: tuple[BudgetPart, ...]
    """Errors that the intervals include, each alone."""
    missing: tuple[BudgetPart, ...]
    """Errors that no data can show and nobody declared: what 0.2 mm of each would do."""
    scatter_known: bool
    """True if stations were read more than once, or the repeatability is declared."""
    notes: tuple[str, ...]
    """Sentences on outliers, and on stations that a probe cannot read."""


class MeanLevelBudget(JsonRecord):
    """Error of the mean level and the standard uncertainties of it, after ASME V&V 20."""

    error_mm: float
    """E: simulated minus measured mean level."""
    volume_level_mm: float | None
    """Level that volume gained by the numerics makes, or lost, below 0: that volume over the area of the fluid's
    surface. It is in E. None if the particles are not known."""
    data_mm: float
    """Standard uncertainty by the readings."""
    numerics_mm: float | None
    """Standard uncertainty by the numerics: the particles' size, the scatter of single runs, and volume gained or lost;
    None without runs of three sizes."""
    inputs_mm: float | None
    """Standard uncertainty by the declared inputs; None if none was varied."""
    validation_mm: float
    """The standard uncertainty by all that are known together: u_val if numerics and inputs are."""
    resolved: bool | None
    """True if |E| is larger than twice u_val, False if the two are consistent; None until numerics and all declared
    inputs are known."""
    inputs_waiting: bool
    """True if inputs are declared that no run has varied yet."""


class StationErrors(JsonRecord):
    """Error of the level at each station and the standard uncertainties of it, (n,) each."""

    s_mm: Numbers
    """Places of the stations along the crack."""
    error_mm: Numbers
    """Simulated minus measured level."""
    data_mm: Numbers
    """Standard uncertainty by the readings."""
    numerics_mm: Numbers | None
    """Standard uncertainty by the numerics; None if it is not known."""
    inputs_mm: Numbers | None
    """Standard uncertainty by the declared inputs; None if none was varied."""
    validation_mm: Numbers
    """Standard uncertainty by all of them that are known."""
    profile_mm: Numbers
    """Half the 95 % band by all of them that holds at all stations together."""
    by_chance: float
    """Number of stations outside their own bands that a perfect model would have on average."""

    @property
    def above(self) -> NDArray[np.bool_]:
        """True where E lies outside the band of the station by itself."""
        return np.abs(self.error_mm) > 2 * self.validation_mm

    @property
    def off(self) -> NDArray[np.bool_]:
        """True where E lies outside the band that holds at all stations together."""
        return np.abs(self.error_mm) > self.profile_mm


@with_config(PART)
@dataclass(frozen=True)
class StationError:
    """The error at one station."""

    error_mm: float
    """Absolute error."""
    s_mm: float
    """Place of the station along the crack."""


@with_config(PART)
@dataclass(frozen=True)
class ShiftedError:
    """The comparison with the readings shifted along the crack."""

    shift_mm: float
    """Distance by which the readings are shifted."""
    mean_error_mm: float
    """Mean error with the readings shifted by ``shift_mm``."""
    bias_mm: float
    """Bias with the readings shifted by ``shift_mm``."""


class Alignment(JsonRecord):
    """The choice of s = 0, and the errors that other choices would give."""

    choice: str
    """Choice of s = 0, in a sentence."""
    shifts: tuple[ShiftedError, ...]
    """Errors with the readings moved along the crack, since s = 0 is a choice."""


class SizeSeries(JsonRecord):
    """One number at three particle sizes."""

    values: tuple[float, ...] = in_unit("mm")
    """Mean over the runs of each size."""
    runs: tuple[int, ...]
    """Number of runs at each size, which differ in seed."""
    scatter: float = in_unit("mm")
    """Standard deviation of a single run."""
    order_95: tuple[float, float]
    """Ends of the 95 % range of the order of convergence, within 0.5 to 2."""
    band: float = in_unit("mm")
    """Half-width of 95 % of the middle size's error, without the scatter of single runs."""


@with_config(PART)
@dataclass(frozen=True)
class SizeStudy:
    """Mean level and mean error at three particle sizes, from the finest to the coarsest."""

    radii_mm: tuple[float, ...]
    """Radii of the particles; the trial's own is in the middle."""
    mean_level_mm: SizeSeries
    """Mean of the simulated level over the covered length."""
    mean_error_mm: SizeSeries
    """Mean error."""


class InputEffect(JsonRecord):
    """Change of the simulated level for an input that is larger by its standard uncertainty."""

    name: str
    """Key of the input in the table [uncertainty]."""
    standard: float = in_unit("that of the name")
    """Declared standard uncertainty, in the unit that the name ends with."""
    mean_level_mm: float
    """Change of the mean level."""
    largest_mm: float
    """Largest change of the level anywhere, as an absolute value."""
    share: float
    """Share of the mean level's variance by all inputs that this one makes alone: its first-order index."""
    model: str
    """Model that moved the input: particles, or slot for the fast model."""


class InputDrawsRecord(JsonRecord):
    """Runs of the fast model with all inputs drawn together."""

    runs: int
    """Number of runs, less that with the inputs as they are."""
    together: float
    """Share of the mean level's variance by these inputs that none makes alone."""
    unfit: tuple[str, ...]
    """Reasons why the case is outside the fast model's domain."""


class ErrorUncertainty(JsonRecord):
    """Intervals of the error, and the parts that they are made of."""

    mean_error_interval_mm: tuple[float, float]
    """Ends of the 95 % interval of the mean error by the readings."""
    bias_interval_mm: tuple[float, float]
    """Ends of the 95 % interval of the bias by the readings."""
    bias_systematic_mm: float
    """Standard uncertainty of the bias that more stations would not reduce."""
    levels: StationBands
    budget: BudgetSummary
    mean_level: MeanLevelBudget
    stations: StationErrors
    worst_at_a_station: StationError | None
    """Worst error at a station; None if the worst error of all is at one."""
    sentences: tuple[str, ...]
    """Conclusions that ASME V&V 20 allows, or that it is not assessed; and the names of the errors in none of them."""
    unused: tuple[str, ...] = ()
    """Sentences on declared errors that the readings contradict and that no interval includes."""
    alignment: Alignment
    numerics: SizeStudy | None
    """Mean level and mean error at three particle sizes; None if no other particle sizes were run."""
    inputs: tuple[InputEffect, ...]
    """Effects of the inputs that were varied."""
    input_draws: InputDrawsRecord | None
    """Runs of the fast model with all inputs drawn together; None if particles moved the inputs, or none was moved."""
    inputs_left_out: tuple[str, ...]
    """Names of the inputs without a declared uncertainty."""
    effect_scatter_mm: float | None
    """Standard deviation of an effect by the scatter of single runs; None if it is not known."""
    design_radius_mm: float | None
    """Radius of the particles in the runs of the effects; None if there are none."""
