"""A file of settings from anybody: whatever is wrong with it is told in few words, each place once."""

import json
import time
from pathlib import Path
from typing import Any, Literal

import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.settings import Settings, checked, read_settings


class Tables(Settings):
    volume_ml: float | Literal["cavity"] = "cavity"
    box_mm: tuple[float, float, float] = (1.0, 1.0, 1.0)
    names: tuple[str, ...] = ()
    points: tuple[tuple[float, float], ...] = ()


def refusal(text: str, folder: Path) -> str:
    path = folder / "cell.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_settings(Tables, path, name="cell file", starter="'sealtwin init' writes one")
    assert all(line.startswith(str(path)) for line in str(caught.value).splitlines())
    return str(caught.value)


def test_a_whole_number_of_thousands_of_digits_is_refused(tmp_path):
    """Python parses such a hexadecimal number, and then refuses to write it down."""
    assert "thousands of digits" in refusal(f"volume_ml = 0x{'f' * 5000}", tmp_path)


def test_a_long_list_of_the_wrong_kind_is_refused_in_a_few_lines(tmp_path):
    said = refusal(f"points = [{', '.join(['1'] * 20_000)}]", tmp_path)
    assert "points.0 = 1" in said
    assert "and 19992 more faults" in said
    assert len(said) < 2000


def test_a_long_value_is_told_by_its_beginning(tmp_path):
    said = refusal(f'volume_ml = "{"x" * 50_000}"', tmp_path)
    assert "volume_ml = 'xxx" in said
    assert len(said) < 500


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("volume_ml = nan", "volume_ml = nan: should be a finite number, or should be 'cavity'."),
        ("box_mm = [1.0]", "box_mm: 1 given, 3 needed."),
        ("box_mm = []", "box_mm: 0 given, 3 needed."),
        ("box_mm = [1.0, 1.0, 1.0, 1.0]", "box_mm: Tuple should have at most 3 items, not 4."),
    ],
)
def test_each_place_is_told_once_and_in_a_users_words(tmp_path, text, said):
    assert refusal(text, tmp_path) == f"{tmp_path / 'cell.toml'}: {said}"


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e999"])
def test_no_number_is_infinite_or_none(tmp_path, value):
    assert "finite" in refusal(f"box_mm = [1.0, {value}, 1.0]", tmp_path)


@pytest.mark.parametrize("text", ["volume_ml" + ".a" * 5000 + " = 1", "volume_ml = " + "[" * 50_000, "\0", "= 1"])
def test_what_is_no_toml_is_refused_at_once(tmp_path, text):
    began = time.process_time()
    assert "cell.toml" in refusal(text, tmp_path)
    assert time.process_time() - began < 2  # 0.1 s; tables in tables would take gigabytes and minutes


def test_a_file_whose_name_is_not_utf8_is_refused_before_it_gets_into_any_record():
    content: dict[str, Any] = {"names": ["caf\udce9"]}
    with pytest.raises(InputError, match="rename it") as caught:
        checked(Tables, Path("photos/caf\udce9.png"), content)
    json.dumps(str(caught.value), ensure_ascii=False).encode()
