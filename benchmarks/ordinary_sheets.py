"""Twenty-two sheets as ordinary labs write them, with what they say and, where they leave something open, the answer."""

# ruff: noqa: E501  Each sheet is a line.

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl

from sealtwin.core.records import Floats

S_MM = (1.0, 3.0, 5.0, 7.0, 9.0, 11.0)
Rows = list[list[Any]]
Change = Callable[[Rows], Sequence[Sequence[Any]]]


@dataclass(frozen=True)
class OrdinarySheet:
    """A sheet: the manner in which it is written, its file's suffix, and the change of plain rows of depths to it."""

    manner: str
    suffix: str
    change: Change
    answers: Mapping[str, str] = field(default_factory=dict)  # What pairing.csv is told where it asks
    merged: Sequence[str] = ()  # Cells of a workbook that are merged

    def write(self, path: Path, levels: Floats) -> None:
        write_rows(path, self.change(_depths(levels)), merged=self.merged)


def write_rows(path: Path, rows: Sequence[Sequence[Any]], merged: Sequence[str] = ()) -> None:
    """Write rows as the suffix of a file says. A text has decimal commas, and semicolons between cells."""
    rows = [[None if cell == "" else cell for cell in row] for row in rows]
    if path.suffix == ".xlsx":
        book = openpyxl.Workbook()
        for row in rows:
            book.worksheets[0].append(row)
        for span in merged:
            book.worksheets[0].merge_cells(span)
        book.save(path)
    else:
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, delimiter=";")
            writer.writerows(
                [f"{cell}".replace(".", ",") if isinstance(cell, float) else cell for cell in row] for row in rows
            )


def levels_mm(number: int) -> Floats:
    """Return three levels at each station, (6, 3), to a hundredth of a millimetre."""
    random = np.random.default_rng([15, number])
    bed_mm = -2.0 + np.linspace(-0.6, 0.5, len(S_MM)) + 0.2 * random.standard_normal(len(S_MM))
    return np.round(bed_mm[:, None] + 0.05 * random.standard_normal((len(S_MM), 3)), 2)


def _depths(levels: Floats) -> Rows:
    return [[s, *(round(-float(level), 2) for level in row)] for s, row in zip(S_MM, levels, strict=True)]


def _below(*head: Sequence[Any]) -> Change:
    return lambda rows: [*head, *rows]


HEAD = ["Abstand [mm]", "Tiefe 1 [mm]", "Tiefe 2 [mm]", "Tiefe 3 [mm]"]
TWO_ROWS: Rows = [
    ["Abstand [mm]", "Tiefe unter Oberkante [mm]", "", ""],
    ["", "1. Messung", "2. Messung", "3. Messung"],
]
BLANK: list[Any] = ["", "", "", ""]


def _mean(rows: Rows) -> list[Any]:
    return [round(float(column), 3) for column in np.mean([row[1:] for row in rows], axis=0)]


def _with_means(rows: Rows) -> Rows:
    return [[*row, round(float(np.mean(row[1:])), 3), round(float(np.std(row[1:])), 3)] for row in rows]


def _side_by_side(rows: Rows) -> Rows:
    head = [["Q08", "", "", "", "", "K3", "", "", ""], [*HEAD, "", *HEAD]]
    return [*head, *([*row, "", row[0], *(value + 0.5 for value in row[1:])] for row in rows)]


def _beside_temperatures(rows: Rows) -> Rows:
    return [[*HEAD, "", "min", "Ofen"], *([*row, "", 10 * number, 20.0 + number] for number, row in enumerate(rows))]


def _merged_places(rows: Rows) -> Rows:
    return [["s [mm]", "depth [mm]"], *([row[0] if k == 0 else None, row[1 + k]] for row in rows for k in range(3))]


def _stacked(rows: Rows) -> Rows:
    again = [[row[0], *(value + 0.7 for value in row[1:])] for row in rows]
    return [["Riss 1", "", "", ""], HEAD, *rows, BLANK, ["Riss 2", "", "", ""], HEAD, *again]


