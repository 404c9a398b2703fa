"""Sixty texts beside readings, in many languages, written by somebody who had not seen the reader.

``python -m benchmarks.sentences`` puts each text of ``sentences.csv`` above, below, between or beside the rows of a
sound sheet, and reads it: thirty change the readings and must be asked about, thirty do not.
"""

import csv
import tempfile
from collections import Counter
from pathlib import Path

from benchmarks.table import Row, run_benchmark
from sealtwin.core.doubts import Doubt
from validate.readings.grid import SheetFaults
from validate.readings.read_readings import read_readings
from validate.settings import Declared

TEXTS = Path(__file__).with_suffix(".csv")
HEADER = ["s [mm]", "depth 1 [mm]", "depth 2 [mm]", "depth 3 [mm]", "Remark"]
ROWS = [[f"{5 * k}", f"{2 + k / 7:.2f}", f"{2.05 + k / 7:.2f}", f"{1.98 + k / 7:.2f}", ""] for k in range(1, 9)]
MOST_NEEDLESS = 6


def main() -> list[Row]:
    asked = Counter[str]()
    with TEXTS.open(encoding="utf-8", newline="") as file, tempfile.TemporaryDirectory() as scratch:
        texts = list(csv.DictReader(file))
        for text in texts:
            path = Path(scratch, "P01.csv")
            path.write_text(sheet(text["where"], text["text"]), encoding="utf-8")
            is_asked = any(doubt.kind == "remark" for doubt in questions_of(path))
            asked[text["changes"]] += is_asked
            if is_asked != (text["changes"] == "yes"):
                print(f"{'asked' if is_asked else 'SILENT'}: {text['where']}, {text['language']}: {text['text']}")
    change = sum(text["changes"] == "yes" for text in texts)
    return [
        Row("texts that change readings: read in silence", change - asked["yes"], f"of {change}", 0, 0),
        Row("texts that do not: asked about", asked["no"], f"of {len(texts) - change}", 0, MOST_NEEDLESS),
    ]


def questions_of(path: Path) -> tuple[Doubt, ...]:
    try:
        return read_readings(path, Declared()).questions
    except SheetFaults as fault:
        return fault.doubts


def sheet(where: str, text: str) -> str:
    """Return a sheet as CSV with a text at a place: above, below, between, or in a row."""
    rows = [HEADER, *(list(row) for row in ROWS)]
    if where == "row":
        rows[4][-1] = text
    else:
        rows.insert({"above": 0, "between": 5, "below": len(rows)}[where], [text, "", "", "", ""])
    return "\n".join(";".join(f'"{cell}"' for cell in row) for row in rows) + "\n"


if __name__ == "__main__":
    run_benchmark(main)
