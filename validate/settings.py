"""Settings of readings, limits and uncertainties: the tables [readings], [gate] and [uncertainty] of a trial file."""

import re
from collections import Counter
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, PrivateAttr, field_validator

from sealtwin.core.errors import present
from sealtwin.core.records import DataKind
from sealtwin.core.run_figures import Method
from sealtwin.core.settings import Settings
from sealtwin.core.solid_figures import WeighedCavity
from sealtwin.scan.settings import Placement

Separator = Literal["comma", "semicolon", "tab"]
Decimal = Literal["point", "comma"]
Quantity = Literal["level", "depth"]
"""Direction of the readings. level is measured upward from the datum, depth downward."""
Unit = Literal["mm", "cm", "m", "µm", "inch"]
MICROMETRES = ("um", "\u03bcm", "micron")  # Other spellings of µm. The second one has a Greek letter.
AS_WRITTEN = re.compile(r"[A-Z]{1,3}|[A-Z]{0,3}[1-9][0-9]{0,6}|sign|unit|face|position|spill|holes|repeats")
"""Pattern of an answer to a doubt about a sheet: a column, a row or a cell that is right as it is, or a property of the
whole sheet."""


COLUMN, SPAN, CELL = r"^[A-Z]{1,3}$", r"^[A-Z]{1,3}(:[A-Z]{1,3})?$", r"^[A-Z]{1,3}[1-9][0-9]{0,6}$"
RANGE = r"^([A-Z]{1,3}([1-9][0-9]{0,6})?:[A-Z]{1,3}([1-9][0-9]{0,6})?|[1-9][0-9]{0,6}:[1-9][0-9]{0,6})$"
Name = Annotated[str, Field(min_length=1, max_length=200)]  # Name of a worksheet or a sample
Rounding = Literal["nearest", "down", "toward_zero"]
Datum = Literal["sample_surface", "sealant_top", "caliper_base"]
Role = Literal["calibrated-on", "held-out", "undeclared"]
"""Use of the readings. calibrated-on: the fluid was tuned on the readings, so the error is a residual and not a test.
held-out: the fluid was not tuned on them. Only such readings can validate."""
DIGIT_MM = 0.01  # Last digit of a digital caliper
PDF = "report.pdf"  # File of the report that is written if output.pictures is True
OF_CALIPERS = ("resolution_mm", "rounding", "probe_mm", "datum_error_mm")
"""Settings of [readings] that a scan does not have."""
SIGNS: dict[str, Quantity] = {"up": "level", "down": "depth"}


class Columns(Settings):
    """Columns and rows of a sheet. They are needed if its header does not name them."""

    s: Annotated[str, Field(pattern=COLUMN)] | None = None
    """Column of the stations, as its letter in a spreadsheet, such as "A"."""
    levels: Annotated[tuple[Annotated[str, Field(pattern=SPAN)], ...], Field(min_length=1, max_length=256)] | None = (
        None
    )
    """Columns of readings, as letters or spans of letters, such as ["B", "C"] or ["B:D"]. No other column is read."""
    places: Unit | Annotated[tuple[float, ...], Field(min_length=2, max_length=10_000)] | None = None
    """Meaning of the station numbers. If they are positions, give their unit. If they only count stations, give
    positions in mm: two (for the lowest and the highest number) if stations are evenly spaced, otherwise one for each
    station in order."""
    repeat: Annotated[str, Field(pattern=COLUMN)] | None = None
    """Column that numbers the readings of a station, if each reading has its own row."""
    s_from: Literal["first", "second"] | None = None
    """End of the crack from which the sheet measures s. In the overlay, s = 0 is at the first end."""
    skip: tuple[Annotated[str, Field(pattern=CELL)] | Annotated[int, Field(ge=1)], ...] = ()
    """Rows to ignore, by number from 1, and single readings to ignore, by cell, for example [9, "E14"]."""
    range: Annotated[str, Field(pattern=RANGE)] | None = None
    """Part of the sheet that is read: cells such as "F2:I30", columns such as "F:I", or rows such as "2:30"."""


