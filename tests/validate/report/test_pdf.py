"""The PDF of a report, which has at most four pages."""

import io
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image
from pypdf import PdfReader

from sealtwin.core.facts import doubt
from sealtwin.core.solid_figures import WeighedCavity
from tests.support.evidence import make_evidence
from validate.compare import assess
from validate.report.chapters import Picture, chapters
from validate.report.pdf import write_pdf
from validate.report.write_report import report_data
from validate.result import ReportData
from validate.settings import Readings, Uncertainty

PICTURE = Image.new("RGB", (200, 100), "grey")
TALL = Image.new("RGB", (45, 120), "grey")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return report_data(make_evidence(tmp_path_factory.mktemp("data"), name="裂 {nb} **no markup**"))


def pages_of(path, data: ReportData, captions) -> list[tuple[str, int]]:
    """Text of each page, and the number of its pictures."""
    jpeg = io.BytesIO()
    PICTURE.save(jpeg, "jpeg")
    pictures = (jpeg, TALL, *[PICTURE] * len(captions))
    write_pdf(path, data, (PICTURE, "Figure 1."), list(zip(pictures, captions, strict=False)))
    pages = PdfReader(path).pages
    streams = [content.get_data() for page in pages if (content := page.get_contents()) is not None]
    return [(page.extract_text(), stream.count(b" Do")) for page, stream in zip(pages, streams, strict=True)]


def test_the_longest_report_has_four_pages_and_all_pictures_with_captions(tmp_path, data, evidence, frames):
    """It has a comparison, snapshots and a weighed cavity. Seen to fail with thirteen pictures: a fifth page."""
    exact = (0.0, 0.0, 0.0)
    weighed = WeighedCavity((), (), (), (), 3.0, 5.0, 16.0, (exact, exact, exact), (1.0, 2.0))
    solid = replace(evidence.solid, figures=replace(evidence.solid.figures, weighed=weighed))
    settings = Readings.model_validate({"file": Path("caliper.csv"), "data": "measured", "role": "held-out"})
    full = replace(evidence, frames=tuple(frames), comparison=assess(evidence, settings, Uncertainty(), None))
    items = [item for chapter in chapters(replace(full, solid=solid)) for item in chapter.items]
    captions = [f"{item.caption} {'A long caption. ' * 30}" for item in items if isinstance(item, Picture)]
    notes = tuple(("Note:", "line\n" * 2000 if number == 1 else "word " * 300) for number in range(6))
    page = data.first_page.model_copy(update={"notes": notes, "labels": notes[:3]})
    cautions = tuple(doubt("fluid.volume", f"Caution {number}. " + "word " * 60) for number in range(40))
    crowded = data.model_copy(update={"first_page": page, "cautions": cautions})
    pages = pages_of(tmp_path / "report.pdf", crowded, captions)
    assert [pictures for _, pictures in pages[2:]] == [6, len(captions) - 6]
    assert len(pages) == 4
    assert [text.count("Figure ") for text, _ in pages[2:]] == [6, len(captions) - 6]
    assert sum(pictures for _, pictures in pages[:2]) == 1
    assert "Caution 1." in pages[1][0]
    assert "Caution 39." not in pages[1][0]
    assert "read report.html" in pages[1][0]
