"""Pages of the PDF: lines as wide as the page allows, and what belongs together on one page."""

import io

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from pypdf import PdfReader

from validate.figures.theme import printable
from validate.report.write_report import Typesetter


def set_with(typeset) -> io.BytesIO:
    with Typesetter("running title") as paper:
        typeset(paper)
        return io.BytesIO(bytes(paper.output()))


def pages_of(typeset) -> list[str]:
    """The text of each page that a function sets."""
    return [page.extract_text() for page in PdfReader(set_with(typeset)).pages]


def drawn_on_pages(typeset) -> list[int]:
    """Number of pictures on each page."""
    contents = [page.get_contents() for page in PdfReader(set_with(typeset)).pages]
    return [content.get_data().count(b" Do") for content in contents if content is not None]


LETTERS = "abcWMil .-"
PARAGRAPHS = st.tuples(
    # Long ones too, of more than one line.
    st.text(LETTERS, max_size=120) | st.text(LETTERS, min_size=90, max_size=120),
    st.sampled_from([8.5, 20.0]),
    st.sampled_from(["", "B"]),
)


@pytest.mark.broad
@settings(max_examples=5, deadline=None)
@given(st.lists(PARAGRAPHS, min_size=5, max_size=10))
def test_nothing_is_lost_and_nothing_is_invented(paragraphs):
    """Each paragraph on a page of its own: a PDF takes half a second, to read and to subset its fonts."""

    def typeset(paper: Typesetter) -> None:
        for number, paragraph in enumerate(paragraphs):
            if number:
                paper.add_page()
            paper.paragraph(*paragraph)

    for number, (page, (text, *_)) in enumerate(zip(pages_of(typeset), paragraphs, strict=True), start=1):
        assert "".join(page.split()) == "".join(f"{text}running title {number} of {len(paragraphs)}".split())


@pytest.mark.parametrize("text", ["a " + "M" * 90 + " b", "sha256 " + "0123456789abcdef" * 9, "word " * 100])
def test_no_line_is_wider_than_the_page_and_words_fill_it(text):
    with Typesetter("") as paper:
        lines = paper.lines(text, paper.epw)
        widths = [paper.get_string_width(line) for line in lines]
        assert len(lines) > 1
        assert max(widths) <= paper.epw + 1e-6
        assert not text.startswith("word") or min(widths[:-1]) > 0.85 * paper.epw


def test_what_the_font_lacks_becomes_a_question_mark():
    assert printable("Ø 5 °, 裂\x00\n缝 \N{FIRE}") == "Ø 5 °, ??\n? ?"
    (page,) = pages_of(lambda paper: paper.paragraph("Ø 5 °, 裂 {nb} {number of pages} **no markup**"))
    assert page.startswith("Ø 5 °, ? {nb}")
    assert "**no markup**" in page


@pytest.mark.broad
def test_a_table_over_pages_says_its_title_again_and_each_has_the_running_title_and_its_number():
    pages = pages_of(lambda paper: paper.table_of([(f"key {i}", "value") for i in range(130)], "Settings"))
    assert len(pages) == 3
    for number, text in enumerate(pages, start=1):
        assert text.startswith("Settings\n")
        assert text.endswith(f"running title {number} of 3")
    assert "key 129" in pages[-1]


def filler(lines: int) -> str:
    return "\n".join(f"line {i}." for i in range(lines))


PARTED = {
    # Broken on purpose, with no look ahead, the paragraph's last line goes over the page.
    "a paragraph is not broken": lambda paper: (paper.paragraph("f\n" * 55), paper.paragraph("Start\n" + filler(9))),
    "a title does not stand alone": lambda paper: (
        paper.paragraph("f\n" * 48),
        paper.chapter("Start", below_in=3.0),
        paper.paragraph(filler(1)),
    ),
    "a row stays on one page": lambda paper: paper.table_of([("key", "x")] * 45 + [("Start", filler(8))], "T"),
}


@pytest.mark.parametrize(
    "typeset",
    [pytest.param(typeset, marks=[] if "paragraph" in name else pytest.mark.broad) for name, typeset in PARTED.items()],
    ids=PARTED,
)
def test_what_belongs_together_is_on_one_page(typeset):
    first, second = pages_of(typeset)
    assert "Start" not in first
    assert "line" not in first
    assert second.index("Start") < second.index("line 0.")


@pytest.mark.broad
def test_a_picture_takes_its_caption_along():
    """Three pictures of 3.4 inches: the third, and its caption, are on the second page."""
    picture = Image.new("RGB", (200, 100), "grey")

    def typeset(paper: Typesetter) -> None:
        paper.paragraph("before")
        for number in ("first", "second", "third"):
            paper.pictures([(picture, f"caption of the {number}")])
        paper.paragraph("after")

    first, second = pages_of(typeset)
    assert [word in first for word in ("before", "of the first", "of the second", "of the third")] == [1, 1, 1, 0]
    assert "caption of the third\nafter" in second
    assert drawn_on_pages(typeset) == [2, 1]
