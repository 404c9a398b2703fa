"""Sheets of readings, and what a lab leaves in place of one."""

import shutil
import unicodedata
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import openpyxl

from tests.support.ingested_lab import sealtwin
from tests.support.lab_folder import DEFAULTS, ENDS
from tests.support.ods_writer import write_content
from tests.support.photos import mortar, with_crack, write_png
from tests.support.sheet_writers import rewritten
from tests.wrong_inputs.table import WrongInput

Write = Callable[[Path], object]
TRIAL = f"""\
name = "P01"
[photo]
file = "P01.png"
data = "synthetic"
mm_per_px = 0.1
ends_px = {ENDS}
[crack]
depth_mm = 8.0
tilt = "vertical"
[path]
volume_ml = 0.08
trim_mm = 1.0
[fluid]
viscosity_pa_s = 5.0
freeze_after_s = "never"
[solver]
model = "slot"
settle_s = 0.2
[readings]
file = "P01.csv"
data = "synthetic"
role = "held-out"
"""
QUICK = DEFAULTS.replace("radius_mm = 0.45\nsubsteps = 2", 'model = "slot"').replace(
    "U = 30.0\nD_cm = 0.3\nfreeze_after_s = 0.2", 'viscosity_pa_s = 5.0\nfreeze_after_s = "never"'
)
"""Of the fast model, which is checked soon."""
KEPT = TemporaryDirectory(prefix="sealtwin-wrong-inputs-")
IN_MM = 'unit = "mm"'


@cache
def simulated() -> Path:
    """Return a run folder by the fast model, whose sheet each row replaces. It is deleted when the tests end."""
    folder = Path(KEPT.name)
    write_photo(folder / "P01.png")
    (folder / "P01.csv").write_text("s_mm,depth_mm\n1,1.5\n12,1.6\n", encoding="utf-8")
    (folder / "trial.toml").write_text(TRIAL, encoding="utf-8")
    for words in (("digitise", folder / "trial.toml", "--out", folder / "run"), ("simulate", folder / "run")):
        answer = sealtwin(*words)
        assert answer.exit_code == 0, answer.output
    return folder / "run"


def write_photo(path: Path) -> None:
    write_png(path, with_crack(mortar((200, 200), seed=0), [(40, 101), (80, 97), (120, 103), (160, 98)], 20))


def of(path: Path, write: str | Write) -> None:
    _ = path.write_text(write, encoding="utf-8") if isinstance(write, str) else write(path)


def sheet(name: str, write: str | Write, *names: str, settings: str = "", suffix: str = ".csv") -> WrongInput:
    """A sheet that a run is not compared with; ``settings`` are further lines of [readings]."""

    def make(folder: Path) -> None:
        shutil.copytree(simulated(), folder, dirs_exist_ok=True)
        (folder / "inputs" / "P01.csv").unlink()
        of(folder / "inputs" / f"P01{suffix}", write)
        trial = (folder / "trial.toml").read_text(encoding="utf-8").replace("/P01.csv", f"/P01{suffix}")
        trial = trial.replace("[readings]\n", f"[readings]\n{settings}\n")
        (folder / "trial.toml").write_text(trial, encoding="utf-8")

    return WrongInput(name, make, "validate {given} --device cpu", (f"P01{suffix}", *names))


def lab(name: str, files: Mapping[str, str | Write], *names: str, settings: str = "", **others: Any) -> WrongInput:
    """A lab's folder of P01, with these files beside its photo."""
    note = f"[crack]\ndepth_mm = 8.0\n[photo]\nends_px = {ENDS}\n"
    notes = {} if "P01_note.xlsx" in files else {"P01.toml": note}

    def make(folder: Path) -> None:
        write_photo(folder / "P01.png")
        for file, write in ({**notes, "lab.toml": f"{QUICK}{settings}\n", **files}).items():
            of(folder / file, write)

    return WrongInput(name, make, "ingest {given} --out {out} --dry-run", names, **others)


def table(*cells: str, head: str = "s_mm;depth_mm") -> str:
    """Rows at s = 1, 4, 7 and so on."""
    return "\n".join([head, *(f"{1 + 3 * row};{cell}" for row, cell in enumerate(cells))]) + "\n"