class Declared(Settings):
    """Facts that a sheet of readings does not state. Nothing is guessed: a missing fact is an error that names it."""

    sheet: Name | None = None
    """Name of the worksheet. It is needed if the workbook has several."""
    sample: Name | None = None
    """Name of the sample. A text in the sheet that names another sample leads to a question. Default: the name of the
    file."""
    separator: Separator | None = None
    """Separator between the fields of a text file. It is needed if the separator is ambiguous."""
    decimal: Decimal | None = None
    """Decimal mark. It is needed if a number such as "1,234" may mean 1.234 or 1234."""
    quantity: Quantity | None = None
    """Direction of the readings. level is measured upward from the datum, depth downward. It is needed if the header
    names neither."""
    unit: Unit | None = None
    """Unit of the columns whose header names none."""
    columns: Columns | None = None
    """Columns of the sheet. They are needed if its header does not name them."""
    as_written: tuple[str, ...] | None = None
    """Answers to doubts about the sheet. Give cells ("E7"), columns ("E") or rows ("7") that are right as they are.
    Give "sign" or "unit" if this property of the whole sheet is right. Give "repeats" if rows
    with the same position, or without one, are repeats."""
    datum: Datum = "sample_surface"
    """Surface from which the readings are measured. Default: the sample's surface, which is the face."""
    datum_level_mm: float | None = Field(default=None, ge=-1000, le=1000)
    """Height of the datum above the sample's surface. It is required if the datum is not the sample's surface, because
    no sheet shows it."""

    _one_spelling = field_validator("unit", mode="before")(lambda unit: "µm" if unit in MICROMETRES else unit)

    @field_validator("as_written")
    @classmethod
    def _are_answers(cls, answers: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for answer in answers or ():
            if not AS_WRITTEN.fullmatch(answer):
                raise ValueError(
                    f"{answer!r:.40} is not an answer: give a cell ("
                    '"E7"), a column ("E"), a row ("7"), or sign, unit or repeats'
                )
        return answers

    def _check(self) -> None:
        if self.datum == "sample_surface" and self.datum_level_mm not in (None, 0.0):
            raise ValueError(
                f"datum_level_mm is {self.datum_level_mm:g}, but the datum is the sample's surface, which is at 0: set "
                "another datum, or remove datum_level_mm"
            )
        if self.datum != "sample_surface" and self.datum_level_mm is None:
            raise ValueError(f'datum is "{self.datum}": give datum_level_mm, its height above the sample\'s surface')


class Readings(Declared):
    """A sheet of caliper readings, or a scan of the sealed face, and how the readings were taken."""

    file: Path | None = None
    """Path of the sheet (CSV or XLSX), absolute or relative to the trial file. Its columns are s_mm and either
    level_1_mm, level_2_mm, ... (upward from the face) or depth_1_mm, ... (downward from the face), or the columns that
    the lab writes. Give file or scan."""
    scan: Path | None = None
    """Path of a scan of the sealed face: points or triangles (PLY, STL, OBJ, GLB, XYZ, CSV), or a height map (PNG
    or TIFF). Give file or scan."""
    placement: Placement | None = None
    """Unit and position of the scan. Required for a scan."""
    data: DataKind
    """Origin of the readings. Only "measured" readings can validate."""
    role: Role
    """Use of the readings: "calibrated-on" if the fluid was tuned on them, and "held-out" if it was not. Every report
    mentions "undeclared"."""
    fitted: tuple[str, ...] | None = None
    """Settings of the trial that were fitted to these readings, by dotted name, such as "fluid.yield_stress_pa". They
    can only be given with the role "calibrated-on". An empty list declares that no setting was fitted. Default: not
    declared, which reports then mention."""
    state: Literal["wet", "cured"] | None = None
    """State of the sealant when it was read. Cured sealant has lost part of the dispensed volume."""
    shrinkage_percent: float | None = Field(default=None, ge=0, lt=100)
    """Loss of volume between dispensing and reading, if the sealant had cured."""
    resolution_mm: float | None = Field(default=None, gt=0, le=10)
    """Resolution of the caliper, which is its last digit. Default: the largest step of which all readings are
    multiples, or 0.01, as of digital calipers."""
    rounding: Rounding | None = None
    """Rounding of each number to the last digit. "nearest": as a digital caliper rounds. "down": to the next lower
    number. "toward_zero": as on a ruler that is read to the last mark passed. The last two differ for negative numbers:
    in steps of 0.5, -12.3 becomes -12.5 or -12. Default: not declared, which reports then mention."""
    limit_mm: float | None = Field(default=None, ge=0, le=10)
    """Limit of the caliper's error, including the error of its scale: a scale that is 2 % off adds 0.2 at 10 mm.
    Default: 0.02, as for digital calipers up to 150 mm. The error of the scale then counts as undeclared. For a scan:
    the limit of the scanner's error that its noise does not show, which otherwise counts as undeclared."""
    probe_mm: float | None = Field(default=None, gt=0, le=100)
    """Width of the tip that touches the sealant. The tip reads the highest point below it."""
    datum_error_mm: float | None = Field(default=None, ge=0, le=100)
    """Standard uncertainty of the datum's height, which is common to all readings."""

    @field_validator("fitted")
    @classmethod
    def _named_once(cls, fitted: tuple[str, ...] | None) -> tuple[str, ...] | None:
        if twice := [name for name, times in Counter(fitted or ()).items() if times > 1]:
            raise ValueError(f"{twice[0]} is listed twice: list each setting only once")
        return fitted

    @property
    def path(self) -> Path:
        """Path of the sheet or the scan."""
        return present(self.scan or self.file, "readings.file or readings.scan")

    def at_path(self, path: Path) -> Self:
        """Return the settings for a copy of the sheet or the scan."""
        return self.model_copy(update={"scan" if self.scan is not None else "file": path})

    def _check(self) -> None:
        super()._check()
        if (self.file is None) == (self.scan is None):
            raise ValueError("give file, a sheet of caliper readings, or scan, a scan of the sealed face, but not both")
        if (self.scan is None) != (self.placement is None):
            raise ValueError(
                "a scan needs the table [readings.placement] with its unit, and a sheet of caliper readings has none"
            )
        fields, names = type(self).model_fields, (*Declared.model_fields, *OF_CALIPERS)
        of_sheets = [name for name in names if name != "as_written" and getattr(self, name) != fields[name].default]
        if self.scan is not None and of_sheets:
            raise ValueError(f"{of_sheets[0]} belongs to a sheet of caliper readings: omit it for a scan")
        if self.fitted == () and self.role == "undeclared":
            raise ValueError(
                'fitted is empty, but role is "undeclared": set role = "held-out" if no setting was fitted'
            )
        if self.fitted and self.role != "calibrated-on":
            raise ValueError(
                f'fitted lists settings, but role is "{self.role}": set role = "calibrated-on", or remove fitted'
            )
        if self.shrinkage_percent is not None and self.state != "cured":
            raise ValueError(
                f'shrinkage_percent = {self.shrinkage_percent:g} needs state = "cured": set this, or remove the key'
            )


class Gate(Settings):
    """Limits that are declared before the run."""

    mean_error_mm: float = Field(gt=0, le=500)
    """Largest allowed mean error, which is the area between the simulated and the measured level divided by the covered
    length. The paper's best run has 1.26. No crack is deeper than 500, so a larger limit is meaningless."""
    reason: Annotated[str, Field(max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")] = ""
    """Reason for the limit, such as what the sealant must do. A report prints it, or states that it is missing."""


PASS_MM = 0.2
"""Assumed standard deviation of a whole pass along the crack, in mm, if none is declared. Three passes, with two
degrees of freedom, cannot exclude it."""
ANGLE = "wall_angle_deg"
OF_THE_WALLS = ("width_mm", ANGLE, "depth_mm")
"""Settings of [uncertainty] that change the solid, in the order in which a weighed fill fits them."""
OF_THE_READINGS = ("station_mm", "station_each_mm", "common_mm", "operator_mm", "datum_tilt_mm", "sinks_mm")
"""Settings of [uncertainty] for errors of the readings that repeats do not show."""
NO_INPUTS = ("differences", *OF_THE_READINGS, "surface_tension_n_m", "pass_mm", "repeatability_mm")
"""Settings of [uncertainty] that are not inputs of a run: errors of readings, the meniscus, and how inputs are
varied."""
Standard = Annotated[float, Field(gt=0, le=1000)]
OrNone = Annotated[float, Field(ge=0, le=1000)]
"""A standard uncertainty that may be declared as 0."""


class Uncertainty(Settings):
    """Standard uncertainties (one standard deviation) of what was set, measured or assumed.

    All of them are optional. An uncertainty that is neither declared nor has a default is not included. The report
    states this.
    """

    differences: Method | None = None
    """Model of the runs with varied inputs. particles: each input is raised and lowered according to a design, in runs
    with the coarser particles. slot: 1,000 runs of the fast model in which all inputs vary at random together. The
    level itself still comes from the particles. Default: slot if the fast model is valid for the trial, and particles
    otherwise. A report names the model for each input."""
    speed_mm_s: Standard | None = None
    """Uncertainty of the nozzle's speed. The volume is constant, so the flow changes with the speed."""
    volume_ml: Standard | None = None
    """Uncertainty of the volume of sealant, and therefore of the flow."""
    start_mm: Standard | None = None
    """Uncertainty of the nozzle's starting point, which shifts the whole path along the crack."""
    pump_delay_s: Standard | None = None
    """Uncertainty of the delay of the pump, which never begins early. The sealant of this time is missing at the
    beginning of the path. If the sample was weighed, the rest of the path gets this sealant."""
    width_mm: Standard | None = None
    """Uncertainty of the crack's mean width, which scales all widths. Default: a quarter of the 95 % interval if the
    width was fitted to the profile of a thin crack. Otherwise it is not included. It
    cannot be given for an outline with kept side cracks."""
    wall_angle_deg: Standard | None = None
    """Uncertainty of the walls' tilt, which is the same for both walls."""
    depth_mm: Standard | None = None
    """Uncertainty of the crack's depth, which is the same along its length."""
    viscosity_percent: Standard | None = None
    """Uncertainty of the viscosity, or of U, in percent of its value. Default: the uncertainty in fluid.material."""
    yield_stress_pa: Standard | None = None
    """Uncertainty of the yield stress. Default: the uncertainty in fluid.material."""
    wall_share: Annotated[float, Field(gt=0, le=0.5)] | None = None
    """Uncertainty of fluid.wall_share, the fraction of the paste's stress that the walls take up."""
    station_mm: Standard | None = None
    """Uncertainty of the origin of s in the readings. It shifts all stations together."""
    station_each_mm: Standard | None = None
    """Uncertainty of each station's position along the crack, independent of the others, for example if a caliper is
    placed by hand."""
    common_mm: Standard | None = None
    """Uncertainty that is the same for all repeats at a station, for example if a rough surface is always read at the
    same point."""
    operator_mm: OrNone | None = None
    """Uncertainty of the offset of an operator who took all repeats. 0 declares that there is no offset. If each repeat
    has its own operator, repeats are passes (``pass_mm``)."""
    datum_tilt_mm: OrNone | None = None
    """Tilt of the datum, or bow of the face, as the uncertainty of its height at one end of the stations if it is right
    at the other end. 0 declares that there is neither."""
    sinks_mm: OrNone | None = None
    """Depth to which the probe sinks into soft sealant (root mean square), which makes readings too low. 0 declares
    that it does not sink."""
    surface_tension_n_m: Annotated[float, Field(ge=0, le=0.1)] | None = None
    """Surface tension of a sealant that may wet the walls. It is not a standard uncertainty. The level in the middle,
    where a caliper reads, is then lower than the computed mean across the crack. The difference is between zero
    (contact angle of 90 degrees) and the whole meniscus (0 degrees). 0 declares that the sealant does not wet the
    walls."""
    pass_mm: OrNone | None = None
    """Standard deviation of a whole pass along the crack, or of an operator, if each column of repeats is one pass.
    Default: 0.2, which three passes cannot exclude. 0 declares that repeats are not passes."""
    repeatability_mm: Standard | None = None
    """Standard deviation of a single reading from earlier work. It is used only if no station was read twice."""

    @property
    def moved(self) -> dict[str, float]:
        """Declared inputs of a run, by name. Extra runs determine their effects."""
        return {name: value for name, value in self if value is not None and name not in NO_INPUTS}

    _unmoved: tuple[str, ...] = PrivateAttr(default=())

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the inputs without a declared uncertainty."""
        none = (*NO_INPUTS, *self._unmoved)
        return tuple(sorted(name for name, value in self if value is None and name not in none))

    def without(self, *names: str) -> Self:
        """Return the uncertainties for a trial in which the inputs ``names`` have no meaning."""
        other = self.model_copy()
        other._unmoved = names
        return other

    def with_sample(self, width_mm: float | None, weighed: WeighedCavity | None) -> Self:
        """Return the uncertainties, completed with the uncertainties of the sample's walls.

        A weighed fill gives the uncertainties of width, angle and depth, each for fixed values of the ones before it.
        Without a weighed fill, ``width_mm`` is the uncertainty of a width fitted to a photo, and is used unless one is
        declared.
        """
        if weighed is not None:
            return self.model_copy(update={name: weighed.steps[i][i] or None for i, name in enumerate(OF_THE_WALLS)})
        if width_mm is None or self.width_mm is not None:
            return self
        return self.model_copy(update={"width_mm": width_mm})

    def with_paste(self, yield_stress_pa: float, viscosity_percent: float | None) -> Self:
        """Return the uncertainties, completed with the paste's measured ones.

        Declared uncertainties take precedence.
        """
        return self.model_copy(
            update={
                "yield_stress_pa": self.yield_stress_pa or yield_stress_pa or None,
                "viscosity_percent": self.viscosity_percent or viscosity_percent or None,
            }
        )
