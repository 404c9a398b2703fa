"""The form of report.json, and the report of a trial in this form.

``python -m validate.report.report_data`` prints the JSON Schema published as
validate/schema/report.schema.json.
"""

import json
import sys
from typing import Any, Literal

from sealtwin.core import facts, solid_figures
from sealtwin.core.facts import Fact, without
from sealtwin.core.records import DataKind, JsonRecord
from sealtwin.core.run_figures import Known
from sealtwin.core.settings_text import described
from validate import comparison, report_input, result, settings, units
from validate.comparison import in_unit
from validate.report_input import Evidence, ReadingsSheet
from validate.result import IF_SEVERAL, Comparison, Outcome, PredictedLevel, SeedRuns
from validate.units import PageTable, unit_of, words
from validate.wording import first_page as first_page_words
from validate.wording.comparison import uncertainty_sentences, volumes_mm3
from validate.wording.first_page import FirstPage, first_page
from validate.wording.headline import NOT_A_VALIDATION, cautions, headline, in_short
from validate.wording.sample_and_run import HEALTH_LABELS, assumptions, left_out


class NumberWithUnit(JsonRecord):
    """A number with its unit."""

    value: Known = in_unit("that of unit")
    """The number; None if it does not exist."""
    unit: str
    """Unit as printed; "1" for a pure number."""
    meaning: str
    """Meaning of the number, in words."""


class ReadingsFile(ReadingsSheet):
    """The file of the readings."""

    dialect: str
    """A sentence on how the sheet was interpreted."""
    data: DataKind
    """Origin of the readings; only measured data can validate."""


class ReportData(JsonRecord):
    """Report of one trial: its results, their uncertainty and their origin."""

    schema_version: Literal[4] = 4
    """Version of this form. Programs for one version cannot read another."""
    name: str
    """Name of the trial."""
    note: str
    """Note of the trial, in its user's words."""
    first_page: FirstPage
    """The first page in words: verdict, two sentences, four figures."""
    in_short: tuple[str, ...]
    """Result in plain sentences."""
    headline: tuple[Fact, ...]
    """First findings of the report: on the gate, the baselines and the use of the readings."""
    outcome: Outcome
    """passed, failed: the gate is outside the mean error's 95 % interval, or a particle escaped. undecided: the gate is
    inside this interval, there are too few readings, or files were edited by hand. open: no readings, or no gate
    declared."""
    edited: tuple[str, ...]
    """Files of the run that were changed after their stage wrote them. If there is one, nothing in the report is a
    result."""
    cautions: tuple[Fact, ...]
    """Warnings to be read before any number."""
    photo_data: DataKind
    """Origin of the photo or the mesh; only measured data can validate."""
    readings: ReadingsFile | None
    """File of the readings; None if there are no readings."""
    comparison: Comparison | None
    """Figures of simulated against measured level, and the verdict; None if there are no readings."""
    prediction: PredictedLevel | None
    """Level of a run without readings, with its band; None if there are readings, or no extra runs."""
    seeds: SeedRuns | None = IF_SEVERAL
    """Runs that differ only in the seed, whose mean is the level; left out if there is one run."""
    uncertainty: tuple[str, ...]
    """Sentences on the uncertainty, and on what the intervals do not include."""
    mass_balance: dict[str, NumberWithUnit]
    """Volume of the dispensed sealant at each place."""
    health: dict[str, NumberWithUnit | str]
    """Numbers that the run recorded about itself."""
    assumptions: tuple[str, ...]
    """Assumptions of the model, in sentences."""
    left_out: tuple[str, ...]
    """Data that no metric includes, and the reasons."""
    provenance: dict[str, str]
    """Versions, device, seed, dates and hashes."""
    commands: tuple[str, ...]
    """Commands that make this report again, in order."""
    tables: tuple[PageTable, ...]
    """All tables of the page."""

    @property
    def findings(self) -> tuple[Fact, ...]:
        """Conclusions according to ASME V&V 20, or a sentence that it was not assessed; empty without readings."""
        return () if self.comparison is None else self.comparison.findings

    @property
    def faults(self) -> tuple[Fact, ...]:
        """Cautions without the one on data that were not measured, which is on the first page."""
        return without(self.cautions, NOT_A_VALIDATION)

    @property
    def tone(self) -> Outcome:
        """Outcome that sets the verdict's colour: "passed" counts as "open" unless the readings were held out."""
        held_out = self.comparison is not None and self.comparison.role == "held-out"
        return "open" if self.outcome == "passed" and not held_out else self.outcome


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of report.json, with the meaning of each field and units of numbers."""
    content: dict[str, Any] = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    content |= ReportData.model_json_schema(mode="serialization")
    modules = (
        settings,
        comparison,
        result,
        report_input,
        units,
        solid_figures,
        facts,
        first_page_words,
        sys.modules[__name__],
    )
    for record in (content, *content["$defs"].values()):
        # The docstring of a table of settings ends with a list of its fields.
        record["description"] = record["description"].partition("\n\nParameters\n")[0]
        meanings = described(next(vars(one)[record["title"]] for one in modules if record["title"] in vars(one)))
        for name, field in record.get("properties", {}).items():
            field |= {"description": meaning} if (meaning := meanings.get(name)) else {}
            if record is not content and '"number"' in json.dumps(field):
                field.setdefault("unit", "1" if name.startswith("share") else unit_of(name))
    return content


def report_data(evidence: Evidence, tables: tuple[PageTable, ...] = ()) -> ReportData:
    """Return the content of report.json. ``tables`` are the tables of the page."""
    readings, sheet = evidence.readings, evidence.sheet
    verdict, outcome = headline(evidence)
    return ReportData(
        name=evidence.name,
        note=evidence.note,
        first_page=first_page(evidence),
        in_short=in_short(evidence),
        headline=verdict,
        outcome=outcome,
        edited=evidence.edited,
        cautions=cautions(evidence),
        photo_data=evidence.photo_data,
        readings=sheet and readings and ReadingsFile(**dict(sheet), dialect=readings.dialect, data=readings.data),
        comparison=evidence.comparison,
        prediction=evidence.prediction,
        seeds=evidence.seeds,
        uncertainty=uncertainty_sentences(evidence),
        mass_balance={
            key: NumberWithUnit(value=volume_mm3, unit="mm³", meaning=label)
            for key, (label, volume_mm3) in volumes_mm3(evidence).items()
        },
        health={key: _health(key, value) for key, value in evidence.run.health.recorded().items()},
        assumptions=tuple(assumptions(evidence)),
        left_out=tuple(left_out(evidence)),
        provenance=evidence.provenance,
        commands=evidence.commands,
        tables=tables,
    )


def _health(key: str, value: Any) -> NumberWithUnit | str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    meaning = HEALTH_LABELS[key][0] if key in HEALTH_LABELS else words(key)
    return NumberWithUnit(value=value, unit=unit_of(key), meaning=meaning)


if __name__ == "__main__":
    sys.stdout.write(json.dumps(schema(), indent=2, ensure_ascii=False) + "\n")
