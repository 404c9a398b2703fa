"""Record of a trial's result: the keys of run.json, and of the answer of a command.

Report page, PDF, report.json, terminal and studies read these records. The docstring of a figure is its description in
the published schema of report.json.
"""

from pathlib import Path
from typing import Literal

from pydantic import Field

from sealtwin.core.facts import Fact, texts
from sealtwin.core.record_files import read_record
from sealtwin.core.records import DataKind, JsonRecord, Numbers, PathSource, WidthSource
from sealtwin.core.solid_figures import Span, WeighedCavity
from validate.comparison import ErrorUncertainty, InputEffect, LevelMetrics, StationError, VolumeComparison
from validate.settings import Gate

COMPARISON, PREDICTION, RESULT = "comparison.json", "prediction.json", "run.json"
IF_SEVERAL = Field(default=None, exclude_if=lambda value: value is None)
"""Default of a field that is not written for a trial of one run."""
Outcome = Literal["passed", "failed", "undecided", "open"]
"""The result of a comparison.

passed: the gate is kept and is outside the interval of the mean error;
failed: the gate is missed and is outside the interval, or a particle escaped;
undecided: the gate is inside that interval, there are too few readings, or files were edited by hand;
open: no gate was declared.
"""


class SampleFigures(JsonRecord):
    """Figures of the digitised sample."""

    data: DataKind
    """Origin of the photo or the mesh."""
    length_mm: float
    """Length of the crack along its centreline."""
    mean_width_mm: float | None
    """Mean width of the crack; None for a path without walls."""
    width_source: WidthSource
    """Source of the width."""
    width_95_mm: Span | None
    """Ends of the 95 % interval of a fitted mean width."""
    cavity_volume_mm3: float | None
    """Volume of the cavity below the face; None for a path without walls."""
    cavity_volume_95_mm3: Span | None
    """Cavity volumes at the ends of the mean width's interval."""
    weighed: WeighedCavity | None
    """Cavity measured by weighing a liquid in it, step by step; None if no liquid was weighed."""
    sealant_mm3: float
    """Volume of sealant that the nozzle dispenses."""
    path_source: PathSource
    """Source of the crack's path."""
    scale_source: str
    """Source of the scale, in words."""
    mm_per_px: float | None
    """Scale at the middle of the crack; None for a mesh."""
    scale_uncertainty: float | None
    """Relative standard uncertainty of the scale; None if it is unknown."""
    scale_residual_mm: float | None
    """RMS misfit of the scale's control points; None if there are none."""
    camera_tilt_deg: float | None
    """Angle between the camera's axis and the face's normal; None if it is unknown."""
    warnings: tuple[Fact, ...]
    """Doubts about photo and solid."""


class FluidFigures(JsonRecord):
    """Figures of the fluid run."""

    particles: int | None
    """Number of particles; None for the fast model."""
    escaped_particles: int | None
    """Number of particles that passed through a wall; any number but 0 is a fault. None for the fast model."""
    spilled_particles: int | None
    """Number of particles that ran over the sample's edge; None for the fast model."""
    above_face_mm3: float
    """Volume of the settled sealant above the face's plane."""
    unfit: tuple[Fact, ...] | None
    """Reasons why the case is outside the fast model's domain; None for particles."""
    volume_ratio: float
    """Volume of the settled sealant divided by the dispensed volume."""
    device: str
    """Device that computed the run."""
    warnings: tuple[Fact, ...]
    """Faults of the fluid."""


class SeedRuns(JsonRecord):
    """Runs of a trial that differ only in the seed. The level of the trial is their mean."""

    seeds: tuple[int, ...]
    """Seed of each run. Particles, volumes and pictures are those of the first."""
    mean_level_mm: float
    """Mean of the level along the crack and over the runs."""
    scatter_mm: float
    """Standard deviation of a single run's level at one place: root mean square along the crack."""
    band_95_mm: float
    """Half-width of the 95 % band about the mean that holds one further run, at a place."""
    warnings: tuple[Fact, ...]
    """Faults of the fluid in the other runs, without those that the first run has as well."""


class PredictedPart(JsonRecord):
    """One error of a predicted level, and its standard uncertainty: half the half-width of its 95 % interval."""

    name: str
    """Name of the error, in words."""
    kind: str
    """Kind of the error: numerics, inputs or model."""
    setting: str
    """Key of the trial file that declares the error; empty if there is no such key."""
    mean_level_mm: float
    """Standard uncertainty of the mean level."""
    place_mm: float
    """Standard uncertainty of the level at one place: root mean square along the crack."""


