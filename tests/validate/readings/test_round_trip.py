"""One profile is read from sheets in every dialect."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.sheet_writers import Hand, write_sheet
from validate.readings.read_readings import read_readings
from validate.settings import Declared

S_MM = [0.0, 5.0, 12.34, 80.0]
LEVELS_MM = np.array([[-16.02, -15.98, -16.18], [-13.07, np.nan, -12.69], [0.0, 1.25, -0.01], [-2.5, -2.5, np.nan]])
CLOSE_MM = 1e-5
"""Resolution of the eighth decimal of a metre, in millimetres."""
TITLE_CELLS = ("A1", "A2", "A3", "A4", *"CDEF")
TITLES = [(), ("Probe 7, Riss A",), ("Messung am 3.4.", 'Prüfer: M; "Meßschieber" 2', "x")]


@st.composite
def hands(draw: st.DrawFn) -> Hand:
    encoding = draw(st.sampled_from(["utf-8", "utf-16", "utf-16-be", "cp1252"]))
    long = draw(st.booleans())
    return Hand(
        workbook=draw(st.sampled_from([False, False, False, True])),
        encoding=encoding,
        mark=encoding == "utf-16-be" or (encoding == "utf-8" and draw(st.booleans())),
        separator=draw(st.sampled_from(SEPARATORS)),
        decimal=draw(st.sampled_from(DECIMALS)),
        newline=draw(st.sampled_from(["\n", "\r\n", "\r"])),
        sep_line=draw(st.booleans()),
        language=draw(st.sampled_from(["canonical", "english", "german", "french", "spanish"])),
        quantity=draw(st.sampled_from(["level", "depth"])),
        long=long,
        station_unit=draw(st.sampled_from(UNITS)),
        unit=draw(st.sampled_from(UNITS)),
        units=draw(st.sampled_from(["name", "brackets", "parentheses", "slash", "in", "row"])),
        missing=draw(st.sampled_from(["", "n/a", "NA", "-", "k.A.", "\u2013"])),
        title=draw(st.sampled_from(TITLES)),
        gap=draw(st.booleans()),
        note=draw(st.booleans()),
        order=draw(st.permutations(range(len(S_MM) * (3 if long else 1)))),
    )


SEPARATORS, DECIMALS, UNITS = [",", ";", "\t"], [".", ","], ["mm", "cm", "m", "inch"]


def read_back(path: Path, hand: Hand) -> str:
    """Compare what is read with what was written; return how it was understood."""
    sheet = read_readings(write_sheet(path, hand, S_MM, LEVELS_MM), Declared(as_written=TITLE_CELLS))
    assert sheet.s_mm == pytest.approx(np.array(S_MM), abs=CLOSE_MM)
    assert sheet.repeats_mm == pytest.approx(LEVELS_MM, abs=CLOSE_MM, nan_ok=True)
    return sheet.dialect


@settings(max_examples=12, deadline=None)
@given(hand=hands())
def test_any_hand_writes_the_same_profile(tmp_path_factory, hand):
    """Encoding, separator, decimals, names, units, layout and order change nothing."""
    read_back(tmp_path_factory.mktemp("hand") / "sheet", hand)
