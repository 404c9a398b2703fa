"""Public reports on sheets of readings, and tables of rheometers."""

from pathlib import Path

import openpyxl
from openpyxl.styles import Alignment

from tests.slow.reports.files import text
from tests.slow.reports.table import (
    CSV,
    PASTE,
    THREE,
    TWELVE,
    XLSX,
    Maker,
    refused,
    report,
)
from tests.support.sheet_writers import rewritten


def flow_curve(*rows: str, header: str = "shear_rate_per_s,stress_pa") -> Maker:
    return text("curve.csv", header, *rows)


RATES = (1, 2, 5, 10, 20, 30, 40, 50, 60, 80, 100)


# A second line of header, the units, is taken for data.
report("ngscopeclient/scopehal/issues/940", PASTE, refused("curve.csv", "line 2|row 2|mpa"), TWELVE)(
    flow_curve("1/s,mPa", *(f"{rate},{1000 * (12 + 1.5 * rate):g}" for rate in RATES))
)


# Columns in another order, and thousands of empty rows behind them.
report("MaCFP/matl-db/pull/124", PASTE, TWELVE, refused("curve.csv", "line 13|row 13|empty"))(
    flow_curve(
        *(f"{12 + 1.5 * rate:g},{rate}" for rate in RATES),
        *[","] * 4000,
        header="stress_pa,shear_rate_per_s",
    )
)


# The sign of a shear rate, which is that of the sense of rotation, gets into the viscosity.
report(
    "bryanvriel/iceutils/pull/25",
    PASTE,
    TWELVE,
    refused("curve.csv", "negative|below 0|greater than 0|sign|line 2|row 2"),
)(flow_curve(*(f"{-rate},{-12 - 1.5 * rate:g}" for rate in RATES)))


@report("yfedoseev/office_oxide/issues/146", XLSX, THREE, refused("a.xlsx", "order|cell|column"))
def cells_out_of_order(folder: Path) -> None:
    """Cells that the file lists in another order are put into each other's columns."""

    def word(place: str, text: str) -> str:
        return f'<c r="{place}" t="inlineStr"><is><t>{text}</t></is></c>'

    rows = f'<row r="1">{word("B1", "level_mm")}{word("A1", "s_mm")}</row>'
    for number, (s_mm, level_mm) in enumerate(((5, -2.0), (10, -2.1), (15, -2.2)), start=2):
        rows += f'<row r="{number}"><c r="B{number}"><v>{level_mm}</v></c><c r="A{number}"><v>{s_mm}</v></c></row>'
    rewritten(folder / "a.xlsx", sheet=rows, on_load=False)


# Numbers before a no-break space are read as texts and left out.
report("ONLYOFFICE/DocumentServer/issues/2741", CSV, THREE, refused("a.csv", "line 2|row 2"))(
    text("a.csv", "s_mm;level_mm", "5;-2,0\u00a0", "10;-2,1\u00a0", "15;-2,2")
)


# Stresses in mPa are taken for Pa.
report("DC-analysis/DCscope/issues/104", PASTE, refused("curve.csv", "stress_mpa"))(
    flow_curve(
        *(f"{rate},{1000 * (12 + 1.5 * rate):g}" for rate in RATES),
        header="shear_rate_per_s,stress_mPa",
    )
)

# An additional comma in the first row shifts all columns.
report("pandas-dev/pandas/issues/9295", CSV, THREE, refused("a.csv", "line 2|row 2"))(
    text("a.csv", "s_mm,level_mm,note", "5,-2.0,a,", "10,-2.1,b", "15,-2.2,c")
)


@report("PHPOffice/PHPExcel/issues/722", XLSX, THREE, refused("a.xlsx", "text|number"))
def numbers_behind_apostrophes(folder: Path) -> None:
    """Numbers after an apostrophe are read as texts."""
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    for row in (("s_mm", "level_mm"), ("5", "-2.0"), ("10", "-2.1"), ("15", "-2.2")):
        sheet.append(row)
    for cell in (cell for cells in sheet["A2:B4"] for cell in cells):
        cell.alignment = Alignment(horizontal="left")
        cell.quotePrefix = True
    book.save(folder / "a.xlsx")


# A remark of two lines is one cell, so that the file has more lines than rows.
report("dbro/csvquote/issues/10", CSV, THREE, refused("a.csv", "c3"))(
    text("a.csv", "s_mm,level_mm,note", '5,-2.0,"left', 'edge, 2 of 3"', "10,-2.1,", "15,-2.2,")
)
