"""Messages about operating system errors and about settings files."""

import errno
import time
from pathlib import Path
from typing import Literal

import pytest
from pydantic import Field

from sealtwin.core.errors import InputError, naming
from sealtwin.core.settings import Settings, read_settings

NO_SPACE = OSError(errno.ENOSPC, "No space left on device")
SHUT = PermissionError(errno.EACCES, "Permission denied", ".photos.123.csv")


@pytest.mark.parametrize("fault", [NO_SPACE, SHUT], ids=["full disk", "temporary file"])
def test_an_operating_system_error_names_the_users_file(fault):
    """An error without a file name would end with a traceback, as a bug."""
    with pytest.raises(OSError, match=r"photos\.csv") as named, naming(Path("out/photos.csv")):
        raise fault
    assert named.value.filename == "out/photos.csv"


class Inner(Settings):
    a: float = 1.0


class Tables(Settings):
    volume_ml: float | Literal["cavity"] = "cavity"
    box_mm: tuple[float, float, float] = (1.0, 1.0, 1.0)
    names: tuple[str, ...] = ()
    points: tuple[tuple[float, float], ...] = ()
    few: tuple[float, ...] = Field(default=(1.0, 1.0), min_length=2)
    either: float | tuple[float, float] = 1.0
    count: int = Field(default=1, le=1_000_000)
    letters: str = Field(default="a", min_length=1, max_length=3)
    flag: bool = False
    inner: Inner = Inner()


def refusal(text: str, folder: Path) -> str:
    path = folder / "cell.toml"
    path.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(InputError) as caught:
        read_settings(Tables, path, name="cell file", starter="'sealtwin init' writes one")
    assert all(line.startswith(str(path)) for line in str(caught.value).splitlines())
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "words", "most"),
    [
        (f"volume_ml = 0x{'f' * 5000}", "thousands of digits", 500),  # Python parses it, and refuses to write it down.
        (f'volume_ml = "{"x" * 50_000}"', "volume_ml = 'xxx", 500),
        (f"points = [{', '.join(['1'] * 20_000)}]", "there are 19992 more faults", 2000),
    ],
    ids=["digits", "text", "list"],
)
def test_a_long_invalid_value_is_refused_in_a_short_message(tmp_path, text, words, most):
    message = refusal(text, tmp_path)
    assert words in message
    assert len(message) < most


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("volume_ml = nan", "volume_ml = nan: should be a finite number, or should be 'cavity'."),
        ("box_mm = [1.0, -1e999, 1.0]", "box_mm.1 = -inf: should be a finite number."),
        ("box_mm = [1.0, 1.0, 1.0, 1.0]", "box_mm: has 4 values; give at most 3."),
        ("points = [[1.0, 2.0], 3]", "points.1 = 3: should be a list."),
        ("count = 1.5", "count = 1.5: should be a whole number."),
        ("count = 2_000_000", "count = 2000000: should be at most 1000000."),
        ("inner = 3", "inner = 3: should be a table."),
    ],
)
def test_the_error_for_a_faulty_settings_file_names_the_key_and_its_fault(tmp_path, text, fault):
    assert refusal(text, tmp_path) == f"{tmp_path / 'cell.toml'}: {fault}"


@pytest.mark.parametrize(
    "text", ["volume_ml" + ".a" * 5000 + " = 1", "volume_ml = " + "[" * 50_000, "= 1", "\udcff", "#" * 200_001]
)
def test_text_that_is_not_toml_is_refused_within_2_seconds(tmp_path, text):
    began = time.process_time()
    assert "cell.toml" in refusal(text, tmp_path)
    assert time.process_time() - began < 2  # 0.1 s; tables in tables would take gigabytes and minutes