SHEETS = (
    OrdinarySheet("a merged header of two rows", ".xlsx", _below(*TWO_ROWS), merged=["A1:A2", "B1:D1"]),
    OrdinarySheet("a header of two rows, saved as CSV", ".csv", _below(*TWO_ROWS)),
    OrdinarySheet("a comment below the header", ".csv", _below(HEAD, ["# Nullpunkt = Probenoberfläche", "", "", ""])),
    OrdinarySheet(
        "a comment that names another zero",
        ".csv",
        lambda rows: [HEAD, ["# Nullpunkt: Fuß des Messschiebers", "", "", ""], *([row[0], *(round(v + 0.8, 2) for v in row[1:])] for row in rows)],
        {"datum": "caliper_base", "datum_level_mm": "0.8"},
    ),
    OrdinarySheet("a row of units", ".csv", _below(["Abstand", "Tiefe 1", "Tiefe 2", "Tiefe 3"], ["[mm]"] * 4)),
    OrdinarySheet("n. m. where nothing was read", ".csv", lambda rows: [HEAD, *([*row[:3], "n. m."] if row[0] == 5.0 else row for row in rows)]),
    OrdinarySheet("a mean row and its deviation", ".csv", lambda rows: [HEAD, *rows, ["Mittelwert", *_mean(rows)], ["Stabw.", 0.3, 0.3, 0.3]]),
    OrdinarySheet("a mean column and its deviation", ".xlsx", lambda rows: [[*HEAD, "MW", "Stabw"], *_with_means(rows)]),
    OrdinarySheet("two tables side by side", ".csv", _side_by_side, {"range": "A1:D8"}),
    OrdinarySheet("another quantity beside the table", ".xlsx", _beside_temperatures, {"range": "A1:D7"}),
    OrdinarySheet("a mean column of formulas never calculated", ".xlsx", lambda rows: [[*HEAD, "Mittel"], *([*row, f"=AVERAGE(B{n}:D{n})"] for n, row in enumerate(rows, 2))]),
    OrdinarySheet("readings that are formulas never calculated", ".xlsx", lambda rows: [HEAD, *([row[0], *(f"={value + 3:.2f}-3" for value in row[1:])] for row in rows)]),
    OrdinarySheet("names that nobody knows", ".csv", _below(["Stelle", "a", "b", "c"]), {"s": "A", "levels": "B C D", "unit": "mm", "sign": "down"}),
    OrdinarySheet("no header at all", ".csv", _below(), {"s": "A", "levels": "B:D", "unit": "mm", "sign": "down"}),
    OrdinarySheet("a photo, a temperature and a remark in each row", ".xlsx", lambda rows: [["Nr.", *HEAD, "Foto", "Temperatur [°C]", "Bemerkung"], *([n, *row, 400 + n, 21.5, "Luftblase" if n == 2 else None] for n, row in enumerate(rows, 1))]),
    OrdinarySheet("a footnote and a signature", ".csv", lambda rows: [HEAD, *rows, BLANK, ["gemessen am 3.4. mit Messschieber 150 mm", "", "", ""], ["Müller", "", "", ""]]),
    OrdinarySheet("another table below", ".csv", _stacked, {"range": "A1:D8"}),
    OrdinarySheet("places merged over their readings", ".xlsx", _merged_places, merged=[f"A{2 + 3 * n}:A{4 + 3 * n}" for n in range(6)]),
    OrdinarySheet("three columns of one name", ".csv", _below(["Abstand [mm]", *["Tiefe [mm]"] * 3]), {"levels": "B:D"}),
    OrdinarySheet("a page of particulars above", ".xlsx", lambda rows: [["Prüfbericht 12/26"], ["Bearbeiter", "M. Muster"], ["Datum", "3.5.2026"], ["Raumtemperatur", 21.4], [None], HEAD, *rows]),
    OrdinarySheet("rows that end early, and sep=", ".csv", lambda rows: [["sep=;"], HEAD, *(row[:3] if row[0] == 11.0 else row for row in rows)]),
    OrdinarySheet("units in the cells", ".csv", lambda rows: [["Position", "Profondeur 1", "Profondeur 2", "Profondeur 3"], *([f"{cell:g} mm".replace(".", ",") for cell in row] for row in rows)]),
)  # fmt: skip
"""Of each, the three readings of a station are those of ``levels_mm``, but for those that its manner leaves out."""
