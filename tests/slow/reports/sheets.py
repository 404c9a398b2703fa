"""Sheets of readings, notes, and tables of rheometers."""

from pathlib import Path

import openpyxl
from openpyxl.styles import Alignment

import sealtwin as st
from tests.slow.reports.files import lab, text
from tests.slow.reports.table import (
    CSV,
    LAB,
    PASTE,
    THREE,
    TWELVE,
    XLSX,
    Maker,
    has_levels,
    held,
    numbers,
    refused,
    report,
    right,
    settings,
    warned,
)
from tests.support.lab_folder import ENDS
from tests.support.sheet_writers import rewritten


def noted(depth: str) -> Maker:
    """Return a function that makes a sound sample, but for the words of its depth."""
    return lambda folder: lab(folder, {"P01_notes.csv": f"depth,{depth}\n"})


def flow_curve(*rows: str, header: str = "shear_rate_per_s,stress_pa") -> Maker:
    return text("curve.csv", header, *rows)


RATES = (1, 2, 5, 10, 20, 30, 40, 50, 60, 80, 100)
SATURATED = [f"{rate},{min(12 + 1.5 * rate, 60):g}" for rate in RATES]
"""12 Pa and 1.5 Pa s by a transducer that shows 60 Pa at most."""

# After a narrow blank as thousands' mark the rest of a number is dropped: 29 000 is 29.
report(
    "apache/ofbiz-framework/pull/845",
    lambda: st.read_readings("a.csv").s_mm,
    right(numbers, (990.5, 1010.5, 1030.5), 0.001),
    refused("a.csv", "a3"),
)(text("a.csv", "s_mm;level_mm", "990,5;-2,15", "1\u202f010,5;-2,25", "1\u202f030,5;-2,05"))

# Of two columns of one name the last one's values replace the first one's.
report("pandas-dev/pandas/issues/9424", CSV, right(numbers, (-2.2, -2.3, -2.4), 0.001), refused("a.csv", "level_mm"))(
    text("a.csv", "s_mm,level_mm,level_mm", "5,-2.0,-2.4", "10,-2.1,-2.5", "15,-2.2,-2.6")
)

