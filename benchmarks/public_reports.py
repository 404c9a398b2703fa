"""Public reports of inputs that went wrong in other software, each as a file of that form: what sealtwin answers.

    python -m benchmarks.public_reports [--only KIND|WORD ...]

Files are made by ``benchmarks.reported_files`` and its like. What a sound answer is was decided before any of them
ran: a right figure, a refusal that names file and cause, or a warning that does. A wrong or assumed figure without a
word is wrong, and so is a traceback.
"""

import argparse

from benchmarks import fifth_reports, first_reports, fourth_reports, second_reports, sixth_reports, third_reports
from benchmarks.report_checks import judge
from benchmarks.table import Row, leave

MODULES = (first_reports, second_reports, third_reports, fourth_reports, fifth_reports, sixth_reports)
DRAWS = tuple(module.REPORTS for module in MODULES)
"""By kind; each draw was made after the faults that the one before it showed were mended."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="KIND|WORD", help="kinds, or parts of addresses")
    asked = parser.parse_args()
    rows = []
    for kind, reports in (pair for draw in DRAWS for pair in draw.items()):
        for report in reports:
            if asked.only is None or any(word == kind or word in report.address for word in asked.only):
                line, sound = judge(report)
                print(f"{'sound' if sound else 'WRONG':<6}{kind} {report.address}: {line}", flush=True)
                rows.append(Row(report.address, float(sound), "", 1, 1))
    leave(rows)


if __name__ == "__main__":
    main()
