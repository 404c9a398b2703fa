"""Public reports of inputs that went wrong in other software, each as a file of that form: what sealtwin answers.

What is left of six draws, each made after the faults that the one before it showed were mended: forms that no quick
test has. Other tests guard the rest: tests/wrong_inputs, of meshes tests/sealtwin/core, of sheets
tests/validate/readings, of cells and plans tests/digitise.
"""

from pathlib import Path

import pytest

from tests.slow.reports import drawings, meshes, photos, sheets, trials
from tests.slow.reports.table import REPORTS, Report, answer_to

MODULES = (drawings, meshes, photos, sheets, trials)
"""Each adds its reports to the table."""


@pytest.mark.slow
@pytest.mark.parametrize("report", REPORTS, ids=lambda report: report.address)
def test_the_answer_to_a_reported_file_is_sound(report: Report, tmp_path: Path):
    answer = answer_to(report, tmp_path)
    assert any(check(answer) for check in report.sound), (answer.code, answer.words[-400:])
