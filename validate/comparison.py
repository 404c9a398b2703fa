"""Results of comparing a simulated level with a measured one: errors, coverage, volumes, baselines and the verdict.

The docstring of a figure is its description in the published schema of report.json.
"""

from dataclasses import dataclass
from typing import Literal

from pydantic import ConfigDict, with_config

from sealtwin.core.facts import Facts, texts
from sealtwin.core.record_files import Amount, Positive
from sealtwin.core.records import DataKind, Floats, JsonRecord, Numbers
from sealtwin.core.run_figures import Known
from sealtwin.core.scan_figures import ScanFigures
from validate.intervals import PART, ErrorUncertainty, StationError, in_unit
from validate.settings import Gate, Role

Outcome = Literal["passed", "failed", "undecided", "open"]
"""The result of a comparison.

passed: the mean error is within the gate, and its interval does not contain the gate;
failed: the mean error exceeds the gate, and its interval does not contain the gate, or a particle escaped;
undecided: the interval contains the gate, there are too few readings, or files were edited by hand;
open: no gate was declared."""


@with_config(PART)
@dataclass(frozen=True)
class ErrorFigures:
    """Exact errors (simulated minus measured level) over the stretch that both curves cover."""

    mean_error_mm: Amount
    """Mean absolute error: the area between the simulated and the measured level, divided by the covered length."""
    bias_mm: float
    """Mean of simulated minus measured level."""
    worst_error_mm: Amount
    """Largest absolute error."""
    worst_at_mm: float
    """Position of the largest error along the crack."""
    share_under_1_mm: float
    """Fraction of the covered length with an error below 1 mm."""
    flat_level_mm: float
    """Constant level with the smallest mean error against the readings, as a baseline."""
    flat_level_error_mm: float
    """Mean error of the constant level ``flat_level_mm`` against the readings."""


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
    """Mean absolute error over the covered length. None if nothing is covered."""


class CurveDistances(JsonRecord):
    """Further measures of the distance between the two levels."""

    area_mm2: float
    """Exact area between the two levels."""
    area_similaritymeasures_mm2: float
    """Area between the two levels, computed by the library that the paper used."""
    rmse_mm: float
    """Root mean square error."""
    p95_error_mm: float
    """95th percentile of the absolute error over the length."""
    frechet_mm: Known
    """Fréchet distance of the two levels."""
    by_bin: tuple[ErrorBin, ...]
    """Mean absolute error in each 10 mm of the crack, as in the report's histogram."""


class ComparedStations(JsonRecord):
    """Stations on the stretch that both levels cover, with both levels, (n,) each."""

    s_mm: Numbers
    """Positions of the stations along the crack."""
    measured_mm: Numbers
    """Measured level."""
    simulated_mm: Numbers
    """Simulated level."""

    @property
    def error_mm(self) -> Floats:
        """Simulated minus measured level."""
        return self.simulated_mm - self.measured_mm


class Basis(JsonRecord):
    """Stretch that is compared, and the numbers of stations on it."""

    covered_from_mm: float
    """Position along the crack at which the comparison begins."""
    covered_to_mm: float
    """Position along the crack at which the comparison ends."""
    covered_length_mm: Positive
    """Length of the compared stretch."""
    length_mm: float
    """Length of the crack along its centreline."""
    coverage: float = in_unit("1")
    """Fraction of the crack's length that is compared."""
    stations_compared: int
    """Number of stations on the stretch that both curves cover."""
    stations_beyond_mm: Numbers
    """Positions of the stations outside the stretch that both curves cover."""
    stations_used: int
    """Number of stations that define the measured line on the compared stretch: those on the stretch, and the next one
    beyond each end."""
    widest_gap_mm: float
    """Largest distance from one station to the next."""
    enough_readings: bool
    """True if the readings allow a verdict: enough stations, close enough together, over enough of the crack."""


class ReadingsScatter(JsonRecord):
    """Scatter of repeated readings, pooled over the stations."""

    stations: int
    """Number of stations."""
    readings: int
    """Number of single readings."""
    degrees_of_freedom: int
    """Number of single readings minus the number of stations."""
    repeatability_sd_mm: float | None
    """Standard deviation of a single reading. None if no station was read more than once."""


@with_config(PART)
@dataclass(frozen=True)
class Baseline:
    """A simpler level that is compared with the same readings over the same stretch."""

    name: str
    """Name of the level, in words."""
    numbers: int
    """Number of coefficients that were fitted to these readings. It is 0 for a level that was made without them."""
    mean_error_mm: float
    """Mean error of the level against the readings."""


class FilledVolumes(JsonRecord):
    """Volumes below and above a level, over a stretch of the crack."""

    underfill_mm3: float
    """Unfilled volume between the level and the mouth."""
    overfill_mm3: float
    """Volume above the mouth and below the level."""
    sealant_mm3: float
    """Volume of sealant below the level."""
    fill_ratio: float
    """Fraction of the cavity that is below the level."""


