"""A path that somebody brings along: as they wrote it, or refused with its line."""

import numpy as np
import pytest

from digitise.mesh_import.cavity import read_path
from sealtwin.core.errors import InputError


@pytest.mark.parametrize(
    "text",
    [
        "1 2\n3 4.5\n",
        "1,2,7\n3,4.5,7\n",
        "# from CAD\n1;2\n\n1;2\n3; 4.5  # the end\n",
        "x,y\r\n1,2\r\n3,4.5\r\n",
        "t_s,x_mm,y_mm,z_mm\n0,1,2,3\n1,3,4.5,3\n",
        "\ufeff1\t2\n3\t4.5",
    ],
)
def test_x_and_y_are_read_however_they_are_parted(tmp_path, text):
    (tmp_path / "path.txt").write_text(text, encoding="utf-8")
    assert np.array_equal(read_path(tmp_path / "path.txt"), [[1.0, 2.0], [3.0, 4.5]])


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "0 different points"),
        (b"1 2\n1 2\n", "1 different points"),
        (b"1 2\n3\n", "line 2: .*'3'"),
        (b"x_inch,y_inch\n1,2\n", "line 1: .*'x_inch y_inch'"),
        (b"1 nan\n", "line 1: .*'1 nan'"),
        (b"\xff\xfe1 2\n", "no text"),
        (b"1 2\n" * 1_300_000, "larger than 5 MB"),
    ],
)
def test_what_is_no_path_is_refused_with_its_line(tmp_path, content, says):
    (tmp_path / "path.txt").write_bytes(content)
    with pytest.raises(InputError, match=says):
        read_path(tmp_path / "path.txt")
