"""The record of a trial's result: the keys of run.json, and of what a command answers.

Report page, PDF, report.json, terminal and studies read these records. The docstring of a figure is its description in
the published schema of report.json.
"""

from pathlib import Path
from typing import Literal

from pydantic import Field

from sealtwin.core.record_files import read_record
from sealtwin.core.records import DataKind, JsonRecord, Numbers, PathSource, WidthSource
from sealtwin.core.solid_figures import Span, WeighedCavity
from validate.comparison import ErrorUncertainty, InputEffect, LevelMetrics, StationError, VolumeComparison, in_unit
from validate.settings import Gate

COMPARISON, PREDICTION, EARLIER, RESULT = "comparison.json", "prediction.json", "earlier_trials.json", "run.json"
Outcome = Literal["passed", "failed", "undecided", "open"]
"""The result of a comparison (decision 0079).

passed: the gate is kept, and lies outside the interval of the mean error;
failed: the gate is missed, or a particle escaped;
undecided: the gate lies inside that interval, the readings are too few, or files were edited by hand;
open: no gate was declared.
"""


class SampleFigures(JsonRecord):
    """Figures of the digitised sample."""

    data: DataKind
    """Origin of the photo or the mesh."""
    length_mm: float
    """Length of the crack along its centreline."""
    mean_width_mm: float | None
    """Mean width of the crack; None of a path alone, which has no walls."""
    width_source: WidthSource
    """Source of the width."""
    width_95_mm: Span | None
    """Ends of the 95 % interval of a fitted mean width."""
    cavity_volume_mm3: float | None
    """Volume of the cavity below the face; None of a path alone."""
    cavity_volume_95_mm3: Span | None
    """Its ends at those of the mean width."""
    weighed: WeighedCavity | None
    """Cavity by a liquid that was weighed in, step by step; None if no liquid was weighed."""
    sealant_mm3: float
    """Sealant that the nozzle gives."""
    path_source: PathSource
    """Source of the crack's path."""
    scale_source: str
    """Source of the scale, in words."""
    mm_per_px: float | None
    """Scale at the middle of the crack; None of a mesh."""
    scale_uncertainty: float | None
    """Standard uncertainty of the scale as a share of it; None if it is not known."""
    scale_residual_mm: float | None
    """RMS misfit of the scale's control points; None if there are none."""
    camera_tilt_deg: float | None
    """Angle between the camera's axis and the face's normal; None if it is not known."""
    warnings: tuple[str, ...]
    """Remarks on photo and solid."""


class FluidFigures(JsonRecord):
    """Figures of the fluid run."""

    particles: int | None
    """Number of particles; None of the fast model, as are the next two."""
    escaped_particles: int | None
    """Number of particles that went through a wall; anything but 0 is a fault."""
    spilled_particles: int | None
    """Number of particles over the sample's edge."""
    unfit: tuple[str, ...] | None
    """Reasons why the fast model is unfit for the case; None of particles."""
    volume_ratio: float
    """Volume of the finished sealant over the volume given."""
    device: str
    """Device that computed the run."""
    warnings: tuple[str, ...]
    """Sentences on what is not sound of the fluid."""


class PredictedPart(JsonRecord):
    """One error of a predicted level, and its standard uncertainty: half the half-width of 95 % by it alone."""

    name: str
    """Name in words."""
    kind: str
    """numerics or inputs."""
    setting: str
    """Key of the trial file that declares it; empty for an error that none declares."""
    mean_level_mm: float
    """Standard uncertainty of the mean level."""
    place_mm: float
    """Standard uncertainty of the level at a place, root mean square along the crack."""


class PredictedLevel(JsonRecord):
    """The level of a run without readings, with its band by the numerics and by the declared inputs."""

    s_mm: Numbers
    """Places along the crack; the next five are at them."""
    level_mm: Numbers
    """Predicted level, from the face."""
    band_95_mm: Numbers
    """Half-width of the 95 % band at each place by itself."""
    profile_band_95_mm: Numbers
    """Half-width of the band that holds the whole level in 95 %."""
    numerics_mm: Numbers | None
    """Standard uncertainty by the numerics; None if they are not known."""
    inputs_mm: Numbers | None
    """Standard uncertainty by the inputs; None if none is declared."""
    mean_level_mm: float
    """Mean level along the crack."""
    mean_level_95_mm: tuple[float, float]
    """Ends of its 95 % interval."""
    parts: tuple[PredictedPart, ...]
    """All errors that the band is made of, each alone."""
    inputs: tuple[InputEffect, ...]
    """Effects of the inputs that were moved."""
    inputs_left_out: tuple[str, ...]
    """Names of the inputs without a declared uncertainty."""
    unfit: tuple[str, ...]
    """Reasons why the case is outside the domain of the fast model that moved the inputs."""


Quantity = Literal["mean_level_mm", "fill_ratio", "heap_mm2"]
"""Name of a quantity that is computed and read: mean level; share of the room below the face that is filled; heap above
the face in mm³ on each mm of crack."""


class EarlierTrial(JsonRecord):
    """A trial whose readings were measured and held out: what was computed and what was read, over the same length."""

    name: str
    """Name of the sample."""
    level_error_mm: float
    """Mean of computed minus read level."""
    computed_fill_ratio: float
    """Share of the room below the face that the computed level fills."""
    read_fill_ratio: float
    """The same of the read level."""
    computed_heap_mm2: float
    """Heap above the face by the computed level, in mm³ on each mm of crack."""
    read_heap_mm2: float
    """The same by the read level."""


