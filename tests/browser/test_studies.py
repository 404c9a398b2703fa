"""Pages of studies in a browser: width, loaded files and accessibility."""

import importlib
from pathlib import Path

import pytest

from sealtwin.core.facts import Fact
from tests.support.mapped_study import make_chart
from validate.figures.chart import Excluded
from validate.figures.map_page import map_page
from validate.figures.page import write_page

pytestmark = pytest.mark.browser

HOSTILE = "</title></script><script>window.struck = 1</script><img src=x onerror='window.struck = 1'>"


def a_map(folder: Path) -> Path:
    chart = make_chart((Excluded(36, {HOSTILE: HOSTILE}, Fact("failed", HOSTILE)),), name=HOSTILE + "W" * 300)
    write_page(folder / "map.html", map_page(chart, ()))
    return folder / "map.html"


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1280, "dark")])
def test_study_pages_fit_the_window_load_no_other_file_and_pass_axe(chromium, tmp_path, width, scheme):
    target = a_map(tmp_path).as_uri()
    complaints, asked = [], set()
    context = chromium.new_context(viewport={"width": width, "height": 844}, color_scheme=scheme)
    page = context.new_page()
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda fault: complaints.append(str(fault)))
    page.on("request", lambda request: asked.add(request.url))
    page.goto(target)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("window.struck") is None
    axe = importlib.import_module("axe_playwright_python.sync_playwright").Axe()
    violations = axe.run(page).response["violations"]
    assert [(rule["id"], [node["html"][:80] for node in rule["nodes"]]) for rule in violations] == []
    assert complaints == []
    assert asked == {target}
    context.close()
