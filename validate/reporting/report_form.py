"""The form of report.json, and the schema that is published for it.

python -m validate.reporting.report_form > validate/schema/report.schema.json
"""

import json
import sys
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from sealtwin.records import DataKind, Outcome
from validate.settings import Role

SCHEMA = "report.schema.json"
"""In validate/schema/."""


class Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class Quantity(Part):
    """A number with its unit."""

    value: float | None
    """None where the number does not exist, as the error of a stretch without readings."""
    unit: str
    """As it is written; "1" for a pure number."""
    meaning: str
    """In words."""
    interval_95: tuple[float, float] | None = None
    """Ends of the 95 % interval in the same unit; None where none was computed."""


class Verdict(Part):
    """What the comparison comes to."""

    sentence: str
    """As the report leads with it."""
    findings: tuple[str, ...]
    """What ASME V&V 20 allows one to say, to be read with the sentence; empty where there is no verdict."""
    outcome: Outcome
    """passed, failed: the gate lies outside the mean error's 95 % interval, or the run leaks. undecided: inside it, or
    too few readings, or files edited by hand. open: no readings, or no gate declared."""
    edited: tuple[str, ...]
    """Files of the run that are not as their stage wrote them: with one, nothing here is a result of the trial."""
    mean_error_limit_mm: float | None
    """The gate that the trial declared before the run."""
    role: Role | None
    """Whether the fluid was tuned on these readings; None without readings."""
    photo_data: DataKind
    """Where the photo, or the mesh, comes from; only measured data can validate."""
    readings_data: DataKind | None
    """Where the readings come from; None without any."""


class ErrorBin(Part):
    """Mean absolute error over a stretch of the crack."""

    from_mm: float
    """Where it begins, along the crack from the end where the nozzle starts."""
    to_mm: float
    """Where it ends."""
    covered_mm: float
    """How much of it has readings."""
    mean_error_mm: float | None
    """None where nothing of it has."""


class Uncertainty(Part):
    """What the mean level's error may come from, as in ASME V&V 20; standard uncertainties."""

    error_mm: float
    """E: simulated less measured."""
    data_mm: float
    """Of the readings."""
    numerics_mm: float | None
    """Of the particles' size; None where no other sizes were run."""
    inputs_mm: float | None
    """Of the declared inputs; None where none was varied."""
    validation_mm: float
    """u_val: of all that is known, together."""
    resolved: bool
    """Whether E is larger than twice u_val: smaller, the data cannot tell that the model is off, nor that it is not."""
    sentences: tuple[str, ...]
    """What that allows one to say, and what is not in it."""


class ReadingsFile(Part):
    """Which readings were judged."""

    name: str
    """Of the file, as the user or the lab named it."""
    sha256: str
    """Of its content."""
    operator: str | None
    """Who read; None where no note says."""
    date: str | None
    """When it was read, as the lab writes it; None where no note says."""
    dialect: str
    """How the sheet was understood, in a sentence."""


class Sizes(Part):
    """One number at three particle sizes, from the finest to the coarsest."""

    radii_mm: tuple[float, ...]
    """Of the particles; the trial's own stands in the middle."""
    values_mm: tuple[float, ...]
    """The number at each of them."""
    kind: str
    """converging, no order, or oscillatory."""
    order: float | None
    """As observed; None where there is none."""
    band_95_mm: float
    """By the grid convergence index where it converges, else the spread of the three."""


class Input(Part):
    """What one declared standard uncertainty of an input does to the simulated level."""

    meaning: str
    """In words."""
    standard: float
    """As declared."""
    unit: str
    """Of it."""
    mean_level_mm: float
    """Change of the mean level for an input larger by that."""
    largest_mm: float
    """Largest change of the level anywhere, whatever its sign."""


class Shift(Part):
    """The comparison with the readings moved along the crack."""

    shift_mm: float
    """By how much."""
    mean_error_mm: float
    """Then."""
    bias_mm: float
    """Then."""


class PageTable(Part):
    """A table of the page, every number in words with its unit."""

    title: str
    """As on the page."""
    rows: tuple[tuple[str, str], ...]
    """Label, and what it labels."""


class ReportData(Part):
    """One trial: what was found, how sure that is, what it rests on."""

    schema_version: Literal[2] = 2
    """Larger where a program that reads this version would go wrong."""
    name: str
    """Of the trial."""
    note: str
    """Its user's own words."""
    verdict: Verdict
    """In one line, with what it takes to be more than a line."""
    cautions: tuple[str, ...]
    """What must be read before any number."""
    metrics: dict[str, Quantity]
    """Simulated against measured level; empty without readings."""
    readings: ReadingsFile | None
    """None without readings."""
    error_by_bin: tuple[ErrorBin, ...]
    """Along the crack, as in the report's histogram."""
    uncertainty: Uncertainty | None
    """None where none was assessed."""
    sizes: dict[str, Sizes]
    """Mean level and mean error at three particle sizes; empty where no other sizes were run."""
    inputs: dict[str, Input]
    """By their names in the trial's table [uncertainty]; empty where none is declared or none was varied."""
    shifts: tuple[Shift, ...]
    """Where s is 0 is a choice: what another one would make of the error. Empty without readings."""
    mass_balance: dict[str, Quantity]
    """Where the dispensed sealant is, as particles."""
    settled: dict[str, Quantity]
    """The same as volumes of settled sealant, beside what the readings hold; empty without readings."""
    health: dict[str, Quantity | str]
    """What the run recorded of itself."""
    assumptions: tuple[str, ...]
    """What was taken for granted."""
    left_out: tuple[str, ...]
    """Data that stand in no metric, and why."""
    provenance: dict[str, str]
    """Versions, device, seed, dates, hashes."""
    commands: tuple[str, ...]
    """What makes this report again, one after the other."""
    tables: tuple[PageTable, ...]
    """All that stand on the page, so that no number of it is missing here."""


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of report.json."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return head | ReportData.model_json_schema(mode="serialization")


if __name__ == "__main__":
    sys.stdout.write(json.dumps(schema(), indent=2, ensure_ascii=False) + "\n")
