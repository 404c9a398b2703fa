"""Limits of a station, before and after the crack is traced."""

from pathlib import Path

import pytest

from validate.readings.read_readings import LONGEST_MM, CrackLimits
from validate.readings.sheet import FaultList, Place


def _refused(length_mm: float | None, s_mm: float) -> bool:
    faults = FaultList()
    CrackLimits(length_mm, 16.0).check_station(Place(Path("a.csv")), f"{s_mm}", s_mm, faults)
    return bool(faults.faults)


@pytest.mark.parametrize("length_mm", [None, 80.0, 1000.0])
def test_no_station_lies_before_the_crack_begins(length_mm):
    """An end is known to two millimetres. An ingest once let any station pass, minus infinity included."""
    assert not _refused(length_mm, -2.0)
    assert _refused(length_mm, -2.1)
    assert _refused(length_mm, -1e308)


def test_the_scale_has_its_share_at_the_end():
    assert not _refused(80.0, 82.4)
    assert _refused(80.0, 82.5)
    assert not _refused(1000.0, 1029.0)
    assert not _refused(None, LONGEST_MM)
    assert _refused(None, 1e308)
