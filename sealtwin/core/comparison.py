"""Records of a comparison between a simulated and a measured level: what comparison.json holds, key by key.

The docstring of a figure is also its meaning in report.json and its description in the published schema.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sealtwin.core.records import DataKind, Floats, JsonRecord, Known

Role = Literal["calibrated-on", "held-out", "undeclared"]
"""Use of the readings: the fluid was tuned on them, so that the error is a residual and no test; it was not; or it is
undeclared. Only held-out readings can validate.
"""

Outcome = Literal["passed", "failed", "undecided", "open"]
"""The result of a comparison (decision 0079).

passed: the gate is kept, and lies outside the interval of the mean error;
failed: the gate is missed, or a particle escaped;
undecided: the gate lies inside that interval, the readings are too few, or files were edited by hand;
open: no gate was declared.
"""


class ErrorBin(JsonRecord):
    """Mean absolute error over a stretch of the crack."""

    from_mm: float
    """Beginning of the stretch, along the crack from the end where the nozzle starts."""
    to_mm: float
    """End of the stretch."""
    covered_mm: float
    """Length of the stretch that both curves cover."""
    mean_error_mm: Known
    """Mean absolute error over the covered length; None where nothing is covered."""


class ReadingsScatter(JsonRecord):
    """Scatter of repeated readings, pooled over the stations."""

    stations: int
    readings: int
    degrees_of_freedom: int
    repeatability_sd_mm: float | None
    """Standard deviation of a single reading; None without repeats."""


class Baseline(JsonRecord):
    """A level along the crack that no simulation made, held against the same readings over the same stretch."""

    name: str
    """Name in words."""
    numbers: int
    """Number of its coefficients that were fitted to these readings; 0 for a level that has not seen them."""
    mean_error_mm: float
    """Mean error of that level."""


class LevelMetrics(JsonRecord):
    """Figures of simulated minus measured level over the stretch that both curves cover, all exact integrals."""

    mean_error_mm: float
    """Area between the simulated and the measured level over the covered length."""
    worst_error_mm: float
    """Largest absolute error."""
    worst_at_mm: float
    """Place of the largest error along the crack."""
    covered_from_mm: float
    """Place along the crack where the comparison begins."""
    covered_to_mm: float
    """Place along the crack where the comparison ends."""
    covered_length_mm: float
    """Length that is compared."""
    coverage: float
    """Share of the crack's length that is compared."""
    length_mm: float
    """Length of the crack along its centreline."""
    stations_compared: int
    """Number of stations on the stretch that both curves cover."""
    stations_beyond_mm: Floats
    """Places of the stations beyond that stretch."""
    stations_used: int
    """Number of stations that shape the readings' line there, one just beyond either end included."""
    widest_gap_mm: float
    """Largest distance from one station to the next."""
    enough_readings: bool
    escaped_particles: int
    area_mm2: float
    """Area between the two levels, exact."""
    area_similaritymeasures_mm2: float
    """Area between the two levels by the library that the paper used."""
    area_difference_mm2: float
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
    start_zone_error_mm: Known
    """Mean error over the first bin."""
    end_zone_error_mm: Known
    """Mean error over the last bin."""
    flat_level_mm: float
    """Constant level that is nearest to the readings: a baseline."""
    flat_level_error_mm: float
    """Mean error of that constant level."""
    beats_flat_level: bool
    baselines: tuple[Baseline, ...] = ()
    """Levels without a simulation: of readings that were calibrated on, the best curves through them; of held-out ones,
    levels that have not seen them."""
    beats_baseline: bool | None = None
    """True if the mean error is smaller than that of each baseline with no more numbers than settings were fitted; None
    without such a baseline."""
    readings: ReadingsScatter
    role: Role
    fitted: tuple[str, ...] | None = None
    """Settings that were fitted to these readings, by dotted name: empty if none was, None if nobody declared it."""
    lab_searched: bool = False
    """True if a lab's catalogue was searched, and names no study or calibration with held-out readings."""
    readings_data: DataKind
    readings_dialect: str
    photo_data: DataKind
    simulated_underfill_mm3: float
    """Room between the simulated level and the mouth, over the covered length."""
    simulated_overfill_mm3: float
    """Heap between the mouth and the simulated level, over the covered length."""
    simulated_sealant_mm3: float
    simulated_fill_ratio: float
    """Share of the cavity filled over the covered length, simulated."""
    measured_underfill_mm3: float
    """Room between the measured level and the mouth, over the covered length."""
    measured_overfill_mm3: float
    """Heap between the mouth and the measured level, over the covered length."""
    measured_sealant_mm3: float
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
    shrinkage_percent: float | None
    readings_when_dispensed_mm3: float
    """The same before the sealant shrank, where that is declared."""


