import re
import xml.etree.ElementTree as ET

import pypdf
import pytest

from digitise.scaling.sheet import Bar, Sheet, Words, as_pdf, as_svg
from tests.sheets import Page, read_pdf, read_svg

SHEET = Sheet(
    210.0,
    297.0,
    (Bar(10.0, 20.0, 100.0, 0.3), Bar(30.5, 200.25, 16.0, 16.0, 0.75)),
    (Words(10.0, 12.5, 'Print (at "100 %") \\ <flat>'),),
)


@pytest.fixture(params=["pdf", "svg"])
def page(request, tmp_path) -> Page:
    path = tmp_path / f"sheet.{request.param}"
    path.write_bytes(as_pdf(SHEET) if request.param == "pdf" else as_svg(SHEET).encode())
    return read_pdf(path) if request.param == "pdf" else read_svg(path)


def test_a_page_has_the_true_size_of_its_paper(page):
    """To a micrometre: 4 decimals of a point."""
    assert page.size_mm == pytest.approx((210, 297), abs=1e-3)


def test_bars_lie_where_they_were_put_in_millimetres_from_the_lower_left(page):
    assert page.bars[-2] == pytest.approx((10, 20, 100, 0.3, 0), abs=1e-3)
    assert page.bars[-1] == pytest.approx((30.5, 200.25, 16, 16, 0.75), abs=2e-3)


def test_words_say_what_was_written(page):
    assert page.text == 'Print (at "100 %") \\ <flat>'


def test_a_viewer_is_asked_to_print_a_pdf_unscaled(tmp_path):
    (tmp_path / "sheet.pdf").write_bytes(as_pdf(SHEET))
    reader = pypdf.PdfReader(tmp_path / "sheet.pdf", strict=True)
    assert reader.viewer_preferences is not None
    assert reader.viewer_preferences.print_scaling == "/None"


def test_every_offset_of_a_pdf_points_at_its_object():
    """Viewers mend a wrong table silently; printers refuse the file."""
    content = as_pdf(SHEET)
    start = int(re.findall(rb"startxref\n(\d+)", content)[0])
    assert content[start : start + 4] == b"xref"
    offsets = [int(offset) for offset in re.findall(rb"(\d{10}) 00000 n", content)]
    for number, offset in enumerate(offsets, start=1):
        assert content[offset:].startswith(f"{number} 0 obj".encode())


def test_an_svg_is_well_formed():
    assert ET.fromstring(as_svg(SHEET)).tag.endswith("svg")
