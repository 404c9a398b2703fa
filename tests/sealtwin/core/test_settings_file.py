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


@pytest.mark.parametrize(
    ("text", "words", "most"),
    [
        (f"volume_ml = 0x{'f' * 5000}", "thousands of digits", 500),  # Python parses it, and refuses to write it down.
        (f'volume_ml = "{"x" * 50_000}"', "volume_ml = 'xxx", 500),
        (f"points = [{', '.join(['1'] * 20_000)}]", "and 19992 more faults", 2000),
    ],
    ids=["digits", "text", "list"],
)
def test_a_long_value_of_the_wrong_kind_is_refused_in_a_few_lines(tmp_path, text, words, most):
    message = refusal(text, tmp_path)
    assert words in message
    assert len(message) < most


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("volume_ml = nan", "volume_ml = nan: should be a finite number, or should be 'cavity'."),
        ("box_mm = [1.0, -1e999, 1.0]", "box_mm.1 = -inf: should be a finite number."),
        ("box_mm = [1.0]", "box_mm: 1 given, 3 needed."),
        ("box_mm = []", "box_mm: 0 given, 3 needed."),
        ("box_mm = [1.0, 1.0, 1.0, 1.0]", "box_mm: Tuple should have at most 3 items, not 4."),
    ],
)
def test_each_place_is_told_once_and_in_a_users_words(tmp_path, text, fault):
    assert refusal(text, tmp_path) == f"{tmp_path / 'cell.toml'}: {fault}"


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
