"""Public reports of inputs that went wrong in other software, each as a file of that form: what sealtwin answers.

What is left of six draws, each made after the faults that the one before it showed were mended; other tests guard the
rest. For 14 of them the case is a row of ``tests/wrong_inputs``:

- photos: transformersphp-background-removal/issues/4, imago/issues/4, libvips/issues/1946, OCRmyPDF/issues/137,
  obs-service-tar_scm/issues/398
- digitise: netDxf/issues/184, gdal/issues/3636
- readings: weewx/issues/607, turicreate/issues/1692, ExcelDataReader/issues/40, numpy/issues/10448, ert/pull/37
- material: CoreFloodManager/issues/7, pyGAPS/issues/3
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
