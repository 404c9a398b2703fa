"""The page and the PDF of a report: complete, self-contained, with names that are not interpreted."""

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from pypdf import PdfReader

from sealtwin.core.errors import InputError
from tests.support.evidence import make_evidence
from tests.support.report_stubs import leave_out_figures
from validate.report.write_report import REPORT, write_report
from validate.result import ReportData
from validate.settings import Gate

HOSTILE = "<script>alert(1)</script> $\\frac$ {{ 7*7 }} $x_{1 </svg> \"quoted\" & 'so'"
RUDE = "\N{RIGHT-TO-LEFT OVERRIDE}</title><!-- " + "\N{FIRE}" * 80
"""Text that reverses the line, closes the element around it, and has characters that no font of ours has."""


class Reader(HTMLParser):
    """Tags with their attributes, and the text that a person reads."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += data


def written(folder: Path, **choices) -> tuple[str, Reader, str]:
    """Source of the page, its content, and the text of the PDF."""
    write_report(folder, make_evidence(folder, **choices), pdf=True)
    page = (folder / "report.html").read_text(encoding="utf-8")
    pdf = "\n".join(part.extract_text() for part in PdfReader(folder / "report.pdf").pages)
    return page, Reader(page), pdf


NAMES = {
    "gate": Gate(mean_error_mm=1.0),
    "name": "Slot 7 " + HOSTILE,
    "note": HOSTILE + " Riß 裂缝 \x07" + RUDE,
    "source": HOSTILE,
    "provenance": {HOSTILE: HOSTILE},
    "commands": (HOSTILE, "sealtwin run trial.toml"),
}


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    folder = tmp_path_factory.mktemp("usual")
    content = written(folder, **NAMES)
    return (*content, ReportData.model_validate_json((folder / "report.json").read_text(encoding="utf-8")))


def test_page_and_pdf_of_a_report_have_the_same_order_and_figure_numbers(usual):
    _, page, pdf, _ = usual
    titles = "Agreement with the readings|Readings|Dispensed sealant, by place|Crack and solid|Nozzle path|"
    titles += "Numerical health|Settings in effect|Provenance|Assumed and left out"
    facts = "Bond number 2.2|0.987|sealtwin run trial.toml|kinematic viscosity in effect"
    assert [words for words in f"{titles}|{facts}".split("|") if words not in page.text] == []
    for text in (page.text, pdf.replace("\n", " ")):
        for words in ("Limit 1 mm", "flat level of the dispensed volume", "held out"):
            assert text.index("Slot 7") < text.index(words) < text.index("Figure 2. ")
        assert "over the photo (measured); scale: " in text.replace("\n", " ")
    numbers = [re.findall(r"Figure\s(\d+)\.\s", text) for text in (page.text, pdf)]
    assert numbers[0] == numbers[1] == [str(number) for number in range(1, 7)]


def test_the_report_page_is_self_contained(usual):
    source, page, *_ = usual
    assert len(source) < 3_000_000
    assert {"link", "iframe", "object", "form"}.isdisjoint(tag for tag, _ in page.tags)
    keys = ("src", "href", "xlink:href")
    references = [value or "" for _, each in page.tags for key, value in each.items() if key in keys]
    assert references
    assert all(value.startswith(("data:image/", "#")) for value in references)
    inside = {attributes["id"] for _, attributes in page.tags if "id" in attributes}
    assert {value[1:] for value in references if value.startswith("#")} <= inside
    assert "url(http" not in source
    # Namespaces are the only addresses left.
    spaces = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert set(re.findall(r"https?://[^\"' <>]+", source)) == spaces
    policy = next(attributes["content"] for _, attributes in page.tags if attributes.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert [tag for tag, _ in page.tags if tag == "script"] == []
    assert "script-src" not in policy


def test_every_figure_has_a_text_alternative_and_the_colours_of_the_page(usual):
    source, page, *_ = usual
    figures = [attributes for tag, attributes in page.tags if tag == "svg"]
    assert len(figures) == 6
    assert all(figure["role"] == "img" and figure["aria-label"] for figure in figures)
    drawing = source[source.index("<svg") :]
    # Curves too: a blue that is visible on white is hardly visible on a dark page.
    for variable, colour in (("var(--ink)", "#1c2833"), ("var(--simulated)", "#0072b2")):
        assert variable in drawing
        assert colour not in drawing
    # Each figure, since a style is taken function by function.
    drawings = re.findall(r"<svg.*?</svg>", source, flags=re.DOTALL)
    assert all("var(--muted)" in drawing_of_axes for drawing_of_axes in drawings if "xtick" in drawing_of_axes)


def test_names_with_markup_are_shown_as_plain_text(usual):
    """Broken on purpose: with autoescape off the page has a script, with parse_math on the PDF cannot be drawn."""
    source, page, pdf, data = usual
    assert [tag for tag, _ in page.tags].count("script") == 0
    assert data.note.endswith(RUDE)
    assert data.provenance == {HOSTILE: HOSTILE}
    assert page.text.count(HOSTILE) >= 5
    assert "alert(1)</script>" not in source
    assert HOSTILE.split(" {{")[0] in pdf
    assert pdf.count("alert(1)") >= 2
    assert RUDE in page.text
    assert "裂缝" in page.text
    assert "Riß ??" in pdf


def test_a_report_without_readings_states_that_nothing_was_compared(tmp_path, monkeypatch):
    leave_out_figures(monkeypatch)
    _, page, pdf = written(tmp_path, readings_data=None, photo_data="synthetic")
    for text in (page.text, pdf):
        assert "compared with nothing" in text
        assert text.index("Not a validation") < text.index("The sample from above")
        assert text.count("Not a validation") == 1
        assert "Agreement with the readings" not in text
        assert "mean error" not in text
    assert sum(tag == "svg" for tag, _ in page.tags) == 5
    data = ReportData.model_validate_json((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert (data.comparison, data.outcome) == (None, "open")
    before = [(tmp_path / name).read_bytes() for name in REPORT]
    written(tmp_path, readings_data=None, photo_data="synthetic")
    assert [(tmp_path / name).read_bytes() for name in REPORT] == before, "the same evidence gives the same bytes"


@pytest.mark.parametrize("content", [None, b"no picture"])
def test_the_error_for_an_unreadable_overlay_names_the_file(tmp_path, content):
    evidence = make_evidence(tmp_path)
    evidence.overlay_path.unlink()
    if content is not None:
        evidence.overlay_path.write_bytes(content)
    with pytest.raises(InputError, match=r"overlay\.png: (not found|the picture cannot be read)"):
        write_report(tmp_path, evidence)
    assert not (tmp_path / "report.html").exists()
