"""Options of a photo: numbers are read or refused by the option's name, files by theirs."""

from pathlib import Path

import pytest
import typer

from sealtwin.cli.options import along, board, points, two_numbers
from sealtwin.core.errors import InputError


def test_points_and_numbers_are_read_as_written():
    assert points("1,2 3.5,-4", "--via") == [(1.0, 2.0), (3.5, -4.0)]
    assert two_numbers("160x40", "x", "--face-mm") == (160.0, 40.0)
    assert along("16", "--depth-mm") == 16.0


@pytest.mark.parametrize("text", ["1;2", "1,2,3", "a,b", "nan,1", "1,inf", "", ","])
def test_anything_but_two_finite_numbers_is_refused_by_its_option(text):
    with pytest.raises(typer.BadParameter, match="--roi"):
        two_numbers(text, ",", "--roi")


@pytest.mark.parametrize("text", ["deep", "nan", "inf", "16 mm", ""])
def test_a_depth_that_is_no_number_is_refused(text):
    with pytest.raises(typer.BadParameter, match="--depth-mm"):
        along(text, "--depth-mm")


def test_depths_along_the_crack_come_from_a_table(tmp_path):
    table = tmp_path / "depths.csv"
    table.write_text("s_mm,depth_mm\n0,12\n40,16.5\n")
    assert along(str(table), "--depth-mm") == [[0.0, 12.0], [40.0, 16.5]]


@pytest.mark.parametrize(
    "content",
    [
        "\ufeffs_mm,depth_mm\r\n0,12\r\n40,16.5\r\n",
        "\ufeffs_mm;depth_mm\r\n0;12\r\n40;16,5\r\n",
        "s_mm\tdepth_mm\n0\t12\n40\t16,5\n",
        "s_mm, depth_mm\n0, 12\n\n40, 16.5\n\n",
        "note,depth_mm,s_mm\nbegin,12,0\nmiddle,16.5,40\n",
    ],
    ids=["UTF-8 with a mark", "decimal comma", "tabs", "spaces and empty lines", "other columns"],
)
def test_a_table_is_read_as_spreadsheets_save_it(tmp_path, content):
    table = tmp_path / "depths.csv"
    table.write_bytes(content.encode())
    assert along(str(table), "--depth-mm") == [[0.0, 12.0], [40.0, 16.5]]


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("s_mm,depth_mm\n", "no rows"),
        ("", "no column"),
        ("s_mm,tiefe\n0,12\n", "no column depth_mm"),
        ("s_mm,depth_mm\n0,12\n40,deep\n", "line 3"),
        ("s_mm,depth_mm\n0,\n", "line 2"),
        ('s_mm,depth_mm\n0,"1,250"\n', "line 2: ..0., .1,250"),
        ("s_mm,depth_mm\n0,inf\n", "line 2"),
        ("x" * 300_000, "larger than"),
    ],
)
def test_a_table_of_depths_that_cannot_be_used_is_named(tmp_path: Path, content, named):
    table = tmp_path / "depths.csv"
    table.write_text(content)
    with pytest.raises(InputError, match=named) as fault:
        along(str(table), "--depth-mm")
    assert "depths.csv" in str(fault.value)


def test_a_table_in_a_spreadsheets_other_encoding_is_read(tmp_path):
    table = tmp_path / "depths.csv"
    table.write_bytes("s_mm,depth_mm\n0,16\n".encode("utf-16"))
    assert along(str(table), "--depth-mm") == [[0.0, 16.0]]


def test_markers_come_from_the_file_that_the_trial_takes_them_from(tmp_path):
    file = tmp_path / "markers.toml"
    rows = ", ".join(
        f"{{id = {n}, x_mm = {x}.0, y_mm = {y}.0}}" for n, x, y in [(0, 0, 0), (1, 9, 0), (2, 9, 9), (3, 0, 9)]
    )
    file.write_text(f"[photo.markers]\nsize_mm = 4.0\nmarkers = [{rows}]\n")
    read = board(file)
    assert read is not None
    assert [marker["id"] for marker in read["markers"]] == [0, 1, 2, 3]
    file.write_text("[markers]\nsize_mm = 4.0\n")
    with pytest.raises(InputError, match=r"markers\.toml"):
        board(file)
