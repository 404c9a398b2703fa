"""Files of the kinds that failed in other software, according to public bug reports, are given to sealtwin.

The reports were drawn six times, and the faults that a draw showed were mended before the next; these are the forms
that no quick test has. The others are in tests/wrong_inputs, tests/sealtwin/core (meshes), tests/validate/readings
(sheets) and tests/digitise (cells and plans).
"""

from pathlib import Path

import pytest

from tests.slow.reports import drawings, meshes, photos, sheets, trials
from tests.slow.reports.table import REPORTS, Report, answer_to

MODULES = (drawings, meshes, photos, sheets, trials)
"""Modules that add their reports to the table."""


@pytest.mark.slow
@pytest.mark.parametrize("report", REPORTS, ids=lambda report: report.address)
def test_files_from_bug_reports_get_an_acceptable_answer(report: Report, tmp_path: Path):
    answer = answer_to(report, tmp_path)
    assert any(check(answer) for check in report.sound), (answer.code, answer.words[-400:])
