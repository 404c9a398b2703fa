"""Stored results of particle runs are judged only if they were computed by the present solver."""

import importlib

import pytest

from benchmarks import blind_labs, blind_roads, calibration, slot_cases
from benchmarks.kept_runs import PARTS
from sealtwin.core.files import read_json

KEPT = (blind_labs.KEPT, blind_roads.KEPT, calibration.KEPT, slot_cases.KEPT)
JUDGES = ("calibration", "slot", "blind_own_band", "blind_roads")


@pytest.mark.parametrize("name", JUDGES)
def test_a_benchmark_refuses_stored_results_of_another_solver(name, monkeypatch, capsys):
    """The benchmark ends with a sentence that names the command to compute them again, and prints no figure."""
    monkeypatch.setitem(PARTS, "simulate", 999)
    with pytest.raises(SystemExit) as left:
        importlib.import_module(f"benchmarks.{name}").main()
    sentence = str(left.value.code)
    assert "while this version has " in sentence
    assert "simulate 999: 'python -m benchmarks." in sentence
    assert "target" not in capsys.readouterr().out


@pytest.mark.parametrize("kept", KEPT, ids=lambda kept: kept.path.name)
def test_each_stored_result_records_the_version_numbers_of_its_stages(kept):
    assert kept.path.exists()
    assert set(read_json(kept.path.with_suffix(".json"))) == set(kept.stages)
