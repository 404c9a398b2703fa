"""Several tables on one sheet: where each begins and ends, and which lines are its title."""

import pytest

from validate.readings.read_readings import read_readings
from validate.readings.samples import part_of, parts_of, read_cells
from validate.readings.sheet import SheetFaults
from validate.readings.tables import common_lines, tables_of
from validate.settings import Columns, Declared

HEAD, ROWS = "s [mm];Pegel 1 [mm];Pegel 2 [mm]", ("0;-1;-1,1", "5;-1;-1,2")
TABLE = "\n".join((HEAD, *ROWS))


def _beside(*tables: str) -> str:
    """Lay tables beside each other, with a blank column between them."""
    lines = [table.split("\n") for table in tables]
    widths = [max(line.count(";") for line in each) for each in lines]
    rows = ([each[at] if at < len(each) else "" for each in lines] for at in range(max(map(len, lines))))
    return "\n".join(
        ";;".join(line + ";" * (width - line.count(";")) for line, width in zip(row, widths, strict=True))
        for row in rows
    )


# fmt: off
SHEETS = {
    "one": (f"Labor\n{TABLE}", "A1:C4 Labor"),
    "a remark between its rows": (f"{TABLE}\nRiss verzweigt;siehe Foto\n9;-1;-1\n", "A1:C5"),
    "a gap between its repeats": ("s;Pegel 1;;Pegel 2;Pegel 3\n0;-1;;-1;-1\n1;-1;;-2;-1\n", "A1:E3"),
    "side by side": (_beside(f"P 1\n{TABLE}", f"P 2\n{TABLE}\n9;-1;-1"), "A1:C4 P 1; E1:G5 P 2"),
    "a line above both": ("Labor\n" + _beside(f"P 1\n{TABLE}", f"P 2\n{TABLE}"), "A2:C5 P 1; E2:G5 P 2"),
    "from another row on": (_beside(f"P 1\n{TABLE}\n9;-1;-1", f"\n\nP 2\n{TABLE}"), "A1:C5 P 1; E3:G6 P 2"),
    "without a blank column": ("P 1;;P 2;\ns;Pegel;s;Pegel\n0;-1;0;-1\n1;-1;1;-1\n", "A1:B4 P 1; C1:D4 P 2"),
    "under unknown names": (_beside(*["x;h 1;h 2\n0;1;1\n1;1;1"] * 2), "A1:C3; E1:G3"),
    "under names with a sample": ("P1 s;P1 Pegel;P2 s;P2 Pegel\n0;-1;0;-1\n1;-1;1;-1\n", "A1:B3; C1:D3"),
    "one below the other": (f"Labor\n\nP 1\n{TABLE}\nMittel;-1;-1\n\nP 2\n\n{TABLE}", "A3:C7 P 1; A9:C13 P 2"),
    "without a blank row": (f"P 1\n{TABLE}\nP 2\n{TABLE}\nP 3\n{TABLE}", "A1:C4 P 1; A5:C8 P 2; A9:C12 P 3"),
    "titles of two lines": (f"P 1\nMai\n{TABLE}\n\nP 2\nJuni\n{TABLE}", "A1:C5 P 1 Mai; A7:C11 P 2 Juni"),
    "other columns below": (f"P 1\n{TABLE}\n\ns;Risstiefe\n0;9\n1;9\n", "A2:C4; A6:B8"),
}
# fmt: on


@pytest.mark.parametrize(("text", "expected"), SHEETS.values(), ids=SHEETS)
def test_tables_of_a_sheet_have_ranges_and_titles(tmp_path, text, expected):
    (tmp_path / "a.csv").write_text(text)
    grid = read_cells(tmp_path / "a.csv", Declared(separator="semicolon"))
    tables = ([table.cells, *(row.cell(table.columns[0]).text for row in table.title)] for table in tables_of(grid))
    assert "; ".join(map(" ".join, tables)) == expected


def test_a_line_about_all_tables_is_a_remark_of_each(tmp_path):
    """Outside the range of the second table it was lost, and with it the doubt about the zero."""
    path = tmp_path / "a.csv"
    path.write_text("Nullpunkt: Tisch\n" + _beside(f"P 1\n{TABLE}", f"P 2\n{TABLE}"))
    for span in ("A2:C5", "E2:G5"):
        (line,) = common_lines(read_cells(path, Declared()), span)
        assert line.cell(0).text == "Nullpunkt: Tisch"
        (doubt,) = (one for one in read_readings(path, Declared(columns=Columns(range=span))).doubts if "datum" in one)
        assert "line 1" in doubt


def test_a_part_is_named_by_its_range(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(_beside(TABLE, TABLE))
    assert [str(part) for part in parts_of(path)] == ["A1:C3", "E1:G3"]
    names = ["A1:C3", "sheet Mai, B:D", "columns B D", "rows of P1", "P1"]
    parts = [part_of(path, name) for name in names]
    assert [part and (part.sheet, part.cells, part.levels) for part in parts] == [
        (None, "A1:C3", None), ("Mai", "B:D", None), (None, None, "B D"), None, None,
    ]  # fmt: skip


def test_columns_of_numbered_samples_are_no_repeats(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("s [mm];Probe 1 Tiefe [mm];Probe 2 Tiefe [mm]\n0;1;2\n5;1;2\n")
    with pytest.raises(SheetFaults) as caught:
        read_readings(path, Declared())
    assert "'Probe 1 Tiefe [mm]', 'Probe 2 Tiefe [mm]': columns of several samples" in str(caught.value)
    assert read_readings(path, Declared(columns=Columns(levels=("C",)))).level_mm.tolist() == [-2.0, -2.0]
