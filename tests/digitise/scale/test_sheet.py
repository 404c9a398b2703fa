import io

import pypdf
import pytest

from digitise.scale.marker_print import Bar, MarkerFrame, as_pdf, board_around
from tests.sheets import Page, read_pdf

FACE_MM = (160.0, 40.0)
FRAME = MarkerFrame(
    (210.0, 297.0),
    (Bar(10.0, 20.0, 100.0, 0.3), Bar(30.5, 200.25, 16.0, 16.0, 0.75)),
    ((10.0, 12.5, 'Print (at "100 %") \\ <flat> $1 & $2'),),
    board_around(FACE_MM, 16.0, "4x4_50", 8),
    FACE_MM,
)


@pytest.fixture(scope="module")
def pdf() -> bytes:
    return as_pdf(FRAME)


@pytest.fixture(scope="module")
def page(pdf, tmp_path_factory) -> Page:
    path = tmp_path_factory.mktemp("sheet") / "sheet.pdf"
    path.write_bytes(pdf)
    return read_pdf(path)


def test_bars_and_words_lie_on_a_page_of_true_size_where_they_were_put(page):
    """In millimetres from the lower left, to five micrometres: fpdf2 writes 2 decimals of a point."""
    assert page.size_mm == pytest.approx((210, 297), abs=5e-3)
    assert len(page.bars) == 2
    assert page.bars[0] == pytest.approx((10, 20, 100, 0.3, 0), abs=5e-3)
    assert page.bars[1] == pytest.approx((30.5, 200.25, 16, 16, 0.75), abs=5e-3)
    assert page.text == 'Print (at "100 %") \\ <flat> $1 & $2'


def test_a_viewer_is_asked_to_print_a_pdf_unscaled(pdf):
    reader = pypdf.PdfReader(io.BytesIO(pdf), strict=True)
    assert reader.viewer_preferences is not None
    assert reader.viewer_preferences.print_scaling == "/None"


def test_the_same_page_is_the_same_bytes(pdf):
    """A frame printed again is recognised as the file that exists: no date, no random names."""
    assert as_pdf(FRAME) == pdf
