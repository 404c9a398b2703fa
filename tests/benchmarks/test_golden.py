"""The comparison of the golden runs reports what moved and nothing else; its inputs are what they claim to be."""

import json
from pathlib import Path

import pytest

from benchmarks import golden
from benchmarks.golden_inputs import slotted_block, write_mesh


def _write(folder: Path, name: str, content: object) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def _compare(tmp_path: Path, name: str, old: object, new: object) -> golden.Findings:
    _write(tmp_path / "old", name, old)
    _write(tmp_path / "new", name, new)
    return golden.compare_case("case", tmp_path / "old", tmp_path / "new")


def test_a_number_deep_in_a_json_file_is_reported_with_its_path(tmp_path: Path):
    old = {"stages": [{"name": "a", "levels_mm": [1.0, 2.0]}, {"name": "b", "levels_mm": [3.0, 4.0]}]}
    new = {"stages": [{"name": "a", "levels_mm": [1.0, 2.0]}, {"name": "b", "levels_mm": [3.0, 4.000000000000001]}]}
    found = _compare(tmp_path, "run/report.json", old, new)
    assert found.numbers == 4
    assert found.differing == [
        golden.Difference("case", "run/report.json", "stages/1/levels_mm/1", 4.0, 4.000000000000001)
    ]


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ({"passed": True}, {"passed": 1}, "passed"),
        ({"outcome": "passed"}, {"outcome": "failed"}, "outcome"),
        ({"limit_mm": None}, {"limit_mm": 0.0}, "limit_mm"),
        ({"a": 1, "b": 2}, {"a": 1}, "b"),
        ({"a": 1}, {"a": 1, "b": 2}, "b"),
        ({"a": []}, {"a": {}}, "a"),
    ],
)
def test_words_kinds_and_keys_are_held_too(tmp_path: Path, old: object, new: object, key: str):
    assert [it.key for it in _compare(tmp_path, "x.json", old, new).differing] == [key]


def test_a_file_that_is_gone_or_new_is_reported(tmp_path: Path):
    _write(tmp_path / "old", "gone.json", {})
    _write(tmp_path / "new", "made.json", {})
    found = golden.compare_case("case", tmp_path / "old", tmp_path / "new")
    assert [it.file for it in found.differing] == ["gone.json", "made.json"]


def test_a_case_that_was_never_recorded_is_not_identical(tmp_path: Path):
    (tmp_path / "new").mkdir()
    assert golden.compare_case("case", tmp_path / "old", tmp_path / "new").differing


def test_renamed_keys_columns_and_files_are_compared_under_their_new_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    renamed = {
        "health.csv": "record.csv",
        "health.csv#t_s": "time_s",
        "*.json#fluid/U": "paste/u",
        "run.json#/particles": "/count",
    }
    monkeypatch.setattr(golden, "RENAMED", renamed)
    _write(tmp_path / "old", "run/health.csv", "t_s,particles\n0.5,1\n1.0,2\n")
    _write(tmp_path / "new", "run/record.csv", "time_s,particles\n0.5,1\n1.5,2\n")
    _write(tmp_path / "old", "run.json", {"a": {"fluid": {"U": 30.0}, "particles": 1}, "particles": 7})
    _write(tmp_path / "new", "run.json", {"a": {"paste": {"u": 31.0}, "particles": 1}, "count": 7})
    found = golden.compare_case("case", tmp_path / "old", tmp_path / "new")
    assert [(it.file, it.key, it.old, it.new) for it in found.differing] == [
        ("run.json", "a/paste/u", 30.0, 31.0),
        ("run/record.csv", "time_s/2", 1.0, 1.5),
    ]


def test_volatile_values_may_differ_and_their_keys_may_not_vanish(tmp_path: Path):
    old = {"stages": {"digitise": {"wall_time_s": 1.0, "key": "0a" * 32, "finished_utc": "2026-11-20T23:02:49+00:00"}}}
    new = {"stages": {"digitise": {"wall_time_s": 2.0, "key": "0b" * 32, "finished_utc": "2026-11-21T03:02:49+00:00"}}}
    assert _compare(tmp_path, "manifest.json", old, new).differing == []
    del new["stages"]["digitise"]["wall_time_s"]
    assert [it.key for it in _compare(tmp_path, "manifest.json", old, new).differing] == ["stages/digitise/wall_time_s"]


def test_digits_of_a_number_pass_for_no_hash(tmp_path: Path):
    found = _compare(tmp_path, "x.csv", "a_mm\n0.123456789012\n", "a_mm\n0.123456789013\n")
    assert [it.key for it in found.differing] == ["a_mm/1"]


def test_a_number_that_moved_on_purpose_is_counted_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(golden, "MOVED", (golden.Rule("x.json", "a/*", "a better a"),))
    found = _compare(tmp_path, "x.json", {"a": [1, 2], "b": 3}, {"a": [1, 5], "b": 4})
    assert [it.key for it in found.moved] == ["a/1"]
    assert [it.key for it in found.differing] == ["b"]


@pytest.mark.parametrize(
    ("change", "keys"), [("came", {"new"}), ("went", {"gone"}), ("rounded", {"figures"}), ("moved", {"level", "word"})]
)
def test_a_rule_hides_no_other_change_than_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: golden.Change, keys: set[str]
):
    monkeypatch.setattr(golden, "MOVED", (golden.Rule("*", "*", "any key", changes=(change,)),))
    old = {"gone": 1.0, "figures": 79.55, "level": 79.55, "word": "a"}
    new = {"new": 1.0, "figures": 79.5463, "level": 79.5563, "word": "b"}
    found = _compare(tmp_path, "x.json", old, new)
    assert {it.key for it in found.moved} == keys
    assert {it.key for it in found.differing} == {"gone", "new", "figures", "level", "word"} - keys


def test_prose_is_to_be_looked_at_and_a_duration_in_it_is_not(tmp_path: Path):
    found = _compare(tmp_path, "x.json", {"verdict": "it took 3.1 s"}, {"verdict": "it took 4.0 s"})
    assert not found.look
    found = _compare(tmp_path, "x.json", {"verdict": "all is well"}, {"verdict": "all was well"})
    assert list(found.look) == ["x.json"]
    assert not found.differing


@pytest.mark.parametrize("name", ["crack.stl", "crack.ply", "crack.glb"])
def test_a_vertex_that_moved_by_a_micrometre_is_reported(tmp_path: Path, name: str):
    vertices, faces = slotted_block()
    for folder in ("old", "new"):
        (tmp_path / folder).mkdir()
        write_mesh(tmp_path / folder / name, vertices, faces)
    assert golden.compare_case("case", tmp_path / "old", tmp_path / "new").differing == []
    vertices[5, 1] += 1e-3
    write_mesh(tmp_path / "new" / name, vertices, faces)
    found = golden.compare_case("case", tmp_path / "old", tmp_path / "new")
    assert "volume" in {it.key for it in found.differing}
    assert any(it.key.startswith("vertex ") and it.key.endswith("/1") for it in found.differing)


def test_a_waypoint_of_a_program_is_reported_and_a_comment_is_not(tmp_path: Path):
    old = "' made by 0.1.0\nP0 = XY(243.768, -26.103, 105.000, 0.000) /R\n"
    new = "' made by\n' 0.2.0\nP0 = XY(243.768, -26.104, 105.000, 0.000) /R\n"
    found = _compare(tmp_path, "path.prg", old, new)
    assert [(it.key, it.old, it.new) for it in found.differing] == [("1/3", -26.103, -26.104)]
