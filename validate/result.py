"""Record of a trial's result: the keys of run.json and report.json, and of a command's answer.

Report page, PDF, terminal and studies read these records. The docstring of a figure is its description in the published
schema of report.json, which ``python -m tests.support.report_schema`` prints.
"""

import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from sealtwin.core.facts import Facts, without
from sealtwin.core.record_files import read_record
from sealtwin.core.records import (
    DataKind,
    JsonRecord,
    Outline,
    PathSource,
    Profile,
    Run,
    Solid,
    Trajectory,
    WidthSource,
)
from sealtwin.core.run_folder import number_words
from sealtwin.core.solid_figures import Span, WeighedCavity
from sealtwin.core.vtk_files import Frame
from validate.comparison import Comparison, Outcome
from validate.intervals import PredictedLevel
from validate.units import PageTable

COMPARISON, PREDICTION, RESULT = "comparison.json", "prediction.json", "run.json"
SHOWN_REMARKS = 3  # Largest number of remarks on the readings that the first page and the terminal quote
IF_SEVERAL = Field(default=None, exclude_if=lambda value: value is None)
"""Default of a field that is not written for a trial with only one run."""
NOT_A_VALIDATION = "data.not-a-validation"  # Key of the caution about data that were not measured


class SampleFigures(JsonRecord):
    """Figures of the digitised sample."""

    data: DataKind
    """Origin of the photo or the mesh."""
    length_mm: float
    """Length of the crack along its centreline."""
    mean_width_mm: float | None
    """Mean width of the crack. None for a path without walls."""
    width_source: WidthSource
    """Method by which the width was determined."""
    width_95_mm: Span | None
    """Ends of the 95 % interval of the mean width, if it was fitted."""
    cavity_volume_mm3: float | None
    """Volume of the cavity below the face. None for a path without walls."""
    cavity_volume_95_mm3: Span | None
    """Volume of the cavity at each end of the mean width's 95 % interval."""
    weighed: WeighedCavity | None
    """Cavity measured by weighing a liquid in it, step by step. None if no liquid was weighed."""
    sealant_mm3: float
    """Volume of sealant that the nozzle dispenses."""
    path_source: PathSource
    """Method by which the crack's path was determined."""
    scale_source: str
    """Source of the scale, in words."""
    mm_per_px: float | None
    """Scale at the middle of the crack. None for a mesh."""
    scale_uncertainty: float | None
    """Relative standard uncertainty of the scale. None if it is unknown."""
    scale_residual_mm: float | None
    """RMS misfit of the scale's control points. None if there are none."""
    camera_tilt_deg: float | None
    """Angle between the camera's axis and the face's normal. None if it is unknown."""
    warnings: Facts
    """Warnings about the photo and the solid."""


class FluidFigures(JsonRecord):
    """Figures of the fluid run."""

    particles: int | None
    """Number of particles. None for the fast model."""
    escaped_particles: int | None
    """Number of particles that passed through a wall. Any number other than 0 is a fault. None for the fast model."""
    spilled_particles: int | None
    """Number of particles that ran over the sample's edge. None for the fast model."""
    above_face_mm3: float
    """Volume of the settled sealant above the plane of the face."""
    unfit: Facts | None
    """Reasons why the fast model is not valid for this case. None for particles."""
    volume_ratio: float
    """Volume of the settled sealant divided by the dispensed volume."""
    device: str
    """Device that computed the run."""
    warnings: Facts
    """Warnings about the fluid in the run, for example that it lost volume."""


class SeedRuns(JsonRecord):
    """Runs of a trial that differ only in the seed. The level of the trial is their mean."""

    seeds: tuple[int, ...]
    """Seed of each run. Particles, volumes and pictures are from the first run."""
    mean_level_mm: float
    """Mean of the level, along the crack and over the runs."""
    scatter_mm: float
    """Standard deviation of a single run's level at a position, as root mean square along the crack."""
    band_95_mm: float
    """Half-width of the 95 % band, about the mean, for the level of one further run at a position."""
    warnings: Facts
    """Faults of the fluid in the other runs, without faults that the first run also has."""


class ComputedBy(JsonRecord):
    """Version and stage numbers of the program that computed a stage."""

    sealtwin: str | None = None
    """Version of the package. None if it was not recorded."""
    stage_numbers: dict[str, int]
    """Number of each stage up to this one."""


