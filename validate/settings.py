"""Readings, limits and uncertainties: the tables [readings], [gate] and [uncertainty] of a trial file."""

import re
from collections import Counter
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from sealtwin.core.records import DataKind
from sealtwin.core.run_figures import Method
from sealtwin.core.settings import Settings
from sealtwin.core.solid_figures import WeighedCavity

Separator = Literal["comma", "semicolon", "tab"]
Decimal = Literal["point", "comma"]
Quantity = Literal["level", "depth"]
"""level counts upward from the datum, depth downward."""
Unit = Literal["mm", "cm", "m", "inch"]
AS_WRITTEN = re.compile(r"[A-Z]{1,3}|[A-Z]{0,3}[1-9][0-9]{0,6}|sign|unit|datum|direction")
"""Answer to a doubt about a sheet: a column, a row, a cell, or what the whole sheet has."""


Text = Annotated[str, Field(min_length=1, max_length=200)]
RANGE = r"^([A-Z]{1,3}([1-9][0-9]{0,6})?:[A-Z]{1,3}([1-9][0-9]{0,6})?|[1-9][0-9]{0,6}:[1-9][0-9]{0,6})$"
OF_THE_SHEET = ("sheet", "unit", "datum", "datum_level_mm")
"""Settings that [readings.columns] may hold too; they mean those of [readings]."""
Sign = Literal["up", "down"]
Datum = Literal["sample_surface", "sealant_top", "caliper_base"]
Role = Literal["calibrated-on", "held-out", "undeclared"]
"""Use of the readings: the fluid was tuned on them, so that the error is a residual and no test; it was not; or it is
undeclared. Only held-out readings can validate.
"""
SIGNS: dict[str, Quantity] = {"up": "level", "down": "depth"}


class Columns(Settings):
    """Columns of a sheet whose header does not name them, and other facts that it leaves open, as in [readings]."""

    s: Text | None = None
    """Column of the stations: its name in the header, or its letter in a spreadsheet, as "A"."""
    levels: Annotated[tuple[Text, ...], Field(min_length=1, max_length=256)] | None = None
    """Columns of readings: names, letters or spans of letters, as ["B", "C"] or ["B:D"]. No other column is read."""
    repeat: Text | None = None
    """Column that numbers the readings of a station, if each reading has a row."""
    header_rows: int | None = Field(default=None, ge=0, le=20)
    """Number of rows of the header; 0 for a sheet that begins with its readings."""
    transposed: bool | None = None
    """True if each station has a column: letters then count rows, "A" for the first. Left out, names decide."""
    s_from: Literal["first", "second"] | None = None
    """End of the crack from which the sheet counts s, if it is the second: s = 0 of the overlay is at the first."""
    skip: tuple[Text | Annotated[int, Field(ge=1)], ...] = ()
    """Rows that are not read: by number from 1, or by the text of their first cell, as ["Mittelwert", 9]."""
    missing: tuple[Text, ...] = ()
    """Words of this sheet for a missing reading, beside the usual ones, as ["n. lesbar"]."""
    range: Annotated[str, Field(pattern=RANGE)] | None = None
    """Part of the sheet that is read: cells, as "F2:I30", or columns, as "F:I", or rows, as "2:30"."""
    sign: Sign | None = None
    """Direction in which readings count: "up" for levels, "down" for depths, as quantity of [readings]."""
    sheet: Text | None = None
    """Worksheet, as in [readings]."""
    unit: Unit | None = None
    """Unit of all columns, as in [readings]."""
    datum: Datum | None = None
    """Datum, as in [readings]."""
    datum_level_mm: float | None = Field(default=None, ge=-1000, le=1000)
    """Height of that datum above the sample's surface, as in [readings]."""


