"""Public reports of inputs that went wrong in other software, each as a file of that form: what sealtwin answers.

    python -m benchmarks.public_reports [--only KIND|WORD ...]

Files are made by ``benchmarks.reported_files`` and its like. What a sound answer is was decided before any of them
ran: a right figure, a refusal that names file and cause, or a warning that does. A wrong or assumed figure without a
word is wrong, and so is a traceback.
"""

from collections.abc import Sequence
from typing import Annotated

from typer import Option

from benchmarks import fifth_reports, first_reports, fourth_reports, second_reports, sixth_reports, third_reports
from benchmarks.report_checks import Report, judge
from benchmarks.table import Row, run_benchmark

DRAWS = {
    "first": first_reports.REPORTS,
    "second": second_reports.REPORTS,
    "third": third_reports.REPORTS,
    "fourth": fourth_reports.REPORTS,
    "fifth": fifth_reports.REPORTS,
    "sixth": sixth_reports.REPORTS,
}
"""By kind; each draw was made after the faults that the one before it showed were mended."""


def main(
    only: Annotated[list[str] | None, Option(help="kind, or part of an address; may be given again")] = None,
) -> list[Row]:
    rows = []
    for name, draw in DRAWS.items():
        chosen = [(kind, one) for kind, reports in draw.items() for one in reports if _asked(only, kind, one)]
        sound = 0
        for kind, report in chosen:
            line, is_sound = judge(report)
            print(f"{'sound' if is_sound else 'WRONG':<6}{kind} {report.address}: {line}", flush=True)
            sound += is_sound
        if chosen:
            rows.append(Row(f"reports of the {name} draw, sound", sound, "", len(chosen), len(chosen)))
    return rows


def _asked(words: Sequence[str] | None, kind: str, report: Report) -> bool:
    return words is None or any(word == kind or word in report.address for word in words)


if __name__ == "__main__":
    run_benchmark(main)
