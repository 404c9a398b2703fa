"""Measured dam breaks of the literature, and the page of 'sealtwin demo --measured'."""

import html
import json
import re

import numpy as np
import pytest

from sealtwin.study import measured_blocks
from sealtwin.study.measured_blocks import SHOWN, content, dam_break_of, dam_breaks, measured_page, table
from tests.support.paths import ROOT
from tests.support.processes import sealtwin
from tests.support.report_stubs import leave_out_figures
from validate.figures.page import write_page

LONG = 1.1  # Computed over measured fronts of the courses that the tests give


def course(case, *_, **__):
    clock, shift = content()["clock"], content()["calibrated"]["shift_outlines"]
    return (np.arange(9) + shift) * clock["outline_s"], LONG * case.measured_mm


def test_the_stored_dam_break_fronts_equal_the_benchmark_results():
    """reports/results.json has the rows of 'python -m benchmarks.measured', perhaps of another processor."""
    results = json.loads((ROOT / "reports" / "results.json").read_text(encoding="utf-8"))["measured"]["rows"]
    values = {row["name"].partition(":")[0]: row["value"] for row in results if row["name"].endswith(", computed")}
    fronts_mm = {dam_break_of(row): row["front_mm"] for row in table("computed.csv")}
    assert len(fronts_mm) == 7
    for case, front_mm in fronts_mm.items():
        assert front_mm == pytest.approx(values[f"{case.name}, outline 8"], rel=0.01)


def test_the_dam_break_page_states_clock_shift_differences_and_sources(tmp_path):
    """Both courses of this test are 1.1 times as long as measured."""
    sheet = measured_page({case: course(case) for case in dam_breaks([SHOWN])})
    write_page(tmp_path / "measured.html", sheet)
    page = re.sub(r"<(style|svg).*?</\1>|<[^>]+>", " ", (tmp_path / "measured.html").read_text("utf-8"), flags=re.S)
    words = " ".join(html.unescape(page).split())
    assert "These flows are not in a crack" in words
    assert "Only one number is fitted to the films: a time shift of 24 ms" in words
    assert "differ by +10 % and +10 %" in words
    for source in content()["sources"].values():
        assert all(text in words for text in source.values())
    assert len(words.split()) < 400


def test_demo_measured_prints_both_fronts_and_the_path_of_the_page(tmp_path, monkeypatch):
    leave_out_figures(monkeypatch)
    monkeypatch.setattr(measured_blocks, "course_of", course)
    answer = sealtwin("demo", "--measured", "--out", tmp_path)
    assert answer.exit_code == 0, answer.output
    assert answer.stdout.splitlines() == [
        "front of the block of 42 x 38 mm: 50.1 mm computed, 45.5 mm measured",
        "front of the block of 29 x 20 mm: 23.4 mm computed, 21.3 mm measured",
        f"Page: {tmp_path / 'measured.html'}",
    ]
