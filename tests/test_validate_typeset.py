"""Lines of the PDF are as wide as the page allows, whatever letters they hold."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.textpath import TextPath

from validate.theme import printable
from validate.typeset import wrapped


@settings(max_examples=40, deadline=None)
@given(st.text(alphabet="abcWMil .-", max_size=120), st.sampled_from([8.5, 20.0]), st.sampled_from(["normal", "bold"]))
def test_nothing_is_lost_and_nothing_is_invented(text, size_pt, weight):
    lines = wrapped(text, 2.0, size_pt, weight)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


@pytest.mark.parametrize("text", ["W" * 300, "ill " * 60, "a " + "M" * 40 + " b", "sha256 " + "0123456789abcdef" * 4])
def test_no_line_is_wider_than_the_page(text):
    lines = wrapped(text, 3.0, 10.0)
    assert len(lines) > 1
    for line in lines:
        # Outlines of the letters, measured by another part of matplotlib; 1 % for the bearings at the ends.
        assert TextPath((0, 0), line, size=10.0).get_extents().width <= 3.0 * 72 * 1.01


def test_lines_are_filled():
    lines = wrapped("word " * 100, 5.0, 10.0)
    widths = [TextPath((0, 0), line, size=10.0).get_extents().width for line in lines[:-1]]
    assert min(widths) > 0.85 * 5.0 * 72


def test_what_the_font_lacks_becomes_a_question_mark():
    assert printable("Ø 5 °, 裂\x00\n缝 \N{FIRE}") == "Ø 5 °, ??\n? ?"
