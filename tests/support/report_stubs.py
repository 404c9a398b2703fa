"""Reports and figures that are left out: drawing them takes seconds, which most tests of a run are not about."""

from pathlib import Path

import pytest
from PIL import Image

from validate.figures import page
from validate.report import write_report as report_module
from validate.result import Evidence


def leave_out_figures(patch: pytest.MonkeyPatch) -> None:
    """Write reports and sheets with all their words, and with empty pictures in place of their plates."""
    patch.setattr(page, "as_svg", lambda *_: "<svg></svg>")
    patch.setattr(report_module, "as_svg", lambda *_: "<svg></svg>")
    patch.setattr(report_module, "as_picture", lambda *_: Image.new("RGB", (2, 1)))


def leave_out_pages(patch: pytest.MonkeyPatch) -> list[Evidence]:
    """Write the files of a report empty; returns the evidence of the reports to come."""
    given: list[Evidence] = []

    def write_report(folder: Path, evidence: Evidence, **_: bool) -> list[str]:
        given.append(evidence)
        for name in report_module.REPORT:
            (folder / name).touch()
        return [*report_module.REPORT]

    patch.setattr(report_module, "write_report", write_report)
    return given