class TrialResult(JsonRecord):
    """Result of a trial: the content of its run folder. A part is None if its stage is not finished."""

    version: Literal[2] = 2
    """Version of this record's format."""
    name: str
    """Name of the trial."""
    assumed: tuple[str, ...] = ()
    """Settings that were neither given nor measured, in words with their values."""
    folder: str
    """Path of the run folder."""
    wall_time_s: float
    """Computing time of all finished stages."""
    stages: tuple[str, ...]
    """Finished stages."""
    computed_by: dict[str, ComputedBy] = Field(default_factory=dict)
    """Version and stage numbers for each finished stage."""
    other_versions: tuple[str, ...] = ()
    """A sentence if a stage was computed with stage numbers that differ from this version's."""
    edited: tuple[str, ...] = ()
    """Files that were changed after their stage wrote them."""
    sample: SampleFigures | None = None
    """Figures of the digitised sample."""
    fluid: FluidFigures | None = None
    """Figures of the fluid run."""
    seeds: SeedRuns | None = IF_SEVERAL
    """Runs that differ only in the seed. Left out if there is only one run."""
    report: str | None = None
    """Path of the report page."""
    comparison: Comparison | None = None
    """Comparison with the readings, as in comparison.json. None if there are no readings."""
    prediction: PredictedLevel | None = None
    """Level of a run without readings, as in prediction.json. None if there are readings, or no extra runs."""

    @property
    def numbers(self) -> dict[str, int]:
        """Stage numbers with which the comparison was computed. Empty if there is no comparison."""
        by = self.computed_by.get("validate")
        return {} if by is None else by.stage_numbers


def read_result(folder: Path) -> TrialResult:
    """Read run.json. Raises InputError, which names the key that is not valid."""
    remedy = "Delete it. The next command that runs a stage in this folder writes it again."
    return read_record(TrialResult, folder / RESULT, remedy, strict=True)


def read_comparison(folder: Path) -> Comparison:
    """Read comparison.json of a run folder. Raises InputError, which names the key that is not valid."""
    return read_record(Comparison, folder / COMPARISON, strict=True)


class ReadingsSheet(JsonRecord):
    """File of the readings, as the report names it for the person who signs."""

    name: str
    """Name of the file, as given by the user or the lab."""
    sha256: str
    """SHA-256 hash of the file's content."""
    operator: str | None
    """Name of the person who took the readings. None if no note gives it."""
    date: str | None
    """Date of the readings, as written by the lab. None if no note gives it."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """One trial, with the results of its stages."""

    name: str
    note: str = ""
    assumed: tuple[str, ...] = ()  # Settings that were neither given nor measured, in words with their values
    outline: Outline
    solid: Solid
    trajectory: Trajectory
    run: Run
    profile: Profile  # The simulated level
    seeds: SeedRuns | None = None  # Runs whose mean is ``profile``. None if there is only one run.
    readings: Profile | None = None  # None if there is no caliper sheet. The report then shows only the simulation.
    comparison: Comparison | None = None  # Comparison of profile and readings. None if there are no readings.
    prediction: PredictedLevel | None = None  # Prediction of a run without readings. None if there are no extra runs.
    volume_ratio: float
    overlay_path: Path
    straight_path: Path  # Picture of the photo along the crack
    photo_data: DataKind
    provenance: dict[str, str]  # Versions, device, seed, times and hashes, in the order of the report
    commands: tuple[str, ...] = ()  # Commands that make this report again, in order
    sheet: ReadingsSheet | None = None  # File of the readings. None if there are no readings.
    edited: tuple[str, ...] = ()  # Files of the run that were changed after their stage wrote them
    can_be_varied: bool = False  # True if 'sealtwin validate RUN --uncertainty' adds something
    frames: tuple[Frame, ...] = ()  # Snapshots of the run, in order of time
    can_be_planned: bool = False  # True if 'sealtwin plan' accepts the sealant


def provenance(
    facts: dict[str, str], device: str, seed: Any, versions: dict[str, str], numbers: Mapping[str, int]
) -> dict[str, str]:
    """Return the origin of a report: program, machine, ``facts``, and the run's device, seed and versions.

    ``numbers`` are the stage numbers with which the results were computed.
    """
    return {
        "sealtwin": version("sealtwin"),
        "stage numbers": number_words(numbers),
        "system": f"{platform.system()} {platform.machine()}",
        **facts,
        "device": device,
        **({} if seed is None else {"seed": str(seed)}),
        **{name: text for name, text in versions.items() if name != "sealtwin"},
    }


class ErrorBar(JsonRecord):
    """One bar of a small bar chart."""

    name: str
    """Name of the level that has this error."""
    error_mm: float
    """Mean error against the same readings."""
    own: bool
    """True for the simulation, False for a baseline."""


class Tile(JsonRecord):
    """One of the four figures on the first page."""

    title: str
    """Question that the figure answers."""
    figure: str
    """The figure with its unit, or one word."""
    text: str
    """Meaning, interval or parts of the figure, in one or two sentences."""
    bars: tuple[ErrorBar, ...] = ()
    """Errors with which the figure is compared."""


class FirstPage(JsonRecord):
    """First page of the report, without its figure."""

    subject: str
    """Size of the crack and amount of sealant."""
    state: str
    """Verdict in a few words, with a mark."""
    verdict: str
    """The result in one or two sentences."""
    lead: tuple[str, ...]
    """Sentences about the line (level) and the dots (readings) of the figure, and about the largest error."""
    labels: tuple[tuple[str, str], ...]
    """Warnings, each with a word and a text."""
    tiles: tuple[Tile, ...]
    """The four figures of the page."""
    notes: tuple[tuple[str, str], ...]
    """Sentences about what the level depends on, and the trial's note, each with a word and a text."""