class VolumeComparison(JsonRecord):
    """The readings beside the volumes of the run: the level that its volume alone would have, and the mass balance."""

    volume_balance_level_mm: float
    """Level at which the dispensed volume would lie flat in the whole crack: a baseline that needs no readings."""
    volume_balance_error_mm: float
    """Mean error of that level."""
    beats_volume_balance: bool
    mass_balance: MassBalance


class StationBands(JsonRecord):
    """Half-widths of 95 % bands of the stations' levels by the readings, (n,) each."""

    s_mm: Floats
    band_95_mm: Floats
    """Half-width for each station by itself; of twenty stations, one lies outside by chance."""
    profile_band_95_mm: Floats
    """Half-width for all stations together, which holds at all of them at once in 95 %."""


class BudgetPart(JsonRecord):
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
    """Standard uncertainty of the mean error, where the error keeps its sign."""
    station_mm: float
    """Standard uncertainty of the level at one station, root mean square over them."""


class BudgetSummary(JsonRecord):
    """All errors of a comparison, part by part."""

    parts: tuple[BudgetPart, ...]
    missing: tuple[BudgetPart, ...]
    """Errors that no data can show and nobody declared: what 0.2 mm of each would do."""
    scatter_known: bool
    notes: tuple[str, ...]
    """Sentences on outliers, and on stations that a probe cannot read."""


class ErrorBudget(JsonRecord):
    """Error of the mean level and the standard uncertainties of it, after ASME V&V 20."""

    error_mm: float
    """E: simulated minus measured mean level."""
    volume_level_mm: float | None
    """Level that volume gained by the numerics makes, or lost, below 0: that volume over the area of the fluid's
    surface. It is in E. None where the particles are not known."""
    data_mm: float
    """Standard uncertainty by the readings."""
    numerics_mm: float | None
    """Standard uncertainty by the numerics: the particles' size, the scatter of single runs, and volume gained or lost;
    None where there are not several runs at each of three sizes."""
    inputs_mm: float | None
    """Standard uncertainty by the declared inputs; None where none was varied."""
    validation_mm: float
    """The standard uncertainty by all that are known together: u_val where numerics and inputs are."""
    resolved: bool | None
    """True if |E| is larger than twice u_val, False if the two are consistent; None until numerics and all declared
    inputs are known."""


class MeanLevelBudget(ErrorBudget):
    """Error of the mean level, as comparison.json has it."""

    inputs_waiting: bool
    """True if inputs are declared that no run has varied yet."""


class StationErrors(JsonRecord):
    """Error of the level at each station and the standard uncertainties of it, (n,) each."""

    s_mm: Floats
    error_mm: Floats
    data_mm: Floats
    numerics_mm: Floats | None
    inputs_mm: Floats | None
    validation_mm: Floats
    profile_mm: Floats
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


class ShiftedError(JsonRecord):
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
    shifts: tuple[ShiftedError, ...]


class SizeSeries(JsonRecord):
    """One number at three particle sizes."""

    values: tuple[float, ...]
    """Mean over the runs of each size."""
    runs: tuple[int, ...]
    """Number of runs at each size, which differ in seed."""
    scatter: float | None
    """Standard deviation of a single run; None where each size was run once, as are the next two."""
    order_95: tuple[float, float] | None
    """Ends of the 95 % range of the order of convergence, within 0.5 to 2."""
    band: float | None
    """Half-width of 95 % of the middle size's error, without the scatter of single runs."""


