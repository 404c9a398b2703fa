"""The comparison of the golden runs reports what moved and nothing else."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks import golden
from benchmarks.golden_inputs import slotted_block, write_mesh

FINISHED = {"wall_time_s": 1.0, "key": "0a" * 32, "finished_utc": "2026-11-20T23:02:49+00:00"}
LATER = {"wall_time_s": 2.0, "key": "0b" * 32, "finished_utc": "2026-11-21T03:02:49+00:00"}
PROGRAM = "' made by 0.1.0\nP0 = XY(243.768, -26.103, 105.000, 0.000) /R\n"


def compared(folder: Path, old: dict[str, Any], new: dict[str, Any]) -> golden.Findings:
    """Files of two records by their names: texts, or what a JSON holds."""
    for side, files in (("old", old), ("new", new)):
        for name, content in files.items():
            path = folder / side / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return golden.compare_case("case", folder / "old", folder / "new")


@pytest.mark.parametrize(
    ("name", "old", "new", "keys"),
    [
        ("run/report.json", {"a": [{"b": [1.0, 4.0]}]}, {"a": [{"b": [1.0, 4.000000000000001]}]}, ["a/0/b/1"]),
        ("x.json", {"passed": True}, {"passed": 1}, ["passed"]),
        ("x.json", {"outcome": "passed"}, {"outcome": "failed"}, ["outcome"]),
        ("x.json", {"limit_mm": None}, {"limit_mm": 0.0}, ["limit_mm"]),
        ("x.json", {"a": 1, "b": 2}, {"a": 1}, ["b"]),
        ("x.json", {"a": 1}, {"a": 1, "b": 2}, ["b"]),
        ("x.json", {"a": []}, {"a": {}}, ["a"]),
        ("manifest.json", {"digitise": FINISHED}, {"digitise": LATER}, []),
        ("manifest.json", {"a": FINISHED}, {"a": {"key": FINISHED["key"]}}, ["a/wall_time_s", "a/finished_utc"]),
        # Digits of a number are no hash.
        ("x.csv", "a_mm\n0.123456789012\n", "a_mm\n0.123456789013\n", ["a_mm/1"]),
        ("path.prg", PROGRAM, "' made by\n' 0.2.0\nP0 = XY(243.768, -26.104, 105.000, 0.000) /R\n", ["1/3"]),
    ],
)
def test_numbers_words_kinds_and_keys_may_not_differ_but_for_durations_hashes_and_comments(
    tmp_path, name, old, new, keys
):
    assert [it.key for it in compared(tmp_path, {name: old}, {name: new}).differing] == keys


def test_a_file_that_is_gone_or_new_is_reported(tmp_path):
    found = compared(tmp_path, {"gone.json": {}}, {"made.json": {}})
    assert [it.file for it in found.differing] == ["gone.json", "made.json"]


def test_a_case_that_was_never_recorded_is_not_identical(tmp_path):
    (tmp_path / "new").mkdir()
    assert compared(tmp_path, {}, {}).differing


def test_renamed_keys_columns_and_files_are_compared_under_their_new_names(tmp_path, monkeypatch):
    renamed = {"health.csv": "record.csv", "health.csv#t_s": "time_s", "*.json#fluid/U": "paste/u"}
    monkeypatch.setattr(golden, "RENAMED", renamed | {"run.json#/particles": "/count"})
    old = {"a": {"fluid": {"U": 30.0}, "particles": 1}, "particles": 7}
    new = {"a": {"paste": {"u": 31.0}, "particles": 1}, "count": 7}
    found = compared(
        tmp_path,
        {"run/health.csv": "t_s,particles\n0.5,1\n1.0,2\n", "run.json": old},
        {"run/record.csv": "time_s,particles\n0.5,1\n1.5,2\n", "run.json": new},
    )
    assert [(it.file, it.key, it.old, it.new) for it in found.differing] == [
        ("run.json", "a/paste/u", 30.0, 31.0),
        ("run/record.csv", "time_s/2", 1.0, 1.5),
    ]


@pytest.mark.parametrize(
    ("change", "keys"), [("came", {"new"}), ("went", {"gone"}), ("rounded", {"figures"}), ("moved", {"level", "word"})]
)
def test_a_rule_hides_no_other_change_than_its_own(tmp_path, monkeypatch, change: golden.Change, keys):
    monkeypatch.setattr(golden, "MOVED", (golden.Rule("*", "*", "any key", changes=(change,)),))
    old = {"gone": 1.0, "figures": 79.55, "level": 79.55, "word": "a"}
    new = {"new": 1.0, "figures": 79.5463, "level": 79.5563, "word": "b"}
    found = compared(tmp_path, {"x.json": old}, {"x.json": new})
    assert {it.key for it in found.moved} == keys
    assert {it.key for it in found.differing} == {"gone", "new", "figures", "level", "word"} - keys


def test_prose_is_to_be_looked_at_and_a_duration_in_it_is_not(tmp_path):
    old = {"a.json": {"verdict": "it took 3.1 s"}, "b.json": {"verdict": "all is well"}}
    new = {"a.json": {"verdict": "it took 4.0 s"}, "b.json": {"verdict": "all was well"}}
    found = compared(tmp_path, old, new)
    assert list(found.look) == ["b.json"]
    assert not found.differing


@pytest.mark.parametrize("name", ["crack.stl", "crack.ply", "crack.glb"])
def test_a_vertex_that_moved_by_a_micrometre_is_reported(tmp_path, name):
    vertices, faces = slotted_block()
    for folder in ("old", "new"):
        (tmp_path / folder).mkdir()
        write_mesh(tmp_path / folder / name, vertices, faces)
    assert compared(tmp_path, {}, {}).differing == []
    vertices[5, 1] += 1e-3
    write_mesh(tmp_path / "new" / name, vertices, faces)
    found = compared(tmp_path, {}, {})
    assert "volume" in {it.key for it in found.differing}
    assert any(it.key.startswith("vertex ") and it.key.endswith("/1") for it in found.differing)
