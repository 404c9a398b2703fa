"""The PDF of a report."""

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


def test_a_report_has_all_its_texts_and_pictures_with_captions(tmp_path, data, evidence, frames):
    """It has a comparison, snapshots and a weighed cavity."""
    exact = (0.0, 0.0, 0.0)
    weighed = WeighedCavity((), (), (), (), 3.0, 5.0, 16.0, (exact, exact, exact), (1.0, 2.0))
    solid = replace(evidence.solid, figures=replace(evidence.solid.figures, weighed=weighed))
    settings = Readings.model_validate({"file": Path("caliper.csv"), "data": "measured", "role": "held-out"})
    full = replace(evidence, frames=tuple(frames), comparison=assess(evidence, settings, Uncertainty(), None))
    items = [item for chapter in chapters(replace(full, solid=solid)) for item in chapter.items]
    captions = [f"{item.caption} {'A long caption. ' * 30}" for item in items if isinstance(item, Picture)]
    notes = tuple(("Note:", "line\n" * 100 if number == 1 else "word " * 300) for number in range(6))
    page = data.first_page.model_copy(update={"notes": notes, "labels": notes[:3]})
    cautions = tuple(doubt("fluid.volume", f"Fault {number}. " + "word " * 60) for number in range(40))
    crowded = data.model_copy(update={"first_page": page, "cautions": cautions})
    pages = pages_of(tmp_path / "report.pdf", crowded, captions)
    text = "\n".join(text for text, _ in pages)
    assert [f"Fault {number}." in text for number in range(1, 40)] == [True] * 39
    assert text.count("line") >= 200
    assert sum(pictures for _, pictures in pages) == 1 + len(captions)
    # A picture and its caption are on one page.
    assert all(text.count("Figure ") == pictures for text, pictures in pages)
