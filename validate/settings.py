"""What a result is held against: the tables [readings] and [gate] of a trial file."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sealtwin.records import DataKind
from sealtwin.settings import Settings

Role = Literal["calibrated-on", "held-out"]
"""Whether the fluid was tuned on these very readings. A match with those it was tuned on is a residual, no test."""


Separator = Literal["comma", "semicolon", "tab"]
Decimal = Literal["point", "comma"]
Quantity = Literal["level", "depth"]
"""level counts upward from the datum, depth downward."""
Unit = Literal["mm", "cm", "m", "inch"]
Datum = Literal["sample_surface", "sealant_top", "caliper_base"]


class Declared(Settings):
    """What a sheet of readings does not say of itself. Nothing of it is ever guessed: what neither says is asked."""

    sheet: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """Of a workbook with several."""
    sample: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """Whose rows are meant, where a column of the sheet names the sample of each; spelt as file names may spell it."""
    separator: Separator | None = None
    """Between the fields of a text file, where it cannot be told from its rows."""
    decimal: Decimal | None = None
    """Where "1,234" may be one and a quarter, or more than a thousand."""
    quantity: Quantity | None = None
    """Where the header names neither: which way readings count."""
    unit: Unit | None = None
    """Of all columns whose header names none."""
    datum: Datum = "sample_surface"
    """What readings are counted from. The sample's surface, its face, is what this format means; see decision 0071."""
    datum_level_mm: float | None = Field(default=None, ge=-1000, le=1000)
    """Height of that datum above the sample's surface; needed for the other two, since no sheet shows it."""

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
    """Beside the trial file, or absolute. CSV or XLSX. Columns s_mm and level_1_mm, level_2_mm, ... (upward from the
    face) or depth_1_mm, ... (downward from it), or as the lab writes them: the sign is never guessed.
    """
    data: DataKind
    """Where the readings come from; only "measured" ones can validate."""
    role: Role
    state: Literal["wet", "cured"] | None = None
    """Of the sealant when it was read. What has cured has lost volume that was dispensed."""
    shrinkage_percent: float | None = Field(default=None, ge=0, lt=100)
    """Volume lost from dispensing until it was read, where it had cured."""
    resolution_mm: float = Field(default=0.01, gt=0, le=10)
    """Last digit of the caliper; 0.01 on digital ones."""
    limit_mm: float = Field(default=0.02, ge=0, le=10)
    """Limit of its error; digital calipers up to 150 mm state 0.02."""
    probe_mm: float | None = Field(default=None, gt=0, le=100)
    """Width of what touches the sealant: it reads the highest point that it covers."""
    datum_error_mm: float | None = Field(default=None, ge=0, le=100)
    """Standard uncertainty of the datum's own height, common to all readings."""

    @model_validator(mode="after")
    def _shrinks_by_curing(self) -> Self:
        if self.shrinkage_percent is not None and self.state != "cured":
            raise ValueError(
                f'shrinkage_percent = {self.shrinkage_percent:g} without state = "cured": wet sealant has not shrunk'
            )
        return self


class Gate(Settings):
    """Limits declared before the run, each of which the result must keep."""

    mean_error_mm: float = Field(gt=0)
    """Area between the simulated and the measured level over the covered length; 1.26 in the paper's best run."""