def under(head: str) -> str:
    return table("21.5", "24", "13", "12", head=head)


def ods(*cells: str, columns: str = "") -> Write:
    """Depths, as XML of a cell each."""
    texts = "".join(
        f'<table:table-cell office:value-type="string"><text:p>{name}</text:p></table:table-cell>'
        for name in ("s_mm", "depth_mm")
    )
    rows = "".join(
        f'<table:table-row><table:table-cell office:value-type="float" office:value="{1 + 3 * row}"/>{cell}'
        "</table:table-row>"
        for row, cell in enumerate(cells)
    )
    content = f'<table:table table:name="a">{columns}<table:table-row>{texts}</table:table-row>{rows}</table:table>'
    return lambda path: write_content(path, content)


def number(value: str, shown: str = "", more: str = "") -> str:
    text = f"<text:p>{shown}</text:p>" if shown else ""
    return f'<table:table-cell office:value-type="float" office:value="{value}" {more}>{text}</table:table-cell>'


SOUND = (number("2.15"), number("2.4"), number("1.3"))


def xlsx(*depths: str, row: str = "", on_load: bool = False) -> Write:
    """Depths, as XML within a cell each; ``row`` are attributes of the last row."""
    head = "".join(f'<c t="inlineStr"><is><t>{name}</t></is></c>' for name in ("s_mm", "depth_mm"))
    cells = [f"<c><v>{1 + 3 * row}</v></c><c>{depth}</c>" for row, depth in enumerate(depths)]
    rows = [f"<row>{each}</row>" for each in (head, *cells[:-1])] + [f"<row {row}>{cells[-1]}</row>"]

    def write(path: Path) -> None:
        rewritten(path, sheet="".join(rows), on_load=on_load)

    return write


def book(*rows: Any, form: str = "General") -> Write:
    """A workbook whose second column has a number format."""

    def write(path: Path) -> None:
        workbook = openpyxl.Workbook()
        for number, row in enumerate(rows, start=1):
            workbook.worksheets[0].append(row)
            workbook.worksheets[0].cell(number, 2).number_format = form
        workbook.save(path)

    return write


SIX = "2.15;2.1\n3;2.0;2.1\n5;1.9;2.1\n7;1.8;2.0\n9;1.8;2.1\n11;1.9;2.0\n"
COLUMNS = '<table:table-column/><table:table-column table:visibility="collapse"/>'
NOBODY = '<table:table-cell office:value-type="string" office:string-value="kaputt"/>'
FORMULA = 'table:formula="of:=1-1"'
TWINS = {f"{unicodedata.normalize(form, 'P01 Größe')}.csv": under("s_mm;depth_mm") for form in ("NFC", "NFD")}


def along_the_crack(name: str, rows: str, *named: str, quantity: str = "depth") -> WrongInput:
    """A table of depths or widths along the crack, under its header."""

    def make(folder: Path) -> None:
        write_photo(folder / "P01.png")
        (folder / "along.csv").write_text(f"s_mm;{quantity}_mm{rows}", encoding="utf-8")

    depth = "" if quantity == "depth" else "--depth-mm 8 "
    command = f"digitise {{given}}/P01.png --mm-per-px 0.1 {depth}--{quantity}-mm {{given}}/along.csv --out {{out}}"
    return WrongInput(name, make, command, ("along.csv", *named), lacks=("P01.png",))


