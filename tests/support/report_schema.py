"""The published schema of report.json, validate/schema/report.schema.json, from its records.

python -m tests.support.report_schema > validate/schema/report.schema.json
"""

import json
import sys
from typing import Any

from sealtwin.core import doubts, facts, solid_figures
from sealtwin.core.settings_text import described
from validate import comparison, intervals, result, settings, units


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of report.json, with the meaning of each field and units of numbers."""
    content: dict[str, Any] = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    content |= result.ReportData.model_json_schema(mode="serialization")
    modules = settings, comparison, intervals, units, solid_figures, facts, doubts, result
    for record in (content, *content["$defs"].values()):
        # The docstring of a table of settings ends with a list of its fields.
        record["description"] = record["description"].partition("\n\nParameters\n")[0]
        meanings = described(next(vars(one)[record["title"]] for one in modules if record["title"] in vars(one)))
        for name, field in record.get("properties", {}).items():
            # Pydantic's title of a field is its name in other letters.
            field.pop("title", None)
            field |= {"description": meaning} if (meaning := meanings.get(name)) else {}
            if record is not content and "unit" not in record["properties"] and '"number"' in json.dumps(field):
                field.setdefault("unit", "1" if name.startswith("share") else units.unit_of(name))
    return content


if __name__ == "__main__":
    sys.stdout.write(json.dumps(schema(), indent=2, ensure_ascii=False) + "\n")
