"""The record of all benchmarks: what is run again, what it keeps, and what its table says."""

import json
import subprocess

import pytest

from benchmarks import results
from benchmarks.results import code_sha256, measure, table

BENCHMARK = """
from math import inf, nan
from benchmarks.table import Row, finish
kept, slow = Row("kept | width", 1.5, "mm", 0, 2.0), Row("slow", 3.0, "s", 0, 2.0, because="of | this")
finish([kept, slow, Row("none", nan, "s")])
"""


@pytest.fixture
def benchmarks(tmp_path, monkeypatch):
    """Two benchmarks of this test's own, one of which fails to end with a table; counts how often each ran."""
    good, bad = tmp_path / "good.py", tmp_path / "bad.py"
    counted = f"open({str(tmp_path / 'ran')!r}, 'a').write('x')\n"
    good.write_text(counted + BENCHMARK)
    bad.write_text("raise SystemExit(0)")
    monkeypatch.setattr(results, "COMMANDS", {"good": str(good), "bad": str(bad)})
    monkeypatch.setattr(results, "RESULTS", tmp_path / "results.json")
    monkeypatch.setattr(results, "code_sha256", lambda *_: "a hash")
    monkeypatch.setattr(results, "stage_numbers", lambda _: {})
    return tmp_path


def run(*names):
    with pytest.raises(SystemExit) as left:
        results.main(list(names) or list(results.COMMANDS))
    return left.value.code


def test_what_ran_on_this_very_code_is_not_run_again(benchmarks, monkeypatch):
    assert run("good") == 1, "a target is missed"
    assert run("good") == 1
    assert (benchmarks / "ran").read_text() == "x"
    monkeypatch.setattr(results, "code_sha256", lambda *_: "another hash")
    run("good")
    assert (benchmarks / "ran").read_text() == "xx"


@pytest.mark.slow
def test_a_benchmark_without_a_table_has_no_result(benchmarks, capsys):
    assert run() == 1
    results = json.loads((benchmarks / "results.json").read_text())
    assert (results["good"]["exit_code"], results["bad"]["exit_code"]) == (1, 2)
    assert "no result: bad" in (printed := capsys.readouterr().out)
    assert "no result, exit code 2" in printed


def test_what_failed_is_run_again_on_the_same_code(benchmarks):
    run()
    (benchmarks / "bad.py").write_text((benchmarks / "good.py").read_text())
    run()
    assert json.loads((benchmarks / "results.json").read_text())["bad"]["exit_code"] == 1
    assert (benchmarks / "ran").read_text() == "xx", "once each: what ended with a table is not run again"


def test_the_table_counts_targets_and_names_those_that_are_missed(benchmarks):
    made = {"good": {"code": "new"} | measure([str(benchmarks / "good.py")])}
    counted, missed, waiting = table(made, {"good": "new"}).splitlines()
    assert counted.startswith("good               1 of 2 ")
    assert missed == "    slow: 3 s for <= 2"
    assert waiting.split() == ["bad", "not", "run", "yet"]
    assert "changed since" not in counted
    assert "changed since" in table(made, {"good": "newer"}).splitlines()[0]


@pytest.fixture
def checkout(tmp_path):
    """A file of one character for each name, which git knows."""

    def make(*names):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text("1")
        subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
        return tmp_path

    return make


FOLLOWS = (
    ("benchmarks/solids.py", True),
    ("benchmarks/table.py", True),
    ("digitise/solid/build_solid.py", True),
    ("digitise/__init__.py", True),
    ("simulate/__init__.py", False),
    ("fixtures/paper-trial/trial.toml", True),
    ("constraints.txt", True),
    ("simulate/run.py", False),
    ("validate/compare.py", False),
    ("validate/labels.toml", False),
    ("benchmarks/calibration.csv", False),
    ("README.md", False),
)


@pytest.mark.parametrize(("name", "follows"), FOLLOWS)
def test_the_hash_follows_what_a_benchmark_imports(checkout, name, follows):
    root = checkout(*(name for name, _ in FOLLOWS))
    before = code_sha256(root, "-m benchmarks.solids")
    (root / name).write_text("2")
    assert (code_sha256(root, "-m benchmarks.solids") != before) == follows


@pytest.mark.parametrize(
    ("text", "follows"),
    [
        ('"""Other words."""\nx = 1  # why\n', False),
        ("x = (\n    1\n)\n", False),
        ("x = 2\n", True),
        ('x = "1"\n', True),
    ],
)
def test_words_and_layout_of_a_module_are_not_in_the_hash(checkout, text, follows):
    root = checkout("benchmarks/solids.py")
    (root / "benchmarks" / "solids.py").write_text('"""Words."""\nx = 1\n')
    before = code_sha256(root, "-m benchmarks.solids")
    (root / "benchmarks" / "solids.py").write_text(text)
    assert (code_sha256(root, "-m benchmarks.solids") != before) == follows


def test_data_of_a_benchmarks_own_name_are_its(checkout):
    root = checkout("benchmarks/calibration.csv", "benchmarks/slot/runs.csv")
    before = {name: code_sha256(root, results.COMMANDS[name]) for name in ("calibration", "slot")}
    (root / "benchmarks" / "slot" / "runs.csv").write_text("2")
    assert code_sha256(root, results.COMMANDS["calibration"]) == before["calibration"]
    assert code_sha256(root, results.COMMANDS["slot"]) != before["slot"]


@pytest.mark.parametrize(
    ("name", "follows"),
    [("sealtwin/lab/ingest.py", True), ("benchmarks/ordinary_sheets.py", False), ("tests/lab/test_ingest.py", False)],
)
def test_a_benchmark_that_starts_programs_follows_all_that_is_installed(checkout, name, follows):
    root = checkout(name)
    before = code_sha256(root, results.COMMANDS["speed_bars"])
    (root / name).write_text("2")
    assert (code_sha256(root, results.COMMANDS["speed_bars"]) != before) == follows
