"""Sheets of text, read or refused."""

import json

import pytest

from sealtwin.core.records import Profile
from validate.readings.read_readings import read_readings
from validate.readings.grid import SheetFaults
from validate.settings import Columns, Declared


@pytest.fixture
def read(tmp_path):
    def from_text(text: str | bytes, depth_mm: float | None = None, columns: dict | None = None, **declared) -> Profile:
        path = tmp_path / "lab.csv"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        if columns is not None:
            declared["columns"] = Columns.model_validate_json(json.dumps(columns))
        return read_readings(path, Declared(**declared), 80.0, depth_mm)

    return from_text


@pytest.fixture
def refused(read):
    def faults(text: str | bytes, *how, **declared) -> SheetFaults:
        with pytest.raises(SheetFaults) as caught:
            read(text, *how, **declared)
        return caught.value

    return faults