class MassBalance(JsonRecord):
    """Volumes of the settled sealant, and the volume below the measured level."""

    dispensed_mm3: float
    """Dispensed volume."""
    in_crack_mm3: float
    """Volume of the settled particles whose centres are at or below the plane of the face."""
    above_mm3: float
    """Volume of the settled particles whose centres are above the plane of the face."""
    spilled_mm3: float
    """Volume of dispensed sealant that ran over the sample's edge."""
    lost_mm3: float
    """Volume that the numerics lost: dispensed minus settled minus spilled volume. It is negative if they gained
    volume."""
    footprint_mm2: float
    """Area of the face outside the mouth that sealant covers."""
    readings_mm3: float
    """Volume of sealant below the measured level, over the covered length."""
    readings_state: Literal["wet", "cured"] | None
    """Declared state of the sealant at the time of the reading. None if it was not declared."""
    shrinkage_percent: float | None = in_unit("%")
    """Declared shrinkage before the reading. None if it was not declared."""
    readings_when_dispensed_mm3: float
    """Volume, before shrinkage, of the sealant below the measured level. It equals ``readings_mm3`` if no shrinkage is
    declared."""


class VolumeComparison(JsonRecord):
    """Level that the dispensed volume predicts without a simulation, and the volume balance of run and readings."""

    volume_balance_level_mm: float
    """Flat level of the dispensed volume in the whole crack, as a baseline that needs no readings."""
    volume_balance_error_mm: float
    """Mean error of this flat level against the readings."""
    beats_volume_balance: bool
    """True if the mean error is smaller than the mean error of the flat level."""
    mass_balance: MassBalance
    """Volumes of the settled sealant, and the volume below the measured level."""


class Comparison(JsonRecord):
    """Comparison of a simulated with a measured level, over the stretch that both cover, and the verdict."""

    model_config = ConfigDict(allow_inf_nan=False)

    errors: ErrorFigures
    """Exact errors of the simulated level."""
    distances: CurveDistances
    """Further measures of the distance between the two levels."""
    basis: Basis
    """Stretch that is compared, and the numbers of stations on it."""
    stations: ComparedStations
    """Stations on the compared stretch, with both levels."""
    simulated_volumes: FilledVolumes
    """Volumes below and above the simulated level, over the covered length."""
    measured_volumes: FilledVolumes
    """Volumes below and above the measured level, over the covered length."""
    baselines: tuple[Baseline, ...] = ()
    """Simpler levels for comparison. They include the best curves through the readings unless the readings were held
    out. Unless settings were fitted to the readings, they include levels made without the readings: the flat level of
    the dispensed volume and, after extra runs, the level of the fast model."""
    beats_baseline: bool | None = None
    """True if the mean error is smaller than the mean error of every baseline that has at most as many coefficients as
    settings were fitted. None if there is no such baseline."""
    scatter: ReadingsScatter
    """Scatter of the repeated readings."""
    scan: ScanFigures | None = None
    """Figures of the scan from which the level was read. None for caliper readings."""
    role: Role
    """Use of the readings: for calibrating the fluid, or held out."""
    fitted: tuple[str, ...] | None = None
    """Dotted names of the settings that were fitted to these readings. Empty if no setting was fitted, None if this was
    not declared."""
    readings_data: DataKind
    """Origin of the readings. Only measured data can validate."""
    readings_dialect: str
    """Sentence that describes how the sheet of readings was interpreted."""
    readings_remarks: tuple[str, ...] = ()
    """Remarks on the readings: texts and marks beside them, and readings that may be slips. They were read all the
    same."""
    photo_data: DataKind
    """Origin of the photo or the mesh."""
    escaped_particles: int
    """Number of particles that passed through a wall. If it is not 0, the figures are invalid."""
    headline: Facts = ()
    """Findings about the gate, the baselines and the earlier use of the readings."""
    outcome: Outcome = "open"
    """Result of the comparison, from the gate, the mean error and its 95 % interval."""
    passed: bool | None = None
    """True if the mean error is within the gate. False if it exceeds the gate, or if a particle escaped. None if there
    is no gate."""
    gate: Gate | None = None
    """Limit that was declared before the run. None if no limit was declared."""
    findings: Facts = ()
    """Conclusions that ASME V&V 20 allows, or the reason why it was not assessed. Without a verdict, only the declared
    errors that are not used."""
    volumes: VolumeComparison | None = None
    """Volumes of the run and of the readings. None if no run was assessed."""
    uncertainty: ErrorUncertainty | None = None
    """Intervals of the error, and the parts that cause them. None if the comparison was not assessed."""

    def __eq__(self, other: object) -> bool:
        return self is other  # Arrays cannot be compared as a whole

    def __hash__(self) -> int:
        return id(self)

    @property
    def verdict(self) -> str:
        """The headline as a single text."""
        return " ".join(texts(self.headline))

    @property
    def interval_95_mm(self) -> tuple[float, float] | None:
        """Ends of the mean error's 95 % interval due to the readings, in mm. None if it was not assessed."""
        return None if self.uncertainty is None else self.uncertainty.mean_error_interval_mm

    @property
    def worst_at_a_station(self) -> StationError | None:
        """Largest error at a station. None if the overall largest error is at a station, or was not assessed."""
        return None if self.uncertainty is None else self.uncertainty.worst_at_a_station

    @property
    def mean_error_mm(self) -> float:
        """Mean absolute error of the simulated level."""
        return self.errors.mean_error_mm

    @property
    def bias_mm(self) -> float:
        """Mean of simulated minus measured level."""
        return self.errors.bias_mm

    @property
    def worst_error_mm(self) -> float:
        """Largest absolute error."""
        return self.errors.worst_error_mm

    @property
    def worst_at_mm(self) -> float:
        """Position of the largest error along the crack."""
        return self.errors.worst_at_mm