# fmt: off
CASES: list[WrongInput] = [
    # A number beside a unit.
    sheet("a decimal before the unit", under("s_mm;Tiefe (0,1 mm)"), "'Tiefe (0,1 mm)'", "as_written"),
    sheet("a factor of places", under("Pos (0,1 mm);depth_mm"), "'Pos (0,1 mm)'", "as_written"),
    sheet("tenths and a declared unit", under("s_mm;Tiefe [1/10 mm]"), "column B", "settings, mm", settings=IN_MM),
    sheet("a factor below the header", "s;depth\nmm;0,1 mm\n1;21.5\n4;24\n", "B2 '0,1 mm'", settings=IN_MM),
    # Units beside the readings.
    sheet("a row in inches", table("2.15;mm", "0.0945;inch", "1.3;mm", "1.2;mm", head="s_mm;depth;Einheit"),
        "C3 'inch'", "as_written", settings=IN_MM),
    sheet("a unit above", f"Einheit: Zoll\n{under('s_mm;depth')}", "A1 'Einheit: Zoll'", settings=IN_MM),
    sheet("a unit below", f"{under('s_mm;depth')}alle Werte in cm\n", "'alle Werte in cm'", settings=IN_MM),
    sheet("a format in cm", book(("s_mm", "depth_mm"), (1, 2.15), (4, 2.4), (7, 1.3), form='0.00" cm"'), "column B",
        "cm in its cells", suffix=".xlsx"),
    # Cells that are no number.
    sheet("an error of OpenOffice", ods(*SOUND, number("0", "Err:503")), "B5", "'Err:503'", suffix=".ods"),
    sheet("a text in an attribute", ods(*SOUND, NOBODY), "B5", "'kaputt'", suffix=".ods"),
    sheet("zeros of formulas in ODS", ods(*[number("0", "", FORMULA)] * 3), "formula", "B2", "B4", suffix=".ods"),
    sheet("a zero that is left to the next program",
        xlsx("<f>1+1</f><v>2</v>", "<f>1-1</f><v>0</v>", "<v>1.5</v>", on_load=True), "formula", "B3", suffix=".xlsx"),
    # What is no sheet.
    sheet("a page in HTML", "<!DOCTYPE html>\n<table><tr><td>1</td></tr></table>\n", "'<!DOCTYPE html'", suffix=".xls"),
    sheet("columns by blanks", "s_mm   depth_mm\n1   2.15\n4   2.4\n7   1.3\n", "letters", "'1   2.15'"),
    # Doubts, which need the crack.
    lab("hundredths with digits of a micrometre",
        {"P01.csv": table("2.15", "2.41", "1.37", head="s_mm;Tiefe [1/100 mm]")}, "1/100 mm", "as_written"),
    lab("a row of zeros", {"P01.csv": f"s_mm;depth_1_mm;depth_2_mm\n1;{SIX}0;0;0\n"}, "B8", "as_written = B8 C8"),
    lab("a factor above", {"P01.csv": f"Faktor;0.1\n{table('1.5', '1.4', '1.3', '1.2')}"}, "A1 'Faktor 0.1'"),
    lab("a row of no height",
        {"P01.xlsx": xlsx(*[f"<v>{depth}</v>" for depth in (1.5, 1.4, 1.3)], row='ht="0" customHeight="1"')}, "hidden",
        "as_written = A4 B4"),
    lab("a hidden column", {"P01.ods": ods(*SOUND, columns=COLUMNS)}, "hidden", "as_written = B"),
    # Sisters.
    sheet("a line of NUL bytes", "s_mm,depth_mm\n1,1.5\n\0\0\0\0\n7,1.3\n", "P01.csv", "NUL"),
    sheet("a quotation mark that does not close", 's_mm,depth_mm,note\n1,1.5,"left\n4,1.4,\n7,1.3,\n', "line 2",
        "quotation"),
    sheet("a quotation mark that closes in another row",
        's_mm,depth_mm,note\n1,1.5,"left\n4,1.4,\n7,1.3,edge"\n10,1.2,\n', "line 4", "quotation"),
    along_the_crack("a depth in inches", ";Einheit\n0;8;mm\n9;0.3;inch\n", "row 3", "unit"),
    along_the_crack("a depth in µm", "\n0;8\n10;9000\n", "row 3", "9000", "500"),
    along_the_crack("a depth before the start", "\n-3;8\n10;9\n", "row 2", "-3"),
    along_the_crack("widths out of order", "\n5;2\n3;2\n", "row 3", "row before (5)", quantity="width"),
    along_the_crack("a width of nothing", "\n5;0\n", "row 2", "width_mm", quantity="width"),
    along_the_crack("depths of a scan", "\n" + "".join(f"{row};8\n" for row in range(1001)), "1001 rows", "1000"),
    # What a lab leaves.
    lab("twins by Unicode", TWINS, "P01 Größe"),
    lab("a note by a formula", {"P01_note.xlsx": book(("Tiefe [mm]", "=8+1"))}, "P01_note.xlsx: is not read"),
]
# fmt: on
