import io
import re

import pypdf
import pytest

from digitise.scale.marker_print import Bar, MarkerFrame, as_pdf, as_svg, board_around
from tests.sheets import Page, read_pdf, read_svg

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


@pytest.fixture(scope="module", params=["pdf", "svg"])
def page(request, pdf, tmp_path_factory) -> Page:
    path = tmp_path_factory.mktemp("sheet") / f"sheet.{request.param}"
    path.write_bytes(pdf if request.param == "pdf" else as_svg(FRAME))
    return read_pdf(path) if request.param == "pdf" else read_svg(path)


def test_bars_and_words_lie_on_a_page_of_true_size_where_they_were_put(page):
    """In millimetres from the lower left, to a micrometre: matplotlib writes 6 decimals of a point."""
    assert page.size_mm == pytest.approx((210, 297), abs=1e-3)
    assert len(page.bars) == 2
    assert page.bars[0] == pytest.approx((10, 20, 100, 0.3, 0), abs=1e-3)
    assert page.bars[1] == pytest.approx((30.5, 200.25, 16, 16, 0.75), abs=2e-3)
    assert page.text == 'Print (at "100 %") \\ <flat> $1 & $2'


def test_a_viewer_is_asked_to_print_a_pdf_unscaled(pdf):
    reader = pypdf.PdfReader(io.BytesIO(pdf), strict=True)
    assert reader.viewer_preferences is not None
    assert reader.viewer_preferences.print_scaling == "/None"


def test_every_offset_of_a_pdf_points_at_its_object(pdf):
    """Viewers mend a wrong table silently; printers refuse the file."""
    start = int(re.findall(rb"startxref\n(\d+)", pdf)[0])
    assert pdf[start : start + 4] == b"xref"
    offsets = [int(offset) for offset in re.findall(rb"(\d{10}) 00000 n", pdf)]
    assert len(offsets) > 5
    for number, offset in enumerate(offsets, start=1):
        assert pdf[offset:].startswith(f"{number} 0 obj".encode())


def test_the_same_page_is_the_same_bytes(pdf):
    """A frame printed again is recognised as the file that exists: no date, no random names."""
    assert as_pdf(FRAME) == pdf
    assert as_svg(FRAME) == as_svg(FRAME)
