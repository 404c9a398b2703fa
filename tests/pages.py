"""Reports and figures that are left out: drawing them takes seconds, which most tests of a run are not about."""

from pathlib import Path

import pytest
from PIL import Image

from validate.figures import page, snapshots
from validate.figures.theme import DrawnFigure
from validate.report import write_report as report_module
from validate.result import Evidence


def leave_out_figures(patch: pytest.MonkeyPatch) -> None:
    """Write reports and sheets with all their words, and with empty pictures in place of their plates; no gallery."""
    patch.setattr(snapshots, "write_gallery", lambda *_: [])
    patch.setattr(page, "as_svg", lambda *_: "<svg></svg>")
    empty = DrawnFigure("<svg></svg>", Image.new("RGB", (2, 1)))
    patch.setattr(report_module, "draw_both", lambda *_: empty)
    patch.setattr(report_module, "as_svg", lambda *_: empty.svg)
    patch.setattr(report_module, "as_picture", lambda *_: empty.pixels)


def leave_out_pdf(patch: pytest.MonkeyPatch) -> None:
    """Write reports with an empty PDF, whose fonts take a tenth of a second."""
    patch.setattr(report_module, "write_pdf", lambda path, *_: path.touch())


def leave_out_pages(patch: pytest.MonkeyPatch) -> list[Evidence]:
    """Write the files of a report empty, and no pictures of a run; returns the evidence of the reports to come."""
    given: list[Evidence] = []

    def write_report(folder: Path, evidence: Evidence) -> None:
        given.append(evidence)
        for name in report_module.REPORT:
            (folder / name).touch()

    patch.setattr(report_module, "write_report", write_report)
    patch.setattr(snapshots, "write_gallery", lambda *_: [])
    return given
