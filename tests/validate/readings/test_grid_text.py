"""Text files: encoding, separator and fields. Damaged, too large and other files are refused in a sentence."""

import io
import os
import zipfile

import pytest

from sealtwin.core.errors import InputError
from tests.support.sheet_writers import Hand, write_sheet
from validate.readings.grid import LARGEST_FILE_BYTES, Grid, SheetFaults, read_grid

S_MM, LEVELS_MM = [0.0, 5.0, 12.34], [[-16.02, -15.98], [-13.07, float("nan")], [1.25, -0.01]]
NOTES = "s_mm,depth_mm,note; who; why\n0,1,a;b;c\n5,2,d;e;f\n"
"""Notes full of semicolons divide the rows of this sheet as evenly as its commas do."""


def texts(grid: Grid, row: int) -> list[str]:
    return [*grid.texts(row)]


@pytest.fixture
def grid_of(tmp_path):
    def read(content: str | bytes, **settings) -> Grid:
        path = tmp_path / "a.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_grid(path, **settings)

    return read


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("stated", [False, True])
def test_fields_are_read_with_every_separator_and_line_end(tmp_path, separator, newline, stated):
    title = ("Messung am 3.4.", 'Prüfer: M; "Meßschieber" 2')
    hand = Hand(separator=separator, decimal=",", newline=newline, sep_line=stated, title=title, gap=True, note=True)
    grid = read_grid(write_sheet(tmp_path / "a.csv", hand, S_MM, LEVELS_MM))
    assert grid.separator == separator
    assert [row - stated for row in grid.rows] == [1, 2, 4, 6, 7, 8]
    assert texts(grid, 2 + stated) == [title[1]]
    assert texts(grid, 8 + stated) == ["", "12,34", "1,25", "-0,01", "ok; Foto 1, Blatt 2"]


ENCODINGS = [
    *(("utf-8", False, "UTF-8"), ("utf-8", True, "UTF-8"), ("utf-16", False, "UTF-16"), ("utf-16-be", True, "UTF-16")),
    *(("latin-1", False, "Windows-1252"), ("cp1252", False, "Windows-1252")),
]


@pytest.mark.parametrize(("encoding", "mark", "name"), ENCODINGS)
def test_the_encoding_of_a_text_file_is_recognised(tmp_path, encoding, mark, name):
    hand = Hand(encoding=encoding, mark=mark, language="german", separator=";", decimal=",", title=("Prüfer: Groß",))
    grid = read_grid(write_sheet(tmp_path / "sheet.csv", hand, S_MM, LEVELS_MM))
    assert grid.written == ("CSV", name, "semicolons")
    assert (texts(grid, 1), texts(grid, 3)) == (["Prüfer: Groß"], ["0,00", "-16,02", "-15,98"])


def test_a_declared_or_stated_separator_overrides_the_detected_separator(grid_of):
    assert grid_of(NOTES).separator == ";"
    assert texts(grid_of(NOTES, separator="comma"), 2) == ["0", "1", "a;b;c"]
    assert texts(grid_of("sep=,\n" + NOTES), 3) == ["0", "1", "a;b;c"]
    assert grid_of("no separator at all").separator == ","
    with pytest.raises(SheetFaults, match=r"a text file, which has no sheets, but .* = 'Messung'"):
        grid_of(NOTES, sheet="Messung")


ARCHIVE = io.BytesIO()
with zipfile.ZipFile(ARCHIVE, "w") as archive:
    archive.writestr("content.xml", "<x/>")
REFUSED = {
    "NUL bytes": (b"s_mm;depth_mm\n0;1\n\0\0\0\0\n5;2\n", "NUL bytes"),
    "UTF-16 without its mark": ("s_mm;depth_mm\n0;1\n".encode("utf-16-le"), "NUL bytes"),
    "a wrong quotation mark": (b'sep=;\ns_mm;depth_mm\n0;1;"12\n5;2\n10;3;4"\n15;4\n', "line 5"),
    "Shift-JIS": ("いち [mm];レベル [mm]\n0;1\n".encode("cp932"), "Shift-JIS"),
    "no text": (b"\xff\xfes\x00\x00\xd8\x00\x00", "UTF-16"),
    "a page": (b"\xef\xbb\xbf  <!DOCTYPE html><table>", "<!DOCTYPE html"),
    "an old workbook": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), ".xls"),
    "a workbook cut off": (b"PK\x03\x04" + bytes(30), "damaged"),
    "another zip": (ARCHIVE.getvalue(), "an ODS or another archive, but only XLSX"),
    "a vast cell": (b"s_mm,depth_mm\n0,1\n5," + b"1" * 200_000, "not a CSV"),
    "columns": (b"s_mm" + b",depth_mm" * 20_000 + b"\n0,1\n", "256 columns"),
    "rows": (b";1\n" * 10_101, "10100 rows"),
    "size": (b"1" * (LARGEST_FILE_BYTES + 1), "5,000,000 bytes"),
}


@pytest.mark.parametrize(("content", "words"), REFUSED.values(), ids=REFUSED)
def test_a_file_that_is_not_a_table_is_refused_with_the_reason(grid_of, tmp_path, content, words):
    with pytest.raises(SheetFaults) as caught:
        grid_of(content)
    (doubt,) = caught.value.doubts
    assert not doubt.is_remark
    assert doubt.where.file == tmp_path / "a.csv"
    assert words in str(doubt)
    assert len(str(doubt)) < 3_000


def test_a_pipe_and_a_missing_file_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    for name, words in {"pipe.csv": "is a device or a pipe", "none.csv": "the readings cannot be opened"}.items():
        with pytest.raises(InputError, match=f"{name}: {words}"):
            read_grid(tmp_path / name)