class SizeStudy(JsonRecord):
    """Mean level and mean error at three particle sizes, from the finest to the coarsest."""

    radii_mm: tuple[float, ...]
    mean_level_mm: SizeSeries
    mean_error_mm: SizeSeries


class InputEffect(JsonRecord):
    """Change of the simulated level for an input that is larger by its standard uncertainty."""

    name: str
    standard: float
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
    together: float
    """Share of the mean level's variance by these inputs that none makes alone."""
    unfit: tuple[str, ...]
    """Reasons why the case is outside the fast model's domain."""


class ErrorUncertainty(JsonRecord):
    """Intervals of the error, and the parts that they are made of; comparison.json names each by its figure."""

    mean_error_interval_mm: tuple[float, float] = Field(serialization_alias="mean_error_mm")
    """Ends of the 95 % interval of the mean error by the readings."""
    bias_interval_mm: tuple[float, float] = Field(serialization_alias="bias_mm")
    """Ends of the 95 % interval of the bias by the readings."""
    bias_systematic_mm: float
    """Standard uncertainty of the bias that more stations would not reduce."""
    levels: StationBands
    budget: BudgetSummary
    mean_level: MeanLevelBudget
    stations: StationErrors
    sentences: tuple[str, ...]
    """Conclusions that ASME V&V 20 allows, or that it is not assessed; and the names of the errors in none of them."""
    unused: tuple[str, ...] = ()
    """Those of the sentences on declared errors that the readings contradict and that no interval has."""
    alignment: Alignment
    numerics: SizeStudy | None
    """None where no other particle sizes were run."""
    inputs: tuple[InputEffect, ...]
    input_draws: InputDrawsRecord | None
    """None where particles moved the inputs, or none was moved."""
    inputs_left_out: tuple[str, ...]
    """Names of the inputs without a declared uncertainty."""
    effect_scatter_mm: float | None
    design_radius_mm: float | None


@dataclass(frozen=True)
class Comparison:
    """A simulated level compared with a measured one, and the verdict on it."""

    metrics: LevelMetrics
    uncertainty: ErrorUncertainty | None = None
    """None where the comparison was not assessed."""
    volumes: VolumeComparison | None = None
    """None where the comparison was not assessed beside a run."""
    mean_error_limit_mm: float | None = None
    """The declared gate; None where the trial declares none."""
    gate_reason: str = ""
    """Reason of the gate, in its user's words; empty where none is declared."""
    passed: bool | None = None
    """True if the mean error keeps the gate; None without a gate, False where a particle escaped."""
    outcome: Outcome = "open"
    headline: tuple[str, ...] = ()
    """Sentences on the gate, on the baselines, and on what the readings were used for before."""
    findings: tuple[str, ...] = ()
    """Conclusions that ASME V&V 20 allows, or that it is not assessed; without a verdict, declared errors that are not
    used alone."""

    @property
    def verdict(self) -> str:
        """The headline as one text."""
        return " ".join(self.headline)

    @property
    def mean_error_mm(self) -> float:
        """Area between the two levels over the covered length, in mm."""
        return self.metrics.mean_error_mm

    @property
    def worst_error_mm(self) -> float:
        """Largest absolute error, in mm."""
        return self.metrics.worst_error_mm

    @property
    def worst_at_mm(self) -> float:
        """Place of the largest error along the crack, in mm."""
        return self.metrics.worst_at_mm

    @property
    def interval_95_mm(self) -> tuple[float, float] | None:
        """Ends of the mean error's 95 % interval by the readings in mm; None where it was not assessed."""
        return None if self.uncertainty is None else self.uncertainty.mean_error_interval_mm

    def content(self) -> dict[str, Any]:
        """Return the content of comparison.json."""
        gate = {"mean_error_mm": self.mean_error_limit_mm, "reason": self.gate_reason}
        return {
            "verdict": self.verdict,
            "headline": self.headline,
            "outcome": self.outcome,
            "passed": self.passed,
            "gate": {} if self.mean_error_limit_mm is None else gate,
            "findings": self.findings,
            **self.metrics.model_dump(),
            **({} if self.volumes is None else self.volumes.model_dump()),
            **({} if self.uncertainty is None else {"uncertainty": self.uncertainty.model_dump(by_alias=True)}),
        }
