"""Options of a photo: numbers are read or refused by the option's name, files by theirs."""

from pathlib import Path

import pytest
import typer

from sealtwin.cli.options import along, read_numbers
from sealtwin.core.errors import InputError


@pytest.mark.parametrize(
    ("read", "texts"),
    [
        (lambda text: read_numbers(text, "X,Y", "--roi"), ("1,2,3", "a,b", "nan,1", "")),
        (lambda text: along(text, "--roi"), ("deep", "nan", "")),
    ],
    ids=["anything but two finite numbers", "a depth that is no number"],
)
def test_what_cannot_be_read_is_refused_by_its_option(read, texts):
    for text in texts:
        with pytest.raises(typer.BadParameter, match="--roi"):
            read(text)


@pytest.mark.parametrize(
    "content",
    [
        "s_mm,depth_mm\n0,12\n40,16.5\n",
        "s_mm,depth_mm\n0,12\n40,16.5\n".encode("utf-16"),
        "\ufeffs_mm;depth_mm\r\n0;12\r\n40;16,5\r\n",
        "note,depth_mm,s_mm\nbegin,12,0\nmiddle,16.5,40\n",
    ],
    ids=["plain", "UTF-16", "decimal comma", "other columns"],
)
def test_a_table_is_read_as_spreadsheets_save_it(tmp_path, content):
    table = tmp_path / "depths.csv"
    table.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert along(str(table), "--depth-mm") == [[0.0, 12.0], [40.0, 16.5]]


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("s_mm,depth_mm\n", "0 rows"),
        ("s_mm,tiefe\n0,12\n", "no column depth_mm"),
        ("s_mm,depth_mm\n0,12\n40,deep\n", "row 3"),
        ('s_mm,depth_mm\n0,"1,250"\n', "row 2: .*1,250"),
        ("x" * 300_000, "larger than"),
    ],
)
def test_a_table_of_depths_that_cannot_be_used_is_named(tmp_path: Path, content, named):
    table = tmp_path / "depths.csv"
    table.write_text(content)
    with pytest.raises(InputError, match=named) as fault:
        along(str(table), "--depth-mm")
    assert "depths.csv" in str(fault.value)
