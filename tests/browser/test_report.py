"""The report in a browser: wide and narrow, light and dark, with and without scripts."""

import importlib
from pathlib import Path
from typing import Any

import pytest

from tests.support.evidence import make_evidence
from validate.report.write_report import write_report
from validate.settings import Gate

pytestmark = pytest.mark.browser

LOOK = Path(__file__).with_name("look.js").read_text(encoding="utf-8")

HOSTILE = "</title></script><script>window.struck = 1</script><img src=x onerror='window.struck = 1'> \u202e$\\frac$"
NAME = HOSTILE + "\N{FIRE}" * 80


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    write_report(folder, make_evidence(folder, gate=Gate(mean_error_mm=1.0), readings_data="reconstructed"))
    return folder / "report.html"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A report whose texts from the user contain HTML and scripts."""
    folder = tmp_path_factory.mktemp("hostile")
    texts: dict[str, Any] = {"name": NAME, "note": HOSTILE * 3, "source": HOSTILE, "commands": (HOSTILE,)}
    write_report(folder, make_evidence(folder, **texts, provenance={HOSTILE: "0123456789abcdef" * 20}))
    return folder / "report.html"


@pytest.mark.parametrize(("width", "scheme"), [(390, "dark"), (1280, "light")])
def test_axe_finds_no_accessibility_violation_in_the_report(open_report, report, width, scheme):
    """All rules of axe-core are applied, with best practices and colour contrast."""
    axe = importlib.import_module("axe_playwright_python.sync_playwright").Axe()
    page = open_report(report, width=width, color_scheme=scheme)
    violations = axe.run(page).response["violations"]
    assert [(rule["id"], [node["html"][:80] for node in rule["nodes"]]) for rule in violations] == []


@pytest.mark.parametrize("width", [320, 768])
def test_no_part_of_the_report_is_wider_than_the_window_or_cut(open_report, report, hostile, width):
    """A name of any length does not make the page scroll sideways; no word of a plot is cut off by its edge."""
    page = open_report(hostile, width=width, height=844)
    assert page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    page = open_report(report, width=width, height=844)
    within = """() => [...document.querySelectorAll("figure svg, figure img, figure canvas")].filter((it) =>
        it.checkVisibility()).map((it) => {
        const box = it.getBoundingClientRect();
        return box.left >= 0 && box.right <= document.documentElement.clientWidth && box.width > 200;
    })"""
    assert all(page.evaluate(within))
    seen = page.evaluate(LOOK)
    assert (seen["cut"], seen["wider_px"]) == (0, 0)


def test_html_in_names_is_shown_as_text_and_not_executed(open_report, hostile):
    page = open_report(hostile)
    assert page.evaluate("window.struck") is None
    assert page.title() == NAME + ": sealtwin report"
    assert page.inner_text(".first .top b").startswith("</title></script>")
    assert page.locator("script").count() == 0
