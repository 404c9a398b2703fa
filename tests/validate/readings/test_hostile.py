"""Vast, damaged and changing files are refused in a sentence, within bounded time and memory."""

import os
import random
import time
import tracemalloc

import pytest

from sealtwin.core.errors import InputError
from tests.sheet_writers import Hand, write_sheet
from validate.readings.read_readings import read_readings
from validate.readings.samples import sheets_of
from validate.settings import Declared


@pytest.mark.parametrize("start", [b"s_mm,depth_mm\n", b"PK\x03\x04"], ids=["text", "workbook"])
def test_a_gigabyte_is_refused_before_it_is_read(tmp_path, start):
    path = tmp_path / "large.csv"
    path.write_bytes(start)
    os.truncate(path, 1_000_000_000)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="larger than"):
            read_readings(path, Declared())
        assert tracemalloc.get_traced_memory()[1] < 20_000_000
    finally:
        tracemalloc.stop()


VAST = {
    "blank columns": ("s_mm,depth_mm" + "," * 50_000 + "\n0,1\n", "1 station"),
    "columns": ("s_mm" + ",depth_mm" * 20_000 + "\n0,1\n", "more than 256 columns"),
    "a vast cell": ("s_mm,depth_mm\n0,1\n5," + "1" * 200_000 + "\n", "not a CSV"),
    "a long number": ("s_mm,depth_mm\n0,1\n5," + "1" * 100_000 + "\n", "is not a number"),
    "a long name": ("s_mm,depth_mm" + "x" * 100_000 + "\n0,1\n", "no column of readings"),
    "a slow name": ("s_mm,depth (in" + " " * 100_000 + "x\n0,1\n", "no column of readings"),
    "lines": ("\n" * 50_000 + "s_mm,depth_mm\n0,1\n", "1 station"),
    "blanks": (";\n" * 10_100, "more than 10000 rows"),
}


@pytest.mark.parametrize(("content", "words"), VAST.values(), ids=VAST)
def test_vast_text_is_refused_shortly(tmp_path, content, words):
    """A pattern that backtracks takes hours for a name of 100,000 blanks. The time is this process's alone."""
    path = tmp_path / "vast.csv"
    path.write_text(content)
    began = time.process_time()
    with pytest.raises(InputError, match=words) as caught:
        read_readings(path, Declared())
    assert time.process_time() - began < 5
    assert len(str(caught.value)) < 3_000


@pytest.mark.parametrize("workbook", [False, True])
def test_damaged_files_are_read_or_refused(tmp_path, workbook):
    """Files with bytes changed, cut out and repeated raise InputError, or are read."""
    hand = Hand(workbook=workbook, encoding="utf-16", language="german", long=True)
    path = write_sheet(tmp_path / "a", hand, [0.0, 5.0, 12.34], [[-1.0, -1.5], [-2.0, -2.5], [0.25, float("nan")]])
    sound = path.read_bytes()
    dice = random.Random(0)
    outcomes = {True: 0, False: 0}
    for _ in range(DAMAGES):
        path.write_bytes(damaged(sound, dice))
        sheets_of(path)
        try:
            read_readings(path, Declared())
            outcomes[True] += 1
        except InputError:
            outcomes[False] += 1
    assert outcomes[False] > DAMAGES / 2


DAMAGES = 40


def damaged(content: bytes, dice: random.Random) -> bytes:
    result = bytearray(content)
    for _ in range(dice.randint(1, 6)):
        at = dice.randrange(len(result))
        match dice.randrange(4):
            case 0:
                result[at] = dice.randrange(256)
            case 1:
                del result[at : at + dice.randint(1, 40)]
            case 2:
                result[at:at] = result[at : at + dice.randint(1, 40)]
            case _:
                result[at] ^= 1 << dice.randrange(8)
        if not result:
            return b""
    return bytes(result)