# A header in the middle, of files that were joined, becomes missing values.
report(
    "manybabies/mb2-analysis/issues/89",
    CSV,
    right(numbers, (-2.0, -2.1, -2.2, -2.3), 0.001),
    refused("a.csv", "line 4|row 4|header"),
)(text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2.1", "s_mm,level_mm", "15,-2.2", "20,-2.3"))

# Of 'Between 10 and 20' the first number is taken.
report("dylanwal/unit_parse/issues/13", LAB, held("p01_notes", "is not read"))(noted("between 7 and 9 mm"))


@report(
    "bigbio/proteomics-sample-metadata/issues/423",
    LAB,
    right(settings("crack.depth_mm", "P01", "P02"), (8, 12), 0),
    held("notes.csv"),
    held("crack.depth_mm"),
)
def one_note_of_two(folder: Path) -> None:
    """Of a file with several samples one is used for all."""
    ends = f"photo.ends_px = {ENDS}\n"
    notes = {"P01_ends.toml": ends, "P02_ends.toml": ends}
    notes["notes.csv"] = "sample,P01\ndepth,8 mm\nsample,P02\ndepth,12 mm\n"
    lab(folder, notes, ("P01", "P02"))


# A second line of header, the units, is taken for data.
report("ngscopeclient/scopehal/issues/940", PASTE, refused("curve.csv", "line 2|row 2|mpa"), TWELVE)(
    flow_curve("1/s,mPa", *(f"{rate},{1000 * (12 + 1.5 * rate):g}" for rate in RATES))
)

# Saturated samples are part of a fit.
report(
    "sPHENIX-Collaboration/coresoftware/pull/204",
    PASTE,
    refused("curve.csv", "satur|plateau|same stress|levels off|limit|bend|no line"),
    warned("satur|plateau|same stress|levels off|limit|bend"),
)(flow_curve(*SATURATED))

# Columns in another order, and thousands of empty rows behind them.
report("MaCFP/matl-db/pull/124", PASTE, TWELVE, refused("curve.csv", "line 13|row 13|empty"))(
    flow_curve(
        *(f"{12 + 1.5 * rate:g},{rate}" for rate in RATES),
        *[","] * 4000,
        header="stress_pa,shear_rate_per_s",
    )
)

# +1.5E-03, as instruments write it, is no number.
report("mholt/PapaParse/issues/1070", PASTE, TWELVE, refused("curve.csv", "line 2|row 2"))(
    flow_curve(*(f"{rate:+.6E},{12 + 1.5 * rate:+.6E}" for rate in RATES))
)

# Of several values of one place all but one are dropped, without a word.
report(
    "Deltares/ddlpy/issues/24",
    CSV,
    has_levels((-2.0, -2.1, -2.2, -2.6, -2.5, -2.4), (-2.2, -2.3, -2.4)),
    refused("a.csv", "a5"),
)(text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2.1", "15,-2.2", "15,-2.6", "10,-2.5", "5,-2.4"))

# Decimal commas and decimal points in one file, separated by semicolons: some numbers are texts.
report("vizabi/vizabi/issues/2547", CSV, has_levels((-2.15, -2.25, -2.05)), refused("a.csv", "a3"))(
    text("a.csv", "s_mm;level_mm", "5,5;-2,15", "10.5;-2.25", "15,5;-2,05")
)


# Digits joined by an underscore are read as one number.
report("pyexcel/pyexcel/issues/138", CSV, refused("a.csv", "2_1"))(
    text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2_1", "15,-2.2")
)

# Decimal commas in a file that commas separate: columns fall apart.
report(
    "SheetJS/sheetjs/issues/2236",
    CSV,
    has_levels((-2.15, -2.25, -2.05)),
    refused("a.csv", "comma|line 2|row 2|cells|columns|separat"),
)(text("a.csv", "s_mm,level_mm", "5,0,-2,15", "10,0,-2,25", "15,0,-2,05"))

# The sign of a shear rate, which is that of the sense of rotation, gets into the viscosity.
report(
    "bryanvriel/iceutils/pull/25",
    PASTE,
    TWELVE,
    refused("curve.csv", "negative|below 0|greater than 0|sign|line 2|row 2"),
)(flow_curve(*(f"{-rate},{-12 - 1.5 * rate:g}" for rate in RATES)))


@report("yfedoseev/office_oxide/issues/146", XLSX, THREE, refused("a.xlsx", "order|cell|column"))
def cells_out_of_order(folder: Path) -> None:
    """Cells that stand in another order in the file land in each other's columns."""

    def word(place: str, text: str) -> str:
        return f'<c r="{place}" t="inlineStr"><is><t>{text}</t></is></c>'

    rows = f'<row r="1">{word("B1", "level_mm")}{word("A1", "s_mm")}</row>'
    for number, (s_mm, level_mm) in enumerate(((5, -2.0), (10, -2.1), (15, -2.2)), start=2):
        rows += f'<row r="{number}"><c r="B{number}"><v>{level_mm}</v></c><c r="A{number}"><v>{s_mm}</v></c></row>'
    rewritten(folder / "a.xlsx", sheet=rows, on_load=False)


# Numbers with a no-break space behind them are texts, and left out.
report("ONLYOFFICE/DocumentServer/issues/2741", CSV, THREE, refused("a.csv", "line 2|row 2"))(
    text("a.csv", "s_mm;level_mm", "5;-2,0\u00a0", "10;-2,1\u00a0", "15;-2,2")
)


# Marks of inches are unbalanced quotation marks.
report("tilo/smarter_csv/issues/283", CSV, THREE, refused("a.csv", "c2"))(
    text("a.csv", "s_mm\tlevel_mm\tnote", '5\t-2.0\tgauge 3/4"', "10\t-2.1\t", '15\t-2.2\t20" board')
)


@report("tidyverse/readxl/issues/648", XLSX, THREE, refused("a.xlsx", "place|cell|column|row"))
def cells_without_places(folder: Path) -> None:
    """Cells without their places get into the wrong columns."""

    def word(text: str) -> str:
        return f'<c t="inlineStr"><is><t>{text}</t></is></c>'

    rows = f"<row>{word('s_mm')}{word('note')}{word('level_mm')}</row>"
    for s_mm, level_mm in ((5, -2.0), (10, -2.1), (15, -2.2)):
        rows += f'<row><c><v>{s_mm}</v></c><c r="C{1 + s_mm // 5}"><v>{level_mm}</v></c></row>'
    rewritten(folder / "a.xlsx", sheet=rows, on_load=False)


# An apostrophe that sets thousands apart makes no number.
report("adobe/react-spectrum/issues/8545", CSV, THREE, refused("a.csv", "1'000"))(
    text("a.csv", "s_mm;level_mm", "995;-2,0", "1'000;-2,1", "1'005;-2,2")
)

# Of 1.2.3.4 the start, 1.2, is read.
report("dumbmatter/csv-sql-live/pull/1", CSV, refused("a.csv", "-2.1.5"))(
    text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2.1.5", "15,-2.2")
)

# Rows with an empty cell in the column that groups them are dropped.
report(
    "PEtab-dev/PEtab/pull/298",
    CSV,
    has_levels((-2.1, -2.2), (-2.0, -2.2, -2.1, -2.3)),
    refused("a.csv", "a3"),
)(text("a.csv", "s_mm,run,level_mm", "5,1,-2.0", "5,,-2.2", "10,1,-2.1", "10,2,-2.3"))

# Stresses in mPa stand where Pa are written.
report("DC-analysis/DCscope/issues/104", PASTE, refused("curve.csv", "stress_mpa"))(
    flow_curve(
        *(f"{rate},{1000 * (12 + 1.5 * rate):g}" for rate in RATES),
        header="shear_rate_per_s,stress_mPa",
    )
)

# One comma more in the first row shifts all columns.
report("pandas-dev/pandas/issues/9295", CSV, THREE, refused("a.csv", "line 2|row 2"))(
    text("a.csv", "s_mm,level_mm,note", "5,-2.0,a,", "10,-2.1,b", "15,-2.2,c")
)


@report("PHPOffice/PHPExcel/issues/722", XLSX, THREE, refused("a.xlsx", "text|number"))
def numbers_behind_apostrophes(folder: Path) -> None:
    """Numbers are texts behind an apostrophe."""
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    for row in (("s_mm", "level_mm"), ("5", "-2.0"), ("10", "-2.1"), ("15", "-2.2")):
        sheet.append(row)
    for cell in (cell for cells in sheet["A2:B4"] for cell in cells):
        cell.alignment = Alignment(horizontal="left")
        cell.quotePrefix = True
    book.save(folder / "a.xlsx")


# A remark of two lines is one cell, and the lines of a file are more than its rows.
report("dbro/csvquote/issues/10", CSV, THREE, refused("a.csv", "c3"))(
    text("a.csv", "s_mm,level_mm,note", '5,-2.0,"left', 'edge, 2 of 3"', "10,-2.1,", "15,-2.2,")
)
