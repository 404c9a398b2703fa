"""The page of a study: self-contained, with escaped names and its numbers in CSV files."""

import csv
import re

from sealtwin.core.facts import Fact
from tests.support.mapped_study import make_chart
from validate.figures.chart import Excluded
from validate.figures.map_page import map_page
from validate.figures.page import write_page

HOSTILE = "<script>alert(1)</script> $\\frac{a}{b}$ =1+1"


def test_a_map_page_is_self_contained_and_shows_names_as_plain_text(tmp_path):
    """Nothing is loaded from other places, and every figure has a text alternative and a file."""
    hostile = make_chart((Excluded(36, {"fluid.U": "=2+2"}, Fact("failed", HOSTILE)),), name=HOSTILE)
    folder, written = tmp_path, write_page(tmp_path / "map.html", map_page(hostile, ()))
    page = (folder / "map.html").read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    assert not re.search(r"(?:src|href)=\"(?!data:|#)", page)
    names = {"levels", "heat", "influence-U", "influence-D", "cost"}
    assert {f"figures/{name}.svg" for name in names} <= set(written)
    assert page.count("<svg") == len(names) == page.count('role="img" aria-label=')
    assert all((folder / name).is_file() for name in written)
    with (folder / "figures" / "runs.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 35
    assert min(rows, key=lambda row: float(row["mean_error_mm"]))["fluid.U"] == "30"
    # Names and reasons are text, in the page and in the CSV that a spreadsheet opens.
    assert "<script" not in page
    assert "&lt;script&gt;alert(1)" in page
    left_out = (folder / "figures" / "left-out.csv").read_text(encoding="utf-8")
    assert not re.search(r"(?:^|,)\"?[=+@-]", left_out, flags=re.MULTILINE)