class PredictedLevel(JsonRecord):
    """Level of a run without readings, with its band, which is due to the numerics and the declared inputs."""

    s_mm: Numbers
    """Positions along the crack at which level, bands and uncertainties are given."""
    level_mm: Numbers
    """Predicted level, measured from the face."""
    band_95_mm: Numbers
    """Half-width of the 95 % band of a single place."""
    profile_band_95_mm: Numbers
    """Half-width of the band that contains the whole level in 95 % of cases."""
    numerics_mm: Numbers | None
    """Standard uncertainty due to the numerics; None if it was not computed."""
    inputs_mm: Numbers | None
    """Standard uncertainty due to the inputs; None if no input is declared."""
    model_mm: Numbers | None = None
    """Standard uncertainty due to the model: at the ends of the path, for a fluid with a yield stress; by the meniscus,
    for a declared surface tension; and half of the difference of particles and fast model. None without all three."""
    fast_level_mm: Numbers | None = None
    """Level by the fast model; None if it is unfit, or computed ``level_mm``."""
    flat_level_mm: Numbers | None = None
    """Level of the dispensed volume lying flat in the crack."""
    mean_level_mm: float
    """Mean level along the crack."""
    mean_level_95_mm: tuple[float, float]
    """Ends of the mean level's 95 % interval."""
    parts: tuple[PredictedPart, ...]
    """All errors included in the band, one by one."""
    missing: tuple[PredictedPart, ...] = ()
    """Undeclared errors of the model, which the band does not include."""
    inputs: tuple[InputEffect, ...]
    """Effects of the varied inputs."""
    inputs_left_out: tuple[str, ...]
    """Names of the inputs without a declared uncertainty."""
    unfit: tuple[Fact, ...]
    """Reasons why the case is outside the domain of the fast model."""


class Comparison(LevelMetrics):
    """A simulated level compared with a measured one, and the verdict."""

    headline: tuple[Fact, ...] = ()
    """Findings on the gate, the baselines and the earlier use of the readings."""
    outcome: Outcome = "open"
    """passed, failed, undecided or open, according to the gate, the mean error and its 95 % interval."""
    passed: bool | None = None
    """True if the mean error keeps the gate; None without a gate, False if a particle escaped."""
    gate: Gate | None = None
    """Limit declared before the run; None if none was declared."""
    findings: tuple[Fact, ...] = ()
    """Conclusions that ASME V&V 20 allows, or why it is not assessed. Without a verdict, only declared errors that are
    not used."""
    volumes: VolumeComparison | None = None
    """Volumes of the run and of the readings; None if no run was assessed."""
    uncertainty: ErrorUncertainty | None = None
    """Intervals and their parts; None if the comparison was not assessed."""

    @property
    def verdict(self) -> str:
        """The headline as one text."""
        return " ".join(texts(self.headline))

    @property
    def interval_95_mm(self) -> tuple[float, float] | None:
        """Ends of the mean error's 95 % interval, which is due to the readings, in mm; None if it was not assessed."""
        return None if self.uncertainty is None else self.uncertainty.mean_error_interval_mm

    @property
    def worst_at_a_station(self) -> StationError | None:
        """Worst error at a station; None if the worst error overall is at a station, or was not assessed."""
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
    """Version of the form of this record."""
    name: str
    """Name of the trial."""
    folder: str
    """Path of the run folder."""
    wall_time_s: float
    """Computing time of all finished stages."""
    stages: tuple[str, ...]
    """Finished stages."""
    computed_by: dict[str, ComputedBy] = Field(default_factory=dict)
    """Version and stage numbers for each finished stage."""
    other_versions: tuple[str, ...] = ()
    """A sentence if a stage was computed with other stage numbers than this version's."""
    edited: tuple[str, ...] = ()
    """Files that were changed after their stage wrote them."""
    sample: SampleFigures | None = None
    """Figures of the digitised sample."""
    fluid: FluidFigures | None = None
    """Figures of the fluid run."""
    seeds: SeedRuns | None = IF_SEVERAL
    """Runs that differ only in the seed; left out if there is one run."""
    report: str | None = None
    """Path of the report's page."""
    comparison: Comparison | None = None
    """Comparison with the readings, as in comparison.json; None if there are no readings."""
    prediction: PredictedLevel | None = None
    """Level of a run without readings, as in prediction.json; None if there are readings, or no extra runs."""

    @property
    def numbers(self) -> dict[str, int]:
        """Stage numbers with which the comparison was computed; empty without a comparison."""
        by = self.computed_by.get("validate")
        return {} if by is None else by.stage_numbers


def read_result(folder: Path) -> TrialResult:
    """Read run.json. Raises InputError, naming the key that does not fit."""
    remedy = "Delete it; the next command that runs a stage in this folder writes it again."
    return read_record(TrialResult, folder / RESULT, remedy, strict=True)


def read_comparison(folder: Path) -> Comparison:
    """Read comparison.json of a run folder. Raises InputError, naming the key that does not fit."""
    return read_record(Comparison, folder / COMPARISON, strict=True)
