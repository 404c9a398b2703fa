"""Kept results of particle runs: which solver computed them, and that no other one's are judged."""

import importlib

import pytest

from benchmarks import blind_labs, calibration, slot_cases
from benchmarks.kept_runs import PARTS, KeptRuns
from sealtwin.core.files import read_json

KEPT = (blind_labs.KEPT, calibration.KEPT, slot_cases.KEPT)
JUDGES = ("calibration", "slot", "blind_own_band")


@pytest.mark.parametrize("name", JUDGES)
def test_a_benchmark_judges_no_results_of_another_solver(name, monkeypatch, capsys):
    """It ends with one sentence, which names the command that computes them anew, and prints no figure."""
    monkeypatch.setitem(PARTS, "simulate", 999)
    with pytest.raises(SystemExit) as left:
        importlib.import_module(f"benchmarks.{name}").main()
    sentence = str(left.value.code)
    assert "while this version has " in sentence
    assert "simulate 999: 'python -m benchmarks." in sentence
    assert "target" not in capsys.readouterr().out


@pytest.mark.parametrize("kept", KEPT, ids=lambda kept: kept.path.name)
def test_each_kept_result_states_who_computed_it(kept):
    assert kept.path.exists()
    assert set(read_json(kept.path.with_suffix(".json"))) == set(kept.stages)


@pytest.mark.parametrize("folder", [True, False])
def test_results_of_another_solver_go_when_new_ones_begin(tmp_path, folder, monkeypatch, capsys):
    kept = KeptRuns(tmp_path / ("runs" if folder else "runs.csv"), "python -m benchmarks.runs")
    content = kept.path / "1.csv" if folder else kept.path
    kept.require()
    kept.begin()
    content.parent.mkdir(exist_ok=True)
    content.write_text("level_mm\n-4\n")
    kept.begin()
    kept.require()
    assert content.is_file(), "of this solver: added to"
    assert capsys.readouterr().out == ""
    monkeypatch.setitem(PARTS, "simulate", 999)
    with pytest.raises(SystemExit, match=r"computed by simulate \d+, while .*: 'python -m benchmarks.runs' computes"):
        kept.require()
    kept.begin()
    assert not kept.path.exists()
    assert "removed, and computed anew" in capsys.readouterr().out
    content.parent.mkdir(exist_ok=True)
    content.write_text("level_mm\n-4\n")
    kept.require()
    kept.path.with_suffix(".json").unlink()
    with pytest.raises(SystemExit, match="computed by tracing unknown, solids unknown, simulate unknown"):
        kept.require()