class Declared(Settings):
    """Facts that a sheet of readings leaves open. None is guessed: a missing one is asked for."""

    sheet: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """Name of the worksheet, in a workbook with several."""
    sample: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """Sample whose rows are read, if a column names the sample of each row; spelt as file names may spell it."""
    separator: Separator | None = None
    """Separator between the fields of a text file, if its rows leave it open."""
    decimal: Decimal | None = None
    """Decimal mark, if "1,234" may be one and a quarter, or more than a thousand."""
    quantity: Quantity | None = None
    """level counts upward from the datum, depth downward; needed if the header names neither."""
    unit: Unit | None = None
    """Unit of the columns whose header names none."""
    columns: Columns | None = None
    """Columns of the sheet, if its header does not name them."""
    as_written: tuple[str, ...] | None = None
    """Answers to doubts about the sheet: cells ("E7"), columns ("E") or rows ("7") that are meant as they are, and
    "sign", "unit", "datum" or "direction" of the whole sheet.
    """
    datum: Datum = "sample_surface"
    """Datum that readings count from. The sample's surface, its face, is the datum of this format (decision 0071)."""
    datum_level_mm: float | None = Field(default=None, ge=-1000, le=1000)
    """Height of that datum above the sample's surface; needed for the other two, since no sheet shows it."""

    @field_validator("as_written")
    @classmethod
    def _are_answers(cls, answers: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for answer in answers or ():
            if not AS_WRITTEN.fullmatch(answer):
                raise ValueError(
                    f'{answer!r:.40} is no cell ("E7"), column ("E"), row ("7"), sign, unit, datum or direction'
                )
        return answers

    @model_validator(mode="after")
    def _says_it_once(self) -> Self:
        """Take what [readings.columns] says of the whole sheet as said of [readings]."""
        if (columns := self.columns) is None:
            return self
        said: dict[str, Any] = {key: value for key in OF_THE_SHEET if (value := getattr(columns, key)) is not None}
        if columns.sign is not None:
            said["quantity"] = SIGNS[columns.sign]
        for key, value in said.items():
            if key in self.model_fields_set and getattr(self, key) != value:
                raise ValueError(f"{key} is {getattr(self, key)!r:.40}, and columns says {value!r:.40}; keep one")
        # The settings are frozen for all others.
        rest = columns.model_copy(update=dict.fromkeys((*OF_THE_SHEET, "sign")))
        for key, value in {**said, "columns": rest}.items():
            object.__setattr__(self, key, value)
        self.model_fields_set.update(said)
        return self

    @model_validator(mode="after")
    def _knows_its_datum(self) -> Self:
        if self.datum == "sample_surface" and self.datum_level_mm not in (None, 0.0):
            raise ValueError(
                f"datum_level_mm = {self.datum_level_mm:g}: the sample's surface is at 0; name another datum, or leave "
                "datum_level_mm out"
            )
        if self.datum != "sample_surface" and self.datum_level_mm is None:
            raise ValueError(
                f'datum = "{self.datum}": give datum_level_mm, the height of that datum above the sample\'s surface'
            )
        return self


class Readings(Declared):
    """A sheet of caliper readings: how it is written, and how it was measured."""

    file: Path
    """Path of the sheet, CSV, XLSX or ODS, beside the trial file or absolute. Its columns are s_mm and level_1_mm,
    level_2_mm, ... (upward from the face) or depth_1_mm, ... (downward from it), or as the lab writes them.
    """
    data: DataKind
    """Origin of the readings; only "measured" ones can validate."""
    role: Role
    """Use of the readings: "calibrated-on" if the fluid was tuned on them, "held-out" if not. Every report states one
    that is "undeclared"."""
    fitted: tuple[str, ...] | None = None
    """Settings of the trial that were fitted to these readings, by dotted name, as "fluid.yield_stress_pa"; only with
    the role "calibrated-on". An empty list declares that none was. Left out, it is undeclared, as reports state."""
    state: Literal["wet", "cured"] | None = None
    """State of the sealant when it was read. Cured sealant has lost volume that was dispensed."""
    shrinkage_percent: float | None = Field(default=None, ge=0, lt=100)
    """Share of the volume lost from dispensing until it was read, if it had cured."""
    resolution_mm: float = Field(default=0.01, gt=0, le=10)
    """Last digit of the caliper; 0.01 on digital ones."""
    limit_mm: float = Field(default=0.02, ge=0, le=10)
    """Limit of the caliper's error; digital ones up to 150 mm state 0.02."""
    probe_mm: float | None = Field(default=None, gt=0, le=100)
    """Width of the tip that touches the sealant: it reads the highest point that it covers."""
    datum_error_mm: float | None = Field(default=None, ge=0, le=100)
    """Standard uncertainty of the datum's own height, common to all readings."""

    @field_validator("fitted")
    @classmethod
    def _named_once(cls, fitted: tuple[str, ...] | None) -> tuple[str, ...] | None:
        if twice := [name for name, times in Counter(fitted or ()).items() if times > 1]:
            raise ValueError(f"{twice[0]} is named twice; name each setting once, since their number counts")
        return fitted

    @model_validator(mode="after")
    def _fits_its_role(self) -> Self:
        if self.fitted == () and self.role == "undeclared":
            raise ValueError(
                'fitted is empty, and role is "undeclared": readings that nothing was fitted to are "held-out"'
            )
        if self.fitted and self.role != "calibrated-on":
            raise ValueError(
                f'fitted names settings, and role is "{self.role}": readings that something was fitted to have the '
                'role "calibrated-on"'
            )
        return self

    @model_validator(mode="after")
    def _shrinks_by_curing(self) -> Self:
        if self.shrinkage_percent is not None and self.state != "cured":
            raise ValueError(
                f'shrinkage_percent = {self.shrinkage_percent:g} without state = "cured": wet sealant has not shrunk'
            )
        return self


class Gate(Settings):
    """Limits declared before the run."""

    mean_error_mm: float = Field(gt=0, le=500)
    """Area between the simulated and the measured level over the covered length; 1.26 in the paper's best run. No crack
    is deeper than 500, so that a larger limit declares nothing."""
    reason: Annotated[str, Field(max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")] = ""
    """Reason for that limit, as what the sealant must do; a report prints it, or that there is none."""


PASS_MM = 0.2
"""Standard deviation of a pass that is allowed for if none is declared: three passes leave two degrees of freedom, and
cannot tell it from none."""
ANGLE = "wall_angle_deg"
OF_THE_WALLS = ("width_mm", ANGLE, "depth_mm")
"""Settings of [uncertainty] that change the solid, in the order of a weighed fill."""
NO_INPUTS = ("differences", "station_mm", "station_each_mm", "common_mm", "pass_mm", "repeatability_mm")
"""Settings of [uncertainty] about the readings, or about how inputs are moved."""
Standard = Annotated[float, Field(gt=0, le=1000)]


class Uncertainty(Settings):
    """Standard uncertainties, one standard deviation each, of what was set, measured or assumed.

    All are optional and none has a default: one that is not declared is not included, as the report states.
    """

    differences: Method | None = None
    """Model of the runs with moved inputs. particles: each input up and down by a design, with the coarser particles.
    slot: the fast model, 1,000 runs with all inputs drawn together; the level stays the particles'. Left out, slot
    if the trial is within the fast model's domain, else particles; a report names it beside each input.
    """
    speed_mm_s: Standard | None = None
    """Uncertainty of the nozzle's speed. The volume stays the same, and the flow changes with the speed."""
    volume_ml: Standard | None = None
    """Uncertainty of the volume of sealant, and so of the flow."""
    start_mm: Standard | None = None
    """Uncertainty of the start of the nozzle, which shifts the whole path along the crack."""
    width_mm: Standard | None = None
    """Uncertainty of the crack's mean width, which scales all its widths. Left out, that of a width fitted to a
    thin crack's profile is a quarter of its 95 % interval."""
    wall_angle_deg: Standard | None = None
    """Uncertainty of the tilt of the walls, the same for both."""
    depth_mm: Standard | None = None
    """Uncertainty of the crack's depth, the same over all of its length."""
    viscosity_percent: Standard | None = None
    """Uncertainty of the viscosity, or of U."""
    yield_stress_pa: Standard | None = None
    """Uncertainty of the yield stress. Left out, it is that of fluid.material, and so is viscosity_percent."""
    station_mm: Standard | None = None
    """Uncertainty of the origin of the readings' s: all stations shift together."""
    station_each_mm: Standard | None = None
    """Uncertainty of each station's own place along the crack, as of a caliper that is set by hand."""
    common_mm: Standard | None = None
    """Uncertainty of a station's level that all its repeats share, as of a rough bed that is read at one place."""
    pass_mm: float | None = Field(default=None, ge=0, le=1000)
    """Standard deviation of a whole pass, or operator, along the crack, if each column of repeats is one. Without it,
    0.2 mm are allowed for, which three passes cannot exclude; 0 declares that repeats are no passes."""
    repeatability_mm: Standard | None = None
    """Standard deviation of a single reading from earlier work, used only if no station was read twice."""

    @property
    def moved(self) -> dict[str, float]:
        """Declared inputs, by name, whose effect is found by extra runs."""
        return {name: value for name, value in self if value is not None and name not in NO_INPUTS}

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the inputs without a declared uncertainty."""
        return tuple(sorted(name for name, value in self if value is None and name not in NO_INPUTS))

    def with_sample(self, width_mm: float | None, weighed: WeighedCavity | None) -> Self:
        """Return them with what the sample itself says of its walls.

        A weighed fill leaves each of width, angle and depth the uncertainty that it has where those before it are
        given. Without one, a width fitted to a photo has the doubt ``width_mm``, unless one is declared.
        """
        if weighed is not None:
            return self.model_copy(update={name: weighed.steps[i][i] or None for i, name in enumerate(OF_THE_WALLS)})
        if width_mm is None or self.width_mm is not None:
            return self
        return self.model_copy(update={"width_mm": width_mm})

    def with_paste(self, yield_stress_pa: float, viscosity_percent: float | None) -> Self:
        """Return them with what the measurement of the paste leaves open, unless it is declared."""
        measured = {"yield_stress_pa": yield_stress_pa or None, "viscosity_percent": viscosity_percent or None}
        return self.model_copy(update={key: value for key, value in measured.items() if getattr(self, key) is None})
