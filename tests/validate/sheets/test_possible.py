"""Where a station can be, whether the crack is traced yet or not."""

from pathlib import Path

import pytest

from validate.sheets.faults import FaultList, Place
from validate.sheets.possible import LONGEST_MM, Crack


def _refused(length_mm: float | None, s_mm: float) -> bool:
    faults = FaultList()
    Crack(length_mm, 16.0).check_station(Place(Path("a.csv")), f"{s_mm}", s_mm, faults)
    return faults.count > 0


@pytest.mark.parametrize("length_mm", [None, 80.0, 1000.0])
def test_no_station_lies_before_the_crack_begins(length_mm):
    """Two millimetres: what an end is known to. Once an ingest let any place pass, minus infinity too."""
    assert not _refused(length_mm, -2.0)
    assert _refused(length_mm, -2.1)
    assert _refused(length_mm, -1e308)


def test_the_scale_has_its_share_at_the_end():
    assert not _refused(80.0, 82.4)
    assert _refused(80.0, 82.5)
    assert not _refused(1000.0, 1029.0)
    assert not _refused(None, LONGEST_MM)
    assert _refused(None, 1e308)
