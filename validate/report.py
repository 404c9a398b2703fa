"""What a reviewer signs: a page, a PDF and a file for programs, all from the same facts and figures."""

from pathlib import Path

from sealtwin.store.files import replacing, write_json, write_text
from validate.evidence import Evidence
from validate.reporting.chapters import chapters
from validate.reporting.page import page
from validate.reporting.pdf import write_pdf
from validate.reporting.report_data import report_data
from validate.statements.table import Table

REPORT = ("report.html", "report.pdf", "report.json")
"""What is written."""

__all__ = ["REPORT", "Evidence", "write_report"]


def write_report(folder: Path, evidence: Evidence) -> None:
    """Write report.html, which needs no other file and no network, report.pdf, and report.json.

    Raises InputError where the overlay cannot be read.
    """
    content = chapters(evidence)
    write_text(folder / "report.html", page(evidence, content))
    with replacing(folder / "report.pdf") as temporary:
        write_pdf(temporary, evidence, content)
    tables = [item for chapter in content for item in chapter.items if isinstance(item, Table)]
    write_json(folder / "report.json", report_data(evidence, tables).model_dump(mode="json"))
