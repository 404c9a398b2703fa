"""Words in a program: whatever somebody calls a trial, it stays a comment."""

from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from digitise.robots.gcode import gcode_text
from digitise.robots.robot_path import LONGEST, comments, decimal
from digitise.robots.spel import spel_text
from digitise.robots.urscript import urscript_text
from tests.cells import placed
from tests.robot_readers import read_gcode, read_spel, read_urscript

PATH = placed()
HOSTILE = [
    "bench\nG1 Z-500 F9000",
    "bench\r\nMove P999",
    "a ; G28\u2028G1 Z-500",
    "x\") : Motor Off '",
    "*) (*) ! ? ~ \x18 % $X\x85G0 Z0",
    "'''\"\"\" end\ndef evil():\n",
    "\x00\x0b\x0c\x1c\x1d\x1e\u2029 G0 Z-9",
]


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.parametrize(
    ("text", "read"), [(gcode_text, read_gcode), (spel_text, read_spel), (urscript_text, read_urscript)]
)
def test_a_hostile_name_never_becomes_code(name, text, read):
    """The readers refuse words they do not know; what they do know must be the same with any name."""
    plain, named = text(replace(PATH, head=("bench",))), text(replace(PATH, head=(name,)))
    assert read(named) == read(plain)
    assert len(named.splitlines()) == len(plain.splitlines())
    assert named.splitlines()[1:] == plain.splitlines()[1:]


@given(st.lists(st.integers(0, 0x10FFFF).map(chr), max_size=60).map("".join))
@example("0" * 200)
@example("".join(map(chr, range(0x2100))))
def test_a_comment_is_one_line_of_harmless_signs(text):
    said = comments("", [text])[0]
    assert len(said.splitlines()) <= 1
    # GRBL obeys ! ? ~ even in comments; % ends a tape, * begins a checksum, quotes and brackets open things.
    assert not set(said) & set("!?~%*$'\"`;#()[]{}<>\\|&^@\t\x7f")
    assert said.isascii()
    assert len(said) <= len(" ") + LONGEST


def test_plain_words_and_numbers_are_kept():
    assert comments("", ["trial paper-trial_2, 4.8 ml: 100/160 = ok"]) == [" trial paper-trial_2, 4.8 ml: 100/160 = ok"]
    assert comments(";", ["a", ""]) == ["; a", ";"]


@pytest.mark.parametrize(
    ("value", "decimals", "text"), [(1e-9, 4, "0.0000"), (-1e-9, 4, "0.0000"), (1e6, 1, "1000000.0"), (-2.5, 0, "-2")]
)
def test_numbers_have_no_powers_of_ten_and_no_minus_zero(value, decimals, text):
    assert decimal(value, decimals) == text
