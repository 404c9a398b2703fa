"""Helpers that read sheets of text, collect the doubts about them, and answer these."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from sealtwin.core.doubts import COLUMNS, Doubt
from sealtwin.core.records import Profile
from validate.readings.grid import SheetFaults
from validate.readings.read_readings import read_readings
from validate.settings import Columns, Declared

OWN = {"columns.s": "A", "columns.levels": ["B", "C"], "columns.places": "mm", "unit": "mm", "quantity": "depth"}
OWN |= {"decimal": "comma", "datum": "caliper_base", "datum_level_mm": 5.0}
"""Answers that only the user knows."""
ADDED = ("as_written", "skip")  # Settings of which all entries count


def declared_of(columns: dict[str, Any] | None = None, **declared: Any) -> Declared:
    chosen = None if columns is None else Columns.model_validate_json(json.dumps(columns))
    return Declared(columns=chosen, **declared)


def answered(doubts: Sequence[Doubt], columns: dict[str, Any] | None = None, **declared: Any) -> dict[str, Any]:
    """Return the settings with the answers of all doubts, put together as a user writes them."""
    answers, own = dict[str, Any](), OWN | declared.pop("own", {})
    for doubt in doubts:
        for key, value in doubt.answers.items():
            value = own[key] if value is None else value
            answers[key] = [*answers.get(key, []), *value] if isinstance(value, list) else answers.get(key, value)
    columns = {**(columns or {})}
    for key, value in answers.items():
        table, name = (columns, key.removeprefix(COLUMNS)) if key.startswith(COLUMNS) else (declared, key)
        value = [*dict.fromkeys(value)] if isinstance(value, list) else value
        value = [*table.get(name, []), *value] if name in ADDED else value
        table[name] = tuple(value) if name == "as_written" else value
    return {"columns": columns or None, **declared}


@pytest.fixture
def write(tmp_path):
    def to_file(text: str | bytes, name: str = "lab.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return to_file


@pytest.fixture
def read(write):
    def from_text(text: str | bytes, depth_mm: float | None = None, length_mm: float = 12.0, **declared) -> Profile:
        return read_readings(write(text), declared_of(**declared), length_mm, depth_mm)

    return from_text


@pytest.fixture
def doubts_of(read):
    """Return all that is open or in doubt about a sheet."""

    def doubts(text: str | bytes, *crack_mm: float, **declared) -> Sequence[Doubt]:
        try:
            return read(text, *crack_mm, **declared).questions
        except SheetFaults as faults:
            return faults.doubts

    return doubts


def listed(profile: Profile) -> list[list[float | None]]:
    """Return the repeats of each station, None for a missing one."""
    assert profile.repeats_mm is not None
    return [[None if mm != mm else mm for mm in row] for row in profile.repeats_mm.tolist()]


def brief(doubts: Sequence[Doubt]) -> str:
    """Return the kinds of doubts, their cells, and their answers without the names of settings."""
    parts = list[str]()
    for doubt in doubts:
        values = [
            value if isinstance(value, list) else [value] for value in doubt.answers.values() if value is not None
        ]
        answers = [f"{entry}" for value in values for entry in value]
        parts.append(" ".join([doubt.kind, *doubt.cells, *(["=", *answers] if answers else [])]))
    return "; ".join(parts)
