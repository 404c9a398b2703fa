"""Wrong caches, edited files, links and names."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tests.wrong_inputs.table import WrongInput, answers

RUN = {"version": 1, "stages": {}}
CATALOGUE = {"version": 6, "pairing": "", "sources": {}}
RECORD = {
    **{"sample": "p1", "name": "P1", "revision": 1, "folder": "P1", "source": "photos", "content": "", "files": []},
    **{"dialect": None, "date": None, "operator": None, "said": {}, "remarks": [], "ingested_utc": "", "sealtwin": ""},
}
PLANNED = {
    **{"number": 1, "key": 64 * "a", "settings": {"fluid.U": 3.0}, "trial": {"solver": {}}, "sample": "aaaaaaaaaaaa"},
    **{"kin": "", "work_s": 1.0},
}
PLAN = {"version": 1, "study": "tiny", "stage_numbers": {}, "runs": [PLANNED]}
FIGURES = {"volume_ratio": 1.0, "profile_sha256": "", "fluid_warnings": []}
OUTCOME = {"version": 1, "state": "done", "wall_s": 1.0, "figures": FIGURES}
OUTCOME_FILE = f"runs/{16 * 'a'}/outcome.json"

Content = dict[str, Any] | str | Path


def folder_of(contents: Mapping[str, Content]) -> Callable[[Path], None]:
    """Return a maker of files: JSON of a dictionary, a text as it is, a link to a path."""

    def make(folder: Path) -> None:
        for name, content in contents.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, Path):
                path.symlink_to(content)
            else:
                path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")

    return make


def study_of(outcome: dict[str, Any], **plan: Any) -> Callable[[Path], None]:
    return folder_of({"plan.json": PLAN | plan, OUTCOME_FILE: outcome})


def lab_of(catalogue: Content = CATALOGUE, **others: Content) -> Callable[[Path], None]:
    """Return a maker of a lab of one sample; ``others`` are record and run in place of its own."""
    files = {"record": "P1/record.json", "run": "P1/run/run.json"}
    contents = {files[name]: content for name, content in ({"record": RECORD} | others).items()}
    return folder_of({"catalogue.json": catalogue} | contents)


ran = answers("lab {given} --device cpu")
mapped = answers("map {given}")
validated = answers("validate {given}")

# fmt: off
CASES: list[WrongInput] = [
    ran("record of a sample whose files are a word", lab_of(record={**RECORD, "files": "none"}), "P1/record.json",
        "files", "none"),
    ran("run of a lab whose time is a word",
        lab_of(run={"version": 2, "name": "P1", "folder": "run", "wall_time_s": "short", "stages": []}),
        "P1/run/run.json", "wall_time_s = 'short'"),
    mapped("outcome of a run whose volume ratio is a word",
        study_of({**OUTCOME, "figures": {**FIGURES, "volume_ratio": "whole"}}), "outcome.json",
        "figures.volume_ratio = 'whole'"),
    mapped("outcome of a run that is done and has no figures", study_of({**OUTCOME, "figures": None}),
        "outcome.json", "figures"),
    mapped("plan of a study with a setting that is too large for a number",
        folder_of({"plan.json": json.dumps(PLAN).replace('"solver": {}', '"solver": {"radius_mm": 1e999}')}),
        "plan.json", "a number is too large"),
    validated("manifest of a run with a list in 600 others",
        folder_of({"manifest.json": f'{{"version": 1, "stages": {{}}, "x": {600 * "["}{600 * "]"}}}'}),
        "manifest.json", "damaged"),
]
# fmt: on