class Bias(JsonRecord):
    """Error of one quantity over several trials."""

    quantity: Quantity
    """mean_level_mm, fill_ratio or heap_mm2."""
    relative: bool
    """True if bias is a factor and scatter a share; else both are in the quantity's unit."""
    bias: float = in_unit("that of the quantity; 1 if relative")
    """Computed minus read, mean over the trials; if relative, computed over read, geometric mean."""
    scatter: float = in_unit("that of the quantity; 1 if relative")
    """Standard deviation of that from trial to trial; if relative, of its logarithm. It includes errors of readings."""
    trials: int
    """Number of trials."""


OF_QUANTITY = in_unit("that of the quantity")


class Expectation(Bias):
    """Value of a quantity that the readings of a new trial should find."""

    computed: float = OF_QUANTITY
    """Value that was computed for this trial."""
    expected: float = OF_QUANTITY
    """The same less the bias, or over it if it is a factor."""
    expected_95: tuple[float, float] = OF_QUANTITY
    """Ends of the 95 % interval for the next trial's readings, by Student's t."""


class EarlierTrials(JsonRecord):
    """A lab's earlier trials, and what they make of this one."""

    trials: tuple[EarlierTrial, ...]
    """Latest trial of each other sample of the lab that counts."""
    expectations: tuple[Expectation, ...]
    """Value that each quantity should have by them."""


class Comparison(LevelMetrics):
    """A simulated level compared with a measured one, and the verdict on it."""

    headline: tuple[str, ...] = ()
    """Sentences on the gate, on the baselines, and on what the readings were used for before."""
    outcome: Outcome = "open"
    """passed, failed, undecided or open: the gate against the mean error and its 95 % interval."""
    passed: bool | None = None
    """True if the mean error keeps the gate; None without a gate, False if a particle escaped."""
    gate: Gate | None = None
    """The limit that was declared before the run; None if there is none."""
    findings: tuple[str, ...] = ()
    """Conclusions that ASME V&V 20 allows, or that it is not assessed; without a verdict, declared errors that are not
    used alone."""
    volumes: VolumeComparison | None = None
    """The readings beside the volumes of the run; None if the comparison was not assessed beside a run."""
    uncertainty: ErrorUncertainty | None = None
    """Intervals and their parts; None if the comparison was not assessed."""

    @property
    def verdict(self) -> str:
        """The headline as one text."""
        return " ".join(self.headline)

    @property
    def interval_95_mm(self) -> tuple[float, float] | None:
        """Ends of the mean error's 95 % interval by the readings in mm; None if it was not assessed."""
        return None if self.uncertainty is None else self.uncertainty.mean_error_interval_mm

    @property
    def worst_at_a_station(self) -> StationError | None:
        """Worst error at a station; None if the worst error of all is at one, or was not assessed."""
        return None if self.uncertainty is None else self.uncertainty.worst_at_a_station


class ComputedBy(JsonRecord):
    """Version and stage numbers that computed a stage."""

    sealtwin: str | None = None
    """Version of the package; None if it was not recorded."""
    stage_numbers: dict[str, int]
    """Number of each stage up to this one."""


class TrialResult(JsonRecord):
    """Result of a trial: what its run folder contains. A part is None if its stage is not finished."""

    version: Literal[2] = 2
    """Version of this form."""
    name: str
    """Name of the trial."""
    folder: str
    """Run folder."""
    wall_time_s: float
    """Computing time of all finished stages."""
    stages: tuple[str, ...]
    """Finished stages."""
    computed_by: dict[str, ComputedBy] = Field(default_factory=dict)
    """Version and numbers by finished stage."""
    other_versions: tuple[str, ...] = ()
    """A sentence if other stage numbers than this version's computed a stage."""
    edited: tuple[str, ...] = ()
    """Files that are not as their stage wrote them."""
    sample: SampleFigures | None = None
    """Figures of digitise."""
    fluid: FluidFigures | None = None
    """Figures of simulate."""
    report: str | None = None
    """Path of the report's page."""
    comparison: Comparison | None = None
    """Comparison with the readings, as in comparison.json; None without readings."""
    prediction: PredictedLevel | None = None
    """Level of a run without readings, as in prediction.json; None with readings, or without extra runs."""
    earlier_trials: EarlierTrials | None = None
    """The lab's earlier trials, as in earlier_trials.json; None with fewer than two that count."""

    @property
    def numbers(self) -> dict[str, int]:
        """Stage numbers that the comparison was computed by; empty without one."""
        by = self.computed_by.get("validate")
        return {} if by is None else by.stage_numbers


def read_result(folder: Path) -> TrialResult:
    """Read run.json. Raises InputError, naming the key that does not fit."""
    return read_record(
        TrialResult, folder / RESULT, "Delete it; the next command that runs a stage there writes it anew.", strict=True
    )


def read_comparison(folder: Path) -> Comparison:
    """Read comparison.json of a run folder. Raises InputError, naming the key that does not fit."""
    return read_record(Comparison, folder / COMPARISON, strict=True)