class ReadingsFile(ReadingsSheet):
    """File of the readings, how it was interpreted, and the origin of its data."""

    dialect: str
    """Sentence that describes how the sheet was interpreted."""
    data: DataKind
    """Origin of the readings. Only measured data can validate."""


class ReportData(JsonRecord):
    """Report of one trial: its result, what the page states about it, and its origin."""

    schema_version: Literal[4] = 4
    """Version of this format. Programs for one version cannot read another."""
    name: str
    """Name of the trial."""
    note: str
    """Note of the trial, in the user's words."""
    first_page: FirstPage
    """The first page in words: verdict, two sentences, four figures."""
    headline: Facts
    """First findings of the report: about the gate, the baselines and the use of the readings."""
    outcome: Outcome
    """passed or failed: the mean error's 95 % interval does not contain the gate, or a particle escaped (failed).
    undecided: the interval contains the gate, there are too few readings, or files were edited by hand. open: there are
    no readings, or no gate was declared."""
    edited: tuple[str, ...]
    """Files of the run that were changed after their stage wrote them. If there is one, nothing in the report is a
    valid result."""
    cautions: Facts
    """Warnings that should be read before any number."""
    photo_data: DataKind
    """Origin of the photo or the mesh. Only measured data can validate."""
    readings: ReadingsFile | None
    """File of the readings. None if there are no readings."""
    comparison: Comparison | None
    """Comparison of the simulated with the measured level, and the verdict. None if there are no readings."""
    prediction: PredictedLevel | None
    """Level of a run without readings, with its band. None if there are readings, or no extra runs."""
    seeds: SeedRuns | None = IF_SEVERAL
    """Runs that differ only in the seed. The level is their mean. Left out if there is only one run."""
    uncertainty: Facts
    """Facts about several runs whose mean is the level, about the uncertainty, and about what the intervals do not
    include."""
    assumptions: Facts
    """Assumptions of the model, and data that no measure includes."""
    figures: Facts
    """Volume of dispensed sealant in each part of the sample, and the figures that the run recorded about itself."""
    provenance: dict[str, str]
    """Versions, device, seed, dates and hashes."""
    commands: tuple[str, ...]
    """Commands that make this report again, in order."""
    tables: tuple[PageTable, ...]
    """All tables of the page."""

    @property
    def faults(self) -> Facts:
        """Cautions, without the caution about data that were not measured, which is on the first page."""
        return without(self.cautions, NOT_A_VALIDATION)

    @property
    def tone(self) -> Outcome:
        """Outcome that sets the verdict's colour. "passed" counts as "open" unless the readings were held out."""
        held_out = self.comparison is not None and self.comparison.role == "held-out"
        return "open" if self.outcome == "passed" and not held_out else self.outcome
