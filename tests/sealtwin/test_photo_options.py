"""Options of a photo: numbers are read or refused by the option's name, files by theirs."""

from pathlib import Path

import pytest
import typer

from sealtwin.cli.options import along, board, points, two_numbers
from sealtwin.core.errors import InputError, present


def test_points_and_numbers_are_read_as_written():
    assert points("1,2 3.5,-4", "--via") == [(1.0, 2.0), (3.5, -4.0)]
    assert two_numbers("160x40", "x", "--face-mm") == (160.0, 40.0)
    assert along("16", "--depth-mm") == 16.0


@pytest.mark.parametrize(
    ("read", "texts"),
    [
        (lambda text: two_numbers(text, ",", "--roi"), ("1,2,3", "a,b", "nan,1", "")),
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
        ("s_mm,depth_mm\n", "no rows"),
        ("s_mm,tiefe\n0,12\n", "no column depth_mm"),
        ("s_mm,depth_mm\n0,12\n40,deep\n", "line 3"),
        ('s_mm,depth_mm\n0,"1,250"\n', "line 2: ..0., .1,250"),
        ("x" * 300_000, "larger than"),
    ],
)
def test_a_table_of_depths_that_cannot_be_used_is_named(tmp_path: Path, content, named):
    table = tmp_path / "depths.csv"
    table.write_text(content)
    with pytest.raises(InputError, match=named) as fault:
        along(str(table), "--depth-mm")
    assert "depths.csv" in str(fault.value)


def test_markers_come_from_the_file_that_the_trial_takes_them_from(tmp_path):
    file = tmp_path / "markers.toml"
    corners = enumerate([(0, 0), (9, 0), (9, 9), (0, 9)])
    rows = ", ".join(f"{{id = {n}, x_mm = {x}.0, y_mm = {y}.0}}" for n, (x, y) in corners)
    file.write_text(f"[photo.markers]\nsize_mm = 4.0\nmarkers = [{rows}]\n")
    read = present(board(file), "read")
    assert [marker["id"] for marker in read["markers"]] == [0, 1, 2, 3]
    file.write_text("[markers]\nsize_mm = 4.0\n")
    with pytest.raises(InputError, match=r"markers\.toml"):
        board(file)
