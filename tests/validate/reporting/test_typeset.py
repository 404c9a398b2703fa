"""Lines of the PDF are as wide as the page allows, whatever letters they hold."""

import io

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import FigureBase
from matplotlib.textpath import TextPath
from pypdf import PdfReader

from tests.evidence import axes_of
from validate.drawing.theme import canvas, printable
from validate.reporting.typeset import HEIGHT_IN, MARGIN_IN, WIDTH_IN, Typesetter, wrapped


def pages_of(typeset) -> list[str]:
    """The text of each page that a function sets."""
    target = io.BytesIO()
    with PdfPages(target) as pages:
        setter = Typesetter(pages, "running title")
        typeset(setter)
        setter.end()
    return [page.extract_text() for page in PdfReader(target).pages]


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


def test_a_table_over_a_page_says_its_title_again():
    first, second = pages_of(lambda setter: setter.table("Settings", [(f"key {i}", "value") for i in range(70)]))
    assert first.startswith("Settings\n")
    assert second.startswith("Settings, continued\n")
    assert "key 69" in second


def test_a_short_table_and_a_paragraph_are_not_broken():
    """Broken on purpose, with no look ahead, the table's last row and the paragraph's last line go over the page."""
    rows = [(f"key {i}", "value") for i in range(12)]
    filler = "\n".join("filler" for _ in range(50))
    first, second = pages_of(lambda setter: (setter.text(filler), setter.table("Short", rows)))
    assert "Short" not in first
    assert all(f"key {i} value" in second for i in range(12))
    paragraph = "\n".join(f"line {i}" for i in range(9))
    first, second = pages_of(
        lambda setter: (setter.text(filler), setter.text("\n".join("x" * 7)), setter.text(paragraph))
    )
    assert "line" not in first
    assert all(f"line {i}" in second for i in range(9))


def test_the_last_rows_come_over_together():
    """Of so many rows one or two would stand alone on the second page."""
    most = 0
    for count in range(48, 56):
        pages = pages_of(lambda setter, count=count: setter.table("T", [(f"key {i}", "value") for i in range(count)]))
        assert len(pages) == 1 or pages[1].count("value") >= 3
        most = max(most, len(pages))
    assert most == 2


def test_each_page_has_the_running_title_and_its_number():
    pages = pages_of(lambda setter: setter.table("T", [(f"key {i}", "value") for i in range(130)]))
    assert len(pages) == 3
    for number, text in enumerate(pages, start=1):
        assert text.endswith(f"running title {number} of 3")


def test_a_chapter_s_title_does_not_stand_alone():
    filler = "\n".join("filler" for _ in range(48))
    first, second = pages_of(
        lambda setter: (setter.text(filler), setter.chapter("Chapter", below_in=3.0), setter.text("below"))
    )
    assert "Chapter" not in first
    assert second.startswith("Chapter\nbelow")


def test_a_row_stays_on_one_page():
    long = "\n".join(f"line {i}" for i in range(8))
    first, second = pages_of(lambda setter: setter.table("T", [(f"key {i}", "x") for i in range(45)] + [("row", long)]))
    assert "line" not in first
    assert all(f"line {i}" in second for i in range(8))


def test_a_row_longer_than_a_page_goes_on():
    long = "\n".join(f"line {i}." for i in range(150))
    texts = pages_of(lambda setter: setter.table("T", [("row", long)]))
    assert len(texts) == 3
    assert all(f"line {i}." in "".join(texts) for i in range(150))


def test_a_figure_lies_below_the_text_and_takes_its_caption_along():
    places = []

    def draw(on: FigureBase) -> None:
        axes = canvas(on, 9, 3).add_subplot()
        axes.set_xlabel("x (mm)")
        places.append(on)

    def typeset(setter: Typesetter) -> None:
        setter.text("before")
        setter.figure(4.0, draw, "caption of the first")
        setter.figure(4.0, draw, "caption of the second")
        setter.figure(4.0, draw, "caption of the third")
        setter.text("after")

    first, second = pages_of(typeset)
    assert [word in first for word in ("before", "of the first", "of the second", "of the third")] == [1, 1, 1, 0]
    assert "caption of the third\nafter" in second
    boxes = [
        axes.get_window_extent().transformed(on.figure.dpi_scale_trans.inverted())
        for on in places
        for axes in axes_of(on)
    ]
    for box in boxes:
        assert box.x0 > MARGIN_IN
        assert box.x1 < WIDTH_IN - MARGIN_IN + 0.01
        assert 2.5 < box.height < 4.0
    # From the top of the page down; the third begins a new one.
    tops_in = [HEIGHT_IN - box.y1 for box in boxes]
    assert MARGIN_IN < tops_in[0] < tops_in[1] - 4.0
    assert tops_in[2] < tops_in[0]
